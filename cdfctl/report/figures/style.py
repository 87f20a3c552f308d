"""What all figures share: matplotlib if it is there, one style, one palette.

Colours are of the palette of Okabe and Ito. They differ in lightness too, and whatever a colour tells is told again by
a line style, a marker or a hatch, so that a figure can be read without colour. Sizes are those of a printed page: text
stays legible at the width the figure is made for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from cdfctl.errors import MissingError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INSTALL = "python -m pip install 'cdfctl[plot]'"

COLUMN, PAGE = 8.5, 17.5
"""Width (cm) of a column and of a page of text."""

CM = 1.0 / 2.54

BLACK, BLUE, VERMILION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE, YELLOW = "#E69F00", "#56B4E9", "#CC79A7", "#F0E442"
GREY, FAINT = "0.45", "0.85"

FIELD_MAP = "cividis"
"""Colours of a distance: their lightness grows with it."""

STYLE: dict[str, Any] = {
    "font.size": 7.5,
    "axes.titlesize": 8.0,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "legend.columnspacing": 1.2,
    "legend.handletextpad": 0.5,
    "legend.borderaxespad": 0.2,
    "figure.titlesize": 8.5,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.1,
    "hatch.linewidth": 0.5,
    "text.parse_math": False,  # a "$" in somebody's name is no formula
    "svg.hashsalt": "cdfctl",  # else the identifiers in an SVG are random
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
}

_SERIES: tuple[tuple[str, Any, str], ...] = (
    (BLUE, "-", "o"),
    (VERMILION, "--", "s"),
    (BLACK, "-.", "^"),
    (ORANGE, (0, (1.0, 1.2)), "D"),
    (GREEN, (0, (6.0, 1.5)), "v"),
    (PURPLE, (0, (4.0, 1.2, 1.0, 1.2, 1.0, 1.2)), "P"),
    (SKY, (0, (2.5, 1.0)), "X"),
    (GREY, "-", "*"),
)
MOST_SERIES = len(_SERIES)
"""As many lines of one panel can be told apart."""


def colour(i: int) -> str:
    """Colour of the i-th of some series."""
    return _SERIES[i % MOST_SERIES][0]


def line(i: int) -> dict[str, Any]:
    """Colour and line style of the i-th of some series."""
    name, style, _ = _SERIES[i % MOST_SERIES]
    return {"color": name, "linestyle": style}


def marker(i: int) -> dict[str, Any]:
    """Colour and marker of the i-th of some series."""
    name, _, shape = _SERIES[i % MOST_SERIES]
    return {"color": name, "marker": shape}


@contextmanager
def styled() -> Iterator[None]:
    """The style of cdfctl over matplotlib's own defaults, whatever the user's settings are.

    Raises:
        MissingError: matplotlib is not installed.
    """
    need_matplotlib()
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def need_matplotlib() -> None:
    """Raises :class:`MissingError` if matplotlib is not installed."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise MissingError("figures need matplotlib, which is not installed", hint=INSTALL) from None


def new_figure(width: float, height: float, *, compress: bool = True) -> Figure:
    """An empty figure of so many centimetres; ``compress`` closes the gaps between panels of a fixed shape.

    Raises:
        MissingError: matplotlib is not installed.
    """
    need_matplotlib()
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(compress=compress, w_pad=0.03, h_pad=0.03, wspace=0.02, hspace=0.02)
    return Figure(figsize=(width * CM, height * CM), layout=layout)


def grid(axes: Axes) -> None:
    """Faint lines behind everything else."""
    axes.grid(color=FAINT, linewidth=0.5)
    axes.set_axisbelow(True)


def legend_above(axes: Axes, columns: int, *, handles: Sequence[Any] | None = None) -> None:
    """A legend over the axes, where it hides nothing; no legend where nothing has a name."""
    found = axes.get_legend_handles_labels()[0] if handles is None else handles
    if found:
        tight = {"handlelength": 1.5, "columnspacing": 0.7} if len(found) > 4 else {}
        axes.legend(
            handles=found, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(columns, len(found)),
            borderaxespad=0.3, labelspacing=0.25, **tight,
        )  # fmt: skip


def halo() -> Any:
    """A white edge around text, to be read over lines."""
    from matplotlib.patheffects import withStroke

    return withStroke(linewidth=1.5, foreground="white")


def signed(value: float, digits: int = 3) -> str:
    """A number with the sign printers use."""
    return f"{value:.{digits}f}".replace("-", "−")


def mixed(first: str, second: str, share: float) -> tuple[float, float, float]:
    """The colour that is ``share`` of the way from ``first`` to ``second``."""
    from matplotlib.colors import to_rgb

    a, b = to_rgb(first), to_rgb(second)
    red, green, blue = ((1.0 - share) * x + share * y for x, y in zip(a, b, strict=True))
    return red, green, blue
