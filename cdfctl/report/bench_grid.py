"""A sweep of two fields as a grid: success over the values of one against those of the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.table import Table
from rich.text import Text

from cdfctl.benchmark.statistics import CellSummary


@dataclass(frozen=True)
class SweepGrid:
    """One method's successes: ``cells[i][j]`` at the i-th of ``rows`` and the j-th of ``columns``, empty where there is
    none; ``corner`` names the two fields."""

    title: str
    corner: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]


def sweep_grids(summaries: Sequence[CellSummary]) -> list[SweepGrid]:
    """One grid for each scenario, method and rule, where two fields were swept."""
    methods: dict[tuple[str, str, str], dict[tuple[str, str], str]] = {}
    fields: tuple[str, str] = ("", "")
    for summary in summaries:
        cell = summary.cell
        if len(cell.settings) != 2:
            return []
        first, second = cell.settings
        fields = first.field, second.field
        found = methods.setdefault((cell.scenario.name, cell.controller, cell.on_infeasible), {})
        found[first.text, second.text] = f"{summary.success_rate:.2f}"
    return [_grid(method, fields, found) for method, found in methods.items()]


def _grid(method: tuple[str, str, str], fields: tuple[str, str], found: dict[tuple[str, str], str]) -> SweepGrid:
    rows, columns = (tuple(dict.fromkeys(key[axis] for key in found)) for axis in (0, 1))
    return SweepGrid(
        title=f"{method[0]} {method[1]} ({method[2]}), success",
        corner=f"{fields[0]} \\ {fields[1]}",
        rows=rows,
        columns=columns,
        cells=tuple(tuple(found.get((row, column), "") for column in columns) for row in rows),
    )


def grid_table(grid: SweepGrid) -> Table:
    """For a terminal."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="dim", title_justify="left")
    table.add_column(Text(grid.corner), overflow="fold")
    for column in grid.columns:
        table.add_column(Text(column), justify="right")
    for row, cells in zip(grid.rows, grid.cells, strict=True):
        table.add_row(Text(row), *(Text(cell) for cell in cells))
    return table


def grid_markdown(grid: SweepGrid) -> list[str]:
    """The same as lines of Markdown."""
    corner = grid.corner.replace("\\", "\\\\")
    head = [f"**{grid.title}**", "", f"| {corner} | " + " | ".join(grid.columns) + " |"]
    lines = [f"| {row} | " + " | ".join(cells) + " |" for row, cells in zip(grid.rows, grid.cells, strict=True)]
    return [*head, "| --- |" + " ---: |" * len(grid.columns), *lines, ""]
