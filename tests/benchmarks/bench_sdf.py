"""How long the signed distance field takes: ``python tests/benchmarks/bench_sdf.py [robot …]``.

One thread, after warm-up, medians and 99th percentiles in ms of a whole call from Python. Not a test: it is not
collected by pytest. It begins with what a fresh process waits for its first answer; with an empty ``CDFCTL_CACHE``
that is compilation.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

start = time.perf_counter()

from cdfctl.fields.sdf import SDF  # noqa: E402 - the import is part of what is timed
from cdfctl.robots.robot import Robot, load_robot  # noqa: E402
from cdfctl.types import Box, Cylinder, Obstacle, PointCloud, Scene, Shape, Sphere  # noqa: E402

WORKSPACE = ([-0.7, -0.7, 0.1], [0.7, 0.7, 1.0])


def scene(rng: np.random.Generator, shape: Shape, count: int) -> Scene:
    """``count`` obstacles anywhere around the robot; the nearest are in it."""
    return Scene([Obstacle(shape, rng.uniform(*WORKSPACE), rng.normal(size=4)) for _ in range(count)])


def measure(call: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """Median and 99th percentile, ms."""
    times = np.empty(repeats)
    for i in range(repeats):
        begin = time.perf_counter()
        call()
        times[i] = time.perf_counter() - begin
    median, worst = np.percentile(1e3 * times, [50, 99])
    return float(median), float(worst)


def bench(robot: Robot, repeats: int = 1000) -> None:
    """Print one line a case."""
    rng, field, q = np.random.default_rng(0), SDF(robot), robot.home
    cloud = Scene([Obstacle(PointCloud(rng.uniform(*WORKSPACE, size=(5000, 3)), 0.01), [0.0, 0.0, 0.0])])
    cases: dict[str, Callable[[], Any]] = {}
    for name, obstacles in {
        "6 balls": scene(rng, Sphere(0.05), 6),
        "50 balls": scene(rng, Sphere(0.05), 50),
        "6 boxes": scene(rng, Box((0.1, 0.2, 0.1)), 6),
        "6 cylinders": scene(rng, Cylinder(0.05, 0.2), 6),
        "cloud of 5000": cloud,
    }.items():
        cases[f"{name}, nearest link"] = lambda obstacles=obstacles: field.query(q, obstacles)  # type: ignore[misc] # mypy cannot infer lambdas with defaults
        cases[f"{name}, every link"] = lambda obstacles=obstacles: field.per_link(q, obstacles)  # type: ignore[misc] # the same
    sizes = [len(piece.vertices) for piece in robot.pieces]
    print(f"{robot.name}: {len(sizes)} pieces of {min(sizes)} to {max(sizes)} vertices")
    for name, call in cases.items():
        call()
        median, worst = measure(call, repeats)
        print(f"  {name:28s} median {median:6.3f} ms   99 % {worst:6.3f} ms")


def main() -> None:
    """Time the robots named on the command line, the Franka otherwise."""
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for i, name in enumerate(sys.argv[1:] or ["franka"]):
        robot = load_robot(name)
        if i == 0:
            SDF(robot).query(robot.home, scene(np.random.default_rng(0), Sphere(0.05), 6))
            print(f"first answer of this process, imports and robot included: {time.perf_counter() - start:.2f} s")
        bench(robot)


if __name__ == "__main__":
    main()
