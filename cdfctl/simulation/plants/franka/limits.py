"""What a Franka Research 3 can do, by the robot description that it sends itself; and what a scenario may ask of it.

The greatest velocity of a joint falls as it nears a position limit, from where it could just brake:

    v_max(q) = min(v, max(0, -o + sqrt(2 a (q_max - q)))),     v_min(q) = -min(v, max(0, -o + sqrt(2 a (q - q_min))))

with v the joint's velocity limit, a its deceleration and o an offset: ``<limit>`` and
``<position_based_velocity_limits>`` of the URDF (source: Franka Robotics, limits for Franka Research 3).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdfctl.robots.robot import Robot
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


@dataclass(frozen=True)
class ArmLimits:
    """Limits of an arm's joints, each (n,): positions rad, ``velocity`` rad/s, ``deceleration`` rad/s^2, ``offset``
    rad/s; a deceleration of +inf where the velocity limit does not depend on position."""

    lower: Array
    upper: Array
    velocity: Array
    deceleration: Array
    offset: Array

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.lower)

    def __call__(self, q: Array) -> tuple[Array, Array]:
        """Least and greatest joint velocity (n,) at ``q`` (n,), rad/s."""
        up = np.sqrt(2.0 * self.deceleration * np.maximum(self.upper - q, TOLERANCE)) - self.offset
        down = np.sqrt(2.0 * self.deceleration * np.maximum(q - self.lower, TOLERANCE)) - self.offset
        return -np.clip(down, 0.0, self.velocity), np.clip(up, 0.0, self.velocity)

    def complaints(self, robot: Robot, owner: str) -> Iterator[Complaint]:
        """What ``robot`` may do in a scenario and ``owner``, the arm with these limits, cannot."""
        if robot.n != self.n:
            yield f"{robot.name} has {robot.n} joints, {owner} has {self.n}", "the robot for it is fr3", ("robot",)
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


FR3 = ArmLimits(
    lower=np.array([-2.9007, -1.8361, -2.9007, -3.077, -2.8763, 0.4398, -3.0508]),
    upper=np.array([2.9007, 1.8361, 2.9007, -0.1169, 2.8763, 4.6216, 3.0508]),
    velocity=np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26]),
    deceleration=np.array([6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0]),
    offset=np.array([0.652, 0.25, 0.2005, 0.3542, 0.5738, 0.4885, 0.4592]),
)
"""The limits in Franka Robotics' own description of the arm, for what is checked before one is connected."""


def limits_of(urdf: str) -> ArmLimits:
    """The limits in an arm's own URDF; those of :data:`FR3` where it is none."""
    try:
        joints = [j for j in ET.fromstring(urdf).iter("joint") if j.get("type") == "revolute"]
    except ET.ParseError:
        return FR3
    rows = [_row(joint) for joint in joints]
    if not rows:
        return FR3
    return ArmLimits(*np.array(rows, dtype=np.float64).T)


def _row(joint: Any) -> tuple[float, float, float, float, float]:
    def number(tag: str, attribute: str, default: float) -> float:
        element = joint.find(tag)
        return float(element.get(attribute, default)) if element is not None else default

    braking = "position_based_velocity_limits"
    return (
        number("limit", "lower", -np.inf),
        number("limit", "upper", np.inf),
        number("limit", "velocity", np.inf),
        number(braking, "deceleration_limit", np.inf),
        number(braking, "velocity_offset", 0.0),
    )


def complaints(config: FrankaConfig, robot: Robot, dt: float, hold: float) -> Iterator[Complaint]:
    """What a scenario asks that no Franka Research 3 can do; ``dt`` and ``hold`` are in s."""
    yield from FR3.complaints(robot, "a Franka Research 3")
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
