"""What a Franka Research 3 can do, by the robot description that it sends itself; and what a scenario may ask of it.

``<limit>`` of the URDF holds the position and velocity limits, ``<position_based_velocity_limits>`` how the latter fall
towards the former: :mod:`cdfctl.robots.braking`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cdfctl.robots.braking import Braking
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.scenario.plant import FrankaConfig
from cdfctl.scenario.values import Complaint
from cdfctl.types import Array

ACCELERATION, JERK = 10.0, 5000.0
"""The greatest joint acceleration (rad/s^2) and jerk (rad/s^3) of a Franka Research 3, all joints."""

SHORTEST_PERIOD = 0.001
"""The arm takes a command every millisecond, s."""

LONGEST_HOLD = 1.0
"""A dead man's handle that holds longer than this (s) is none."""

TOLERANCE = 1e-6

BRAKING = "position_based_velocity_limits"
"""The element of the arm's URDF that says how its velocity limits fall towards the end stops."""


@dataclass(frozen=True)
class ArmLimits:
    """Limits of an arm's joints: positions ``lower`` and ``upper`` (n,), rad; ``velocity`` (n,), rad/s; and how that
    falls towards the end stops, where it does."""

    lower: Array
    upper: Array
    velocity: Array
    braking: Braking | None

    def __call__(self, q: Array) -> tuple[Array, Array]:
        """Least and greatest joint velocity (n,) at ``q`` (n,), rad/s."""
        if self.braking is None:
            return -self.velocity, self.velocity
        low, high = self.braking.bounds(q)
        return np.maximum(low, -self.velocity), np.minimum(high, self.velocity)

    def complaints(self, robot: Robot, owner: str) -> Iterator[Complaint]:
        """What ``robot`` may do in a scenario and ``owner``, the arm with these limits, cannot."""
        if robot.n != len(self.lower):
            yield (
                f"{robot.name} has {robot.n} joints, {owner} has {len(self.lower)}",
                "the robot for it is fr3",
                ("robot",),
            )
            return
        for i, name in enumerate(robot.joint_names):
            low, high, fast = robot.lower[i], robot.upper[i], robot.velocity_limit[i]
            if low < self.lower[i] - TOLERANCE or high > self.upper[i] + TOLERANCE:
                yield (
                    f"joint '{name}' may be anywhere in [{low:g}, {high:g}] rad, {owner} only in "
                    f"[{self.lower[i]:g}, {self.upper[i]:g}] rad",
                    f"set robot.limits.position.{name}, or take robot fr3",
                    ("robot", "limits", "position", name),
                )
            if fast > self.velocity[i] + TOLERANCE:
                yield (
                    f"joint '{name}' may move at {fast:g} rad/s, {owner} at most at {self.velocity[i]:g} rad/s",
                    "set robot.limits.velocity, or take robot fr3",
                    ("robot", "limits", "velocity"),
                )


@lru_cache
def published() -> ArmLimits:
    """The limits of the shipped robot fr3, for what is checked before an arm is connected."""
    robot = load_robot("fr3")
    return ArmLimits(robot.lower, robot.upper, robot.velocity_limit, robot.braking)


def limits_of(urdf: str) -> ArmLimits:
    """The limits in an arm's own URDF; the published ones where it sends none."""
    try:
        joints = [j for j in ET.fromstring(urdf).iter("joint") if j.get("type") == "revolute"]
    except ET.ParseError:
        return published()
    if not joints:
        return published()

    def numbers(tag: str, attribute: str, default: float) -> Array:
        found = [joint.find(tag) for joint in joints]
        return np.array([default if x is None else float(x.get(attribute, default)) for x in found])

    lower, upper = numbers("limit", "lower", -np.inf), numbers("limit", "upper", np.inf)
    deceleration = numbers(BRAKING, "deceleration_limit", np.inf)
    free = ~np.isfinite(deceleration)
    braking = Braking(
        lower=np.where(free, -np.inf, lower),
        upper=np.where(free, np.inf, upper),
        deceleration=np.where(free, 1.0, deceleration),
        offset=numbers(BRAKING, "velocity_offset", 0.0),
    )
    return ArmLimits(lower, upper, numbers("limit", "velocity", np.inf), braking)


def complaints(config: FrankaConfig, robot: Robot, dt: float, hold: float) -> Iterator[Complaint]:
    """What a scenario asks that no Franka Research 3 can do; ``dt`` and ``hold`` are in s."""
    yield from published().complaints(robot, "a Franka Research 3")
    if dt < SHORTEST_PERIOD - TOLERANCE:
        yield (
            f"{1.0 / dt:g} Hz is more than the arm takes, {1.0 / SHORTEST_PERIOD:g} Hz",
            f"dt of at least {SHORTEST_PERIOD:g} s",
            ("simulation", "dt"),
        )
    if not dt <= hold <= max(LONGEST_HOLD, 3.0 * dt):
        yield (
            f"a command held for {hold:g} s does not fit a control step of {dt:g} s",
            f"from one control step to {LONGEST_HOLD:g} s; 2 to 3 steps are usual",
            ("plant", "hold"),
        )
    for name, asked, greatest, unit in (
        ("acceleration", config.acceleration, ACCELERATION, "rad/s^2"),
        ("jerk", config.jerk, JERK, "rad/s^3"),
    ):
        if asked > greatest:
            yield f"{asked:g} {unit} is more than the arm's {greatest:g} {unit}", None, ("plant", name)
