"""The grid of a sweep over two fields."""

from __future__ import annotations

from cdfctl.benchmark.plan import make_plan
from cdfctl.benchmark.statistics import summarise
from cdfctl.benchmark.sweep import combinations
from cdfctl.report.bench_grid import grid_markdown, sweep_grids


def test_every_value_has_its_place():
    sweep = combinations(["measurement.delay=0,0.1", "controller.margin=0.03,0.06,0.1"])
    plan = make_plan(["S1"], ["sdf-cbf-qp", "sdf-tvcbf-qp"], [], sweep, trials=1, seed=0)
    good = {("0", "0.03"), ("0.1", "0.1")}
    records = [
        {
            "scenario": cell.name, "controller": cell.controller, "on_infeasible": cell.on_infeasible, "trial": 0,
            "outcome": "reached" if tuple(s.text for s in cell.settings) in good else "collision",
            "outcome_sampled": "reached", "time_to_reach_s": 1.0, "path_length_m": 1.0, "joint_path_rad": 1.0,
            "min_clearance_m": 0.1, "infeasible_steps": 0,
        }
        for cell in plan.cells
        if not (cell.controller == "sdf-cbf-qp" and cell.settings[1].text == "0.06")
    ]  # fmt: skip
    first, second = sweep_grids(summarise(plan.cells, records, []))
    assert (first.columns, first.cells) == (("0.03", "0.1"), (("1.00", "0.00"), ("0.00", "1.00")))
    assert (second.rows, second.columns) == (("0", "0.1"), ("0.03", "0.06", "0.1"))
    assert second.cells == (("1.00", "0.00", "0.00"), ("0.00", "0.00", "1.00"))
    assert grid_markdown(second)[2] == "| measurement.delay \\\\ controller.margin | 0.03 | 0.06 | 0.1 |"
    one = make_plan(["S1"], [], [], combinations(["controller.margin=0.03,0.06"]), trials=1, seed=0)
    assert sweep_grids(summarise(one.cells, [], [])) == []
