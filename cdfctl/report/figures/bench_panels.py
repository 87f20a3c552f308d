"""A benchmark: one panel a scenario, one line a method, the paper's values as marks beside ours.

- ``success``: rate of trials that reached without contact, with its Wilson interval at 95 %
- ``time``, ``path``: every success as a tick, the box of their quartiles, and the mean; in the mean time a failure
  counts as the time limit, as in the paper
- ``clearance``: least clearance of every trial against its time to reach; failures at the time limit
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cdfctl.benchmark.document import paper_cell
from cdfctl.benchmark.paper import Triple
from cdfctl.benchmark.reading import CellTrials, StoredBench
from cdfctl.benchmark.statistics import Spread
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.style import BLACK, COLUMN, FAINT, GREY, VERMILION, marker

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas

PAPER: dict[str, Any] = {"marker": "D", "markerfacecolor": "white", "markeredgecolor": BLACK, "markersize": 4.5}
FLAWED: dict[str, Any] = {**PAPER, "markeredgecolor": GREY, "markerfacecolor": FAINT}
ASIDE = 0.22  # of a line: how far above ours and below theirs are drawn


class Group(NamedTuple):
    """The cells of one panel."""

    title: str
    cells: tuple[CellTrials, ...]


def groups(bench: StoredBench) -> list[Group]:
    """One group a scenario, with its swept values, and a rule for infeasible steps, named where it varies."""
    found: dict[tuple[str, str], list[CellTrials]] = {}
    for item in bench.cells:
        found.setdefault((item.cell.name, item.cell.on_infeasible), []).append(item)
    several = len({rule for _, rule in found}) > 1
    return [Group(f"{name}, {rule}" if several else name, tuple(cells)) for (name, rule), cells in found.items()]


def bench_title(bench: StoredBench) -> str:
    """What was run, and how often."""
    trials = sorted({item.summary.trials for item in bench.cells})
    counted = f"{trials[0]}" if len(trials) == 1 else f"{trials[0]}–{trials[-1]}"
    return f"{bench.suite}: {counted} trials of each, seed {bench.seed}"


def bench_parts(bench: StoredBench) -> list[Part]:
    """The four figures."""
    drawers: dict[str, Callable[[Axes, Group, list[str]], None]] = {
        "success": success,
        "time": time,
        "path": path,
        "clearance": clearance,
    }
    return [_part(name, draw, bench) for name, draw in drawers.items()]


def _part(name: str, draw: Callable[[Axes, Group, list[str]], None], bench: StoredBench) -> Part:
    shown = groups(bench)
    methods = list(dict.fromkeys(item.cell.controller for group in shown for item in group.cells))

    def shape(width: float) -> tuple[int, int]:
        columns = min(len(shown), 3 if width > 1.4 * COLUMN else 1)
        return -(-len(shown) // columns), columns

    def height(width: float) -> float:
        rows = shape(width)[0]
        panel = 4.2 if name == "clearance" else 1.0 + 0.55 * max(2, len(methods))
        return rows * panel + 2.2

    def content(canvas: Canvas, width: float) -> None:
        rows, columns = shape(width)
        lines = name != "clearance"
        grid: Any = canvas.subplots(rows, columns, squeeze=False, sharey=lines, sharex=name == "success")
        for axes, group in zip(grid.flat, shown, strict=False):
            draw(axes, group, methods)
            axes.set_title(group.title)
            axes.grid(color=FAINT, linewidth=0.5, axis="x" if lines else "both")
            axes.set_axisbelow(True)
        for i, axes in enumerate(grid.flat):
            if i >= len(shown):
                axes.remove()
            else:
                below = i + columns < len(shown)
                axes.set_xlabel("" if below else X_LABELS[name])
                if lines and i % columns:
                    axes.tick_params(labelleft=False)
                if not lines and i % columns == 0:
                    axes.set_ylabel("least clearance [m]")
        canvas.suptitle(bench_title(bench), x=0.01, ha="left")
        handles, across = _legend(name, bench, methods), 3 if name in ("time", "path") else 5
        canvas.legend(
            handles=handles,
            loc="outside lower center",
            ncols=across if width > 1.4 * COLUMN else 2,
        )

    return Part(name, height, content)


X_LABELS = {
    "success": "success rate",
    "time": "time to reach [s]",
    "path": "length of the joints' path [rad]",
    "clearance": "time to reach [s]",
}


def success(axes: Axes, group: Group, methods: list[str]) -> None:
    """The rate, its interval, and the rate looking at control steps only."""
    for item in group.cells:
        i, summary = methods.index(item.cell.controller), item.summary
        low, high = summary.ci95
        axes.plot([low, high], [i - ASIDE] * 2, color=marker(i)["color"], linewidth=1.6, solid_capstyle="butt")
        axes.plot(summary.success_rate_sampled, i - ASIDE, marker="|", markersize=9, color=BLACK, markeredgewidth=0.8)
        axes.plot(summary.success_rate, i - ASIDE, markersize=4.5, **marker(i))
        paper = paper_cell(summary)
        if paper is not None:
            axes.plot(paper.success, i + ASIDE, linestyle="none", **PAPER)
    axes.set_xlim(-0.04, 1.04)
    _method_axis(axes, methods)


def time(axes: Axes, group: Group, methods: list[str]) -> None:
    """Times of the successes; the mean with failures at the time limit."""
    for item in group.cells:
        i, paper = methods.index(item.cell.controller), paper_cell(item.summary)
        _distribution(axes, i, _successes(item, "time_to_reach_s"), item.summary.time)
        if paper is not None and paper.time is not None:
            good = paper.time_comparable and "time_to_reach_s" not in paper.impossible
            _printed(axes, i, paper.time, PAPER if good else FLAWED)
    axes.set_xlim(left=0.0)
    _method_axis(axes, methods)


def path(axes: Axes, group: Group, methods: list[str]) -> None:
    """Lengths of the joints' paths of the successes."""
    for item in group.cells:
        i, paper = methods.index(item.cell.controller), paper_cell(item.summary)
        _distribution(axes, i, _successes(item, "joint_path_rad"), item.summary.joint_path)
        if paper is not None and paper.path is not None:
            _printed(axes, i, paper.path, PAPER if "joint_path_rad" not in paper.impossible else FLAWED)
    axes.set_xlim(left=0.0)
    _method_axis(axes, methods)


def clearance(axes: Axes, group: Group, methods: list[str]) -> None:
    """Least clearance against time to reach, every trial a mark; a cross at the time limit where it failed."""
    for item in group.cells:
        i, limit = methods.index(item.cell.controller), item.cell.scenario.simulation.time_limit
        for record in item.records:
            if record["min_clearance_m"] is None:
                continue
            good = record["outcome"] == "reached"
            style = {**marker(i), "markersize": 3.0} if good else {"color": marker(i)["color"], "marker": "x"}
            x = record["time_to_reach_s"] if good else limit
            axes.plot(x, record["min_clearance_m"], linestyle="none", **{"markersize": 4.0, "alpha": 0.75, **style})
    axes.axhline(0.0, color=VERMILION, linewidth=0.8, linestyle="--")
    axes.set_xlim(left=0.0)


def _successes(item: CellTrials, column: str) -> list[float]:
    return [float(record[column]) for record in item.records if record["outcome"] == "reached"]


def _distribution(axes: Axes, i: int, values: Sequence[float], spread: Spread) -> None:
    """Ticks, a box from quartile to quartile with the median, and the mean."""
    colour, y = marker(i)["color"], i - ASIDE
    if values:
        axes.plot(values, [y] * len(values), linestyle="none", marker="|", markersize=5, color=colour, alpha=0.35)
        low, middle, high = np.percentile(values, [25, 50, 75])
        axes.plot([low, high], [y, y], color=colour, linewidth=4.5, alpha=0.45, solid_capstyle="butt")
        axes.plot([middle], [y], marker="|", markersize=8, color=BLACK, markeredgewidth=1.1)
    if spread.mean is not None:
        axes.plot(spread.mean, y, markersize=4.5, markeredgecolor=BLACK, markeredgewidth=0.5, **marker(i))


def _printed(axes: Axes, i: int, triple: Triple, style: dict[str, Any]) -> None:
    """The paper's least, greatest and mean."""
    low, high, mean = triple
    axes.plot([low, high], [i + ASIDE] * 2, color=style["markeredgecolor"], linewidth=0.8, marker="|", markersize=4)
    axes.plot(mean, i + ASIDE, linestyle="none", **style)


def _method_axis(axes: Axes, methods: list[str]) -> None:
    axes.set_yticks(range(len(methods)), labels=methods)
    axes.set_ylim(len(methods) - 0.45, -0.55)
    for i in range(1, len(methods)):
        axes.axhline(i - 0.5, color=FAINT, linewidth=0.5)


def _legend(name: str, bench: StoredBench, methods: list[str]) -> list[Any]:
    from matplotlib.lines import Line2D

    sample = partial(Line2D, [], [], linestyle="none")
    papers = [paper for item in bench.cells if (paper := paper_cell(item.summary)) is not None]
    flawed = {
        "time": any(not p.time_comparable or "time_to_reach_s" in p.impossible for p in papers),
        "path": any("joint_path_rad" in p.impossible for p in papers),
    }
    if name == "clearance":
        handles = [sample(label=method, markersize=4.0, **marker(i)) for i, method in enumerate(methods)]
        handles.append(sample(label="failed, at the time limit (any colour)", marker="x", color=BLACK, markersize=4.0))
        handles.append(Line2D([], [], color=VERMILION, linewidth=0.8, linestyle="--", label="contact"))
        return handles
    if name == "success":
        handles = [
            Line2D([], [], color=BLACK, marker="o", markersize=4.5, linewidth=1.6, label="rate and 95 % interval"),
            sample(label="at control steps only", marker="|", markersize=9, color=BLACK),
        ]
    else:
        mean = "mean, failures as the limit" if name == "time" else "mean"
        handles = [
            sample(label="a success", marker="|", markersize=5, color=GREY),
            Line2D([], [], color=GREY, linewidth=4.5, alpha=0.6, solid_capstyle="butt", label="quartiles, median"),
            sample(label=mean, marker="o", markersize=4.5, color=BLACK),
        ]
    if papers:
        shown = "paper" if name == "success" else "paper: least, mean, greatest"
        handles.append(sample(label=shown, **PAPER))
    if flawed.get(name):
        handles.append(sample(label="paper, not comparable", **FLAWED))
    return handles
