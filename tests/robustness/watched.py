"""``cdfctl`` called in this process, watched by an audit hook, and what became of it.

The hook sees what the interpreter opens, starts or connects to, so that "writes nothing, starts nothing" is seen and
not supposed. It cannot be taken off again: this is for worker processes.
"""

from __future__ import annotations

import contextlib
import io
import os
import resource
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cdfctl.cli.main import main

LIMIT = 60  # s on the wall clock, after which it is a hang; what is told is processor time, whatever the load
FORBIDDEN = {
    "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "subprocess.Popen", "socket.connect",
    "os.symlink", "os.link", "ctypes.dlopen",
}  # fmt: skip
CHANGES = {"os.remove": 1, "os.rmdir": 1, "os.rename": 2, "shutil.rmtree": 1}  # events, and how many paths they name
LOOPBACK = "127.0.0.1"
seen: list[str] = []
_places: list[str] = []


def watch(event: str, arguments: tuple[Any, ...]) -> None:
    """Keep in ``seen`` what a reader of files has no business to do."""
    wrong = event in FORBIDDEN
    if event == "open":
        path, mode, flags = arguments
        writes = (isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or (
            mode and set(mode) & set("wax+")
        )
        wrong = bool(writes) and not isinstance(path, int) and not _ours(path)  # a number is of a file open already
    elif event in CHANGES:
        # Within a folder that is open, as shutil.rmtree goes down, a name is not a path; that of the folder was seen.
        within = event in ("os.remove", "os.rmdir") and arguments[1] != -1
        wrong = not within and not all(_ours(path) for path in arguments[: CHANGES[event]])
    elif event == "socket.bind":
        wrong = arguments[1][0] != LOOPBACK
    if wrong:
        seen.append(f"{event} {arguments!r:.200}")


def _ours(path: Any) -> bool:
    return os.path.abspath(os.fsdecode(path)).startswith(tuple(_places))


def begin(*places: str) -> None:
    """Watch from now on: only paths that begin with one of ``places`` may be written, and the cache."""
    _places[:] = [os.path.abspath(place) for place in (*places, os.environ["CDFCTL_CACHE"], "/dev/null")]
    signal.signal(signal.SIGALRM, _hang)
    sys.addaudithook(watch)


def _hang(*_: object) -> None:
    raise TimeoutError("hang")


def peak_mb() -> int:
    """Greatest memory of this process, MB. (``ru_maxrss`` begins at that of the process that started this one.)"""
    status = Path("/proc/self/status")
    if status.exists():
        return int(status.read_text().partition("VmHWM:")[2].split()[0]) // 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def one(words: list[str], call: Callable[[list[str]], int] = main) -> dict[str, Any]:
    """What became of ``call(words)``: status, processor time, messages, what was seen, memory."""
    out, err = io.StringIO(), io.StringIO()
    seen.clear()
    signal.alarm(LIMIT)
    began = time.process_time()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status: Any = call(words)
    except BaseException as error:  # nothing may escape from main()
        status = repr(error)
    finally:
        signal.alarm(0)
    return {
        "status": status,
        "s": time.process_time() - began,
        "err": _ends(err.getvalue()),
        "seen": list(seen),
        "MB": peak_mb(),
    }


def _ends(text: str) -> str:
    """The beginning and the end of a long text."""
    return text if len(text) <= 4000 else f"{text[:1500]} ... {text[-1500:]}"
