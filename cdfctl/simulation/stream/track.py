"""What is known of one obstacle from its measurements: which of them to believe, how fast it is, where it is now.

The sender's clock is its own. The two are set against each other by the least delay seen, message time to the run's
clock on arrival; a message that took longer is older by the difference. A constant delay that every message has cannot
be seen.
"""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np

from cdfctl.simulation.motion import rotation_between, turn
from cdfctl.simulation.stream.message import Measurement
from cdfctl.types import Array

Refusal = Literal["backward", "jump"]

SPAN = 0.05
"""Time over which a velocity is estimated, s: a millimetre of noise is then 0.02 m/s."""

LEAST_SPAN = 0.01
"""The shortest time that gives a velocity at all, s."""

SLACK = 0.05
"""Noise that is no jump, m."""

FORGET = 1.0
"""A track without a measurement for so long (s) begins anew with the next one."""

DRIFT = 1e-3
"""How much faster than the sender's clock ours may run."""

AHEAD = 1.0
"""A message whose time is so much (s) further on than its arrival is not believed."""


class Track:
    """The measurements of one obstacle; times are the run's, s, unless they are said to be the sender's."""

    def __init__(self, pose: Array, max_speed: float) -> None:
        """``pose`` (7,) is where it is before the first measurement."""
        self._max_speed = max_speed
        self._pose = pose
        self._twist = np.zeros(6)
        self._time: float | None = None  # of the last measurement, on the run's clock
        self._arrived = 0.0
        self._offset = 0.0
        self._history: deque[tuple[float, Array]] = deque()  # the sender's time, and the pose
        self._known = False  # its velocity is
        self.log: list[tuple[float, Array]] = []

    def offer(self, measured: Measurement, now: float) -> Refusal | None:
        """Take a measurement that has come at ``now``, or say why not."""
        pose = self._pose.copy()
        pose[:3] = measured.position
        if measured.orientation is not None:
            pose[3:] = measured.orientation
        if measured.velocity is not None and float(np.linalg.norm(measured.velocity)) > self._max_speed:
            return "jump"
        if self._time is None or now - self._arrived > FORGET:
            self._history.clear()
            self._offset = now - measured.t
        else:
            last, before = self._history[-1]
            since = measured.t - last
            if since <= 0.0 or since - (now - self._arrived) > AHEAD:
                return "backward"
            if float(np.linalg.norm(pose[:3] - before[:3])) > self._max_speed * since + SLACK:
                return "jump"
            self._offset = min(self._offset + DRIFT * (now - self._arrived), now - measured.t)
        self._history.append((measured.t, pose))
        self._arrived, self._time, self._pose = now, measured.t + self._offset, pose
        self._twist, self._known = self._twist_of(measured)
        self.log.append((max(self._time, self.log[-1][0] + 1e-9) if self.log else self._time, pose))
        return None

    def age(self, now: float) -> float:
        """How old the last measurement is, s; infinite where there is none, or no velocity yet."""
        return now - self._time if self._time is not None and self._known else np.inf

    def twist(self) -> Array:
        """(6,) measured or estimated."""
        return self._twist

    def pose(self, now: float) -> Array:
        """(7,) where it is by now, by its last pose and its velocity."""
        if self._time is None:
            return self._pose
        since = max(0.0, now - self._time)
        return np.concatenate([self._pose[:3] + since * self._twist[:3], turn(self._twist[3:] * since, self._pose[3:])])

    def _twist_of(self, measured: Measurement) -> tuple[Array, bool]:
        """The velocity by what was measured, else by the difference to the pose :data:`SPAN` ago; whether it is one."""
        history = self._history
        while len(history) > 2 and history[-1][0] - history[1][0] >= SPAN:
            history.popleft()
        t, pose = history[0]
        span = history[-1][0] - t
        enough = span >= LEAST_SPAN
        twist = np.zeros(6)
        if measured.velocity is not None:
            twist[:3] = measured.velocity
        elif enough:
            twist[:3] = (self._pose[:3] - pose[:3]) / span
        if measured.angular_velocity is not None:
            twist[3:] = measured.angular_velocity
        elif enough and measured.orientation is not None:
            twist[3:] = rotation_between(pose[3:], self._pose[3:]) / span
        return twist, enough or measured.velocity is not None
