"""``cdfctl build-cdf``: precompute a robot's contact table."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdfctl.cli import options
from cdfctl.cli.console import note, show, stderr, write_json
from cdfctl.errors import InputError

if TYPE_CHECKING:
    from cdfctl.fields.table.build import BuildParameters, Progress
    from cdfctl.fields.table.store import StoredTable
    from cdfctl.robots.robot import Robot


class Device(StrEnum):
    """Where starts come from."""

    numpy = "numpy"
    cpu = "cpu"
    cuda = "cuda"


def build_cdf(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            help="A shipped robot (see cdfctl robots), a robot file .yaml, or a .urdf.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The .safetensors file. [default: in the user cache]"),
    ] = None,
    resolution: Annotated[
        int | None,
        typer.Option("--resolution", metavar="N", help="Grid points along the longest side. [default: 22]"),
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option("--starts", metavar="N", help="Starts tried for each point and piece. [default: 96]"),
    ] = None,
    radius: Annotated[
        float | None, typer.Option("--radius", metavar="R", help="Radius of the ball, m. [default: 0.05]")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", metavar="N", min=1, help="Threads. [default: every core]")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", metavar="N", help="Seed of the starts. [default: 0]")] = None,
    force: Annotated[bool, typer.Option("--force", help="Build anew, and replace what is there.")] = False,
    device: Annotated[
        Device | None,
        typer.Option(
            "--device",
            help="Random starts as they are (numpy, the fastest on a processor), or moved near contact by torch first.",
            show_default=False,
        ),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> None:
    """Precompute a robot's table of contact configurations, and report how accurate it is."""
    given: dict[str, Any] = {"resolution": resolution, "starts": starts, "radius": radius, "seed": seed}
    given["device"] = None if device is None else device.value
    wanted = {name: value for name, value in given.items() if value is not None}

    from cdfctl.robots.robot import load_robot

    loaded = load_robot(robot)
    from cdfctl.fields.cdf import table_path
    from cdfctl.fields.table.build import BuildParameters

    parameters = BuildParameters(**wanted)
    target = table_path(loaded) if out is None else out
    check_target(target)
    begin = time.perf_counter()
    stored = None if force else present(target, loaded, wanted)
    built = stored is None
    if stored is None:
        stored = make(loaded, parameters, target, jobs, quiet=quiet)
    seconds = time.perf_counter() - begin
    if json:
        write_json(document(stored, built, seconds))
        return
    if quiet:
        return
    from cdfctl.report.table_report import table_report

    show(table_report(stored, target.stat().st_size))
    if built:
        note(f"built in {seconds:.0f} s")
    else:
        note("this table is there and up to date: nothing was built (--force builds it anew)")


def check_target(target: Path) -> None:
    """InputError where a table must not be written to ``target``."""
    from cdfctl.fields.table.store import SUFFIX

    if target.suffix != SUFFIX:
        raise InputError(f"--out {target}: a table is a {SUFFIX} file")
    if target.is_dir():
        raise InputError(f"{target}: is a folder, not a table", "remove it, or give another --out")


def present(target: Path, robot: Robot, wanted: dict[str, Any]) -> StoredTable | None:
    """The table that is there and is what was asked for, None where nothing is there.

    Raises:
        InputError: something else is there.
    """
    from cdfctl.fields.table.store import changed_parameters, load_table

    if not target.exists():
        return None
    stored = load_table(target, robot)
    changed = changed_parameters(stored.parameters, wanted)
    if changed:
        raise InputError(f"{target}: a table is there, but with {'; '.join(changed)}", hint="--force replaces it")
    return stored


def make(robot: Robot, parameters: BuildParameters, target: Path, jobs: int | None, *, quiet: bool) -> StoredTable:
    """Build, measure and write the table."""
    from cdfctl.fields.table.accuracy import measure_accuracy
    from cdfctl.fields.table.build import build_table, forget_chunks
    from cdfctl.fields.table.store import load_table, save_table

    try:
        with progress_bar(f"contacts of {robot.name}", quiet=quiet) as progress:
            table = build_table(robot, parameters, target, jobs=jobs, progress=progress)
        with progress_bar("measuring accuracy", quiet=quiet) as progress:
            accuracy = measure_accuracy(robot, table, parameters.radius, parameters.seed, jobs=jobs, progress=progress)
    except KeyboardInterrupt:
        note("cdfctl: what is done is kept: the same command goes on from there")
        raise
    save_table(target, robot, table, parameters, accuracy)
    forget_chunks(target)
    return load_table(target, robot)


@contextmanager
def progress_bar(what: str, *, quiet: bool) -> Iterator[Progress | None]:
    """A bar with the time left on standard error, if that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=stderr(), transient=True) as bar:
        task = bar.add_task(f"{what} (a first build compiles for a minute)", total=None)

        def progress(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=what if done else None)

        yield progress


def document(stored: StoredTable, built: bool, seconds: float) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {
        "robot": stored.robot,
        "robot_hash": stored.robot_hash,
        "table": str(stored.path),
        "built": built,
        "seconds": seconds if built else None,
        "bytes": stored.path.stat().st_size,
        "points": int(len(stored.table.first) - 1),
        "entries": len(stored.table.piece),
        "parameters": stored.parameters.document(),
        "cdfctl": stored.version,
        "accuracy": stored.accuracy.document(),
    }
