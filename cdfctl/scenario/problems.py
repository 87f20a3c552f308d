"""What is wrong with a scenario file, in the form a user reads: place, field, hint, excerpt with a caret.

scenarios/mine.yaml:12:5: error: unknown key 'velocty'
  field  obstacles[0].velocty
  hint   did you mean velocity?
    12 |     velocty: [0.0, 1.5]
             ^
1 problem in scenarios/mine.yaml; nothing was run.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from cdfctl.errors import InputError, printable

Path = tuple[str | int, ...]

SHOWN = 50
"""Problems printed of one file; the rest is counted."""

DEEPEST = 16
"""Steps of a path: more than any field has."""

WIDTH = 100
"""Characters of a line that an excerpt shows."""

_STEP = re.compile(r"\.?(?P<key>[^.\[\]=\s]+)|\[(?P<index>[0-9]{1,9})\]")


@dataclass(frozen=True)
class Problem:
    """One problem of one file.

    Attributes:
        file: as the user named it.
        message: what is wrong, in one line.
        field: path of the field, ``obstacles[0].velocity``; None for the file as a whole.
        hint: what would be right, or None.
        line: from 1; None where no line of the file is at fault.
        column: from 1.
        excerpt: that line of the file.
        origin: the override at fault, ``--set controller.alpha=x``; None for the file.
    """

    file: str
    message: str
    field: str | None = None
    hint: str | None = None
    line: int | None = None
    column: int | None = None
    excerpt: str | None = None
    origin: str | None = None

    def __str__(self) -> str:
        place = self.origin or self.file
        message, field, hint = (printable(text or "", "") for text in (self.message, self.field, self.hint))
        if self.origin is None and self.line is not None:
            place = f"{self.file}:{self.line}:{self.column}"
        lines = [f"{printable(place, '')}: error: {message}"]
        if field:
            lines.append(f"  field  {field}")
        if hint:
            lines.append(f"  hint   {hint}")
        if self.origin is None and self.excerpt is not None:
            lines += self._excerpt()
        return "\n".join(lines)

    def _excerpt(self) -> list[str]:
        column = (self.column or 1) - 1
        text = "".join(c if c.isprintable() else " " for c in self.excerpt or "")
        first = max(0, column - WIDTH // 2) if len(text) > WIDTH else 0
        shown = text[first : first + WIDTH].rstrip()
        shown = ("..." if first else "") + shown + ("..." if first + WIDTH < len(text) else "")
        gutter = f"    {self.line} | "
        return [gutter + shown, " " * (len(gutter) + (3 if first else 0) + column - first) + "^"]


class ScenarioErrors(InputError):  # noqa: N818  the plural says that it carries all of them
    """Everything that is wrong with one scenario file; the message is the whole text, ready to print as it is.

    Attributes:
        problems: in the order of the file.
        file: as the user named it.
    """

    def __init__(self, problems: Iterable[Problem], file: str) -> None:
        self.problems = sorted(problems, key=lambda p: (p.origin is not None, p.line or 0, p.column or 0))
        self.file = file
        count = len(self.problems)
        parts = [str(problem) for problem in self.problems[:SHOWN]]
        if count > SHOWN:
            parts.append(f"... and {count - SHOWN} more")
        where = file if any(problem.origin is None for problem in self.problems) else "the command line"
        parts.append(f"{count} problem{'' if count == 1 else 's'} in {where}; nothing was run.")
        super().__init__("\n".join(parts))

    def __reduce__(self) -> tuple[type[ScenarioErrors], tuple[list[Problem], str]]:
        return type(self), (self.problems, self.file)


def path_text(path: Path) -> str:
    """``("obstacles", 0, "velocity")`` as ``obstacles[0].velocity``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def parse_path(text: str) -> Path:
    """``obstacles[0].velocity`` as ``("obstacles", 0, "velocity")``.

    Raises:
        InputError: it is not such a path.
    """
    path: list[str | int] = []
    position = 0
    for match in _STEP.finditer(text):
        if match.start() != position or (match["index"] is not None and not path):
            break
        if match["key"] is not None and (text[match.start()] == ".") == (not path):
            break
        path.append(match["key"] if match["key"] is not None else int(match["index"]))
        position = match.end()
    if not path or position != len(text) or len(path) > DEEPEST or not text.isprintable():
        raise InputError(f"'{text}' is not the path of a field", "a path looks like obstacles[0].velocity")
    return tuple(path)
