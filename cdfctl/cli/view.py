"""``cdfctl view``: a run in three dimensions, in the browser or as a page of its own."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdfctl.cli import options
from cdfctl.cli.console import note, write_json
from cdfctl.errors import InputError

if TYPE_CHECKING:
    from cdfctl.report.view.replay import Replay
    from cdfctl.report.view.viewer import Source

WAIT = 0.1
"""Between two looks for a run that has not begun, s."""


def view(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, as cdfctl run writes it.")],
    html: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write one page that opens without a server, and end."),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Follow a run in progress: cdfctl run ... --live --out RUN.")
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(
            "--port",
            metavar="N",
            min=0,
            max=65535,
            help="Serve on this port; 0 for any free one. [default: 8080, or the next free one]",
            show_default=False,
        ),
    ] = None,
    host: Annotated[
        str, typer.Option("--host", metavar="ADDRESS", help="Serve on this address; the default is this machine alone.")
    ] = "127.0.0.1",
    no_open: Annotated[bool, typer.Option("--no-open", help="Do not open the browser.")] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> int:
    """Replay a run in the browser: arm, obstacles, q*, distance and charts over time. Ctrl-C ends it."""
    from cdfctl.report.view.solids import need_packages

    if html is not None and live:
        raise InputError("--html and --live exclude each other", hint="write the page once the run is over")
    need_packages()
    if html is not None:
        return _write_page(run, html, json=json, quiet=quiet)
    from cdfctl.cli.run import interrupts

    with suppress(KeyboardInterrupt), interrupts() as interrupted:
        _serve(run, host, port, live=live, browser=not no_open, json=json, quiet=quiet, stop=interrupted)
    # A viewer ends when its user has seen enough: that is its normal end, and nothing is left half done.
    note("cdfctl: closed", quiet=quiet)
    return 0


def _write_page(folder: Path, page: Path, *, json: bool, quiet: bool) -> int:
    from cdfctl.report.view.facts import facts_of, title_of
    from cdfctl.report.view.page import check_page, html_page, write_page
    from cdfctl.report.view.replay import Replay
    from cdfctl.simulation.run_folder import read_run

    check_page(page)
    found = read_run(folder)
    text, warnings = html_page(Replay.of(found), title_of(found.scenario), facts_of(found))
    write_page(page, text)
    for warning in warnings:
        note(f"cdfctl: warning: {warning}", quiet=quiet)
    if json:
        write_json({"run": str(folder), "file": str(page), "bytes": page.stat().st_size, "warnings": warnings})
    else:
        note(f"wrote {page} ({page.stat().st_size / 1e6:.1f} MB)", quiet=quiet)
    return 0


def _serve(
    folder: Path,
    host: str,
    port: int | None,
    *,
    live: bool,
    browser: bool,
    json: bool,
    quiet: bool,
    stop: Callable[[], bool],
) -> None:
    from cdfctl.report.view.facts import title_of
    from cdfctl.report.view.server import serving
    from cdfctl.report.view.viewer import Viewer

    replay, facts, source = _follow(folder, stop, quiet=quiet) if live else _finished(folder)
    with serving(host, port) as server:
        viewer = Viewer(server, replay, title_of(replay.body.scenario), facts, source)
        for warning in viewer.stage.warnings:
            note(f"cdfctl: warning: {warning}", quiet=quiet)
        url = f"http://{'localhost' if host in ('', '0.0.0.0', '::') else host}:{server.get_port()}"
        if json:
            write_json({"run": str(folder), "url": url, "warnings": viewer.stage.warnings})
        else:
            note(f"cdfctl: {folder} at {url} (Ctrl-C ends it)", quiet=quiet)
        if browser:
            _open(url, quiet=quiet)
        viewer.run(stop)


def _finished(folder: Path) -> tuple[Replay, list[str], Source | None]:
    from cdfctl.report.view.facts import facts_of
    from cdfctl.report.view.replay import Replay
    from cdfctl.simulation.run_folder import read_run

    run = read_run(folder)
    return Replay.of(run), facts_of(run), None


def _follow(folder: Path, stop: Callable[[], bool], *, quiet: bool) -> tuple[Replay, list[str], Source | None]:
    """The run in progress into ``folder``, waited for; the finished one where there is one and none is in progress."""
    from cdfctl.report.view.live import Following, can_follow
    from cdfctl.simulation.run_folder import RESULT

    if not can_follow(folder):
        if (folder / RESULT).exists():
            note(f"cdfctl: no run into {folder} is in progress; showing the finished one", quiet=quiet)
            return _finished(folder)
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            return _finished(folder)  # which says what is wrong with it
        note(f"cdfctl: waiting for a run: cdfctl run ... --live --out {folder}", quiet=quiet)
    while True:
        if stop():
            raise KeyboardInterrupt
        if can_follow(folder):
            with suppress(InputError):  # it may have ended just now
                source = Following(folder)
                return source.replay, [], source
        elif (folder / RESULT).exists():
            return _finished(folder)
        time.sleep(WAIT)


def _open(url: str, *, quiet: bool) -> None:
    """Open the browser where there is a screen for it: a text browser would take the terminal."""
    import webbrowser

    screen = sys.platform == "darwin" or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    opened: Any = screen and webbrowser.open(url)
    if not opened:
        note("cdfctl: no browser to open here; open the address yourself", quiet=quiet)
