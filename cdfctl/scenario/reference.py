"""The schema for editors (JSON Schema) and for readers (one row a field)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.variants import DEFAULTS

DIALECT = "https://json-schema.org/draft/2020-12/schema"


@dataclass(frozen=True)
class FieldRow:
    """One field for the reference page; ``default`` is None where the field is required or simply absent."""

    path: str
    kind: str
    unit: str
    default: Any
    required: bool
    source: str
    description: str


def json_schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a scenario file."""
    schema: dict[str, Any] = {"$schema": DIALECT, **Scenario.model_json_schema()}
    schema["title"] = "cdfctl scenario"
    for model in [schema, *schema["$defs"].values()]:
        for name, info in model.get("properties", {}).items():
            model["properties"][name] = _without_null(info)
    for name, default in DEFAULTS.items():
        info = schema["$defs"]["ControllerConfig"]["properties"][name]
        info.update({"default": default.value, "x-source": default.source})
    _one_place_for_obstacles(schema)
    return schema


def _one_place_for_obstacles(schema: dict[str, Any]) -> None:
    """The file has ``obstacles: {source, items, …}`` where the model has ``feed`` beside ``obstacles``."""
    properties, feed = schema["properties"], schema["$defs"]["FeedConfig"]
    del properties["feed"]
    declared = properties["obstacles"]
    items = {key: declared[key] for key in ("type", "items")}
    feed["properties"]["items"] = {**items, "description": "the measured obstacles", "x-unit": "", "x-source": ""}
    feed["required"] = [*feed["required"], "items"]
    outer = {key: value for key, value in declared.items() if key not in items}
    properties["obstacles"] = {"anyOf": [items, {"$ref": "#/$defs/FeedConfig"}], **outer}


def reference() -> tuple[FieldRow, ...]:
    """Every field in the order of the schema; a list's items are written ``obstacles[]``, a type ``shape(ball)``."""
    schema = json_schema()
    return tuple(_rows(schema, schema, ""))


def _without_null(info: dict[str, Any]) -> dict[str, Any]:
    """Optional means the key may be left out, not that it may be null."""
    branches = [branch for branch in info.get("anyOf", []) if branch != {"type": "null"}]
    info = {key: value for key, value in info.items() if key != "title" and not (key == "default" and value is None)}
    if "anyOf" not in info:
        return info
    del info["anyOf"]
    return {**branches[0], **info} if len(branches) == 1 else {"anyOf": branches, **info}


def _rows(schema: dict[str, Any], model: dict[str, Any], prefix: str) -> Iterator[FieldRow]:
    for name, info in model.get("properties", {}).items():
        path = f"{prefix}.{name}" if prefix else name
        yield FieldRow(
            path=path,
            kind=_kind(schema, info),
            unit=info.get("x-unit", ""),
            default=None if "$ref" in info else info.get("default"),
            required=name in model.get("required", []),
            source=info.get("x-source", "") if "default" in info and "$ref" not in info else "",
            description=info.get("description", ""),
        )
        if path == "obstacles":
            listed, measured = info["anyOf"]
            info = listed
            yield from _rows(schema, _without_items(schema["$defs"][measured["$ref"].rsplit("/", 1)[-1]]), path)
        items = info.get("items")
        inner, suffix = (items, "[]") if isinstance(items, dict) else (info, "")
        for tag, reference_ in _models(inner):
            below = f"{path}{suffix}({tag})" if tag else f"{path}{suffix}"
            yield from _rows(schema, schema["$defs"][reference_.rsplit("/", 1)[-1]], below)


def _without_items(model: dict[str, Any]) -> dict[str, Any]:
    """A feed's own fields: its items are the obstacles, told of once."""
    return {**model, "properties": {key: value for key, value in model["properties"].items() if key != "items"}}


def _models(info: dict[str, Any]) -> list[tuple[str, str]]:
    if "$ref" in info:
        return [("", info["$ref"])]
    return list(info.get("discriminator", {}).get("mapping", {}).items())


def _kind(schema: dict[str, Any], info: dict[str, Any]) -> str:
    if "enum" in info or "const" in info:
        return " | ".join(str(value) for value in info.get("enum", [info.get("const")]))
    if "$ref" in info:
        return "mapping"
    if "discriminator" in info:
        return "mapping with type " + " | ".join(tag for tag, _ in _models(info))
    if "anyOf" in info:
        kinds = list(dict.fromkeys(_kind(schema, branch) for branch in info["anyOf"]))
        return "number or draw" if kinds == ["number", "draw"] else " or ".join(kinds)
    if info.get("type") == "object":
        return "draw" if "uniform" in info.get("properties", {}) else "mapping by name"
    if info.get("type") == "array":
        return _list_kind(schema, info)
    names = {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false"}
    return names.get(info.get("type", ""), "value")


def _list_kind(schema: dict[str, Any], info: dict[str, Any]) -> str:
    first = info["prefixItems"][0] if info.get("prefixItems") else info.get("items", {})
    count = f"{info['minItems']} x " if info.get("minItems") and info.get("minItems") == info.get("maxItems") else ""
    return f"list of {count}{_kind(schema, first)}"
