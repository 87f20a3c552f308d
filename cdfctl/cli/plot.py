"""``cdfctl plot``: figures of a run, of a benchmark, and of the paper."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdfctl.cli import options
from cdfctl.cli.console import note, write_json
from cdfctl.errors import InputError

if TYPE_CHECKING:
    from cdfctl.report.figures.part import Part

PAPER = "levels, avoidance, reaching"

OVERVIEW = "overview"

FOLDER = "figures"
"""Where the figures of a run or a benchmark go: a folder inside it."""

FIELDS = {"cdf": ("cdf",), "sdf": ("sdf",), "both": ("cdf", "sdf")}


class Format(StrEnum):
    """Of the files."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


class Shown(StrEnum):
    """Fields over the plane of the joints."""

    cdf = "cdf"
    sdf = "sdf"
    both = "both"


def plot(
    source: Annotated[
        Path | None,
        typer.Argument(metavar="RUN|BENCH", help="A run folder, or a benchmark's folder.", show_default=False),
    ] = None,
    figure: Annotated[
        list[str] | None,
        typer.Option(
            "--figure",
            metavar="NAME",
            help="Which; may be repeated. Without a source, the paper's: levels, avoidance, reaching. "
            "Of a run: task-space, joint-space, time. Of a benchmark: success, time, path, clearance, sweep. "
            "overview: all in one file. [default: all, each in a file]",
            show_default=False,
        ),
    ] = None,
    field: Annotated[
        Shown | None,
        typer.Option("--field", help="Of the joint space. [default: the controller's]", show_default=False),
    ] = None,
    at: Annotated[
        list[float] | None,
        typer.Option(
            "--at",
            metavar="T",
            min=0.0,
            help="Instant of the joint space, s; may be repeated. [default: start, least clearance, end]",
            show_default=False,
        ),
    ] = None,
    animate: Annotated[
        bool, typer.Option("--animate", help="A film of a planar run: MP4 by ffmpeg, or else GIF.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="PATH",
            help="A file (.png, .svg, .pdf; .mp4, .gif), which gets all figures on one sheet, or a folder. "
            "[default: figures/ in the source; else <figure>.png]",
            show_default=False,
        ),
    ] = None,
    layout: Annotated[
        Format | None, typer.Option("--format", help="Of the files. [default: png]", show_default=False)
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            "--width",
            metavar="CM",
            min=6.0,
            max=60.0,
            help="Of the figure, cm: 8.5 for a column, 17.5 for a page. [default: as fits]",
            show_default=False,
        ),
    ] = None,
    dpi: Annotated[int, typer.Option("--dpi", min=50, max=600, help="Of a PNG, dots an inch.")] = 200,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> None:
    """Draw figures of a run, of a benchmark, or of the paper into files."""
    names = list(dict.fromkeys(figure or ()))
    if source is None and not names and not animate:
        raise InputError("nothing to plot", f"name a run folder, a benchmark's folder, or --figure: {PAPER}")
    if source is not None and not source.exists():
        raise InputError(f"{source}: no such folder", "cdfctl run and cdfctl bench say where they write")
    if source is not None and out is None and (source / FOLDER).is_symlink():
        # The folder may be a stranger's: what is in it must not lead elsewhere what is written.
        raise InputError(f"{source / FOLDER}: is a symbolic link", "give --out")
    from cdfctl.report.figures.style import need_matplotlib

    need_matplotlib()
    fields = FIELDS[field.value] if field else None
    if animate:
        if source is None or names or layout is not None:
            raise InputError("--animate is for a run, without --figure and --format", "cdfctl plot RUN --animate")
        written = [_film(source, fields, out, quiet=quiet)]
    else:
        _check_out(out, layout)
        from cdfctl.report.figures.catalogue import paper_parts, source_parts

        parts = paper_parts(names) if source is None else source_parts(source, names, fields, at or ())
        folder = Path() if source is None else source / FOLDER
        sheet = names == [OVERVIEW]
        written = _write(parts, out or folder, layout, width, dpi, sheet=sheet)
    if json:
        files = [{"figure": name, "file": str(path)} for name, path in written]
        write_json({"source": None if source is None else str(source), "figures": files})
    else:
        for _, path in written:
            note(f"wrote {path}", quiet=quiet)


def _check_out(out: Path | None, layout: Format | None) -> None:
    """Say at once, before the work, that ``out`` cannot be written."""
    from cdfctl.report.figures.output import check_output

    if out is None or out.is_dir():
        return
    if not out.suffix:
        if out.exists():
            raise InputError(f"{out} is a file, not a folder", "a file of a figure has a suffix")
        return
    if layout is not None and out.suffix.lower() != f".{layout.value}":
        raise InputError(f"--format {layout.value} and --out {out} say different things", "leave one of them out")
    check_output(out)


def _write(
    parts: list[Part], target: Path, layout: Format | None, width: float | None, dpi: int, *, sheet: bool
) -> list[tuple[str, Path]]:
    """One sheet into a file, or a file each into a folder; a path with a suffix is a file."""
    from cdfctl.report.figures.output import save_figure
    from cdfctl.report.figures.part import figure_of

    suffix = f".{layout.value if layout else 'png'}"
    if target.suffix and not target.is_dir():
        planned = [(parts[0].name if len(parts) == 1 else OVERVIEW, target, parts)]
    else:
        _make_folder(target)
        single = [(part.name, target / f"{part.name}{suffix}", [part]) for part in parts]
        planned = [(OVERVIEW, target / f"{OVERVIEW}{suffix}", parts)] if sheet else single
    for _, path, together in planned:
        save_figure(figure_of(together, width), path, dpi)
    return [(name, path) for name, path, _ in planned]


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}", "give another --out") from None


def _film(source: Path, fields: tuple[str, ...] | None, out: Path | None, *, quiet: bool) -> tuple[str, Path]:
    from cdfctl.report.figures.animation import animate, check_animation, has_ffmpeg
    from cdfctl.report.figures.run_view import view_run

    folder = source / FOLDER if out is None else out if out.is_dir() or not out.suffix else None
    if folder is None and out is not None:
        path = out
        check_animation(path)
    else:
        assert folder is not None
        path = folder / ("film.mp4" if has_ffmpeg() else "film.gif")
    view = view_run(source)
    if folder is not None:
        if not has_ffmpeg():
            note("ffmpeg is not installed: a GIF instead of an MP4", quiet=quiet)
        _make_folder(folder)
    animate(view, fields or view.field_names, path)
    return "film", path
