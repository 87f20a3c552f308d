"""Scenario files: the shipped ones by name, any other by path; read, overridden, validated, with every place kept."""

from __future__ import annotations

import difflib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from cdfctl.errors import InputError, name_hint
from cdfctl.scenario import problems as told
from cdfctl.scenario.feed import expand, in_file
from cdfctl.scenario.files import SUFFIXES, absolute
from cdfctl.scenario.overrides import Override, apply, blame, parse_override
from cdfctl.scenario.problems import Problem, ScenarioErrors, parse_path, path_text
from cdfctl.scenario.resolve import obstructions
from cdfctl.scenario.schema import VERSION, Scenario
from cdfctl.scenario.wording import validate
from cdfctl.scenario.yaml_loader import MAX_BYTES, Document, YamlError, read


@dataclass(frozen=True)
class Entry:
    """A shipped scenario: its name, file and one-line description."""

    name: str
    path: Path
    description: str


@dataclass(frozen=True)
class ScenarioFile:
    """A validated scenario and where each part of it stands.

    Attributes:
        scenario: the scenario; paths inside it are absolute.
        path: its file.
        shown: the file as messages name it.
    """

    scenario: Scenario
    path: Path
    shown: str
    _document: Document = field(repr=False)
    _overrides: tuple[Override, ...] = field(repr=False, default=())

    def located(self, field_path: str | told.Path, message: str, hint: str | None = None) -> Problem:
        """A problem found later (by a check that needs the robot, say), at its place in the file."""
        place = parse_path(field_path) if isinstance(field_path, str) else field_path
        place = in_file(place, self.scenario.feed is not None)
        return _locate(self.shown, self._document, self._overrides, message, hint, place)

    def errors(self, found: Sequence[Problem]) -> ScenarioErrors:
        """These problems as one error, to raise."""
        return ScenarioErrors(found, self.shown)

    def check_runnable(self) -> None:
        """Refuse a task that no controller, or not this one, can do.

        Raises:
            ScenarioErrors: it cannot run; the hint names what is allowed.
        """
        found = [self.located(place, message, hint) for message, hint, place in obstructions(self.scenario)]
        if found:
            raise self.errors(found)


def scenarios_dir() -> Path:
    """Where the shipped scenarios are: inside the installed package, or at the top of the source tree."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_scenarios"
    return installed if installed.is_dir() else package.parent / "scenarios"


def list_scenarios() -> tuple[Entry, ...]:
    """The shipped scenarios, by name."""
    entries = []
    for path in _shipped().values():
        data = read(path.read_text(encoding="utf-8")).data
        entries.append(Entry(path.stem, path, str(data.get("description", ""))))
    return tuple(entries)


def load_scenario(source: str | Path, overrides: Sequence[str | Override] = ()) -> ScenarioFile:
    """The scenario called ``source`` (a shipped name, or a path if it has a '/' or a suffix), with overrides applied.

    Raises:
        ScenarioErrors: everything that is wrong with the file or the overrides, at once.
        InputError: there is no such file, it cannot be read, or an override is malformed.
    """
    path = find_scenario(source)
    shown = _shown(path, source)
    changes = tuple(o if isinstance(o, Override) else parse_override(o) for o in overrides)
    document = _read(path, shown)
    _refuse_newer(document, changes, shown)
    data, found = apply(document.data, changes)
    suspect = [problem.path for problem in document.problems if problem.path is not None]
    found += [_yaml_problem(shown, document, problem) for problem in document.problems]
    data, measured, wrong = expand(data)
    data, missing = absolute(data, path.resolve().parent)
    scenario, complaints = validate(data)
    complaints = [*wrong, *((m, h, in_file(p, measured)) for m, h, p in [*complaints, *missing])]
    for message, hint, place in complaints:
        if not any(place[: len(p)] == p for p in suspect):
            found.append(_locate(shown, document, changes, message, hint, place))
    if found or scenario is None:
        raise ScenarioErrors([replace(problem, file=shown) for problem in found], shown)
    return ScenarioFile(scenario, path, shown, document, changes)


def find_scenario(source: str | Path) -> Path:
    """The file of a shipped name or a path.

    Raises:
        InputError: there is none; the hint names the nearest.
    """
    text = str(source)
    shipped = _shipped()
    if not text or not text.isprintable():
        raise InputError(f"{text!r} is not the name of a scenario", name_hint("", shipped))
    if isinstance(source, str) and "/" not in text and os.sep not in text and not Path(text).suffix:
        if text in shipped:
            return shipped[text]
        near = [name for name in (text, f"{text}.yaml", f"{text}.yml") if os.path.exists(name)]
        hint = f"a path has a '/' or a suffix: ./{near[0]}" if near else name_hint(text, shipped)
        raise InputError(f"unknown scenario '{text}'", hint)
    path = Path(text)
    if not os.path.exists(path):
        raise InputError(f"{text}: no such file", _nearest_file(path, list(shipped)))
    if path.is_dir():
        inside = _scenarios_in(path)
        hint = (
            f"scenario files in it: {', '.join(inside[:8])}"
            if inside
            else "name a scenario file, or a shipped scenario"
        )
        raise InputError(f"{text}: is a directory, not a scenario file", hint)
    return path


def _shipped() -> dict[str, Path]:
    return {path.stem: path for path in sorted(scenarios_dir().glob("*.yaml"))}


def _scenarios_in(folder: Path) -> list[str]:
    try:
        return sorted(child.name for child in folder.iterdir() if child.suffix in SUFFIXES)
    except OSError:
        return []


def _nearest_file(path: Path, names: list[str]) -> str:
    near = difflib.get_close_matches(path.name, _scenarios_in(path.parent), n=1)
    if near:
        return f"did you mean {path.parent / near[0]}?"
    near = difflib.get_close_matches(path.stem.lower(), [name.lower() for name in names], n=1)
    return name_hint(path.stem, names) if near else f"shipped scenarios go by name: {', '.join(names)}"


def _shown(path: Path, source: str | Path) -> str:
    if str(source) == str(path):
        return str(source)
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def _read(path: Path, shown: str) -> Document:
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"{shown}: cannot be read: {error.strerror or error}", "name a scenario file") from None
    if len(raw) > MAX_BYTES:
        hint = "put large point sets in a file of their own (shape.file)"
        raise InputError(f"{shown}: over {MAX_BYTES >> 20} MiB: too large for a scenario", hint)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioErrors([_not_utf8(raw, error.start, shown)], shown) from None
    try:
        return read(text)
    except YamlError as problem:
        raise ScenarioErrors([_yaml_problem(shown, Document(lines=text.splitlines()), problem)], shown) from None


def _not_utf8(raw: bytes, at: int, shown: str) -> Problem:
    start = raw.rfind(b"\n", 0, at) + 1
    line = raw.count(b"\n", 0, at) + 1
    column = len(raw[start:at].decode("utf-8", "replace")) + 1
    excerpt = raw[start:].split(b"\n", 1)[0].decode("utf-8", "replace")
    hint = "save the file as UTF-8"
    return Problem(shown, f"not UTF-8 text: byte 0x{raw[at]:02X}", None, hint, line, column, excerpt)


def _refuse_newer(document: Document, changes: Sequence[Override], shown: str) -> None:
    """A newer version is the one thing to say: what else would be found may be right there."""
    version = document.data.get("version") if isinstance(document.data, dict) else None
    if isinstance(version, int) and version > VERSION and not any(c.path == ("version",) for c in changes):
        _, complaints = validate({"version": version})
        message, hint, place = next(c for c in complaints if c[2] == ("version",))
        raise ScenarioErrors([_locate(shown, document, (), message, hint, place)], shown)


def _yaml_problem(shown: str, document: Document, problem: YamlError) -> Problem:
    field_path = path_text(problem.path) if problem.path else None
    excerpt = _line(document, problem.line)
    return Problem(shown, problem.message, field_path, problem.hint, problem.line, problem.column, excerpt)


def _locate(
    shown: str, document: Document, changes: Sequence[Override], message: str, hint: str | None, place: told.Path
) -> Problem:
    """At the value if the file has it (an unknown key: at the key), else at the nearest part that it has."""
    origin = blame(changes, place)
    if origin is None and place not in document.values:
        # Neither does the file have it: an override of a part of it made it.
        origin = next((o.origin for o in changes if o.path[: len(place)] == place), None)
    if origin is not None:
        return Problem(shown, message, path_text(place), hint, origin=origin)
    nearest = place
    while nearest and nearest not in document.values:
        nearest = nearest[:-1]
    at_key = message.startswith("unknown key") or nearest != place
    line, column = (document.keys if at_key else document.values)[nearest]
    return Problem(shown, message, path_text(place), hint, line, column, _line(document, line))


def _line(document: Document, line: int | None) -> str | None:
    return document.lines[line - 1] if line is not None and line <= len(document.lines) else None
