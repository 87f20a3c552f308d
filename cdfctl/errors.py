"""The errors of cdfctl: every one ends in a message a user can act on, and in an exit status.

The command line prints ``message``, then ``hint``, and exits with ``exit_status``; a library user catches
:class:`CdfctlError`. Anything else that escapes is a bug of ours (status 70).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class CdfctlError(Exception):
    """A failure with a cause the user can mend.

    Attributes:
        message: what is wrong, in one line where one line can say it.
        hint: what to do about it, or None.
        exit_status: the status of the command line (see "Exit status" in the documentation).
    """

    exit_status = 2

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return self.message if self.hint is None else f"{self.message}\n  hint   {self.hint}"


class InputError(CdfctlError):
    """Bad input: a file, an option or an argument that does not validate, or an output that cannot be written."""

    exit_status = 2


class MissingError(CdfctlError):
    """Something needed is not there: a table, an optional package, a server."""

    exit_status = 3


class PlantError(CdfctlError):
    """The plant (simulated or real) failed while running."""

    exit_status = 4


def printable(text: str, keep: str = "\n") -> str:
    """``text`` with escapes in the place of control characters, but for those in ``keep``.

    Names of files, and of what is in them, are others' text: it must not steer the terminal, nor turn a line about.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else repr(c)[1:-1] for c in text)


def unknown_name(kind: str, name: str, allowed: Iterable[str]) -> InputError:
    """The error for a name that is not in a table, with the nearest valid one and the whole list."""
    names = list(allowed)
    return InputError(f"unknown {kind} '{name}'", hint=name_hint(name, names))


def name_hint(name: str, allowed: Iterable[str]) -> str:
    """``did you mean X?`` where a valid name is near, and always the list of what is allowed."""
    names = list(allowed)
    near = difflib.get_close_matches(name.lower(), [n.lower() for n in names], n=1, cutoff=0.6)
    choices = "allowed: " + ", ".join(names)
    if near:
        original = next(n for n in names if n.lower() == near[0])
        return f"did you mean {original}? {choices}"
    return choices
