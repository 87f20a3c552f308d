"""How long ``SafetyFilter.step`` takes: ``python tests/benchmarks/bench_filter.py [variant …]``.

A Franka moves under a slow joystick-like nominal velocity among six moving balls, at 100 Hz, one thread. The same steps
are taken by a filter without and by one with six self-collision rows, in turn, so that the load of the machine weighs
on both alike; the increment is the median of the differences. Not a test: it is not collected by pytest.

Goals for ``dual-tvcbf-qp``: median 0.8 ms without, 1.2 ms with, an increment of at most 0.3 ms.
"""

from __future__ import annotations

import os
import platform
import sys
import time

import numpy as np

from cdfctl import SafetyFilter, Scene, Sphere, load_robot
from cdfctl.control.safety_filter import DEFAULT_VARIANT
from cdfctl.fields.self_distance import SelfDistance
from cdfctl.types import Array, Decision

DT = 0.01
STEPS = 600


def balls(t: float, shapes: tuple[Sphere, ...]) -> Scene:
    """Six balls on circles around the workspace."""
    phase = np.arange(6) * np.pi / 3 + 0.4 * t
    poses = np.zeros((6, 7))
    poses[:, 0], poses[:, 1], poses[:, 2] = 0.55 * np.cos(phase), 0.55 * np.sin(phase), 0.5 + 0.05 * np.arange(6)
    poses[:, 6] = 1.0
    twists = np.zeros((6, 6))
    twists[:, 0], twists[:, 1] = -0.22 * np.sin(phase), 0.22 * np.cos(phase)
    return Scene.from_arrays(shapes, tuple(f"ball-{i}" for i in range(6)), poses, twists)


def timed(safe: SafetyFilter, q: Array, scene: Scene, u: Array) -> tuple[float, Decision]:
    begin = time.perf_counter()
    decision = safe.step(q, scene, u)
    return 1e3 * (time.perf_counter() - begin), decision


def line(name: str, times: Array) -> None:
    median, worst = np.percentile(times, [50, 99])
    print(f"  {name:38s} median {median:6.3f} ms   99 % {worst:6.3f} ms")


def bench(variant: str) -> None:
    """Print what a step takes without and with self-collision rows."""
    robot = load_robot("franka")
    filters = [SafetyFilter(robot, variant, dt=DT, self_collision=count) for count in (0, 6)]
    shapes = tuple(Sphere(0.05) for _ in range(6))
    q = robot.home.copy()
    times = np.zeros((STEPS, 2))
    for k in range(-20, STEPS):  # the first steps compile, and fill the memory of contacts
        scene, nominal = balls(DT * k, shapes), 0.6 * np.sin(0.01 * k * np.arange(1, 8))
        order = (0, 1) if k % 2 else (1, 0)
        for i in order:
            spent, decision = timed(filters[i], q, scene, nominal)
            if k >= 0:
                times[k, i] = spent
            if i == 1:
                held = decision
        q = q + DT * held.u
    own, alone = SelfDistance(robot, 6, 0.02), np.zeros(STEPS)
    for k in range(STEPS):
        begin = time.perf_counter()
        own.query(q)
        alone[k] = 1e3 * (time.perf_counter() - begin)
    print(f"{variant}: {dict(filters[1].counts)}")
    line("6 balls", times[:, 0])
    line("6 balls, 6 self-collision rows", times[:, 1])
    line("increment", times[:, 1] - times[:, 0])
    line(f"the distances of {len(own.pairs)} pairs, 6 gradients", alone)


if __name__ == "__main__":
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for name in sys.argv[1:] or [DEFAULT_VARIANT]:
        bench(name)
