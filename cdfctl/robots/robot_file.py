"""Robot files: a small YAML document that turns a URDF into one of our robots. One file adds a robot."""

from __future__ import annotations

import importlib.metadata
import json
import re
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError
from pydantic_core import ErrorDetails

from cdfctl.errors import InputError, MissingError, name_hint
from cdfctl.reading import check_regular
from cdfctl.scenario.problems import Problem, ScenarioErrors, path_text
from cdfctl.scenario.values import refuse
from cdfctl.scenario.yaml_loader import MAX_BYTES, Document, YamlError, read

DATA = Path(__file__).parent / "data"
ROBOT_FILE_SUFFIXES = (".yaml", ".yml")


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


LONGEST_NAME = 64
_NO_PART_OF_A_NAME = re.compile(r"[^\w .+-]")


def _name(text: str) -> str:
    """It becomes part of the names of files (tables, for one), which have to stay in their folder."""
    if not text or len(text) > LONGEST_NAME or _NO_PART_OF_A_NAME.search(text):
        raise refuse(f"a robot's name is 1 to {LONGEST_NAME} letters, digits, spaces and '.', '_', '+', '-'")
    return text


def name_from(path: Path) -> str:
    """The name of a robot that has none but its file's."""
    return _NO_PART_OF_A_NAME.sub("_", path.stem)[:LONGEST_NAME]


class DataPackage(_Strict):
    """An installed Python package that holds robot data; ``root`` is also the directory of its ROS packages."""

    distribution: str
    root: str


class BrakingFile(_Strict):
    """How one joint's velocity limit falls towards its end stops ``lower`` and ``upper``: see
    :mod:`cdfctl.robots.braking`."""

    lower: FiniteFloat
    upper: FiniteFloat
    deceleration: Annotated[FiniteFloat, Field(gt=0.0)]
    offset: Annotated[FiniteFloat, Field(ge=0.0)] = 0.0


class RobotFile(_Strict):
    """A robot file, version 1. Positions in rad (m for prismatic joints), velocities in rad/s, accelerations in rad/s².

    Attributes:
        urdf: path of the URDF, relative to the root of ``package``; without one, to this file.
        package_dirs: where ``package://`` mesh names are looked for, relative to this file.
        lock: joints to lock, and where.
        srdf: path of an SRDF that says which links may touch, relative as ``urdf``.
        merge: a new name for links that move together, which become one convex hull.
        braking: joints whose velocity limit falls towards the end stops (see :mod:`cdfctl.robots.braking`).
        tip: frame whose path length is reported.
        home: an example configuration out of contact.
        notes: facts to print with results.
    """

    version: Literal[1]
    name: Annotated[str, AfterValidator(_name)]
    description: str
    source: str
    licence: str
    urdf: str = Field(min_length=1)
    srdf: str | None = Field(default=None, min_length=1)
    package: DataPackage | None = None
    package_dirs: tuple[str, ...] = ()
    lock: dict[str, FiniteFloat] = {}
    merge: dict[str, tuple[str, ...]] = {}
    position_limits: dict[str, tuple[FiniteFloat, FiniteFloat]] = {}
    velocity_limits: dict[str, FiniteFloat] = {}
    braking: dict[str, BrakingFile] = {}
    acceleration_limits: dict[str, FiniteFloat] = {}
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
        InputError: the file cannot be read, is not YAML, or does not validate; every problem with its place.
    """
    text = _read_text(path)
    document = Document(lines=text.splitlines())
    try:
        document = read(text)
    except YamlError as error:
        raise ScenarioErrors([_yaml_problem(path, document, error)], str(path)) from None
    problems = [_yaml_problem(path, document, error) for error in document.problems]
    try:
        file = RobotFile.model_validate_json(json.dumps(document.data))
    except ValidationError as error:
        problems += [_problem(path, document, found) for found in error.errors(include_url=False)]
    if problems:
        raise ScenarioErrors(problems, str(path))
    return file


def find_urdf(file: RobotFile, path: Path) -> tuple[Path, tuple[Path, ...], Path | None]:
    """The robot's URDF, its package directories and its SRDF, for a robot file that lies at ``path``.

    Raises:
        MissingError: the data package it names is not installed.
    """
    package_dirs = tuple(path.parent / entry for entry in file.package_dirs)
    if file.package is None:
        return path.parent / file.urdf, package_dirs, path.parent / file.srdf if file.srdf else None
    try:
        distribution = importlib.metadata.distribution(file.package.distribution)
    except importlib.metadata.PackageNotFoundError:
        raise MissingError(
            f"robot '{file.name}' needs the data package {file.package.distribution}, which is not installed",
            hint=f"pip install {file.package.distribution}",
        ) from None
    root = Path(str(distribution.locate_file(file.package.root)))
    return root / file.urdf, (root, *package_dirs), root / file.srdf if file.srdf else None


def _read_text(path: Path) -> str:
    if path.is_dir():
        raise InputError(f"{path}: is a directory, not a robot file")
    try:
        check_regular(path)
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: larger than {MAX_BYTES} bytes, which no robot file is")
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such robot file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text") from None
    if not text.strip():
        raise InputError(f"{path}: the file is empty", hint="a robot file begins with version: 1")
    return text


def _yaml_problem(path: Path, document: Document, error: YamlError) -> Problem:
    field = path_text(error.path) if error.path else None
    return _at(path, document, error.line, error.column, error.message, field, error.hint)


def _problem(path: Path, document: Document, found: ErrorDetails) -> Problem:
    """A validation error at its place in the file: that of the key, or of the nearest parent there is."""
    where, message, hint = found["loc"], found["msg"], None
    if found["type"] == "extra_forbidden":
        message = f"unknown key '{where[-1]}'"
        hint = name_hint(str(where[-1]), DataPackage.model_fields if len(where) > 1 else RobotFile.model_fields)
    elif found["type"] == "missing":
        message = f"'{where[-1]}' is missing"
    known = where
    while known and known not in document.values:
        known = known[:-1]
    line, column = document.keys.get(known, document.values.get(known, (1, 1)))
    return _at(path, document, line, column, message, path_text(where) or None, hint)


def _at(
    path: Path,
    document: Document,
    line: int | None,
    column: int | None,
    message: str,
    field: str | None,
    hint: str | None,
) -> Problem:
    excerpt = document.lines[line - 1] if line is not None and line <= len(document.lines) else None
    return Problem(str(path), message, field, hint, line, column, excerpt)
