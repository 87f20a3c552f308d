"""A benchmark that sweeps fields of a scenario: success rate and mean time over the values.

One field gives lines with intervals, one a method; two give heat maps, one a method; of more, the first two are the
axes and every combination of the others has panels of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cdfctl.benchmark.reading import CellTrials, StoredBench
from cdfctl.benchmark.sweep import label
from cdfctl.report.figures.bench_panels import bench_title
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.style import COLUMN, FIELD_MAP, grid, legend_above, line, marker
from cdfctl.scenario.reference import reference

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas


class Quantity(NamedTuple):
    """What is shown of a cell: its name and unit, its value, and how a number of it is written."""

    name: str
    value: Callable[[CellTrials], float]
    text: Callable[[float], str]
    limits: tuple[float, float] | None


QUANTITIES = (
    Quantity("success rate", lambda item: item.summary.success_rate, lambda v: f"{v:.2f}", (0.0, 1.0)),
    Quantity("mean time [s]", lambda item: item.summary.time.mean or 0.0, "{:.1f}".format, None),
)


class Panel(NamedTuple):
    """Cells that share a panel: ``series`` of cells by method, or of one method where there are two axes."""

    title: str
    cells: tuple[CellTrials, ...]


def swept(bench: StoredBench) -> list[str]:
    """The fields that were swept."""
    return list(dict.fromkeys(setting.field for item in bench.cells for setting in item.cell.settings))


def sweep_part(bench: StoredBench) -> Part:
    """The figure of a benchmark that sweeps at least one field."""
    fields = swept(bench)
    shown = _panels(bench, two=len(fields) > 1)

    def columns(width: float) -> int:
        return 2 if width > 1.4 * COLUMN else 1

    def height(width: float) -> float:
        return 2.0 + 5.2 * len(shown) * 2 / columns(width)

    def draw(canvas: Canvas, width: float) -> None:
        count = columns(width)
        axes: Any = canvas.subplots(len(shown) * 2 // count, count, squeeze=False).ravel()
        for i, panel in enumerate(shown):
            for j, quantity in enumerate(QUANTITIES):
                one = axes[2 * i + j]
                if len(fields) > 1:
                    _heat(canvas, one, panel, fields[:2], quantity)
                else:
                    _lines(one, panel, fields[0], quantity)
        canvas.suptitle(bench_title(bench), x=0.01, ha="left")

    return Part("sweep", height, draw)


def _panels(bench: StoredBench, *, two: bool) -> list[Panel]:
    found: dict[str, list[CellTrials]] = {}
    several = len({item.cell.on_infeasible for item in bench.cells}) > 1
    for item in bench.cells:
        cell = item.cell
        parts = [cell.scenario.name, *([cell.controller] if two else []), *([cell.on_infeasible] if several else [])]
        rest = label(cell.settings[2:])
        found.setdefault(", ".join([*parts, *([rest] if rest else [])]), []).append(item)
    return [Panel(title, tuple(cells)) for title, cells in found.items()]


def _with_unit(field: str) -> str:
    """``controller.alpha [1/s]``: a field of the scenario as the label of an axis."""
    unit = next((row.unit for row in reference() if row.path == field and row.unit), "")
    return f"{field} [{unit}]" if unit else field


def _values(cells: tuple[CellTrials, ...], field: str) -> list[str]:
    """The values of ``field`` as written, in the order of the sweep."""
    return list(dict.fromkeys(s.text for item in cells for s in item.cell.settings if s.field == field))


def _place(item: CellTrials, field: str, values: list[str]) -> int:
    return values.index(next(s.text for s in item.cell.settings if s.field == field))


def _lines(axes: Axes, panel: Panel, field: str, quantity: Quantity) -> None:
    values = _values(panel.cells, field)
    methods = list(dict.fromkeys(item.cell.controller for item in panel.cells))
    for i, method in enumerate(methods):
        cells = [item for item in panel.cells if item.cell.controller == method]
        shift = 0.06 * (i - 0.5 * (len(methods) - 1))
        x = [_place(item, field, values) + shift for item in cells]
        axes.plot(x, [quantity.value(item) for item in cells], label=method, markersize=4, **marker(i) | line(i))
        if quantity.limits is not None:
            for at, item in zip(x, cells, strict=True):
                axes.plot([at, at], item.summary.ci95, color=line(i)["color"], linewidth=0.8)
    axes.set_xticks(range(len(values)), labels=values)
    axes.set(xlabel=_with_unit(field), ylabel=quantity.name, xlim=(-0.4, len(values) - 0.6))
    if quantity.limits is not None:
        axes.set_ylim(-0.04, 1.04)
    axes.set_title(panel.title, loc="right")
    grid(axes)
    legend_above(axes, 2)


def _heat(canvas: Canvas, axes: Axes, panel: Panel, fields: list[str], quantity: Quantity) -> None:
    across, up = (_values(panel.cells, field) for field in fields)
    table = np.full((len(up), len(across)), np.nan)
    for item in panel.cells:
        table[_place(item, fields[1], up), _place(item, fields[0], across)] = quantity.value(item)
    low, high = quantity.limits or (float(np.nanmin(table)), float(np.nanmax(table)))
    high = high if high > low else low + 1.0
    image = axes.imshow(table, cmap=FIELD_MAP, vmin=low, vmax=high, origin="lower", aspect="auto")
    for (i, j), value in np.ndenumerate(table):
        if np.isfinite(value):
            dark = (value - low) / (high - low) < 0.55
            axes.text(
                j, i, quantity.text(float(value)), ha="center", va="center", color="white" if dark else "black",
                fontsize=6.5,
            )  # fmt: skip
    axes.set_xticks(range(len(across)), labels=across)
    axes.set_yticks(range(len(up)), labels=up)
    axes.set(xlabel=_with_unit(fields[0]), ylabel=_with_unit(fields[1]), title=panel.title)
    canvas.colorbar(image, ax=axes, pad=0.02).set_label(quantity.name)
