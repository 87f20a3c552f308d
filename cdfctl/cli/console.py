"""Where output goes: results to standard output, everything else to standard error."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from cdfctl.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType


def stdout() -> Console:
    """The console of results. Rich honours NO_COLOR and leaves colour out where this is no terminal."""
    from rich.console import Console

    return Console(file=sys.stdout, highlight=False)


def stderr() -> Console:
    """The console of progress, notes and errors."""
    from rich.console import Console

    return Console(file=sys.stderr, highlight=False)


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
        abandon_stdout()
        raise
    except OSError as error:
        abandon_stdout()
        raise InputError(f"cannot write to standard output: {error.strerror}") from None


def abandon_stdout() -> None:
    """Send what is still buffered nowhere: else the interpreter tries again as it ends, and complains."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
    """A line for people on standard error."""
    if not quiet:
        print(message, file=sys.stderr, flush=True)
