"""``cdfctl doctor``: what is installed, what is missing, and the command that mends it."""

from __future__ import annotations

from typing import Annotated

import typer

from cdfctl.cli import options
from cdfctl.cli.console import note, show, write_json
from cdfctl.errors import MissingError


def doctor(
    speed: Annotated[bool, typer.Option("--speed", help="Also time the control step (about half a minute).")] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> int:
    """Versions of the stack, solvers, tables, and what is missing."""
    from cdfctl.report.stack import examine, installation_table

    found = examine()
    if not json and not quiet:
        show(installation_table(found))
    timings = []
    if speed and found.healthy:
        from cdfctl.report.speed import measure, speed_table

        note("timing the control step ...", quiet=quiet)
        timings = measure()
        if not json:
            show(speed_table(timings))
    if json:
        document = found.document()
        if speed:
            document["speed"] = [timing.document() for timing in timings]
        write_json(document)
    if quiet and not found.healthy:
        for item in found.missing:
            note(f"missing: {item.what}\n  mend   {item.mend}")
    return 0 if found.healthy else MissingError.exit_status
