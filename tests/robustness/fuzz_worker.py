"""Feed hostile scenario files to ``cdfctl`` in this process and tell, as JSON lines, what became of each.

``python fuzz_worker.py SCENARIOS SEED COUNT``, in an empty folder with CDFCTL_CACHE set. An audit hook sees what
the interpreter opens, starts or connects to, so that "writes nothing, starts nothing" is seen and not supposed.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import signal
import sys
import time
from pathlib import Path
from typing import Any

from tests_mutants import mutants  # the test puts it beside this file

from cdfctl.cli.main import main

LIMIT = 60  # s on the wall clock, after which it is a hang; what is told is processor time, whatever the load
FORBIDDEN = {
    "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "subprocess.Popen", "socket.connect",
    "socket.bind", "os.remove", "os.rename", "os.rmdir", "os.symlink", "os.link", "shutil.rmtree", "ctypes.dlopen",
}  # fmt: skip
seen: list[str] = []


def watch(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open":
        path, mode, flags = arguments
        writes = (isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or (
            mode and set(mode) & set("wax+")
        )
        if writes and not str(path).startswith((os.environ["CDFCTL_CACHE"], "/dev/null", "out")):
            seen.append(f"wrote {path}")
    elif event in FORBIDDEN:
        seen.append(f"{event} {arguments!r:.200}")


def peak_mb() -> int:
    """Greatest memory of this process, MB. (``ru_maxrss`` begins at that of the process that started this one.)"""
    status = Path("/proc/self/status")
    if status.exists():
        return int(status.read_text().partition("VmHWM:")[2].split()[0]) // 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def hang(*_: object) -> None:
    raise TimeoutError("hang")


def one(words: list[str]) -> dict[str, Any]:
    out, err = io.StringIO(), io.StringIO()
    seen.clear()
    signal.alarm(LIMIT)
    began = time.process_time()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status: Any = main(words)
    except BaseException as error:  # nothing may escape from main()
        status = repr(error)
    finally:
        signal.alarm(0)
    return {
        "status": status,
        "s": time.process_time() - began,
        "err": err.getvalue()[-2000:],
        "seen": list(seen),
        "MB": peak_mb(),
    }


def loop(folder: str, seed: int, count: int) -> None:
    schema = io.StringIO()
    with contextlib.redirect_stdout(schema):
        main(["schema"])
    signal.signal(signal.SIGALRM, hang)
    main(["run", "planar-1", "--set", "simulation.time_limit=0.2", "--out", "out", "--quiet"])  # compiles and imports
    sys.addaudithook(watch)
    path = Path("mutant.yaml")
    for i, raw in zip(range(count), mutants(Path(folder), json.loads(schema.getvalue()), seed), strict=False):
        path.write_bytes(raw)
        answers = [one(["check", "./mutant.yaml"])]
        if answers[0]["status"] == 0 and i % 10 == 0:
            shorten = ["--set", "simulation.time_limit=0.02", "--set", "simulation.dt=0.01"]
            answers.append(one(["run", "./mutant.yaml", *shorten, "--out", "out", "--quiet"]))
        for answer in answers:
            print(json.dumps({"file": i, **answer}), flush=True)


if __name__ == "__main__":
    loop(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
