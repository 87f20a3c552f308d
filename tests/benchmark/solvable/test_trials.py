"""What is asked, what is shared between cells, and what a cell's share comes to."""

from __future__ import annotations

import pytest

from cdfctl.benchmark.plan import make_plan
from cdfctl.benchmark.solvable.trials import check_solvable, problem_id, questions, shares
from cdfctl.benchmark.sweep import combinations
from cdfctl.errors import InputError
from cdfctl.scenario import load_scenario

ASKED = ["yes", "yes", "no", "open", "open"]


@pytest.fixture(scope="module")
def plan():
    sweep = combinations(["controller.margin=0.03,0.06"])
    return make_plan(["X1"], ["sdf-tvcbf-qp", "sdf-cbf-qp"], [], sweep, trials=5, seed=0)


def test_a_set_up_is_asked_about_once(plan):
    assert len({problem_id(cell) for cell in plan.cells}) == 1
    waiting = questions(plan, [])
    assert [trial for _, trial in waiting] == [0, 1, 2, 3, 4]
    known = [{"problem": problem_id(waiting[0][0]), "trial": 3, "answer": "no"}]
    assert [trial for _, trial in questions(plan, known)] == [0, 1, 2, 4]
    other = make_plan(["X1"], ["sdf-tvcbf-qp"], [], combinations(["simulation.tolerance=0.2"]), trials=1, seed=0)
    assert problem_id(other.cells[0]) != problem_id(plan.cells[0])


def test_shares_by_hand(plan):
    first, second, *_ = plan.cells
    known = [{"problem": problem_id(first), "trial": i, "answer": said} for i, said in enumerate(ASKED)]
    solved = {
        first.identity: dict(enumerate([True, False, False, False, False])),
        second.identity: dict(enumerate([False, False, False, True])),  # it was stopped after four trials
    }
    found = shares(plan.cells, known, solved)
    assert set(found) == {first.identity, second.identity}
    share = found[first.identity]
    assert (share.yes, share.no, share.open) == ((0, 1, 3), (2,), (4,))  # 3 was solved by the other
    assert share.missed == (1, 3)
    assert share.bounds == (0.6, 0.8)
    assert share.of_solvable == (0.25, 1 / 3)
    other = found[second.identity]
    assert (other.trials, other.missed, other.of_solvable) == (4, (0, 1), (1 / 3, 1 / 3))


def test_what_cannot_be_asked():
    with pytest.raises(InputError, match="two joints; that of 'C1' has 7"):
        check_solvable(load_scenario("C1").scenario)
    with pytest.raises(InputError, match="joint-goal or hold; that of 'reach' is reach"):
        check_solvable(load_scenario("reach").scenario)
