"""The figures of a benchmark as text, before any layout: groups of lines, each ours with the paper's beneath."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cdfctl.benchmark.document import paper_cell
from cdfctl.benchmark.paper import NOT_COMPARABLE, Printed, Triple
from cdfctl.benchmark.statistics import CellSummary, Spread
from cdfctl.benchmark.sweep import label

PAPER = "paper"
IMPOSSIBLE, INCOMPARABLE = "*", "+"
"""Marks behind a printed figure: it cannot be as printed; it does not mean what ours does."""

MOST_SHOWN = 20
"""Trials named in a note; the rest is counted."""

COLUMNS: Mapping[str, str] = {
    "success": "success",
    "ci95": "95 %",
    "solvable": "of solvable",
    "sampled": "sampled",
    "p": "p",
    "collided": "hit",
    "timeout": "late",
    "infeasible": "infeas.",
    "error": "error",
    "time": "time, s",
    "joint_path": "joint path, rad",
    "path": "tip, m",
    "clearance": "clear, mm",
    "infeasible_trials": "trials infeas.",
    "infeasible_steps": "steps infeas.",
    "p50": "p50, ms",
    "p99": "p99, ms",
}
"""Columns by key, and their headings."""

LEGEND = (
    "success: reached without contact at any instant, with its Wilson interval at 95 %; sampled: looking at control "
    "steps only, as the paper does; p: McNemar's exact test on paired trials against the first method.",
    "hit, late, infeas., error: trials that ended in contact, at the time limit, at a step that no velocity satisfied, "
    "or by a failure of the program.",
    "time and path are mean (least-greatest). A failure counts as the time limit in the mean time; all else is over "
    "successes. clear: the least distance to an obstacle in any trial, 0 or less in contact.",
)


@dataclass(frozen=True)
class Line:
    """One line: whose it is, and its cells by column; a column may be absent. ``printed`` for the paper's."""

    title: str
    cells: Mapping[str, str]
    printed: bool = False


@dataclass(frozen=True)
class Group:
    """The lines of one scenario under one rule."""

    title: str
    lines: tuple[Line, ...]


def groups(summaries: Sequence[CellSummary]) -> list[Group]:
    """All lines, scenario by scenario and rule by rule; a sweep's values are in a line's title."""
    found: dict[tuple[str, str], list[Line]] = {}
    for summary in summaries:
        cell = summary.cell
        lines = found.setdefault((cell.scenario.name, cell.on_infeasible), [])
        swept = f"{label(cell.settings)} " if cell.settings else ""
        lines.append(Line(swept + cell.controller, ours(summary)))
        paper = paper_cell(summary)
        if paper is not None:
            lines.append(Line(PAPER, theirs(paper), printed=True))
    return [Group(f"{name}, on infeasible steps: {rule}", tuple(lines)) for (name, rule), lines in found.items()]


def shown(group: Group, columns: Iterable[str]) -> list[str]:
    """Which of some columns have something to say: errors only where there are some, the solvable where asked."""
    absent = {"error": "0", "solvable": ""}
    return [
        c
        for c in columns
        if c not in absent or any(line.cells.get(c, "") not in ("", absent[c]) for line in group.lines)
    ]


def ours(summary: CellSummary) -> dict[str, str]:
    """Our cells."""
    low, high = summary.ci95
    p50, p99 = summary.step_ms
    return {
        "success": f"{summary.successes}/{summary.trials}",
        "ci95": f"{low:.2f}-{high:.2f}",
        **({} if summary.share is None else {"solvable": interval(summary.share.of_solvable)}),
        "sampled": f"{summary.successes_sampled}/{summary.trials}",
        "p": "-" if summary.p_value is None else probability(summary.p_value),
        "collided": str(summary.outcomes["collision"]),
        "timeout": str(summary.outcomes["timeout"]),
        "infeasible": str(summary.outcomes["infeasible"]),
        "error": str(summary.outcomes["error"]),
        "time": spread(summary.time, 1),
        "joint_path": spread(summary.joint_path, 2),
        "path": "-" if summary.path.mean is None else f"{summary.path.mean:.2f}",
        "clearance": "-" if summary.min_clearance is None else f"{1e3 * summary.min_clearance:.1f}",
        "infeasible_trials": str(summary.infeasible_trials),
        "infeasible_steps": str(summary.infeasible_steps),
        "p50": "-" if p50 is None else f"{p50:.2f}",
        "p99": "-" if p99 is None else f"{p99:.2f}",
    }


def theirs(paper: Printed) -> dict[str, str]:
    """The paper's cells, marked where they cannot be or cannot be compared."""
    time = triple(paper.time, 1) + (IMPOSSIBLE if "time_to_reach_s" in paper.impossible else "")
    path = triple(paper.path, 2) + (IMPOSSIBLE if "joint_path_rad" in paper.impossible else "")
    if paper.time is not None and not paper.time_comparable:
        time += INCOMPARABLE
    return {"success": f"{paper.success:.2f}", "time": time, "joint_path": path}


def spread(value: Spread, digits: int) -> str:
    """``mean (least-greatest)``; the mean alone where nothing succeeded."""
    if value.mean is None:
        return "-"
    mean = f"{value.mean:.{digits}f}"
    return mean if value.min is None else f"{mean} ({value.min:.{digits}f}-{value.max:.{digits}f})"


def interval(bounds: tuple[float | None, float | None]) -> str:
    """Two rates, or one where they are the same to two digits."""
    low, high = ("-" if rate is None else f"{rate:.2f}" for rate in bounds)
    return low if low == high else f"{low}-{high}"


def solvable(summaries: Sequence[CellSummary]) -> list[str]:
    """What can be solved of each scenario, and the solvable trials that each controller failed."""
    found, said = [], set()
    for summary in summaries:
        share, cell = summary.share, summary.cell
        if share is None:
            continue
        if cell.name not in said:
            said.add(cell.name)
            bounds = interval(share.bounds)
            proofs = f"{len(share.yes)} solved, {len(share.no)} proved impossible, {len(share.open)} open"
            found.append(f"{cell.name}: solvable share {bounds} ({proofs}).")
        missed = ", ".join(str(i) for i in share.missed[:MOST_SHOWN]) or "none"
        more = f" and {len(share.missed) - MOST_SHOWN} more" if len(share.missed) > MOST_SHOWN else ""
        found.append(f"{cell.name} {cell.controller} ({cell.on_infeasible}): solvable but failed: {missed}{more}.")
    return found


def triple(value: Triple | None, digits: int) -> str:
    """The same for a printed cell."""
    return "-" if value is None else spread(Spread(*value), digits)


def probability(p: float) -> str:
    """A p-value in five characters."""
    return "<.001" if p < 0.001 else f"{p:.3f}"


def notes(summaries: Sequence[CellSummary]) -> list[str]:
    """What has to be said of the paper's cells that are shown."""
    found = []
    incomparable = False
    for summary in summaries:
        paper = paper_cell(summary)
        if paper is None:
            continue
        cell = summary.cell
        found += [
            f"{IMPOSSIBLE} {cell.name} {cell.controller} as printed: {flaw}" for flaw in paper.impossible.values()
        ]
        incomparable |= not paper.time_comparable
    distinct = list(dict.fromkeys(found))
    return [*distinct, f"{INCOMPARABLE} times of C2 are not comparable: {NOT_COMPARABLE}"] if incomparable else distinct


def assumptions(summaries: Sequence[CellSummary]) -> list[str]:
    """Every assumption of the scenarios once, behind the names of those that make it."""
    found: dict[str, list[str]] = {}
    for summary in summaries:
        for sentence in summary.cell.scenario.assumptions:
            names = found.setdefault(sentence, [])
            if summary.cell.scenario.name not in names:
                names.append(summary.cell.scenario.name)
    return [f"{', '.join(names)}: {sentence}" for sentence, names in found.items()]
