"""Commands at a fixed rate on the arm's clock, and what became of the rate."""

from __future__ import annotations

import math
import time

import numpy as np

from cdfctl.simulation.plants import Track
from cdfctl.simulation.plants.franka.arm import Arm, Sample
from cdfctl.types import Array


class Ticks:
    """Tick k is due at k dt after the first. A tick is missed where the command of an earlier one left after it.

    Attributes:
        first: the state at time 0.
        count: commands sent.
        missed: ticks without a command of their own because ours came late.
        missed_by_arm: the same where the arm's clock ran ahead of ours: it, or its network, had been held up.
        lags: (count) s of the arm's clock, from the state that a command was computed from to its being sent.
    """

    def __init__(self, arm: Arm, dt: float, hold: float) -> None:
        """``dt`` is the period and ``hold`` how long a command is kept, s."""
        self._arm, self._dt, self._hold = arm, dt, hold
        self.first = arm.sample()
        self._now = self.first.t
        self._due = 0.0
        self._sent, self._wall = self.first.t, time.monotonic()
        self.count = 0
        self.missed = 0
        self.missed_by_arm = 0
        self.lags: list[float] = []

    def step(self, u: Array) -> tuple[Sample, Track]:
        """Send ``u`` (n,), rad/s, and wait for the next tick.

        Returns:
            The state then, and what was seen between; times are since the first state.
        """
        origin, before, dt = self.first.t, self._now, self._dt
        self._arm.send(u, self._hold)
        sent, wall = self._arm.sample().t, time.monotonic()
        self.count += 1
        self.lags.append(sent - before)
        skipped = max(0, math.floor((sent - origin - self._due) / dt + 1e-9))
        if (sent - self._sent) - (wall - self._wall) > 0.5 * dt:
            self.missed_by_arm += skipped
        else:
            self.missed += skipped
        self._sent, self._wall = sent, wall
        self._due = round(self._due + (1 + skipped) * dt, 12)
        seen = self._arm.wait(origin + self._due)
        last = seen[-1]
        self._now = last.t
        inside = [s for s in seen[:-1] if before < s.t < last.t]
        track = Track(
            np.array([s.t - origin for s in inside]), np.array([s.q for s in inside]).reshape(len(inside), len(u))
        )
        return Sample(round(last.t - origin, 9), last.q, last.dq), track
