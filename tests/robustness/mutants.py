"""Scenario files that no honest user writes: shipped ones and ones drawn from the schema, damaged in a few places.

Two kinds of damage: to the document (a value of another type, a key lost, doubled, misspelt or out of place, a branch
moved or repeated, nesting) and to its text (bytes, tags, aliases, depth, huge numbers, line ends, a byte order mark).
"""

from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import yaml

HOSTILE_FILES = [
    "/etc/passwd",
    "../../../etc/hostname",
    "/dev/zero",
    "/proc/self/mem",
    "",
    ".",
    "~/.ssh/id_rsa",
    "a\0b",
    "x" * 5000,
]
NUMBERS: list[Any] = [
    0, -1, 1, 2**63, -(2**63), 10**30, 1e-320, 1e308, -1e308, 1e-9, 0.1, 1e6, 3.5,
    float("nan"), float("inf"), float("-inf"),
]  # fmt: skip
TEXTS = [
    "",
    " ",
    "null",
    "no",
    "1e3",
    "0x10",
    "010",
    "franka",
    "planar",
    "…",
    "\u202e",
    "\U0001f916" * 50,
    "a" * 3000,
    "{}",
    "%s%n",
    "../x",
]
CONTAINERS: list[Any] = [[], {}, [[]], {"": None}, [None], [1, "a"], {"type": "ball"}, {"uniform": [1, 0]}, [0] * 2000]
TAGS = [
    "!!python/object/apply:os.system ['touch pwned']",
    "!!python/name:os.system",
    "!!binary aGk=",
    "!!set {a}",
    "!x 1",
    "!!int '1'",
    "!!timestamp 2001-01-01",
]
LINES = [
    "\t",
    "---",
    "...",
    "%YAML 1.1",
    "? [a, b]",
    "- x",
    "<<: *a",
    "a: &a [*a]",
    "seed: 1",
    "name: |",
    "}",
    "'",
    '"',
    "#",
    "*nobody",
    "&a &a 1",
]


def drawn(rng: random.Random, schema: dict[str, Any], node: dict[str, Any], depth: int = 0) -> Any:
    """A value as the JSON schema ``node`` wants it: ranges are kept, the rules across fields are not."""
    if "$ref" in node:
        return drawn(rng, schema, schema["$defs"][node["$ref"].rsplit("/", 1)[1]], depth)
    for key in ("anyOf", "oneOf"):
        if key in node:
            return drawn(rng, schema, rng.choice(node[key]), depth)
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return rng.choice(node["enum"])
    match node.get("type"):
        case "object":
            wanted = node.get("required", [])
            items = node.get("properties", {}).items()
            return {k: drawn(rng, schema, v, depth + 1) for k, v in items if k in wanted or rng.random() < 0.3}
        case "array":
            least, most = node.get("minItems", 0), node.get("maxItems", 7)
            count = rng.randint(least, max(least, min(most, least + 3))) if depth < 8 else least
            return [drawn(rng, schema, node.get("items", {}), depth + 1) for _ in range(count)]
        case "number" | "integer" as kind:
            least = node.get("minimum", node.get("exclusiveMinimum", -3))
            value = rng.uniform(least, node.get("maximum", node.get("exclusiveMaximum", least + 6)))
            return round(value) if kind == "integer" else round(value, 4)
        case "boolean":
            return rng.random() < 0.5
        case "string":
            return rng.choice([*node.get("examples", ["planar", "franka", "ball-1"]), "x"])
        case _:
            return None


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths of all values in a document but itself."""
    found = [path] if path else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        found += places(item, (*path, key))
    return found


def at(document: Any, path: tuple[Any, ...]) -> Any:
    """The value at ``path``."""
    for key in path:
        document = document[key]
    return document


def damage_document(rng: random.Random, document: Any) -> None:
    """Change ``document`` in one place."""
    found = places(document)
    if not found:
        return
    path = rng.choice(found)
    parent, key = at(document, path[:-1]), path[-1]
    match rng.randrange(8):
        case 0:
            del parent[key]
        case 1:
            parent[key] = copy.deepcopy(at(document, rng.choice(found)))
        case 2 if isinstance(parent, dict):
            parent[rng.choice([key + "s", key.upper(), key[:-1], "", "type", "file"])] = parent.pop(key)
        case 3 if isinstance(parent, list):
            parent.extend(copy.deepcopy(parent[key]) for _ in range(rng.choice([1, 3, 300])))
        case 4:
            for _ in range(rng.choice([1, 2, 40])):
                parent[key] = [parent[key]]
        case 5:
            parent[key] = rng.choice(HOSTILE_FILES)
        case _:
            parent[key] = rng.choice(rng.choice([NUMBERS, NUMBERS, TEXTS, CONTAINERS]))


def damage_text(rng: random.Random, text: bytes) -> bytes:
    """Change the bytes of a file in one place."""
    at_ = rng.randrange(len(text) + 1)
    lines = text.split(b"\n")
    line = rng.randrange(len(lines))
    match rng.randrange(10):
        case 0:
            return text[:at_] + bytes(rng.randrange(256) for _ in range(rng.choice([1, 4]))) + text[at_:]
        case 1:
            return text[:at_] + text[at_ + rng.choice([1, 5, 80]) :]
        case 2:
            lines.insert(line, rng.choice(LINES).encode())
        case 3:
            key, colon, _ = lines[line].partition(b":")
            lines[line] = key + colon + b" " + rng.choice(TAGS).encode()
        case 4:
            lines.insert(line, b"a: " + rng.choice([b"[" * 3000, b"{a: " * 500, b"9" * 100_000, b"- " * 900]))
        case 5:
            return b"\r\n".join(lines)
        case 6:
            return rng.choice([b"\xef\xbb\xbf", b"\xff\xfe", b"\x00"]) + text
        case 7:
            bomb = b"a0: &a0 [x, x]\n" + b"".join(
                b"a%d: &a%d [*a%d, *a%d]\n" % (i, i, i - 1, i - 1) for i in range(1, 30)
            )
            return bomb + text
        case 8:
            lines.insert(line, lines[line])
        case _:
            lines[line] = b"  " + lines[line]
    return b"\n".join(lines)


def mutants(folder: Path, schema: dict[str, Any], seed: int) -> Any:
    """Endless files as bytes: the scenarios of ``folder`` and draws from ``schema``, damaged; the same for a seed."""
    shipped = [yaml.safe_load(path.read_text()) for path in sorted(folder.glob("*.yaml"))]
    rng = random.Random(seed)
    while True:
        document = copy.deepcopy(rng.choice(shipped)) if rng.random() < 0.6 else drawn(rng, schema, schema)
        for _ in range(rng.choice([0, 1, 1, 2, 3])):
            damage_document(rng, document)
        text = json.dumps(document) if rng.random() < 0.2 else yaml.safe_dump(document, allow_unicode=True)
        raw = text.encode("utf-8", errors="surrogatepass")
        for _ in range(rng.choice([0, 0, 1, 1, 2])):
            raw = damage_text(rng, raw)
        yield raw
