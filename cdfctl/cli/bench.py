"""``cdfctl bench``: randomised trials x controllers, resumable, and their table."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdfctl.cli import options
from cdfctl.cli.console import note, show, stderr, write, write_json
from cdfctl.cli.run import interrupts
from cdfctl.errors import InputError

if TYPE_CHECKING:
    from cdfctl.benchmark.plan import Plan
    from cdfctl.benchmark.run import Runner
    from cdfctl.benchmark.statistics import CellSummary
    from cdfctl.benchmark.store import Store

INTERRUPTED, TOO_FEW = 130, 1

MOST_TRIALS = 1_000_000
"""Of a cell; the keys of all of them are held in memory."""


class Suite(StrEnum):
    """Named lists of scenarios and controllers."""

    paper = "paper"


class Rule(StrEnum):
    """What is done where no velocity satisfies the rows."""

    fail = "fail"
    least_violation = "least-violation"
    brake = "brake"


class Format(StrEnum):
    """Of the table on standard output."""

    table = "table"
    markdown = "markdown"
    latex = "latex"
    csv = "csv"


class Keep(StrEnum):
    """Whose run folders the store keeps."""

    all = "all"
    failures = "failures"
    none = "none"


def bench(
    scenario: Annotated[
        list[str] | None,
        typer.Option("--scenario", metavar="SCENARIO", help="A scenario, as for run; may be repeated."),
    ] = None,
    suite: Annotated[
        Suite | None,
        typer.Option("--suite", help="Instead of --scenario. paper: S1-S3 and C1-C3 with all five methods."),
    ] = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            "--controller",
            metavar="NAME",
            help="May be repeated; the others are compared with the first. [default: each scenario's, or the suite's]",
            show_default=False,
        ),
    ] = None,
    on_infeasible: Annotated[
        list[Rule] | None,
        typer.Option("--on-infeasible", help="May be repeated. [default: each scenario's]", show_default=False),
    ] = None,
    trials: Annotated[
        int, typer.Option("--trials", min=1, max=MOST_TRIALS, help="Of each scenario and controller.")
    ] = 100,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the draws.")] = 0,
    settings: options.Settings = None,
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            "--sweep",
            metavar="FIELD=A,B,C",
            help="Set any field to each of these values; may be repeated.",
            show_default=False,
        ),
    ] = None,
    solvable: Annotated[
        bool,
        typer.Option("--solvable", help="Also bound the share of trials that can be solved at all; two joints only."),
    ] = False,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", min=1, help="Worker processes. [default: one a processor]", show_default=False),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option("--dask", metavar="ADDRESS", help="Run on the cluster of this Dask scheduler, tcp://host:port."),
    ] = None,
    keep: Annotated[Keep, typer.Option("--keep", help="Trials whose run folder the store keeps.")] = Keep.failures,
    min_success: Annotated[
        float | None,
        typer.Option("--min-success", min=0.0, max=1.0, help="End with status 1 if a success rate is below this."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="The store. [default: runs/<suite>-<hash>]", show_default=False),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be run, and run nothing.")] = False,
    layout: Annotated[Format, typer.Option("--format", help="Of the table.")] = Format.table,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> int:
    """Run many trials, keep them in a store that can be resumed, and print a table beside the paper's figures."""
    if bool(scenario) == bool(suite):
        raise InputError(
            "bench needs either --scenario or --suite", "for example cdfctl bench --scenario S1 --trials 20"
        )
    if dask is not None and jobs is not None:
        raise InputError(
            "--jobs and --dask exclude each other", "a cluster has as many jobs as its workers have threads"
        )
    from cdfctl.benchmark.paper import METHODS, SCENARIOS
    from cdfctl.benchmark.plan import make_plan
    from cdfctl.benchmark.sweep import combinations

    plan = make_plan(
        SCENARIOS if suite else scenario or (),
        controller or (METHODS if suite else ()),
        [rule.value for rule in on_infeasible or ()],
        combinations(sweep or ()),
        trials=trials,
        seed=seed,
        suite=suite.value if suite else None,
        overrides=options.overrides(settings, None, None),
    )
    if solvable:
        from cdfctl.benchmark.solvable.trials import check_solvable

        for cell in plan.cells:
            check_solvable(cell.scenario)
    from cdfctl.benchmark.run import Runner, processors
    from cdfctl.benchmark.store import default_store, open_store

    folder = out if out is not None else default_store(plan)
    if dry_run:
        return _say(plan, folder, json=json)
    with ExitStack() as stack:
        client = None
        if dask is not None:
            from cdfctl.benchmark.cluster import connect

            client = stack.enter_context(connect(dask))
        store = stack.enter_context(open_store(folder, plan))
        # A process that is merely killed leaves its workers behind.
        stop = stack.enter_context(interrupts())
        runner = Runner(plan, jobs or processors(), keep.value, client)
        finished = _follow(runner, store, stop, quiet=quiet or json)
        if solvable and finished:
            finished = _bound(runner, store, stop, quiet=quiet or json)
        summaries = _summarise(plan, store)
    if json:
        from cdfctl.benchmark.document import document

        write_json(document(plan, summaries))
    elif not quiet:
        _print(summaries, layout)
    if not finished:
        note(f"cdfctl: interrupted after {_count(store)} of {len(plan)} trials; the same command goes on from there")
        return INTERRUPTED
    note(f"cdfctl: {len(plan)} trials in {folder}", quiet=quiet or json)
    low = [s for s in summaries if min_success is not None and s.success_rate < min_success]
    for summary in low:
        name = f"{summary.cell.name} {summary.cell.controller} ({summary.cell.on_infeasible})"
        note(f"cdfctl: {name}: success {summary.success_rate:.3f} is below {min_success:g}")
    return TOO_FEW if low else 0


def _count(store: Store) -> int:
    return len(store.keys) - len(store.missing())


def _say(plan: Plan, folder: Path, *, json: bool) -> int:
    """What would be run."""
    from cdfctl.benchmark.store import peek

    done = peek(folder, plan)
    cells = [(cell.name, cell.controller, cell.on_infeasible) for cell in plan.cells]
    if json:
        names = ("scenario", "controller", "on_infeasible")
        document = {"store": str(folder), "trials": plan.trials, "seed": plan.seed, "done": done}
        write_json(document | {"to_run": len(plan) - done, "cells": [dict(zip(names, c, strict=True)) for c in cells]})
        return 0
    from cdfctl.report.tables import listing

    show(listing(("scenario", "controller", "on infeasible steps"), cells))
    write(f"{len(cells)} x {plan.trials} = {len(plan)} trials, {done} of them done, into {folder}")
    return 0


def _follow(runner: Runner, store: Store, stop: Callable[[], bool], *, quiet: bool) -> bool:
    """Run what is missing, with a progress bar where standard error is a terminal; False if interrupted on the way."""
    missing = store.missing()
    answers = runner.run(missing)
    try:
        if quiet or not sys.stderr.isatty():
            return all(not stop() for _ in map(store.add, answers))
        from rich.progress import Progress

        with Progress(console=stderr(), transient=True) as progress:
            bar = progress.add_task(runner.plan.suite, total=len(store.keys), completed=len(store.keys) - len(missing))
            for answer in answers:
                store.add(answer)
                progress.advance(bar)
                if stop():
                    return False
        return True
    except KeyboardInterrupt:
        return False
    finally:
        answers.close()


def _bound(runner: Runner, store: Store, stop: Callable[[], bool], *, quiet: bool) -> bool:
    """Find out what can be solved, of the set-ups not known yet; False if interrupted on the way."""
    from cdfctl.benchmark.solvable.trials import questions

    waiting = questions(runner.plan, store.solvable())
    found = runner.solve(waiting)
    try:
        if quiet or not sys.stderr.isatty():
            return all(not stop() for _ in map(store.add_solvable, found))
        from rich.progress import track

        for record in track(found, "what can be solved", len(waiting), console=stderr(), transient=True):
            store.add_solvable(record)
            if stop():
                return False
        return True
    except KeyboardInterrupt:
        return False
    finally:
        found.close()


def _summarise(plan: Plan, store: Store) -> list[CellSummary]:
    """Statistics of all trials there are, also written into the store."""
    import json as json_module

    from cdfctl.benchmark.document import full_document
    from cdfctl.benchmark.statistics import summarise
    from cdfctl.report.bench_text import markdown

    wanted = set(store.keys)
    from cdfctl.benchmark.lines import key_of

    records = [r for r in [*store.records, *store.early.values()] if key_of(r) in wanted]
    summaries = summarise(plan.cells, records, store.timings(), store.solvable())
    store.write("summary.json", json_module.dumps(full_document(plan, summaries), indent=2, allow_nan=False) + "\n")
    store.write("summary.md", markdown(summaries))
    return summaries


def _print(summaries: list[CellSummary], layout: Format) -> None:
    from cdfctl.report import bench_text

    match layout:
        case Format.table:
            from cdfctl.report.bench_table import bench_table

            show(bench_table(summaries))
        case Format.markdown:
            write(bench_text.markdown(summaries).rstrip())
        case Format.latex:
            write(bench_text.latex(summaries).rstrip())
        case Format.csv:
            write(bench_text.table_csv(summaries).rstrip())
