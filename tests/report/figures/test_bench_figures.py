"""Figures of benchmarks: a store written by hand, read back, and drawn."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cdfctl.benchmark.plan import make_plan
from cdfctl.benchmark.reading import read_store
from cdfctl.benchmark.store import open_store
from cdfctl.benchmark.sweep import combinations
from cdfctl.benchmark.trial import Answer
from cdfctl.errors import InputError
from cdfctl.report.figures.bench_panels import PAPER, bench_parts, groups
from cdfctl.report.figures.part import figure_of
from cdfctl.report.figures.sweep import sweep_part, swept
from cdfctl.types import Contact, TrialResult, Verdict

METHODS = ["sdf-tvcbf-qp", "sdf-cbf-qp"]


def verdict(good: bool, trial: int) -> Verdict:
    contact = None if good else Contact(1.0, "link2", "disc-1")
    outcome = "reached" if good else "collision"
    return Verdict(outcome, outcome, 3.0 + 0.1 * trial if good else None, 1.0, 6.0, 0.1 if good else -0.1, 1.0, contact)


def write(folder, plan, succeeds):
    """A store in which ``succeeds(cell, trial)`` says how each trial ended."""
    with open_store(folder, plan) as store:
        for i in range(len(plan)):
            cell, trial = plan[i]
            result = TrialResult(cell.key(trial), verdict(succeeds(cell, trial), trial), 30, 0, (1e-3,))
            store.add(Answer(result, 0.1))
    return folder


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """S1 and S2 as shipped: the first method always succeeds, the second in one trial of four."""
    plan = make_plan(["S1", "S2"], METHODS, [], [()], trials=4, seed=0)
    folder = tmp_path_factory.mktemp("bench") / "plain"
    return write(folder, plan, lambda cell, trial: cell.controller == METHODS[0] or trial == 0)


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    """Two fields swept: as many successes of four as the place in the table."""
    sweep = combinations(["controller.alpha=1,2,4", "controller.margin=0.05,0.1"])
    plan = make_plan(["S1"], METHODS[:1], [], sweep, trials=4, seed=0)
    wanted = {("1", "0.05"): 0, ("2", "0.05"): 1, ("4", "0.05"): 2, ("1", "0.1"): 3, ("2", "0.1"): 4, ("4", "0.1"): 4}
    folder = tmp_path_factory.mktemp("bench") / "grid"
    return write(folder, plan, lambda cell, trial: trial < wanted[tuple(s.text for s in cell.settings)])


def test_a_store_is_read_as_it_was_written(plain, grid):
    bench = read_store(plain)
    assert [(item.cell.name, item.cell.controller) for item in bench.cells] == [
        (name, method) for name in ("S1", "S2") for method in METHODS
    ]
    assert [item.summary.successes for item in bench.cells] == [4, 1, 4, 1]
    assert all(item.cell.shipped and len(item.records) == 4 for item in bench.cells)
    assert not swept(bench)
    assert swept(read_store(grid)) == ["controller.alpha", "controller.margin"]


def test_the_success_panel_has_rate_interval_and_the_papers_value(plain):
    figure = figure_of([bench_parts(read_store(plain))[0]])
    first = figure.axes[0]
    assert [axes.get_title() for axes in figure.axes] == ["S1", "S2"]
    assert [tick.get_text() for tick in first.get_yticklabels()] == METHODS
    low, high = next(sorted(line.get_xdata()) for line in first.lines if len(set(line.get_ydata())) == 1
                     and len(line.get_xdata()) == 2 and round(line.get_ydata()[0]) == 1)  # fmt: skip
    # Wilson's interval of 1 in 4, from its formula.
    z, p, n = 1.959964, 0.25, 4
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    assert (low, high) == pytest.approx((middle - half, middle + half), abs=1e-6)
    papers = [float(line.get_xdata()[0]) for line in first.lines if line.get_marker() == PAPER["marker"]]
    assert papers == [1.00, 0.01]


def test_a_failure_is_a_cross_at_the_time_limit(plain):
    figure = figure_of([bench_parts(read_store(plain))[3]])
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(crosses) == 3
    assert {(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in crosses} == {(20.0, -0.1)}


def test_two_swept_fields_make_a_heat_map(grid):
    figure = figure_of([sweep_part(read_store(grid))])
    (rates,) = [axes.images[0].get_array() for axes in figure.axes if axes.images and "1.00" in _numbers(axes)]
    np.testing.assert_array_equal(rates, [[0.0, 0.25, 0.5], [0.75, 1.0, 1.0]])
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == (
        "controller.alpha [1/s]",
        "controller.margin [m (SDF), rad (CDF)]",
    )
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["1", "2", "4"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["0.05", "0.1"]


def _numbers(axes):
    return [text.get_text() for text in axes.texts]


def test_one_swept_field_makes_lines(tmp_path):
    plan = make_plan(["S1"], METHODS, [], combinations(["controller.alpha=1,2"]), trials=2, seed=0)
    write(tmp_path / "one", plan, lambda cell, trial: cell.controller == METHODS[0])
    figure = figure_of([sweep_part(read_store(tmp_path / "one"))])
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(lines[METHODS[0]], [1.0, 1.0])
    np.testing.assert_array_equal(lines[METHODS[1]], [0.0, 0.0])


@pytest.mark.parametrize("width", [8.5, 17.5])
def test_every_figure_can_be_drawn_at_both_widths(plain, grid, width):
    bench = read_store(plain)
    assert [group.title for group in groups(bench)] == ["S1", "S2"]
    figure_of(bench_parts(bench), width).draw_without_rendering()
    figure_of([sweep_part(read_store(grid))], width).draw_without_rendering()


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("manifest.json", "{", "damaged: not JSON"),
        ("manifest.json", "[]", "not a benchmark's folder"),
        ("manifest.json", json.dumps({"format": "cdfctl-bench", "version": 99}), "newer cdfctl"),
        ("manifest.json", json.dumps({"format": "cdfctl-bench", "version": 1}), "not the manifest"),
        ("trials.jsonl", "", "without a finished trial"),
        ("trials.jsonl", "nonsense\n", "damaged: not a trial"),
        ("timing.jsonl", "{}\n", "damaged: not the times of a trial"),
    ],
)
def test_a_damaged_store_is_one_line(plain, tmp_path, name, text, message):
    for path in plain.iterdir():
        if path.is_file():
            (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_store(tmp_path)
    assert "\n" not in caught.value.message
