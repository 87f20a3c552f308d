"""Robot files: a small YAML document that turns a URDF into one of our robots. One file adds a robot."""

from __future__ import annotations

import importlib.metadata
import json
from pathlib import Path
from typing import Any, Literal, NamedTuple

import yaml
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from cdfctl.errors import InputError, MissingError, name_hint

DATA = Path(__file__).parent / "data"
ROBOT_FILE_SUFFIXES = (".yaml", ".yml")


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class DistributionUrdf(_Strict):
    """A URDF inside an installed data package; ``root`` is also the directory of its ROS packages."""

    distribution: str
    root: str
    path: str


class RobotFile(_Strict):
    """A robot file, version 1. Positions in rad (m for prismatic joints), velocities in rad/s (m/s)."""

    version: Literal[1]
    name: str = Field(min_length=1)
    description: str
    source: str
    licence: str
    urdf: str | DistributionUrdf
    package_dirs: tuple[str, ...] = ()
    lock: dict[str, FiniteFloat] = {}
    merge: dict[str, tuple[str, ...]] = {}
    position_limits: dict[str, tuple[FiniteFloat, FiniteFloat]] = {}
    velocity_limits: dict[str, FiniteFloat] = {}
    tip: str | None = None
    home: tuple[FiniteFloat, ...] | None = None
    notes: tuple[str, ...] = ()


class ShippedRobot(NamedTuple):
    """A robot that comes with cdfctl."""

    name: str
    description: str


def shipped_robots() -> tuple[ShippedRobot, ...]:
    """The robots that come with cdfctl, by name; reads their files only, no URDF."""
    files = (read_robot_file(path) for path in sorted(DATA.glob("*.yaml")))
    return tuple(ShippedRobot(file.name, file.description) for file in files)


def shipped_names() -> tuple[str, ...]:
    """The names of the shipped robots: a robot's file is called as the robot."""
    return tuple(sorted(path.stem for path in DATA.glob("*.yaml")))


def read_robot_file(path: Path) -> RobotFile:
    """Read and validate a robot file.

    Raises:
        InputError: the file cannot be read, is not YAML, or does not validate (the first problem, in one line).
    """
    data = _load_yaml(path)
    try:
        return RobotFile.model_validate_json(json.dumps(data))
    except TypeError as error:
        raise InputError(f"{path}: {error}") from None
    except ValidationError as error:
        raise _first_problem(path, error) from None


def find_urdf(file: RobotFile, path: Path) -> tuple[Path, tuple[Path, ...]]:
    """The robot's URDF and its package directories, for a robot file that lies at ``path``.

    Raises:
        MissingError: the data package it names is not installed.
    """
    package_dirs = tuple(path.parent / entry for entry in file.package_dirs)
    if isinstance(file.urdf, str):
        return path.parent / file.urdf, package_dirs
    try:
        distribution = importlib.metadata.distribution(file.urdf.distribution)
    except importlib.metadata.PackageNotFoundError:
        raise MissingError(
            f"robot '{file.name}' needs the data package {file.urdf.distribution}, which is not installed",
            hint=f"pip install {file.urdf.distribution}",
        ) from None
    root = Path(str(distribution.locate_file(file.urdf.root)))
    return root / file.urdf.path, (root, *package_dirs)


def _load_yaml(path: Path) -> Any:
    if path.is_dir():
        raise InputError(f"{path}: is a directory, not a robot file")
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such robot file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text") from None
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not YAML: {' '.join(str(error).split())}") from None


def _first_problem(path: Path, error: ValidationError) -> InputError:
    problem = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in problem["loc"])
    if problem["type"] == "extra_forbidden":
        key = str(problem["loc"][-1])
        return InputError(f"{path}: unknown key '{field}'", hint=name_hint(key, RobotFile.model_fields))
    if problem["type"] == "missing":
        return InputError(f"{path}: '{field}' is missing")
    return InputError(f"{path}: {field or 'document'}: {problem['msg']}")
