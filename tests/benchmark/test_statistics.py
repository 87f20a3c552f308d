"""Statistics against closed forms and brute force."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.benchmark.plan import Plan
from cdfctl.benchmark.statistics import Spread, mcnemar, summarise, wilson

Z = 1.959963984540054


@given(st.integers(0, 300), st.integers(1, 300))
def test_wilson_is_its_formula(k: int, n: int) -> None:
    k = min(k, n)
    p = k / n
    centre = (p + Z * Z / (2 * n)) / (1 + Z * Z / n)
    half = Z / (1 + Z * Z / n) * math.sqrt(p * (1 - p) / n + Z * Z / (4 * n * n))
    assert wilson(k, n) == pytest.approx((max(0.0, centre - half), min(1.0, centre + half)), abs=1e-9)


def test_wilson_by_hand() -> None:
    assert wilson(100, 100) == pytest.approx((1 / (1 + Z * Z / 100), 1.0))
    assert wilson(0, 100)[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("b", "c"), [(0, 0), (5, 0), (3, 4), (1, 9), (6, 6)])
def test_mcnemar_counts_the_ways_a_coin_can_fall(b: int, c: int) -> None:
    first = [True] * b + [False] * c + [True, False, True]
    other = [False] * b + [True] * c + [True, False, True]
    falls = [sum(f) for f in itertools.product((0, 1), repeat=b + c)]
    extreme = sum(abs(f - (b + c) / 2) >= abs(b - c) / 2 for f in falls) / len(falls)
    assert mcnemar(first, other) == pytest.approx(extreme)
    assert mcnemar(other, first) == mcnemar(first, other)


def test_spread() -> None:
    assert Spread.of([]) == Spread(None, None, None)
    assert Spread.of([2.0, 4.0], [2.0, 4.0, 20.0, 20.0]) == Spread(2.0, 4.0, 11.5)


def line(controller: str, trial: int, outcome: str, **columns: object) -> dict[str, object]:
    good = outcome == "reached"
    base = {"scenario": "small", "controller": controller, "on_infeasible": "least-violation", "seed": 0}
    return {
        **base,
        "trial": trial,
        "outcome": outcome,
        "outcome_sampled": outcome,
        "time_to_reach_s": 1.0 + trial if good else None,
        "path_length_m": 10.0 + trial if good else 99.0,
        "joint_path_rad": 5.0,
        "min_clearance_m": 0.1 - 0.2 * (outcome == "collision"),
        "infeasible_steps": 0,
        **columns,
    }


def test_a_summary_by_hand(plan: Plan) -> None:
    first, other = "sdf-tvcbf-qp", "sdf-cbf-qp"
    records = [
        line(first, 0, "reached"),
        line(other, 0, "collision", outcome_sampled="reached"),
        line(first, 1, "reached", infeasible_steps=3),
        line(other, 1, "error", min_clearance_m=None, path_length_m=None, joint_path_rad=None),
        line(first, 2, "timeout"),
        line(other, 2, "reached"),
        line(first, 3, "infeasible", infeasible_steps=1),
    ]
    timings = [{**line(first, i, "reached"), "step_us": [100, 200, 300]} for i in (0, 0, 1)]
    ours, theirs = summarise(plan.cells, records, timings)
    assert (ours.trials, ours.successes, theirs.trials, theirs.successes) == (4, 2, 3, 1)
    assert ours.time == Spread(1.0, 2.0, (1 + 2 + 3 + 3) / 4)  # the time limit is 3 s
    assert ours.path == Spread(10.0, 11.0, 10.5)
    assert ours.outcomes == {"reached": 2, "collision": 0, "timeout": 1, "infeasible": 1, "error": 0}
    assert theirs.outcomes == {"reached": 1, "collision": 1, "timeout": 0, "infeasible": 0, "error": 1}
    assert (ours.infeasible_trials, ours.infeasible_steps) == (2, 4)
    assert (ours.min_clearance, theirs.min_clearance) == (0.1, pytest.approx(-0.1))
    assert theirs.successes_sampled == 2
    assert ours.step_ms == (pytest.approx(0.2), pytest.approx(0.3))
    assert theirs.step_ms == (None, None)
    assert ours.p_value is None
    assert theirs.p_value == mcnemar([True, True, False], [False, False, True])
    assert theirs.time == Spread(3.0, 3.0, 3.0)
