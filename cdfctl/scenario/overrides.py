"""Overrides: ``--set obstacles[0].velocity=[0, 1, 0]``, applied to a file's plain data before it is validated.

So an override is held to the same rules as the file, and what is wrong with it is said under its own name.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdfctl.errors import InputError
from cdfctl.scenario.feed import collapse, expand, in_file
from cdfctl.scenario.plant import expanded
from cdfctl.scenario.problems import Path, Problem, ScenarioErrors, parse_path, path_text
from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.wording import validate
from cdfctl.scenario.yaml_loader import YamlError, read


@dataclass(frozen=True)
class Override:
    """A field set from outside the file.

    Attributes:
        path: which field.
        value: its plain value.
        origin: what the user wrote to set it.
        switch: ``value`` is the type of the section at ``path``: one of that type keeps its options, any other is
            replaced.
    """

    path: Path
    value: Any
    origin: str
    switch: bool = False


def parse_override(text: str, flag: str = "--set") -> Override:
    """``controller.alpha=3`` as an override; the value is YAML, read as in a file.

    Raises:
        InputError: it has no '=', no valid path, or a value that is not YAML.
    """
    origin = f"{flag} {text}"
    field, equals, value = text.partition("=")
    if not equals:
        raise InputError(f"{origin}: expected FIELD=VALUE", "for example --set controller.alpha=3")
    try:
        path = parse_path(field.strip())
        document = read(value)
        if document.problems:
            raise document.problems[0]
    except (InputError, YamlError) as error:
        message = "the value is missing" if not value.strip() else error.message
        raise InputError(f"{origin}: {message}", error.hint if value.strip() else None) from None
    return Override(path, document.data, origin)


def apply(data: Any, overrides: Sequence[Override]) -> tuple[Any, list[Problem]]:
    """A copy of ``data`` with the overrides set, later ones over earlier ones; and those that have no place in it."""
    data = copy.deepcopy(data)
    if isinstance(data, dict) and "plant" in data:
        data["plant"] = expanded(data["plant"])  # so that plant.timestep has a place where the file says plant: mujoco
    problems = []
    for override in overrides:
        try:
            data = _set(data, override.path, override.value, override.switch)
        except InputError as error:
            problems.append(Problem("", error.message, path_text(override.path), error.hint, origin=override.origin))
    return data, problems


def _set(data: Any, path: Path, value: Any, switch: bool = False) -> Any:
    """``data`` with ``value`` at ``path``; a section the file leaves out is made, an item of a list is not."""
    root: Any = data if data is not None else {}
    parent, parts = root, list(path)
    for i, part in enumerate(parts):
        here = path_text(path[:i]) or "the file"
        if isinstance(part, int):
            if not isinstance(parent, list):
                raise InputError(f"{here} is not a list in the file", f"set it as a whole: {here}=[...]")
            if part >= len(parent):
                raise InputError(f"there is no {here}[{part}]: the list has {len(parent)}, counted from 0")
        elif isinstance(parent, list):
            raise InputError(f"{here} is a list", f"name an item by its place: {here}[0]")
        elif not isinstance(parent, dict):
            raise InputError(f"{here} is a single value, without fields")
        if i == len(parts) - 1:
            parent[part] = _switched(parent.get(part), value) if switch and isinstance(parent, dict) else value
        elif isinstance(part, int):
            parent = parent[part]
        else:
            if parent.get(part) is None and isinstance(parts[i + 1], str):
                parent[part] = {}
            parent = parent.get(part)
    return root


def _switched(section: Any, kind: Any) -> Any:
    """``section`` as it is where it is of the type ``kind``, else one of that type without options."""
    return section if isinstance(section, dict) and section.get("type") == kind else {"type": kind}


def set_fields(scenario: Scenario, values: Mapping[str, Any], origin: str = "set") -> Scenario:
    """``scenario`` with fields set by path, validated again: ``{"controller.alpha": 3.0}``.

    Raises:
        ScenarioErrors: the result does not validate; each problem names ``origin`` and the field.
    """
    data = collapse(scenario.model_dump(mode="json", exclude_none=True))
    overrides = [Override(parse_path(path), value, f"{origin} {path}={value}") for path, value in values.items()]
    data, problems = apply(data, overrides)
    data, measured, wrong = expand(data)
    changed, complaints = validate(data)
    for message, hint, place in [*wrong, *((m, h, in_file(p, measured)) for m, h, p in complaints)]:
        problems.append(Problem(scenario.name, message, path_text(place), hint, origin=blame(overrides, place)))
    if changed is None or problems:
        raise ScenarioErrors(problems, scenario.name)
    return changed


def blame(overrides: Sequence[Override], place: Path) -> str | None:
    """The last override that set this place or what holds it; None where the file did."""
    return next((o.origin for o in reversed(overrides) if place[: len(o.path)] == o.path), None)
