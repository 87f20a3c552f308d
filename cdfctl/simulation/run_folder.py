"""The run folder: ``scenario.yaml``, ``result.json``, ``trajectory.npz``. It is written whole or not at all.

A folder is ours where its ``result.json`` says so. A rerun replaces the three files and keeps whatever else stands
beside them; any other folder that is not empty is refused.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import tempfile
from dataclasses import dataclass, fields
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from cdfctl.errors import InputError
from cdfctl.reading import MIB, check_regular, read_json
from cdfctl.scenario.dump import dump
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.schema import Scenario
from cdfctl.simulation.npz import read_npz, write_npz
from cdfctl.simulation.result import RunResult
from cdfctl.types import OUTCOMES, Trajectory

FORMAT = "cdfctl-run"
VERSION = 1
"""The version of the folder this code writes, and the newest it reads."""

SCENARIO, RESULT, TRAJECTORY = "scenario.yaml", "result.json", "trajectory.npz"

AGAIN = "run the scenario again"
RIGHT = "name the folder that cdfctl run wrote"

NUMBERS = ("seed", "trial", "steps", "infeasible_steps", "time_to_reach_s", "collision_time_s", "min_clearance_m")

STACK = ("cdfctl", "numpy", "pin", "coal", "numba", "qpsolvers", "daqp", "clarabel")
"""The packages that decide a run's numbers; their versions are kept with it."""

_OPTIONAL_ARRAYS = ("h_sdf", "contact_q", "plan_q", "plan_t", "plant_t", "plant_q")


@dataclass(frozen=True)
class Run:
    """A run folder as read: its ``path``, the ``scenario`` as resolved, the ``document`` and the arrays."""

    path: Path
    scenario: Scenario
    document: dict[str, Any]
    trajectory: Trajectory


def default_folder(scenario: Scenario, trial: int) -> Path:
    """``runs/<scenario>-<controller>-<seed>-<trial>``."""
    return Path("runs") / f"{scenario.name}-{scenario.controller.variant}-{scenario.seed}-{trial}"


def check_target(folder: Path) -> None:
    """Refuse, before anything is run, a folder that could not be written afterwards.

    Raises:
        InputError: it is a file, or a non-empty folder that is not a run folder, or there is no right to write there,
            or its name is none.
    """
    try:
        str(folder).encode()
        _check_target(folder)
    except UnicodeEncodeError:
        raise InputError(f"{folder}: the name is not UTF-8", hint="give another --out") from None
    except (OSError, RuntimeError) as error:  # a name too long, a link to itself
        why = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{folder}: cannot be written: {why}", hint="give another --out") from None


def _check_target(folder: Path) -> None:
    if folder.exists() or folder.is_symlink():
        if not folder.is_dir():
            raise InputError(f"{folder}: is a file, not a run folder", hint="give another --out")
        if any(folder.iterdir()) and not _is_ours(folder):
            raise InputError(f"{folder}: is not empty and not a run folder of cdfctl", hint="give another --out")
    parent = folder.resolve().parent
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: {parent} cannot be written to", hint="give another --out")


def write_run(folder: Path, result: RunResult) -> dict[str, Any]:
    """Write ``result`` to ``folder`` and return its document (the keys of ``cdfctl run --json``).

    The files go to a folder of another name first, which is then renamed.

    Raises:
        InputError: the folder is not ours to replace, or cannot be written.
    """
    check_target(folder)
    document = result.document(str(folder))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            _fill(draft, result, document)
            _swap(draft, folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}", hint="give another --out") from None
    return document


def _fill(draft: Path, result: RunResult, document: dict[str, Any]) -> None:
    draft.chmod(0o777 & ~_umask())  # mkdtemp makes it private
    (draft / SCENARIO).write_text(dump(result.scenario), encoding="utf-8")
    write_npz(draft / TRAJECTORY, arrays_of(result.trajectory))
    record = {"format": FORMAT, "version": VERSION, **document, "trial": result.trial, "stop": result.stop}
    record |= {"reason": result.reason, "stack": stack_versions()}
    text = json.dumps(record, indent=2, allow_nan=False, ensure_ascii=False)
    (draft / RESULT).write_text(text + "\n", encoding="utf-8")


def _swap(draft: Path, folder: Path) -> None:
    """Put ``draft`` in the place of ``folder``, keeping what others have put beside our files."""
    if folder.is_dir():
        for item in folder.iterdir():
            if item.name not in (SCENARIO, RESULT, TRAJECTORY):
                item.rename(draft / item.name)
        old = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        folder.rename(old)
        draft.rename(folder)
        shutil.rmtree(old, ignore_errors=True)
    else:
        draft.rename(folder)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def read_run(folder: Path) -> Run:
    """The run in ``folder``.

    Raises:
        InputError: it is no run folder, or a newer one than this code reads, or it is damaged, in one line.
    """
    document = _document(folder)
    path = folder / SCENARIO
    try:
        check_regular(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}", hint=AGAIN) from None
    scenario = load_scenario(path).scenario
    path = folder / TRAJECTORY
    try:
        arrays = read_npz(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}", hint=AGAIN) from None
    except ValueError as error:
        raise InputError(f"{path}: damaged: {error}", hint=AGAIN) from None
    return Run(folder, scenario, document, trajectory_of(arrays, path))


def check_fits(run: Run, robot: str, n: int, m: int) -> None:
    """Refuse a run whose arrays are not of ``robot`` with its ``n`` joints among ``m`` obstacles, or not of numbers.

    Raises:
        InputError: in one line, with the file.
    """
    path, arrays = run.path / TRAJECTORY, run.trajectory
    if arrays.q.shape[1] != n:
        raise InputError(
            f"{path}: is of {arrays.q.shape[1]} joints, but the scenario's robot '{robot}' has {n}",
            hint=AGAIN,
        )
    if arrays.h.shape[1] != m:
        raise InputError(f"{path}: is of {arrays.h.shape[1]} obstacles, but the scenario has {m}", hint=AGAIN)
    if not all(np.isfinite(array).all() for array in (arrays.t, arrays.q, arrays.obstacle_pose)):
        raise InputError(f"{path}: damaged: a time, a configuration or a pose is not finite", AGAIN)


def _document(folder: Path) -> dict[str, Any]:
    path = folder / RESULT
    try:
        record = read_json(path, 4 * MIB)
    except OSError as error:
        raise InputError(f"{folder}: not a run folder: {RESULT}: {error.strerror or error}", hint=RIGHT) from None
    except ValueError:
        raise InputError(f"{path}: damaged: not JSON", hint=AGAIN) from None
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise InputError(f"{folder}: not a run folder of cdfctl", hint=RIGHT)
    version = record.get("version")
    if not isinstance(version, int) or version < 1:
        raise InputError(f"{path}: damaged: no version", hint=AGAIN)
    if version > VERSION:
        raise InputError(
            f"{path}: written by a newer cdfctl (format {version}, this one reads {VERSION})", hint="update cdfctl"
        )
    _check_document(record, path)
    return record


def _check_document(record: dict[str, Any], path: Path) -> None:
    """What figures and pages rely on in a document that anyone may have written."""
    for name in NUMBERS:
        value = record.get(name)
        if value is not None and not (isinstance(value, int | float) and abs(value) < 1e18):
            raise InputError(f"{path}: damaged: '{name}' is no number", hint=AGAIN)
    robot, outcome = record.get("robot", ""), record.get("outcome")
    if not isinstance(robot, str) or len(robot) > 256 or (outcome is not None and outcome not in OUTCOMES):
        raise InputError(f"{path}: damaged: 'robot' or 'outcome' is none", hint=AGAIN)


def _is_ours(folder: Path) -> bool:
    try:
        record = read_json(folder / RESULT)
    except (OSError, ValueError):
        return False
    return isinstance(record, dict) and record.get("format") == FORMAT


def arrays_of(trajectory: Trajectory) -> dict[str, Any]:
    """The arrays by the names they have in ``trajectory.npz``; those that are None are left out."""
    arrays = {f.name: getattr(trajectory, f.name) for f in fields(trajectory)}
    return {name: array for name, array in arrays.items() if array is not None}


def trajectory_of(arrays: dict[str, Any], path: Path) -> Trajectory:
    """The arrays as a trajectory, their shapes checked against each other."""
    required = [f.name for f in fields(Trajectory) if f.name not in _OPTIONAL_ARRAYS]
    for name in required:
        if name not in arrays:
            raise InputError(f"{path}: damaged: the array '{name}' is missing", hint=AGAIN)
    if arrays["u"].ndim != 2 or arrays["h"].ndim != 2:
        raise InputError(f"{path}: damaged: 'u' and 'h' must have two axes", hint=AGAIN)
    (N, n), m = arrays["u"].shape, arrays["h"].shape[1]
    K = arrays["plan_t"].shape[-1] if "plan_t" in arrays and arrays["plan_t"].ndim else 0
    expected: dict[str, tuple[int, ...]] = {
        "t": (N + 1,),
        "q": (N + 1, n),
        "u": (N, n),
        "obstacle_pose": (N + 1, m, 7),
        "obstacle_twist": (N + 1, m, 6),
        "h": (N, m),
        "V": (N,),
        "slack": (N,),
        "infeasible": (N,),
        "step_time": (N,),
        "h_sdf": (N, m),
        "contact_q": (N, m, n),
        "plan_q": (N, K, n),
        "plan_t": (N, K),
    }
    if "plant_t" in arrays:
        expected |= {"plant_t": (arrays["plant_t"].size,), "plant_q": (arrays["plant_t"].size, n)}
    for name, shape in expected.items():
        kind = np.bool_ if name == "infeasible" else np.float64
        array = arrays.get(name)
        if array is not None and (array.shape != shape or array.dtype != kind):
            raise InputError(f"{path}: damaged: '{name}' is {array.dtype} {array.shape}, expected {shape}", hint=AGAIN)
    return Trajectory(**{name: arrays[name] for name in expected if name in arrays})


def stack_versions() -> dict[str, str]:
    """Versions of what decides a run's numbers, and the platform."""
    from cdfctl import __version__

    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in STACK:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = __version__ if name == "cdfctl" else "not installed"
    return versions
