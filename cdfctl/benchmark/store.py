"""The store of a benchmark: a folder that survives being killed, and is resumed.

    manifest.json     what was run: configuration, versions, the number of trials asked for last
    trials.jsonl      one line a trial, in the order of the plan; deterministic columns only
    arrived.jsonl     trials that finished before their turn; gone when the benchmark is complete
    timing.jsonl      one line a trial, as they came: times, which no two runs share
    solvable.jsonl    one line a set-up that was asked about (--solvable): what is proved of it
    trajectories/     run folders of the trials that are kept
    summary.json, summary.md

Every line goes to the operating system before the next trial is taken up, so a kill loses the trials in flight only. A
torn last line is dropped. One process at a time: a lock that its death releases.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from cdfctl.benchmark.plan import Plan, digest
from cdfctl.benchmark.trial import Answer, record_of, timing_of
from cdfctl.benchmark.versions import versions
from cdfctl.errors import InputError
from cdfctl.simulation.run_folder import write_run
from cdfctl.types import TrialKey

FORMAT = "cdfctl-bench"
VERSION = 1
"""The version of the store this code writes, and the newest it reads."""

MANIFEST, TRIALS, ARRIVED, TIMING, LOCK = "manifest.json", "trials.jsonl", "arrived.jsonl", "timing.jsonl", ".lock"
SOLVABLE = "solvable.jsonl"

Record = dict[str, Any]


def default_store(plan: Plan) -> Path:
    """``runs/<suite>-<hash>``: another configuration, or other code, is another folder."""
    return Path("runs") / f"{plan.suite}-{digest({'configuration': plan.configuration(), 'versions': versions()})}"


def key_of(record: Record) -> TrialKey:
    """The key of a line of ``trials.jsonl``."""
    names = ("scenario", "controller", "on_infeasible", "seed", "trial")
    return TrialKey(*(record[name] for name in names))


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
        _append(self.folder / TIMING, [timing_of(answer)])
        record = record_of(answer.result)
        if self.keys[len(self.records)] != answer.result.key:
            _append(self.folder / ARRIVED, [record])
        self.early[answer.result.key] = record
        self._advance()

    def _advance(self) -> None:
        """Move what has its turn now from ``early`` to ``trials.jsonl``."""
        ready: list[Record] = []
        while (place := len(self.records) + len(ready)) < len(self.keys) and self.keys[place] in self.early:
            ready.append(self.early[self.keys[place]])
        _append(self.folder / TRIALS, ready)
        for record in ready:
            del self.early[key_of(record)]
        self.records += ready
        if not self.early:
            _unlink(self.folder / ARRIVED)

    def timings(self) -> list[Record]:
        """The lines of ``timing.jsonl``."""
        return read_lines(self.folder / TIMING)

    def solvable(self) -> list[Record]:
        """The lines of ``solvable.jsonl``."""
        return read_lines(self.folder / SOLVABLE)

    def add_solvable(self, record: Record) -> None:
        """Keep what is proved of one set-up. Raises :class:`InputError` as :meth:`add`."""
        _append(self.folder / SOLVABLE, [record])

    def write(self, name: str, text: str) -> None:
        """Write a file of the store whole or not at all. Raises :class:`InputError` where the disk does not take it."""
        _replace(self.folder / name, text)


def folder_name(key: TrialKey) -> str:
    """The name of a kept run: that of ``cdfctl run``, and the rule."""
    return f"{key.scenario}-{key.controller}-{key.on_infeasible}-{key.seed}-{key.trial}".replace("/", "_")


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
        lock = (folder / LOCK).open("a")
    except OSError as error:
        raise _unwritable(folder, error) from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{folder}: another bench is writing to this store", "wait for it, or use --out") from None
        for name in (TRIALS, ARRIVED, TIMING, SOLVABLE):
            _drop_torn(folder / name)
        keys = list(plan.keys())
        records, early = _read(folder, keys)
        _replace(folder / MANIFEST, json.dumps(_manifest(plan, max(len(records), len(keys))), indent=2) + "\n")
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
        raise InputError(f"{folder}: is a file, not a benchmark's folder", "give another --out")
    path = folder / MANIFEST
    if not path.exists():
        if any(item.name != LOCK for item in folder.iterdir()):
            raise InputError(f"{folder}: is not empty and not a benchmark's folder", "give another --out")
        return
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"{path}: damaged: not JSON", "give another --out") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputError(f"{folder}: is not empty and not a benchmark's folder", "give another --out")
    if manifest.get("version") != VERSION:
        found = f"{path}: format {manifest.get('version')}, this cdfctl reads {VERSION}"
        raise InputError(f"{found}: the store is of another version", "use the cdfctl that wrote it, or another --out")
    if manifest.get("configuration") != json.loads(json.dumps(plan.configuration())):
        raise InputError(f"{folder}: holds a benchmark of another configuration", "give another --out")
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
    """The finished trials of a store; ``trials.jsonl`` has to follow the plan as far as both go."""
    records = read_lines(folder / TRIALS)
    for line, (record, key) in enumerate(zip(records, keys, strict=False), start=1):
        if key_of(record) != key:
            place = f"{folder / TRIALS}:{line}"
            raise InputError(f"{place}: damaged: not the trial that belongs there", "use another --out")
    wanted = set(keys[len(records) :])
    early = {key_of(record): record for record in read_lines(folder / ARRIVED)}
    return records, {key: record for key, record in early.items() if key in wanted}


def read_lines(path: Path) -> list[Record]:
    """The objects of a file of JSON lines; a torn last line is left out, and there may be no file.

    Raises:
        InputError: it cannot be read, or a line in it is damaged.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    records = []
    for number, line in enumerate(text.split("\n")[:-1], start=1):
        try:
            record = json.loads(line)
            if path.name == SOLVABLE:
                record["problem"], record["trial"], record["answer"]
            elif path.name != TIMING:
                key_of(record)
        except (ValueError, TypeError, KeyError):
            raise InputError(f"{path}:{number}: damaged: not a trial", "use another --out") from None
        records.append(record)
    return records


def _drop_torn(path: Path) -> None:
    """Cut off what follows the last line feed: a write that was cut short."""
    try:
        if not path.exists():
            return
        data = path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            os.truncate(path, whole)
    except OSError as error:
        raise _unwritable(path, error) from None


def _append(path: Path, records: list[Record]) -> None:
    if not records:
        return
    text = "".join(json.dumps(record, ensure_ascii=False, allow_nan=False) + "\n" for record in records)
    try:
        with path.open("ab", buffering=0) as file:
            _write_all(file, text.encode("utf-8"))
    except OSError as error:
        raise _unwritable(path, error) from None


def _write_all(file: IO[bytes], data: bytes) -> None:
    while data:  # a full disk may take a part
        data = data[file.write(data) :]


def _replace(path: Path, text: str) -> None:
    draft = path.with_name(f".{path.name}.new")
    try:
        draft.write_text(text, encoding="utf-8")
        draft.replace(path)
    except OSError as error:
        _unlink(draft)
        raise _unwritable(path, error) from None


def _unlink(path: Path) -> None:
    with suppress(OSError):
        path.unlink(missing_ok=True)


def _unwritable(path: Path, error: OSError) -> InputError:
    return InputError(
        f"{path}: cannot be written: {error.strerror or error}",
        "the trials written before are kept: the same command goes on from there",
    )
