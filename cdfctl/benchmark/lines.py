"""The files of a store: lines of JSON that are appended whole and checked when read, and documents that are replaced.

A line of trials ends with ``crc``, the CRC-32 of the rest of it, so that a bit that has turned over is noticed. What is
appended is in the operating system's hands when the call returns; a torn last line is left out.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NamedTuple

from cdfctl.errors import InputError
from cdfctl.reading import MIB, drafted, parse_json, read_bytes, refuse_link
from cdfctl.types import TrialKey

Record = dict[str, Any]

AGAIN = "run the benchmark again, with another --out"
CRC = "crc"
MOST = 4096 * MIB  # of one file

KEY = ("scenario", "controller", "on_infeasible", "seed", "trial")
REACHED = ("time_to_reach_s", "path_length_m", "joint_path_rad")  # what a trial that did has


class Kind(NamedTuple):
    """What a line is, and the types its columns have to have."""

    what: str
    columns: Mapping[str, tuple[type, ...]]


_NUMBER = (int, float, type(None))
_NAMED = {"scenario": (str,), "controller": (str,), "on_infeasible": (str,), "trial": (int,)}
_COUNTED = {"seed": (int,), "outcome": (str,), "outcome_sampled": (str,), "steps": (int,), "infeasible_steps": (int,)}
_MEASURED = dict.fromkeys((*REACHED, "min_clearance_m", "collision_time_s"), _NUMBER)
TRIAL = Kind("a trial", {**_NAMED, **_COUNTED, **_MEASURED, "reason": (str, type(None))})
TIMES = Kind("the times of a trial", {**_NAMED, "step_us": (list,)})
PROVED = Kind("the proof of a trial", {"problem": (str,), "trial": (int,), "answer": (str,)})


def key_of(record: Record) -> TrialKey:
    """The key of a line of ``trials.jsonl``."""
    return TrialKey(*(record[name] for name in KEY))


def read_lines(path: Path, kind: Kind) -> list[Record]:
    """The objects of a file of lines; a torn last line is left out, and there may be no file.

    Raises:
        InputError: it cannot be read, or a line in it is damaged.
    """
    try:
        text = read_bytes(path, MOST).decode("utf-8", errors="replace") if os.path.lexists(path) else ""
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}", AGAIN) from None
    records = []
    for number, line in enumerate(text.split("\n")[:-1], start=1):
        record = _record(line, kind)
        if record is None:
            raise InputError(f"{path}:{number}: damaged: not {kind.what}", AGAIN)
        records.append(record)
    return records


def _record(line: str, kind: Kind) -> Record | None:
    try:
        record = parse_json(line)
    except ValueError:
        return None
    if not isinstance(record, dict):
        return None
    said = record.pop(CRC, None)
    # Lines of older benchmarks have no checksum; a column that nobody knows may be what was one.
    if said != checksum(record) if said is not None else kind is TRIAL and not record.keys() <= kind.columns.keys():
        return None
    if not all(isinstance(record.get(name, record), types) for name, types in kind.columns.items()):
        return None
    numbers = [record[name] for name, types in kind.columns.items() if int in types and record[name] is not None]
    if record.get("outcome") == "reached" and any(record.get(name) is None for name in REACHED):
        return None
    return record if all(map(_is_sane, [*numbers, *record.get("step_us", ())])) else None


def _is_sane(value: object) -> bool:
    return isinstance(value, int | float) and abs(value) < 1e18


def checksum(record: Record) -> str:
    """CRC-32 of ``record`` as it is written, in hexadecimal."""
    return f"{zlib.crc32(json.dumps(record, ensure_ascii=False).encode('utf-8', 'surrogatepass')):08x}"


def drop_torn(path: Path) -> None:
    """Cut off what follows the last line feed: a write that was cut short.

    Raises:
        InputError: it cannot be read or written.
    """
    try:
        refuse_link(path)
        if not path.exists():
            return
        data = read_bytes(path, MOST)
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            os.truncate(path, whole)
    except OSError as error:
        raise unwritable(path, error) from None


def append(path: Path, records: Sequence[Record], *, checked: bool = True) -> None:
    """Append ``records`` as lines, with their checksums if ``checked``. Raises :class:`InputError`."""
    if not records:
        return
    lines = [{**record, CRC: checksum(record)} if checked else record for record in records]
    text = "".join(json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n" for line in lines)
    try:
        with path.open("ab", buffering=0) as file:
            _write_all(file, text.encode("utf-8"))
    except OSError as error:
        raise unwritable(path, error) from None


def _write_all(file: IO[bytes], data: bytes) -> None:
    while data:  # a full disk may take a part
        data = data[file.write(data) :]


def replace(path: Path, text: str) -> None:
    """Write a file whole or not at all. Raises :class:`InputError`."""
    draft = path.with_name(f".{path.name}.new")
    try:
        with drafted(path, draft):
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise unwritable(path, error) from None


def unlink(path: Path) -> None:
    """Remove a file if it is there and can be removed."""
    with suppress(OSError):
        path.unlink(missing_ok=True)


def unwritable(path: Path, error: OSError) -> InputError:
    """The error for a store that cannot be written."""
    return InputError(
        f"{path}: cannot be written: {error.strerror or error}",
        "the trials written before are kept: the same command goes on from there",
    )
