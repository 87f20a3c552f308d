"""How long ``SafetyFilter.step`` takes: ``python tests/benchmarks/bench_filter.py [--cpu]``.

A Franka moves under a slow joystick-like nominal velocity among moving balls, at 100 Hz. Where two filters are
compared, the same steps are taken by both in turn, so that the load of the machine weighs on both alike; the increment
is the median of the differences.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from scenes import Motion, circling, crowd
from timing import Measurement, show, timed

from cdfctl import SafetyFilter, load_robot
from cdfctl.control.safety_filter import DEFAULT_VARIANT
from cdfctl.fields.self_distance import SelfDistance
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, Scene

DT = 0.01  # s
STEPS = 600
WARM = 20


def steps(filters: list[SafetyFilter], scene: Motion, count: int = STEPS) -> tuple[Array, list[tuple[Array, Scene]]]:
    """How long the filters take for each of the same steps (count, filters), ms, and where: (q, scene). The last one
    moves the robot."""
    robot = filters[-1].robot
    q, times, where = robot.home.copy(), np.zeros((count, len(filters))), []
    decisions: list[Any] = [None] * len(filters)
    for k in range(-WARM, count):  # the first steps compile, and fill the memory of contacts
        now, nominal = scene(DT * k), 0.6 * np.sin(0.01 * k * np.arange(1, robot.n + 1))
        for i in range(len(filters))[:: 1 if k % 2 else -1]:
            times[max(k, 0), i], decisions[i] = timed(partial(filters[i].step, q, now, nominal))
        if k >= 0:
            where.append((q, now))
        q = q + DT * decisions[-1].u
    return times, where


def measure(robot: Robot) -> Iterator[Measurement]:
    """The control step, the figures that are promised first."""
    filters = [SafetyFilter(robot, DEFAULT_VARIANT, dt=DT, self_collision=count) for count in (0, 6)]
    yield Measurement(f"step, {DEFAULT_VARIANT}, 6 balls", steps(filters[:1], circling())[0][:, 0], 0.5, 1.0)
    filters[0].reset()
    times, where = steps(filters, circling())
    yield Measurement("  with 6 rows of the robot's own links", times[:, 1], 1.2)
    yield Measurement("  what these add", times[:, 1] - times[:, 0], 0.3)
    own = SelfDistance(robot, 6, 0.02)
    alone = [timed(partial(own.query, q))[0] for q, _ in where]
    yield Measurement(f"  the distances of {len(own.pairs)} pairs alone", np.array(alone))
    fifty = SafetyFilter(robot, "sdf-tvcbf-qp", dt=DT, links="all")
    yield Measurement("step, sdf-tvcbf-qp, 50 balls, every link", steps([fifty], crowd(robot, 50))[0][:, 0], 1.0)


if __name__ == "__main__":
    show(measure(load_robot("franka")))
