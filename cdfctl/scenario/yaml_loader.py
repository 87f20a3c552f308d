"""YAML with places: plain data, and for every key and value its line and column.

It reads the YAML 1.2 core scalars (1e-3 is a number, ``no`` is text) and refuses what hides mistakes or costs without
bound: duplicate keys, tags, several documents, numbers with a leading zero, more than :data:`MAX_BYTES` bytes,
:data:`MAX_NODES` values once aliases are expanded, or :data:`MAX_DEPTH` levels.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, NoReturn

import yaml

from cdfctl.scenario.problems import Path

MAX_BYTES = 1 << 20
MAX_NODES = 50_000
MAX_DEPTH = 32
MAX_DIGITS = 400

_INT = re.compile(r"[-+]?(0|[1-9][0-9]*)$")
_BASED = re.compile(r"0o[0-7]+$|0x[0-9a-fA-F]+$")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$")
_LEADING_ZERO = re.compile(r"[-+]?0[0-9]+$")
_SPECIAL = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
}


class YamlError(Exception):
    """A place and what is wrong there; the loader of scenarios makes a :class:`Problem` of it."""

    def __init__(
        self, message: str, hint: str | None = None, mark: yaml.Mark | None = None, path: Path | None = None
    ) -> None:
        super().__init__(message)
        self.message, self.hint, self.path = message, hint, path
        self.line = None if mark is None else mark.line + 1
        self.column = None if mark is None else mark.column + 1


@dataclass
class Document:
    """Plain data and its places.

    Attributes:
        data: dicts, lists, text, numbers, booleans, None.
        keys: path -> (line, column) of the key, from 1; of the value for an item of a list.
        values: path -> (line, column) of the value.
        problems: what is wrong with the YAML though it can be read on: duplicate keys, ambiguous numbers.
        lines: the text of the file.
    """

    data: Any = None
    keys: dict[Path, tuple[int, int]] = field(default_factory=dict)
    values: dict[Path, tuple[int, int]] = field(default_factory=dict)
    problems: list[YamlError] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)


def scalar(text: str) -> str | int | float | bool | None:
    """A plain (unquoted) scalar by the YAML 1.2 core schema.

    Raises:
        ValueError: a number with a leading zero (8 or 10?), or one with too many digits.
    """
    if text in _SPECIAL:
        return _SPECIAL[text]
    if _LEADING_ZERO.match(text):
        raise ValueError(f"'{text}' is ambiguous: octal for some readers, decimal for others")
    is_number = _INT.match(text) or _BASED.match(text) or _FLOAT.match(text)
    if is_number and len(text) > MAX_DIGITS:
        raise ValueError(f"a number of {len(text)} characters")
    if _INT.match(text):
        return int(text)
    if _BASED.match(text):
        return int(text[2:], 8 if text[1] == "o" else 16)
    return float(text) if is_number else text


class _Loader(yaml.SafeLoader):
    """The node API of pyyaml with limits on depth and number, and without tags."""

    depth = 0
    count = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]  # untyped in the stubs
        tag = getattr(event, "tag", None)
        if tag is not None:
            raise YamlError(f"tags are not accepted, found '{_short(tag)}'", "write the value alone", event.start_mark)
        self.count += 1
        if self.count > MAX_NODES:
            raise _too_many()
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise YamlError(f"nested more than {MAX_DEPTH} levels deep", None, event.start_mark)
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


def read(text: str) -> Document:
    """The document in ``text``.

    Raises:
        YamlError: it is not YAML, or not of the kind accepted here.
    """
    document = Document(lines=text.splitlines())
    try:
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
        finally:
            loader.dispose()
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        line = before.count("\n") + 1
        mark = yaml.Mark("", 0, line - 1, len(before) - before.rfind("\n") - 1, None, 0)
        raise YamlError(f"character U+{ord(text[error.position]):04X} is not allowed", None, mark) from None
    except yaml.MarkedYAMLError as error:
        _syntax(error)
    if node is None:
        raise YamlError("the file is empty", "a scenario begins with version: 1")
    document.data = _Builder(document).value(node, ())
    return document


class _Builder:
    """Nodes to plain data, counting every visit: a bomb of aliases is a small graph with a large expansion."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.count = 0
        self.open: set[int] = set()

    def value(self, node: yaml.Node, path: Path) -> Any:
        self.count += 1
        if self.count > MAX_NODES:
            raise _too_many()
        place = (node.start_mark.line + 1, node.start_mark.column + 1)
        self.document.values[path] = place
        self.document.keys.setdefault(path, place)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, path)
        if id(node) in self.open:
            raise YamlError("an anchor contains itself", None, node.start_mark)
        self.open.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            data: Any = [self.value(item, (*path, i)) for i, item in enumerate(node.value)]
        else:
            data = self._mapping(node, path)
        self.open.discard(id(node))
        return data

    def _scalar(self, node: yaml.ScalarNode, path: Path) -> Any:
        if node.style in ('"', "'", "|", ">"):
            return node.value
        try:
            return scalar(node.value)
        except ValueError as error:
            hint = "write it without the zero, or in quotes if it is text"
            self.document.problems.append(YamlError(str(error), hint, node.start_mark, path))
            return 0

    def _mapping(self, node: yaml.Node, path: Path) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            mark = key_node.start_mark
            if not isinstance(key_node, yaml.ScalarNode):
                raise YamlError("a key must be text, found a list or a mapping", None, mark, path)
            key = key_node.value
            plain = key_node.style not in ('"', "'")
            if plain and not isinstance(_quiet(key), str):
                hint = f'put it in quotes: "{_short(key)}"' if key else "text is missing before the colon"
                self.document.problems.append(YamlError(f"a key must be text, found {_short(key)!r}", hint, mark, path))
            if key in data:
                first = self.document.keys[(*path, key)][0]
                self.document.problems.append(
                    YamlError(f"duplicate key '{_short(key)}'", f"first given on line {first}", mark, (*path, key))
                )
                continue
            self.document.keys[(*path, key)] = (mark.line + 1, mark.column + 1)
            data[key] = self.value(value_node, (*path, key))
        return data


def _too_many() -> YamlError:
    message = f"more than {MAX_NODES:,} values, aliases expanded: too large for a scenario"
    return YamlError(message, "put large point sets in a file of their own (shape.file)")


def _quiet(text: str) -> Any:
    try:
        return scalar(text)
    except ValueError:
        return 0


def _short(text: str) -> str:
    text = text.removeprefix("tag:yaml.org,2002:")
    return text if len(text) <= 40 else text[:37] + "..."


_HINTS = (
    ("flow sequence", "is the list that begins on line {line} closed by ']'?"),
    ("flow mapping", "is the mapping that begins on line {line} closed by '}}', with a space after each colon?"),
    ("quoted scalar", "is the quoted text that begins on line {line} closed?"),
    ("simple key", "line {line} has no colon, or no space after it"),
    ("block", "check the indentation since line {line}"),
)


def _syntax(error: yaml.MarkedYAMLError) -> NoReturn:
    """What pyyaml says, with a hint for the usual causes."""
    problem = (error.problem or "it cannot be read").replace("'<stream end>'", "the end of the text")
    hint = None
    if "found another document" in problem or "expected a single document" in str(error.context):
        raise YamlError("more than one document in the file", "remove the line '---'", error.problem_mark) from None
    if r"\t" in problem:
        problem, hint = "a tab where YAML allows spaces only", "indent with spaces"
    elif "mapping values are not allowed" in problem:
        problem, hint = "a colon where none can stand", "text with a colon needs quotes; a key begins its own line"
    elif error.context_mark is not None:
        line = error.context_mark.line + 1
        hint = next((h.format(line=line) for context, h in _HINTS if context in (error.context or "")), None)
    raise YamlError(f"not valid YAML: {problem}", hint, error.problem_mark) from None
