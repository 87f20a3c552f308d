"""The speed of the control step, measured: a Franka that keeps moving among balls that keep moving."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import RenderableType

from cdfctl.control.safety_filter import SafetyFilter
from cdfctl.report.tables import listing
from cdfctl.robots.robot import load_robot
from cdfctl.scenario.variants import DEFAULT_VARIANT
from cdfctl.types import Scene, Sphere

if TYPE_CHECKING:
    from cdfctl.robots.robot import Robot
    from cdfctl.types import Array, Shape

PERIOD = 0.01  # s
STEPS = 1000
WARM_UP = 50
BALLS = (6, 50)


@dataclass(frozen=True)
class Timing:
    """Step times of one set-up, ms."""

    variant: str
    balls: int
    steps: int
    median: float
    p99: float

    def document(self) -> dict[str, Any]:
        """The same as one JSON object."""
        return {
            "controller": self.variant,
            "robot": "franka",
            "obstacles": self.balls,
            "steps": self.steps,
            "step_ms": {"p50": self.median, "p99": self.p99},
        }


def measure(variant: str = DEFAULT_VARIANT) -> list[Timing]:
    """Time :meth:`SafetyFilter.step` for 6 and 50 balls on a Franka, without the first steps, which compile."""
    robot = load_robot("franka")
    return [_measure(robot, variant, balls) for balls in BALLS]


def _measure(robot: Robot, variant: str, balls: int) -> Timing:
    random = np.random.default_rng(0)
    shapes: tuple[Shape, ...] = (Sphere(0.05),) * balls
    names = tuple(f"ball-{i}" for i in range(balls))
    # Around the arm at 0.4 to 0.9 m, as close as a crowd can be without the arm being stuck in it.
    angle, height = random.uniform(-np.pi, np.pi, balls), random.uniform(0.2, 0.9, balls)
    radius, rate = random.uniform(0.4, 0.9, balls), random.uniform(-0.5, 0.5, balls)
    goals = robot.home + random.uniform(-0.5, 0.5, (10, robot.n))
    safe = SafetyFilter(robot, variant=variant, dt=PERIOD)
    q: Array = robot.home.copy()
    times = np.empty(STEPS)
    for k in range(-WARM_UP, STEPS):
        turn = angle + rate * k * PERIOD
        place = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
        poses = np.hstack([place, np.tile([0.0, 0.0, 0.0, 1.0], (balls, 1))])
        twists = np.zeros((balls, 6))
        twists[:, 0], twists[:, 1] = -rate * place[:, 1], rate * place[:, 0]
        scene = Scene.from_arrays(shapes, names, poses, twists)
        nominal = 4.0 * (goals[k // 100 % len(goals)] - q)
        start = time.perf_counter()
        decision = safe.step(q, scene, nominal)
        if k >= 0:
            times[k] = time.perf_counter() - start
        q = q + PERIOD * decision.u
    median, p99 = np.percentile(1e3 * times, [50, 99])
    return Timing(variant, balls, STEPS, float(median), float(p99))


def speed_table(timings: Sequence[Timing]) -> RenderableType:
    """The timings, for people."""
    rows = [(t.variant, str(t.balls), f"{t.median:.3f} ms", f"{t.p99:.3f} ms", str(t.steps)) for t in timings]
    return listing(("control step, franka", "balls", "median", "p99", "steps"), rows)
