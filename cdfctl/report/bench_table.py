"""The table of a benchmark on a terminal: three narrow tables a scenario, legible at 80 columns and without colour."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cdfctl.benchmark.statistics import CellSummary
from cdfctl.report import bench_rows as rows
from cdfctl.report.bench_grid import grid_table, sweep_grids
from cdfctl.report.tables import bullets

SUCCESS = ("success", "ci95", "solvable", "sampled", "p", "collided", "timeout", "infeasible", "error")
MOTION = ("time", "joint_path", "path", "clearance")
STEPS = ("infeasible_trials", "infeasible_steps", "p50", "p99")


def bench_table(summaries: Sequence[CellSummary]) -> RenderableType:
    """The whole report: the paper's figures beneath ours, then the legend, the paper's flaws, the assumptions."""
    parts: list[RenderableType] = []
    for group in rows.groups(summaries):
        parts.append(Text(group.title, style="bold"))
        parts += [_table(group, columns) for columns in (SUCCESS, MOTION, STEPS)]
        parts.append(Text())
    for grid in sweep_grids(summaries):
        parts += [Text(grid.title, style="bold"), grid_table(grid), Text()]
    parts.append(bullets(rows.LEGEND))
    notes = (
        ("What can be solved", rows.solvable(summaries)),
        ("The paper", rows.notes(summaries)),
        ("Assumed", rows.assumptions(summaries)),
    )
    for heading, items in notes:
        if items:
            parts += [Text(heading, style="bold"), bullets(items)]
    return Group(*parts)


def _table(group: rows.Group, columns: Sequence[str]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="dim")
    table.add_column("", overflow="fold", min_width=14)
    shown = rows.shown(group, columns)
    for column in shown:
        table.add_column(rows.COLUMNS[column], justify="right", no_wrap=True)
    for line in group.lines:
        cells = [line.cells.get(column, "") for column in shown]
        if not any(cells):
            continue
        title = f"  {line.title}" if line.printed else line.title
        table.add_row(Text(title), *(Text(cell) for cell in cells), style="dim" if line.printed else "")
    return table
