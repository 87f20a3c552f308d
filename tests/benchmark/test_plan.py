"""The plan: its order, its pairing, and what is refused before anything is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdfctl.benchmark.plan import Plan, make_plan
from cdfctl.benchmark.sweep import combinations
from cdfctl.errors import InputError
from cdfctl.scenario.draws import draw


def test_trial_by_trial_through_all_cells(plan: Plan) -> None:
    keys = list(plan.keys())
    assert len(plan) == len(keys) == 8
    assert [(key.trial, key.controller) for key in keys[:3]] == [
        (0, "sdf-tvcbf-qp"),
        (0, "sdf-cbf-qp"),
        (1, "sdf-tvcbf-qp"),
    ]
    assert [plan[i][0].key(plan[i][1]) for i in range(len(plan))] == keys


def test_a_trial_is_the_same_set_up_for_every_controller(plan: Plan) -> None:
    first, other = (draw(cell.scenario, plan.seed, 3) for cell in plan.cells)
    assert first.obstacles == other.obstacles
    assert first.controller != other.controller
    assert draw(plan.cells[0].scenario, plan.seed, 2).obstacles != first.obstacles


def test_a_sweep_makes_cells_and_hides_the_paper(here: Path) -> None:
    plan = make_plan(["S1"], [], [], combinations(["controller.alpha=1,2"]), trials=1, seed=0)
    assert [cell.name for cell in plan.cells] == ["S1[alpha=1]", "S1[alpha=2]"]
    assert [cell.scenario.controller.alpha for cell in plan.cells] == [1.0, 2.0]
    assert not any(cell.shipped for cell in plan.cells)
    assert make_plan(["S1"], [], [], [()], trials=1, seed=0).cells[0].shipped


def test_the_same_cell_named_twice_is_one(here: Path) -> None:
    plan = make_plan(["./small.yaml", "./small.yaml"], ["sdf-cbf-qp"] * 2, ["fail"] * 2, [()], trials=1, seed=0)
    assert len(plan.cells) == 1
    assert plan.suite == "small"


def test_two_scenarios_of_one_name(here: Path) -> None:
    (here / "other.yaml").write_text((here / "small.yaml").read_text().replace("9.9", "5.0"))
    with pytest.raises(InputError, match="two scenarios are called 'small'"):
        make_plan(["./small.yaml", "./other.yaml"], [], [], [()], trials=1, seed=0)


def test_files_of_shapes_count(here: Path) -> None:
    text = (here / "small.yaml").read_text()
    (here / "points.csv").write_text("0,0,0\n")
    cloud = "{type: point-cloud, file: points.csv, radius: 0.3}"
    (here / "small.yaml").write_text(text.replace("{type: ball, radius: 0.3}", cloud))
    before = make_plan(["./small.yaml"], [], [], [()], trials=1, seed=0).configuration()
    (here / "points.csv").write_text("0,0,0.1\n")
    assert make_plan(["./small.yaml"], [], [], [()], trials=1, seed=0).configuration() != before
