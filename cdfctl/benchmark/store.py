"""The store of a benchmark: a folder that survives being killed, and is resumed.

    manifest.json     what was run: configuration, versions, the number of trials asked for last
    trials.jsonl      one line a trial, in the order of the plan; deterministic columns only
    arrived.jsonl     trials that finished before their turn; gone when the benchmark is complete
    timing.jsonl      one line a trial, as they came: times, which no two runs share
    solvable.jsonl    one line a set-up that was asked about (--solvable): what is proved of it
    trajectories/     run folders of the trials that are kept
    summary.json, summary.md

A line of trials ends with a checksum of the rest (see :mod:`cdfctl.benchmark.lines`). Every line goes to the operating
system before the next trial is taken up, so a kill loses the trials in flight only. A torn last line is dropped. One
process at a time: a lock that its death releases.
"""

from __future__ import annotations

import fcntl
import itertools
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdfctl.benchmark.lines import (
    AGAIN,
    PROVED,
    TIMES,
    TRIAL,
    Record,
    append,
    drop_torn,
    key_of,
    read_lines,
    replace,
    unlink,
    unwritable,
)
from cdfctl.benchmark.plan import Plan, digest
from cdfctl.benchmark.trial import Answer, record_of, timing_of
from cdfctl.benchmark.versions import versions
from cdfctl.errors import InputError
from cdfctl.reading import read_json, refuse_link
from cdfctl.simulation.run_folder import write_run
from cdfctl.types import TrialKey

FORMAT = "cdfctl-bench"
VERSION = 1
"""The version of the store this code writes, and the newest it reads."""

MANIFEST, TRIALS, ARRIVED, TIMING, LOCK = "manifest.json", "trials.jsonl", "arrived.jsonl", "timing.jsonl", ".lock"
SOLVABLE = "solvable.jsonl"

LONGEST_NAME = 180  # bytes; file systems take 255, and drafts of it are longer

ANOTHER = "give another --out"


def default_store(plan: Plan) -> Path:
    """``runs/<suite>-<hash>``: another configuration, or other code, is another folder."""
    return Path("runs") / f"{plan.suite}-{digest({'configuration': plan.configuration(), 'versions': versions()})}"


@dataclass
class Store:
    """A store as read, and open for what is still to come.

    Attributes:
        folder: where it is.
        records: the finished trials, in the order of the plan.
        early: finished trials whose turn has not come, by key.
        keys: the order of the plan, as far as it is asked for now.
    """

    folder: Path
    records: list[Record]
    early: dict[TrialKey, Record]
    keys: list[TrialKey] = field(repr=False)

    def missing(self) -> list[int]:
        """Places in the plan of the trials still to be run."""
        return [i for i in range(len(self.records), len(self.keys)) if self.keys[i] not in self.early]

    def add(self, answer: Answer) -> None:
        """Keep a finished trial.

        Raises:
            InputError: the disk does not take it; what was written before is kept.
        """
        if answer.run is not None:
            write_run(self.folder / "trajectories" / folder_name(answer.result.key), answer.run)
        append(self.folder / TIMING, [timing_of(answer)], checked=False)
        record = record_of(answer.result)
        if self.keys[len(self.records)] != answer.result.key:
            append(self.folder / ARRIVED, [record])
        self.early[answer.result.key] = record
        self._advance()

    def _advance(self) -> None:
        """Move what has its turn now from ``early`` to ``trials.jsonl``."""
        ready: list[Record] = []
        while (place := len(self.records) + len(ready)) < len(self.keys) and self.keys[place] in self.early:
            ready.append(self.early[self.keys[place]])
        append(self.folder / TRIALS, ready)
        for record in ready:
            del self.early[key_of(record)]
        self.records += ready
        if not self.early:
            unlink(self.folder / ARRIVED)

    def timings(self) -> list[Record]:
        """The lines of ``timing.jsonl``."""
        return read_lines(self.folder / TIMING, TIMES)

    def solvable(self) -> list[Record]:
        """The lines of ``solvable.jsonl``."""
        return read_lines(self.folder / SOLVABLE, PROVED)

    def add_solvable(self, record: Record) -> None:
        """Keep what is proved of one set-up. Raises :class:`InputError` as :meth:`add`."""
        append(self.folder / SOLVABLE, [record], checked=False)

    def write(self, name: str, text: str) -> None:
        """Write a file of the store whole or not at all. Raises :class:`InputError` where the disk does not take it."""
        replace(self.folder / name, text)


def folder_name(key: TrialKey) -> str:
    """The name of a kept run: that of ``cdfctl run``, and the rule. What a sweep set can make it too long for one."""
    name = f"{key.scenario}-{key.controller}-{key.on_infeasible}-{key.seed}-{key.trial}".replace("/", "_")
    start = name.encode()[:LONGEST_NAME].decode(errors="ignore")
    return name if start == name else f"{start}-{digest({'name': name})}"


def peek(folder: Path, plan: Plan) -> int:
    """How many of the plan's trials the store in ``folder`` has; nothing is written.

    Raises:
        InputError: the folder is not a store of this plan.
    """
    if not folder.exists():
        return 0
    _check_ours(folder, plan)
    keys = list(plan.keys())
    records, early = _read(folder, keys)
    return min(len(records), len(keys)) + len(early)


@contextmanager
def open_store(folder: Path, plan: Plan) -> Iterator[Store]:
    """The store of ``plan`` in ``folder``, made if need be, resumed where there is one; locked while it is open.

    Raises:
        InputError: the folder is something else, of another configuration or version, damaged, in use, or cannot be
            written.
    """
    if folder.exists():
        _check_ours(folder, plan)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in (LOCK, "trajectories"):
            refuse_link(folder / name)
        # For reading too: where it is a pipe, that does not wait for somebody else.
        lock = os.fdopen(os.open(folder / LOCK, os.O_CREAT | os.O_RDWR, 0o666), "rb")
    except OSError as error:
        raise unwritable(folder, error) from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{folder}: another bench is writing to this store", "wait for it, or use --out") from None
        for name in (TRIALS, ARRIVED, TIMING, SOLVABLE):
            drop_torn(folder / name)
        keys = list(plan.keys())
        records, early = _read(folder, keys)
        replace(folder / MANIFEST, json.dumps(_manifest(plan, max(len(records), len(keys))), indent=2) + "\n")
        store = Store(folder, records, early, keys)
        store._advance()
        yield store


def _manifest(plan: Plan, keys: int) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "suite": plan.suite,
        "trials": keys // len(plan.cells),
        "configuration": plan.configuration(),
        "cells": [{"sweep": {s.field: s.text for s in cell.settings}, "shipped": cell.shipped} for cell in plan.cells],
        "versions": versions(),
    }


def _check_ours(folder: Path, plan: Plan) -> None:
    """Refuse, before anything is run, a folder that is not the store of this plan by this code."""
    if not folder.is_dir():
        raise InputError(f"{folder}: is a file, not a benchmark's folder", ANOTHER)
    path = folder / MANIFEST
    if not os.path.lexists(path):
        if any(item.name != LOCK for item in folder.iterdir()):
            raise InputError(f"{folder}: is not empty and not a benchmark's folder", ANOTHER)
        return
    try:
        manifest = read_json(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}", ANOTHER) from None
    except ValueError:
        raise InputError(f"{path}: damaged: not JSON", ANOTHER) from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputError(f"{folder}: is not empty and not a benchmark's folder", ANOTHER)
    if manifest.get("version") != VERSION:
        found = f"{path}: format {manifest.get('version')}, this cdfctl reads {VERSION}"
        raise InputError(f"{found}: the store is of another version", "use the cdfctl that wrote it, or another --out")
    if manifest.get("configuration") != json.loads(json.dumps(plan.configuration())):
        raise InputError(f"{folder}: holds a benchmark of another configuration", ANOTHER)
    _check_versions(folder, manifest.get("versions"))


def _check_versions(folder: Path, theirs: object) -> None:
    ours = versions()
    if theirs == ours or not isinstance(theirs, Mapping):
        return
    differing = [name for name in ours if theirs.get(name) != ours[name]]
    changed = [f"{name} {theirs.get(name, '-')} then, {ours[name]} now" for name in differing]
    raise InputError(
        f"{folder}: was begun by other code: {'; '.join(changed)}",
        "results of two versions do not mix: give another --out",
    )


def _read(folder: Path, keys: list[TrialKey]) -> tuple[list[Record], dict[TrialKey, Record]]:
    """The finished trials of a store; ``trials.jsonl`` has to follow the plan, and no trial comes twice."""
    records = read_lines(folder / TRIALS, TRIAL)
    seen: set[TrialKey] = set()
    for line, (record, key) in enumerate(itertools.zip_longest(records, keys), start=1):
        if record is None:
            break
        # Beyond the plan there may be what was asked for before, when it had more trials.
        if (key is not None and key_of(record) != key) or key_of(record) in seen:
            place = f"{folder / TRIALS}:{line}"
            raise InputError(f"{place}: damaged: not the trial that belongs there", AGAIN)
        seen.add(key_of(record))
    wanted = set(keys[len(records) :])
    early = {key_of(record): record for record in read_lines(folder / ARRIVED, TRIAL)}
    return records, {key: record for key, record in early.items() if key in wanted}
