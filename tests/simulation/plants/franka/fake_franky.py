"""A stand-in for the module ``franky``: an arm in memory that fails on demand, as franky-sim never does.

Its clock moves by a millisecond at every look, its joints do at once what they are told; commands are kept in ``sent``.
"""

from __future__ import annotations

from enum import Enum, auto
from types import SimpleNamespace
from typing import Any

import numpy as np


class Exception(Exception):  # noqa: N818 - franky's names
    pass


class ControlException(Exception):  # noqa: N818
    pass


class NetworkException(Exception):  # noqa: N818
    pass


class RobotMode(Enum):
    Idle = auto()
    Move = auto()
    Reflex = auto()
    UserStopped = auto()
    Guiding = auto()


class RealtimeConfig(Enum):
    Ignore = auto()
    Enforce = auto()


class Duration(int):
    """Milliseconds."""


class JointVelocityMotion:
    def __init__(self, target: Any, duration: Duration) -> None:
        self.target, self.duration = np.array(target), duration


class JointVelocityStopMotion(JointVelocityMotion):
    def __init__(self) -> None:
        super().__init__(np.zeros(7), Duration(0))


class Limit:
    def __init__(self, most: float) -> None:
        self.max = np.full(7, most)
        self.value = self.max

    def set(self, value: Any) -> None:
        self.value = np.array(value)


class Robot:
    """The arm. ``faults`` maps the number of a command to what is raised at the next look after it."""

    newest: Robot
    start = np.zeros(7)
    mode = RobotMode.Idle
    faults: dict[int, Any] = {}  # noqa: RUF012 - set by a test, for the next arm
    model_urdf = ""

    def __init__(self, host: str, realtime_config: RealtimeConfig) -> None:
        type(self).newest = self
        self.q, self.u, self.ms = np.array(self.start), np.zeros(7), 0
        self.until = 0
        self.sent: list[JointVelocityMotion] = []
        self.recovered = 0
        self.fault: Any = None
        self.frozen = False
        self.joint_acceleration_limit, self.joint_jerk_limit = Limit(15.0), Limit(7500.0)
        self.robot_mode = self.mode

    @property
    def is_in_control(self) -> bool:
        return self.until > self.ms

    @property
    def state(self) -> Any:
        if not self.frozen:
            self.ms += 1
            if self.is_in_control:
                self.q = self.q + 0.001 * self.u
        time = SimpleNamespace(to_sec=lambda ms=self.ms: 0.001 * ms)
        return SimpleNamespace(time=time, q=self.q, dq=self.u * self.is_in_control, robot_mode=self.robot_mode)

    def move(self, motion: JointVelocityMotion, asynchronous: bool) -> None:
        self.sent.append(motion)
        self.u, self.until = motion.target, self.ms + motion.duration
        fault = self.faults.get(len(self.sent))
        if callable(fault):
            fault(self)
        else:
            self.fault = fault

    def poll_motion(self) -> bool:
        if self.fault is not None:
            fault, self.fault, self.until = self.fault, None, 0
            raise fault
        return self.is_in_control

    def join_motion(self, timeout: float) -> bool:
        return True

    def recover_from_errors(self) -> bool:
        self.recovered += 1
        self.robot_mode = RobotMode.Idle
        return True
