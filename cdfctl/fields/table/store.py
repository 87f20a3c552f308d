"""Tables on disk: one file a robot, believed only if it is whole, of a format known here, and of this very robot."""

from __future__ import annotations

import json
import logging
import math
import shlex
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cdfctl import __version__
from cdfctl.errors import CdfctlError, InputError, MissingError
from cdfctl.fields.cdf import table_path
from cdfctl.fields.kernel.starts import Table
from cdfctl.fields.table.accuracy import Accuracy
from cdfctl.fields.table.build import BuildParameters
from cdfctl.fields.table.file import read_file, read_metadata, write_file
from cdfctl.reading import parse_json
from cdfctl.robots.robot import Robot
from cdfctl.robots.robot_file import shipped_names

KIND = "cdfctl contact table"
FORMAT = 1
SUFFIX = ".safetensors"
GAIN = "On a Franka 12 % of first queries find no contact without one, and 2 % with one"  # docs/tables.md

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StoredTable:
    """A table, and what its file says: the robot's name and hash, how it was built, by which cdfctl, its report."""

    path: Path
    table: Table
    robot: str
    robot_hash: str
    parameters: BuildParameters
    version: str
    accuracy: Accuracy


@dataclass(frozen=True)
class TableStatus:
    """Whether the user cache has a table for a robot.

    Attributes:
        path: where it is, or would be.
        state: ``ready``; ``missing``; or ``refused``, for the ``reason`` given.
        reason: None unless refused.
        command: the command that builds it, or builds it anew.
        stored: the table, if it is ready.
    """

    path: Path
    state: Literal["ready", "missing", "refused"]
    reason: str | None
    command: str
    stored: StoredTable | None


def save_table(path: Path, robot: Robot, table: Table, parameters: BuildParameters, accuracy: Accuracy) -> None:
    """Write a table; equal content gives equal bytes.

    Raises:
        InputError: it cannot be written.
    """
    arrays: dict[str, NDArray[Any]] = {**table.members(), "spacing": np.array([table.spacing])}
    metadata = {
        "kind": KIND,
        "format": str(FORMAT),
        "robot": robot.name,
        "robot_hash": robot.hash,
        "parameters": json.dumps(parameters.document(), sort_keys=True),
        "cdfctl": __version__,
        "accuracy": json.dumps(accuracy.document(), sort_keys=True),
    }
    write_file(path, arrays, metadata)


def load_table(path: Path, robot: Robot) -> StoredTable:
    """The table at ``path``, mapped into memory, for ``robot``.

    Raises:
        MissingError: there is no such file.
        InputError: the file is damaged, is no table, is of another format, or of another robot.
    """
    command = build_command(robot, path)
    if not path.exists():
        raise MissingError(f"{path}: there is no table here", hint=f"build it: {command}")
    again = f"build it anew: {command} --force"
    try:
        _check_kind(path, read_metadata(path), again)
        arrays, metadata = read_file(path)
        stored = _stored(path, arrays, metadata)
    except InputError as error:
        raise InputError(error.message, error.hint or again) from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not a table of cdfctl ({type(error).__name__}: {error})", hint=again) from None
    if stored.robot_hash != robot.hash:
        other = "another robot" if stored.robot != robot.name else "another version of this robot"
        raise InputError(
            f"{path}: a table of {other} ('{stored.robot}', {stored.robot_hash[:12]}), not of '{robot.name}' "
            f"({robot.hash[:12]})",
            hint=again,
        )
    _check_arrays(path, stored.table, robot, again)
    return stored


def build_command(robot: Robot, path: Path | None = None) -> str:
    """The command that builds the table of ``robot`` at ``path``, by default in the user cache."""
    what = robot.name if robot.name in shipped_names() else _near(robot.urdf)
    out = "" if path is None or path == table_path(robot) else f" --out {shlex.quote(str(path))}"
    return f"cdfctl build-cdf {what}{out}"


def _near(path: Path) -> str:
    """``path`` as someone in the current folder would type it."""
    try:
        return shlex.quote(str(path.resolve().relative_to(Path.cwd())))
    except (ValueError, OSError):
        return shlex.quote(str(path))


def table_status(robot: Robot) -> TableStatus:
    """What the user cache has for ``robot``; nothing is raised for a table that cannot be used."""
    path, command = table_path(robot), build_command(robot)
    if not path.exists():
        return TableStatus(path, "missing", None, command, None)
    try:
        return TableStatus(path, "ready", None, command, load_table(path, robot))
    except CdfctlError as error:
        return TableStatus(path, "refused", error.message, f"{command} --force", None)


def run_hint(robot: Robot, source: str, *, changed: bool = False) -> str | None:
    """What to tell someone who runs a CDF controller while the user cache has no table; None where it has one.

    One that cannot be used is the business of :func:`cached_table`.

    Args:
        robot: the robot.
        source: a shipped name, or the path of the robot file or URDF that it was read from.
        changed: it has locks or position limits that are not in ``source``, so that a table of ``source`` is of another
            robot.
    """
    if table_status(robot).state != "missing":
        return None
    shown = _near(Path(source)) if Path(source).suffix else source
    command = f"cdfctl build-cdf {shown}"
    if changed:
        command = "build it of a robot file with the locks and limits of the scenario"
    return f"note: there is no contact table of {robot.name}; it would help the search.\n{GAIN}.\n  hint   {command}"


def cached_table(robot: Robot) -> Table | None:
    """The table of the user cache, None for none. One that cannot be used is ignored, and the log says so."""
    status = table_status(robot)
    if status.state == "refused":
        log.warning("contact table ignored: %s; build it anew: %s", status.reason, status.command)
    return None if status.stored is None else status.stored.table


def _check_kind(path: Path, metadata: dict[str, str], again: str) -> None:
    if metadata.get("kind") != KIND:
        raise InputError(f"{path}: a safetensors file, but not a table of cdfctl")
    found = metadata.get("format", "")
    if not found.isdecimal():
        raise InputError(f"{path}: a table without a format version", hint=again)
    if int(found) > FORMAT:
        raise InputError(
            f"{path}: written by a newer cdfctl ({metadata.get('cdfctl', 'unknown')}): its format is {found}, this one "
            f"reads {FORMAT}",
            hint=f"update cdfctl, or {again}",
        )
    if int(found) < FORMAT:
        raise InputError(f"{path}: of the older format {found}, which this cdfctl no longer reads", hint=again)


def _stored(path: Path, arrays: dict[str, NDArray[Any]], metadata: dict[str, str]) -> StoredTable:
    arrays = dict(arrays)
    return StoredTable(
        path=path,
        table=Table(spacing=float(arrays.pop("spacing").item()), **arrays),
        robot=metadata["robot"],
        robot_hash=metadata["robot_hash"],
        parameters=BuildParameters(**parse_json(metadata["parameters"])),
        version=metadata["cdfctl"],
        accuracy=Accuracy.of_document(parse_json(metadata["accuracy"])),
    )


def _check_arrays(path: Path, table: Table, robot: Robot, again: str) -> None:
    """What compiled code relies on, which checks no index."""
    entries = table.piece.size
    kinds = {"origin": "f8", "shape": "i8", "first": "i8", "piece": "i2", "q": "f4"}
    good = (
        all(getattr(table, name).dtype == kind for name, kind in kinds.items())
        and table.origin.shape == table.shape.shape == (3,)
        and bool(np.all(table.shape > 0))
        and table.first.shape == (math.prod(table.shape.tolist()) + 1,)  # in whole numbers, which do not run over
        and table.piece.shape == (entries,)
        and table.q.shape == (entries, robot.n)
        and table.first[0] == 0
        and table.first[-1] == entries
        and bool(np.all(np.diff(table.first) >= 0))
        and (entries == 0 or 0 <= int(table.piece.min()) <= int(table.piece.max()) < len(robot.pieces))
        and bool(np.isfinite(table.q).all() and np.isfinite(table.origin).all() and table.spacing > 0.0)
    )
    if not good:
        raise InputError(f"{path}: damaged: its arrays do not fit together", hint=again)


def changed_parameters(stored: BuildParameters, wanted: dict[str, Any]) -> list[str]:
    """``name stored, not wanted`` for every wanted parameter in which a table differs."""
    return [
        f"{f.name} {getattr(stored, f.name)}, not {wanted[f.name]}"
        for f in fields(stored)
        if f.name in wanted and wanted[f.name] != getattr(stored, f.name)
    ]
