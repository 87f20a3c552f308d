"""Figures into files: checked before the work, whole or not at all, and the same bytes every time."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from cdfctl.errors import InputError
from cdfctl.reading import drafted
from cdfctl.report.figures.style import need_matplotlib, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
SUFFIXES = tuple(f".{name}" for name in FORMATS)
DPI = 200

# Else a file holds the date of its writing.
METADATA = {".png": {"Software": "cdfctl"}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def check_output(path: Path, suffixes: tuple[str, ...] = SUFFIXES) -> None:
    """Say at once, before the work, that a figure cannot be written into ``path``.

    Raises:
        InputError: its suffix is none of ``suffixes``, its folder is not there, or it is a folder.
        MissingError: matplotlib is not installed.
    """
    if path.suffix.lower() not in suffixes:
        raise InputError(f"cannot write a figure as '{path}'", hint="the suffix says how: " + ", ".join(suffixes))
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not path.parent.is_dir():
        raise InputError(f"no such folder: {path.parent}")
    need_matplotlib()


def save_figure(figure: Figure, path: Path, dpi: int = DPI) -> None:
    """Write ``figure`` into ``path``; the suffix says how. The same figure gives the same bytes.

    Raises:
        InputError: as :func:`check_output`, or the file cannot be written.
    """
    check_output(path)
    suffix = path.suffix.lower()
    draft = path.with_name(f".{path.name}.new")
    try:
        with drafted(path, draft), styled(), warnings.catch_warnings():
            # A letter that the font lacks, in somebody's name, is drawn as a box.
            warnings.filterwarnings("ignore", message="Glyph .* missing from")
            engine = figure.get_layout_engine()
            if engine is not None:  # once: saving would lay everything out twice
                engine.execute(figure)
                figure.set_layout_engine("none")
            figure.savefig(draft, format=suffix[1:], dpi=dpi, metadata=METADATA[suffix])
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None
