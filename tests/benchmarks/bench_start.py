"""How long a fresh process takes to its first command: ``python tests/benchmarks/bench_start.py [--cpu]``.

By ``cdfctl run`` of a scenario of one step, until the process has ended, and by a safety filter in three lines of
Python, until it has answered: a loop goes on from there. Kernels, hulls and bytecode are kept from a run before. With
``--cpu`` it is the processor time of the process.
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
import time
print(time.perf_counter(), time.process_time())
"""
RUN = ["-m", "cdfctl", "run", "C1", "--set", "simulation.time_limit=0.1", "--quiet", "--out"]
# Python keeps bytecode unless a shell says otherwise, as those of builds and containers do, and a user's does not.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def run_of_a_step(folder: str) -> float:
    """Time of one process, ms."""
    begin, busy = time.perf_counter(), os.times()
    status = subprocess.run([sys.executable, *RUN, folder], env=ENVIRONMENT, check=False).returncode
    assert status in (0, 1), f"cdfctl run ended in {status}"  # 1: a goal that is not reached in one step
    wall, now = time.perf_counter() - begin, os.times()
    own = now.children_user + now.children_system - busy.children_user - busy.children_system
    return 1e3 * (own if CPU else wall)


def first_command() -> float:
    """Time from the start of a process to the answer of its filter, ms; the clock is that of the whole machine."""
    begin = time.perf_counter()
    child = subprocess.run([sys.executable, "-c", FILTER], env=ENVIRONMENT, stdout=subprocess.PIPE, check=True)
    end, busy = map(float, child.stdout.split())
    return 1e3 * (busy if CPU else end - begin)


def measure() -> Iterator[Measurement]:
    """Both, the first run of each left out."""
    with tempfile.TemporaryDirectory() as folder:
        runs = [run_of_a_step(f"{folder}/{i}") for i in range(TIMES + 1)]
    yield Measurement("start: cdfctl run, one step", np.array(runs[1:]), 2000.0)
    filters = [first_command() for _ in range(TIMES + 1)]
    yield Measurement("start: SafetyFilter, first command", np.array(filters[1:]), 2000.0)


if __name__ == "__main__":
    show(measure())
