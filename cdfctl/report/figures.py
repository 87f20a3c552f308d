"""What all figures share: matplotlib if it is there, one style, and files that are the same every time.

The colours differ in lightness as well as in hue, so a figure can be read without colour.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdfctl.errors import InputError, MissingError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INSTALL = "python -m pip install 'cdfctl[plot]'"
SUFFIXES = (".png", ".svg", ".pdf")
DPI = 150

# Of the palette of Okabe and Ito.
BLUE, ORANGE, VERMILION, BLACK = "#0072B2", "#E69F00", "#D55E00", "#000000"

STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "svg.hashsalt": "cdfctl",  # else the identifiers in an SVG are random
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
}
# Else a file holds the date of its writing.
METADATA = {".png": {"Software": "cdfctl"}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def check_output(path: Path) -> None:
    """Say at once, before the work, that a figure cannot be written into ``path``.

    Raises:
        InputError: its suffix is no format, its folder is not there, or it is a folder.
        MissingError: matplotlib is not installed.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"cannot write a figure as '{path}'", hint="the suffix says how: " + ", ".join(SUFFIXES))
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not path.parent.is_dir():
        raise InputError(f"no such folder: {path.parent}")
    new_figure(1.0, 1.0)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of so many inches.

    Raises:
        MissingError: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
        from matplotlib.layout_engine import ConstrainedLayoutEngine
    except ImportError:
        raise MissingError("figures need matplotlib, which is not installed", hint=INSTALL) from None
    return Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.1, wspace=0.03))


def save_figure(figure: Figure, path: Path) -> None:
    """Write ``figure`` into ``path``; the suffix says how. The same figure gives the same bytes.

    Raises:
        InputError: as :func:`check_output`, or the file cannot be written.
    """
    check_output(path)
    from matplotlib import rc_context

    suffix = path.suffix.lower()
    try:
        with rc_context(STYLE):
            figure.savefig(path, format=suffix[1:], dpi=DPI, metadata=METADATA[suffix])
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
