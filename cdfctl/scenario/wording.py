"""Validate plain data, and say what is wrong in our own words.

Most checks of the schema bring their own text; what pydantic itself finds (unknown and missing keys, wrong kinds) is
put into words here. Its locations name the branch of a union (``shape.ball.radius``): the data has no such key, so it
is dropped.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from cdfctl.errors import InputError
from cdfctl.scenario.consistency import inconsistencies
from cdfctl.scenario.problems import Path, path_text
from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.values import Complaint, found

M = TypeVar("M", bound=BaseModel)

SYNONYMS = {
    "sphere": "ball",
    "disc": "ball",
    "disk": "ball",
    "cube": "box",
    "points": "point-cloud",
    "goal": "joint-goal",
}


def validate(data: Any) -> tuple[Scenario | None, list[Complaint]]:
    """The scenario in ``data``, or everything that is wrong with it as (message, hint, place)."""
    scenario, complaints = validate_as(Scenario, data)
    if scenario is None and isinstance(data, dict):
        # These run inside the model too, but only once all its parts are valid.
        known = {place for _, _, place in complaints}
        complaints += [c for c in inconsistencies(data) if c[2] not in known]
    return scenario, complaints


def validate_as(model: type[M], data: Any) -> tuple[M | None, list[Complaint]]:
    """The same for any model of the schema."""
    empty = [*_empty_values(data, ())]
    try:
        valid = model.model_validate(_without_empty(data))
    except ValidationError as error:
        complaints = [c for detail in error.errors(include_url=False) for c in _complaints(model, detail, data)]
        taken = {place for _, _, place in empty}
        return None, empty + _without_echoes([c for c in complaints if c[2] not in taken])
    return (None, empty) if empty else (valid, [])


def checked(model: type[M], data: Any, what: str) -> M:
    """``data`` as a ``model``, for callers without a file.

    Raises:
        InputError: it does not validate; one line a problem, each beginning with ``what``.
    """
    valid, complaints = validate_as(model, data)
    if valid is None:
        lines = [f"{path_text((what, *place))}: {message}" for message, _, place in complaints]
        hints = [hint for _, hint, _ in complaints if hint]
        raise InputError("\n".join(lines), hints[0] if len(complaints) == 1 and hints else None)
    return valid


def _empty_values(data: Any, path: Path) -> Iterator[Complaint]:
    """``alpha:`` with nothing after it is a slip, not a wish for the default."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list | tuple) else ()
    for key, value in items:
        if value is None and isinstance(data, dict):
            yield f"the key '{key}' has no value", "give one, or remove the key", (*path, key)
        elif value is not None:
            yield from _empty_values(value, (*path, key))


def _without_empty(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _without_empty(value) for key, value in data.items() if value is not None}
    if isinstance(data, list | tuple):
        return [_without_empty(value) for value in data]
    return data


def _complaints(model: type[BaseModel], detail: ErrorDetails, data: Any) -> Iterator[Complaint]:
    kind, context = detail["type"], detail.get("ctx", {})
    place = _place(detail["loc"], data, missing=kind == "missing")
    value = detail["input"]
    if kind == "cdfctl":
        for message, hint, at in context["complaints"]:
            yield message, hint, (*place, *at)
    elif kind == "missing":
        yield f"missing key '{place[-1]}'", _description(model, detail["loc"]), place
    elif kind == "extra_forbidden":
        yield f"unknown key '{place[-1]}'", _nearest(str(place[-1]), _keys(model, detail["loc"][:-1]), model), place
    elif kind in ("literal_error", "union_tag_invalid"):
        tag = kind == "union_tag_invalid"
        allowed = str(context["expected_tags" if tag else "expected"]).replace("'", "").replace(" or ", ", ")
        place = (*place, "type") if tag else place
        wrong = str(context["tag"]) if tag else value
        said = (
            f"unknown {'type' if tag else 'value'} '{wrong}'"
            if isinstance(wrong, str)
            else f"expected text, found {found(wrong)}"
        )
        yield said, _choice(str(wrong), allowed.split(", ")), place
    elif kind == "union_tag_not_found":
        if isinstance(value, dict):
            yield "missing key 'type'", f"allowed: {', '.join(_tags(model, detail['loc']))}", (*place, "type")
        else:
            yield f"expected a mapping with a type, found {found(value)}", None, place
    elif kind in ("model_type", "model_attributes_type", "dict_type", "model_class_type"):
        yield f"expected a mapping, found {found(value)}", "a mapping is lines of 'key: value', indented", place
    else:
        yield f"this value is not valid here: {found(value)}", _description(model, detail["loc"]), place


def _place(loc: tuple[str | int, ...], data: Any, missing: bool) -> Path:
    place: list[str | int] = []
    for i, part in enumerate(loc):
        last = missing and i == len(loc) - 1
        inside = isinstance(data, dict) and part in data
        item = isinstance(data, list | tuple) and isinstance(part, int) and part < len(data)
        if last or inside or item:
            place.append(part)
            data = data[part] if inside or item else None
    return tuple(place)


def _without_echoes(complaints: list[Complaint]) -> list[Complaint]:
    """``radus`` is one slip: not also a missing ``radius``."""
    meant = {(*place[:-1], hint.split()[3].rstrip("?")) for _, hint, place in complaints if hint and _is_guess(hint)}
    return [c for c in complaints if not (c[0].startswith("missing key") and c[2] in meant)]


def _is_guess(hint: str) -> bool:
    return hint.startswith("did you mean ")


def _nearest(key: str, allowed: list[str], model: type[BaseModel]) -> str | None:
    if key == "<<":
        return "merge keys are not accepted: write the keys out"
    near = difflib.get_close_matches(key.lower(), allowed, n=1, cutoff=0.6) or _elsewhere(key, model)
    return f"did you mean {near[0]}?" if near else f"allowed: {', '.join(allowed)}" if allowed else None


def _elsewhere(key: str, model: type[BaseModel]) -> list[str]:
    """``margin`` is ``controller.margin``: the one section of ``model`` that has such a key, if there is just one."""
    found = [
        f"{section}.{key}"
        for section, field in model.model_fields.items()
        if isinstance(field.annotation, type)
        and issubclass(field.annotation, BaseModel)
        and key in field.annotation.model_fields
    ]
    return found if len(found) == 1 else []


def _choice(wrong: str, allowed: list[str]) -> str:
    near = SYNONYMS.get(wrong.lower())
    if near not in allowed:
        close = difflib.get_close_matches(wrong.lower().replace("_", "-"), allowed, n=1, cutoff=0.6)
        near = close[0] if close else None
    choices = f"allowed: {', '.join(allowed)}"
    return f"did you mean {near}? {choices}" if near else choices


def _keys(model: type[BaseModel], loc: tuple[str | int, ...]) -> list[str]:
    return [name for kind in _models(_annotation(model, loc)) for name in kind.model_fields]


def _tags(model: type[BaseModel], loc: tuple[str | int, ...]) -> list[str]:
    return [_tag(kind) for kind in _models(_annotation(model, loc))]


def _description(model: type[BaseModel], loc: tuple[str | int, ...]) -> str | None:
    for kind in _models(_annotation(model, loc[:-1])):
        info = kind.model_fields.get(str(loc[-1]))
        if info is not None and info.description:
            extra = info.json_schema_extra
            unit = extra.get("x-unit") if isinstance(extra, dict) else ""
            return f"{info.description} [{unit}]" if unit else info.description
    return None


def _annotation(model: type[BaseModel], loc: tuple[str | int, ...]) -> Any:
    """The type a location leads to; a union's branch is named in the location by its tag."""
    current: Any = model
    for part in loc:
        origin = get_origin(current)
        if origin is Annotated:
            current = get_args(current)[0]
            origin = get_origin(current)
        models = _models(current)
        if isinstance(part, int):
            arguments = [a for a in _members(current) if get_origin(a) is tuple]
            current = get_args(arguments[0])[0] if arguments else None
        elif len(models) > 1 or (models and _tag(models[0]) == part and part not in models[0].model_fields):
            current = next((kind for kind in models if _tag(kind) == part), None)
        elif models and part in models[0].model_fields:
            current = models[0].model_fields[part].annotation
        else:
            current = None
    return current


def _members(annotation: Any) -> list[Any]:
    if get_origin(annotation) is Annotated:
        return _members(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        return [member for argument in get_args(annotation) for member in _members(argument)]
    return [annotation]


def _models(annotation: Any) -> list[type[BaseModel]]:
    return [m for m in _members(annotation) if isinstance(m, type) and issubclass(m, BaseModel)]


def _tag(model: type[BaseModel]) -> str:
    info = model.model_fields.get("type")
    if info is None or get_origin(info.annotation) is not Literal:
        return ""
    return str(get_args(info.annotation)[0])
