"""The printed table: its flaws follow from its own numbers."""

from __future__ import annotations

import pytest

from cdfctl.benchmark.paper import METHODS, SCENARIOS, printed

CELLS = [(s, m) for s in SCENARIOS for m in METHODS]


def flaws(scenario: str, method: str) -> set[str]:
    """What cannot be: a mean outside its range, once failures, 20 s each, are taken out of the mean time (printed to
    0.1 s; rates of 100 trials are exact)."""
    cell = printed(scenario, method)
    assert cell is not None
    found = set()
    if cell.path is not None and not cell.path[0] <= cell.path[2] <= cell.path[1]:
        found.add("joint_path_rad")
    if cell.time is not None and cell.time_comparable and cell.success > 0.02:
        low, high, mean = cell.time
        over_successes = [(mean + slack - 20.0 * (1.0 - cell.success)) / cell.success for slack in (-0.05, 0.05)]
        if min(over_successes) > high + 0.05 or max(over_successes) < low - 0.05:
            found.add("time_to_reach_s")
    return found


@pytest.mark.parametrize(("scenario", "method"), CELLS)
def test_a_cell_is_flagged_where_it_cannot_be(scenario: str, method: str) -> None:
    cell = printed(scenario, method)
    assert cell is not None
    assert set(cell.impossible) == flaws(scenario, method)


def test_there_are_four_of_them_and_c2_is_not_comparable() -> None:
    cells = {place: printed(*place) for place in CELLS}
    assert sum(len(cell.impossible) for cell in cells.values() if cell) == 4
    assert {place[0] for place, cell in cells.items() if cell and not cell.time_comparable} == {"C2"}


def test_no_cell_for_anything_else() -> None:
    assert printed("S1", "dual-tvcbf-qp") is None
    assert printed("planar-1", "cdf-tvcbf-qp") is None
    assert printed("C2", "sdf-cbf-qp").document()["time_to_reach_s"] is None
