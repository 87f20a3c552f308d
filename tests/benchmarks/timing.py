"""What the benchmarks share: a clock, a measurement, and the table and the record of a run.

Times are of whole calls from Python in one thread, after warm-up, in ms. ``--cpu`` on the command line of any of them
counts the processor time of the thread instead of the wall clock's, which other work on the machine disturbs less.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdfctl import __version__
from cdfctl.types import Array

CPU = "--cpu" in sys.argv
CLOCK = time.thread_time if CPU else time.perf_counter
RECORDS = Path(__file__).resolve().parents[2] / ".benchmarks"
"""Where records are kept, one file a run; git ignores it. The oldest is the reference."""


class Measurement(NamedTuple):
    """Times of one thing (ms), and the goals for their median and 99th percentile where there are any."""

    name: str
    times: Array
    goal: float | None = None
    goal_late: float | None = None

    @property
    def median(self) -> float:
        return float(np.median(self.times))

    @property
    def late(self) -> float:
        return float(np.percentile(self.times, 99))


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """How long ``call`` takes, ms, and what it answers."""
    begin = CLOCK()
    answer = call()
    return 1e3 * (CLOCK() - begin), answer


def repeated(call: Callable[[], Any], count: int) -> Array:
    """How long each of ``count`` calls takes, ms, after one that does not count."""
    call()
    return np.array([timed(call)[0] for _ in range(count)])


def machine() -> str:
    """What the figures hold for."""
    model = platform.machine()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), model)
    return f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}"


def show(measurements: Iterable[Measurement]) -> list[Measurement]:
    """Print one line a measurement as it comes, beside its goals and the first recorded one; and hand them back."""
    first, done = _first_recorded(), []
    print(f"{machine()}, load {os.getloadavg()[0]:.1f}; {'processor' if CPU else 'wall'} time, ms")
    print(f"{'':43}{'median':>9}{'99 %':>9}{'calls':>7}   {'goal':<11} of the first")
    for m in measurements:
        done.append(m)
        goals = [(m.median, m.goal), (m.late, m.goal_late)]
        goal = ", ".join(f"{limit:g}{'' if value <= limit else '!'}" for value, limit in goals if limit is not None)
        ratio = f"{m.median / first[m.name]:.2f}" if first.get(m.name) else "-"
        print(f"{m.name:43}{m.median:9.3f}{m.late:9.3f}{len(m.times):7}   {goal:<11} {ratio}", flush=True)
    return done


def record(measurements: Iterable[Measurement]) -> Path:
    """Write a record of this run, and say where."""
    results = {m.name: {"median": m.median, "p99": m.late, "calls": len(m.times)} for m in measurements}
    when = time.strftime("%Y-%m-%dT%H-%M-%SZ", time.gmtime())
    document = {"format": 1, "when": when, "cdfctl": __version__, **_conditions(), "ms": results}
    RECORDS.mkdir(exist_ok=True)
    path = RECORDS / f"{when}.json"
    path.write_text(json.dumps(document, indent=1) + "\n")
    return path


def _conditions() -> dict[str, str]:
    """What must be alike for two records to be compared."""
    return {"machine": machine(), "clock": "processor" if CPU else "wall"}


def _first_recorded() -> dict[str, float]:
    """The median of each measurement in the oldest record that has it."""
    first: dict[str, float] = {}
    for path in sorted(RECORDS.glob("*.json")):
        document = json.loads(path.read_text())
        if _conditions().items() <= document.items():
            for name, result in document["ms"].items():
                first.setdefault(name, result["median"])
    return first
