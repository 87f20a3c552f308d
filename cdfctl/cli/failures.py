"""How a failed command ends: a message on standard error and an exit status."""

from __future__ import annotations

import errno
import os
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import gettempdir

from cdfctl import __version__
from cdfctl.cli.console import note
from cdfctl.errors import CdfctlError, InputError

BUG = 70

SYSTEM = {errno.ENAMETOOLONG, errno.ELOOP, errno.EACCES, errno.ENOSPC, errno.EMFILE, errno.ENFILE}


def report_failure(error: CdfctlError, *, debug: bool) -> int:
    """Print a failure the user can mend, and return its exit status."""
    _trace(error, debug)
    text = str(error)
    # An error in a file opens with the file's name, as compilers print it; the rest say who is speaking.
    note(text if ": error: " in text.partition("\n")[0] else f"cdfctl: error: {text}")
    return error.exit_status


def report_usage(error: Exception, *, debug: bool) -> int:
    """Print what is wrong with the command line, and return status 2."""
    _trace(error, debug)
    message = error.format_message() if hasattr(error, "format_message") else str(error)
    message = message.replace("Value error, ", "").replace("Input should be", "must be")  # pydantic's, through Typer
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "cdfctl"
    note(f"cdfctl: error: {message}\n  hint   {command} --help")
    return CdfctlError.exit_status


def failure_of_system(error: Exception) -> InputError | None:
    """What the operating system refuses whatever we ask it for, as a failure the user can mend; None for other errors.

    Names that are too long come from every option that names a file, and are not looked for at each of them.
    """
    if not isinstance(error, OSError):
        return None
    if isinstance(error, FileNotFoundError) and not _is_somewhere():
        return InputError("the current folder is no longer there", "cd to another")
    if error.errno in SYSTEM:
        what = error.filename if error.filename is not None else "the system"
        return InputError(f"{what}: {error.strerror}")
    return None


def _is_somewhere() -> bool:
    try:
        return bool(os.getcwd())
    except FileNotFoundError:
        return False


def report_bug(error: Exception, arguments: Sequence[str], *, debug: bool) -> int:
    """Print one line that says where the traceback was written, and return status 70."""
    _trace(error, debug)
    what = " ".join(f"{type(error).__name__}: {error}".split())
    if len(what) > 200:
        what = what[:200] + "…"
    text = f"cdfctl {__version__}, Python {sys.version}\narguments: {list(arguments)!r}\n\n"
    log = _write_log(text + "".join(traceback.format_exception(error)))
    where = f"the log is {log}" if log is not None else "no log could be written; --debug shows the traceback"
    note(f"cdfctl: this is a bug of cdfctl ({what}); {where}")
    return BUG


def _trace(error: Exception, debug: bool) -> None:
    if debug:
        note("".join(traceback.format_exception(error)).rstrip())


def _write_log(text: str) -> Path | None:
    """Write ``text`` to a new file in the cache folder, or else in the system's temporary folder."""
    name = time.strftime("bug-%Y%m%d-%H%M%S.log")
    for folder in _log_folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / name
            path.write_text(text, encoding="utf-8", errors="replace")
        except OSError:
            continue
        return path
    return None


def _log_folders() -> Iterator[Path]:
    from cdfctl.cache import cache_dir

    with suppress(CdfctlError):
        yield cache_dir() / "log"
    with suppress(OSError):
        yield Path(gettempdir())
