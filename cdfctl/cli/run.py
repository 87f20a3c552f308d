"""``cdfctl run``: one closed-loop run, its summary, and its folder."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING

from cdfctl.cli import options
from cdfctl.cli.console import note, show, stderr, write_json
from cdfctl.cli.dry_run import rehearse
from cdfctl.errors import PlantError

if TYPE_CHECKING:
    from cdfctl.simulation.assemble import Trial
    from cdfctl.simulation.journal import Journal
    from cdfctl.simulation.result import RunResult

INTERRUPTED = 130

INTERRUPTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""What ends a run early with the steps so far kept, and an arm stopped."""


def run(
    scenario: options.Scenario,
    controller: options.Controller = None,
    seed: options.Seed = None,
    trial: options.Trial = 0,
    plant: options.Plant = None,
    host: options.Host = None,
    move_to_start: options.MoveToStart = False,
    dry_run: options.DryRun = False,
    live: options.Live = False,
    settings: options.Settings = None,
    out: options.RunFolder = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> int:
    """Run a scenario once, judge it, and write a run folder."""
    from cdfctl.scenario.library import load_scenario

    file = load_scenario(scenario, options.overrides(settings, controller, seed, plant, host, move_to_start))

    # The heavy imports, once the file is known to be good.
    from cdfctl.fields.table.store import run_hint
    from cdfctl.scenario.variants import VARIANTS
    from cdfctl.simulation.assemble import assemble
    from cdfctl.simulation.journal import journal
    from cdfctl.simulation.run_folder import check_target, default_folder, write_run

    wired = assemble(file, trial=trial)
    if VARIANTS[wired.scenario.controller.variant].field != "sdf":
        body = wired.scenario.robot
        changed = bool(body.lock or body.limits.position)
        if hint := run_hint(wired.robot, str(body.name or body.urdf), changed=changed):
            note(hint, quiet=quiet)
    if dry_run:
        return rehearse(wired, json=json, quiet=quiet)
    folder = out if out is not None else default_folder(wired.scenario, trial)
    check_target(folder)
    with journal(folder, wired.scenario, on=live) as kept:
        finished = follow(wired, quiet=quiet, kept=kept)
        result = wired.result()
        if not finished and not len(result.trajectory.u):
            note("cdfctl: interrupted before the first step; nothing was written")
            return INTERRUPTED
        document = write_run(folder, result)
    if kept.problem is not None:
        note(f"cdfctl: warning: could not be followed to the end: {kept.problem}", quiet=quiet)
    if json:
        write_json(document)
    elif not quiet:
        from cdfctl.report.run_summary import run_summary

        show(run_summary(result, document["run_dir"], wired.robot.tip, wired.robot.notes))
    if not finished:
        note(f"cdfctl: interrupted after {len(result.trajectory.u)} steps; they are in {document['run_dir']}")
        return INTERRUPTED
    return status_of(result)


def follow(wired: Trial, *, quiet: bool, kept: Journal) -> bool:
    """Run to the end, with a progress bar where standard error is a terminal; False if interrupted on the way."""
    steps = wired.run()
    with suppress(KeyboardInterrupt), interrupts() as interrupted, closing(steps):
        if quiet or not sys.stderr.isatty():
            return all(not interrupted() for _ in kept.through(steps))
        from rich.progress import BarColumn, Progress, TextColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[clock]}"))
        with Progress(*columns, console=stderr(), transient=True) as progress:
            # The first step of a first run waits for the compiler.
            bar = progress.add_task(
                "preparing (a first run compiles for a minute)", total=wired.rollout.max_steps, clock=""
            )
            for step in kept.through(steps):
                if interrupted():
                    return False
                clock = f"{step.state.t:.1f} of at most {wired.scenario.simulation.time_limit:g} s"
                progress.update(bar, description=wired.scenario.name, completed=step.index + 1, clock=clock)
            progress.update(bar, description="judging", clock="")
        return True
    return False


@contextmanager
def interrupts() -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C has been pressed (or the process told to end, or its terminal closed), to be asked between steps.

    It raises KeyboardInterrupt too, as usual; but that is lost where it strikes while compiled code is being called.
    """
    pressed = False

    def press(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        raise KeyboardInterrupt

    before = {number: signal.signal(number, press) for number in INTERRUPTS}
    try:
        yield lambda: pressed
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def status_of(result: RunResult) -> int:
    """The exit status of a finished run."""
    if result.verdict.outcome == "error":
        note(f"cdfctl: error: {result.reason}")
        return PlantError.exit_status
    return 0 if result.verdict.success else 1
