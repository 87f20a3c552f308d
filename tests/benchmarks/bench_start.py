"""How long a fresh process takes to its first command: ``python tests/benchmarks/bench_start.py [--cpu]``.

By ``cdfctl run`` of a scenario of one step, and by a safety filter in three lines of Python, until the process has
ended. Kernels, hulls and bytecode are kept from a run before. With ``--cpu`` it is the processor time of the process.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import numpy as np
from timing import CPU, Measurement, show

TIMES = 5
FILTER = """
from cdfctl import Obstacle, SafetyFilter, Scene, Sphere, load_robot
robot = load_robot("franka")
SafetyFilter(robot).step(robot.home, Scene([Obstacle(Sphere(0.05), [0.5, 0.3, 0.5])]), [0.1] * 7)
"""
RUN = ["-m", "cdfctl", "run", "C1", "--set", "simulation.time_limit=0.1", "--quiet", "--out"]
# Python keeps bytecode unless a shell says otherwise, as those of builds and containers do, and a user's does not.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def spent(command: list[str]) -> float:
    """Time of one process, ms."""
    begin, busy = time.perf_counter(), os.times()
    status = subprocess.run([sys.executable, *command], env=ENVIRONMENT, check=False).returncode
    assert status in (0, 1), f"{command} ended in {status}"  # 1: a goal that is not reached in one step
    wall, now = time.perf_counter() - begin, os.times()
    own = now.children_user + now.children_system - busy.children_user - busy.children_system
    return 1e3 * (own if CPU else wall)


def measure() -> Iterator[Measurement]:
    """Both, the first run of each left out."""
    with tempfile.TemporaryDirectory() as folder:
        runs = [spent([*RUN, f"{folder}/{i}"]) for i in range(TIMES + 1)]
    yield Measurement("start: cdfctl run, one step", np.array(runs[1:]), 2000.0)
    filters = [spent(["-c", FILTER]) for _ in range(TIMES + 1)]
    yield Measurement("start: SafetyFilter, one step", np.array(filters[1:]), 2000.0)


if __name__ == "__main__":
    show(measure())
