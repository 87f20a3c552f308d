"""A figure is one part, or several under each other: a part knows its name, its height, and how to draw itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from cdfctl.report.figures.style import PAGE, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    Canvas: TypeAlias = Figure | SubFigure

OVERVIEW = "overview"
SHEET = 1.25
"""By so much a part may be wider on a sheet with others than by itself."""


@dataclass(frozen=True)
class Part:
    """Something that can be drawn by itself or as a part of a page.

    Attributes:
        name: by which it is asked for; its file's name.
        height: cm, for a width in cm.
        draw: draws it into a figure or a part of one, of the width in cm.
        width: cm, where nobody asks for another.
    """

    name: str
    height: Callable[[float], float]
    draw: Callable[[Canvas, float], None]
    width: float = PAGE


def figure_of(parts: Sequence[Part], width: float | None = None) -> Figure:
    """The ``parts`` under each other, ``width`` cm wide; without one, that of the widest part.

    Raises:
        MissingError: matplotlib is not installed.
    """
    total = max(part.width for part in parts) if width is None else width
    heights = [part.height(min(part.width * SHEET, total) if len(parts) > 1 else total) for part in parts]
    with styled():
        figure = new_figure(total, sum(heights), compress=len(parts) == 1)
        if len(parts) == 1:
            parts[0].draw(figure, total)
            return figure
        rows = figure.subfigures(len(parts), 1, height_ratios=heights, squeeze=False)[:, 0]
        for i, (part, row) in enumerate(zip(parts, rows, strict=True)):
            wide = min(part.width * SHEET, total)
            aside = 0.5 * (total - wide)
            canvas = row if aside < 1.0 else row.subfigures(1, 3, width_ratios=(aside, wide, aside))[1]
            part.draw(canvas, wide)
            if i > 0:
                canvas.suptitle("")  # the first part has said it
    return figure
