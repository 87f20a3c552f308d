"""Where output goes: results to standard output, everything else to standard error."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from cdfctl.errors import InputError, printable

if TYPE_CHECKING:
    from rich.console import Console, RenderableType


NARROWEST, WIDEST, USUAL = 20, 1000, 80
"""Columns: outside of these the terminal, or COLUMNS, does not say what it is; then it is taken for a usual one."""


def open_streams() -> None:
    """Put /dev/null in the place of standard streams that are closed (``cdfctl run ... >&-``).

    Else Python prints errors among the results, and the next file that is opened becomes the standard stream.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # takes the lowest free number: this one
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115


def stdout() -> Console:
    """The console of results. Rich honours NO_COLOR and leaves colour out where this is no terminal."""
    return _console(sys.stdout)


def stderr() -> Console:
    """The console of progress, notes and errors."""
    return _console(sys.stderr)


def _console(stream: TextIO) -> Console:
    from rich.console import Console

    console = Console(file=stream, highlight=False)
    if not NARROWEST <= console.width <= WIDEST:
        console.width = USUAL
    return console


def show(item: RenderableType) -> None:
    """Print a result for people.

    Raises:
        InputError: standard output cannot be written (a full disk, for example).
    """
    console = stdout()
    with _writing():
        console.print(item)
        console.file.flush()


def write(text: str) -> None:
    """Print a result for programs: ``text`` and a newline, never wrapped or coloured.

    Raises:
        InputError: standard output cannot be written.
    """
    with _writing():
        sys.stdout.write(text + "\n")
        sys.stdout.flush()


@contextmanager
def _writing() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        abandon(sys.stdout)
        raise
    except OSError as error:
        abandon(sys.stdout)
        raise InputError(f"cannot write to standard output: {error.strerror}") from None


def abandon(stream: TextIO) -> None:
    """Send what is still buffered nowhere: else the interpreter tries again as it ends, and complains."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def write_json(document: Mapping[str, Any] | Sequence[Any]) -> None:
    """Print one JSON document; numbers that are not finite become null."""
    write(json.dumps(finite(document), indent=2, allow_nan=False))


def finite(value: Any) -> Any:
    """``value`` with every number that is not finite replaced by None, through mappings and sequences."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return value


def note(message: str, *, quiet: bool = False) -> None:
    """A line for people on standard error. Where that cannot be written, it is left out, and the work goes on."""
    if not quiet:
        try:
            print(printable(message), file=sys.stderr, flush=True)
        except OSError:
            abandon(sys.stderr)
