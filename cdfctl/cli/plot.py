"""``cdfctl plot``: figures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdfctl.cli import options
from cdfctl.cli.console import note, write_json
from cdfctl.errors import unknown_name

FIGURES = ("levels",)


def plot(
    figure: Annotated[
        str,
        typer.Option(
            "--figure",
            metavar="NAME",
            help="Which figure: levels (level sets of both distance fields of the planar arm, with their gradients).",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="A .png, .svg or .pdf file. [default: <figure>.png]", show_default=False
        ),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> None:
    """Draw a figure of the method into a file."""
    if figure not in FIGURES:
        raise unknown_name("figure", figure, FIGURES)
    from cdfctl.report.figures import check_output, save_figure

    path = Path(f"{figure}.png") if out is None else out
    check_output(path)
    from cdfctl.report.figures_levels import levels_figure

    save_figure(levels_figure(), path)
    if json:
        write_json({"figure": figure, "file": str(path)})
    else:
        note(f"wrote {path}", quiet=quiet)
