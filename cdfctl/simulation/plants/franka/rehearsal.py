"""An arm that is not there: it does at once what it is told, and says what that was."""

from __future__ import annotations

from collections.abc import Callable

from cdfctl.simulation.plants.franka.arm import Sample
from cdfctl.simulation.plants.franka.limits import published
from cdfctl.types import Array

Sink = Callable[[float, Array, float], None]
"""Is told each command: time (s), joint velocity (n,), rad/s, and hold time (s)."""


class Rehearsal:
    """Stands in for the arm in ``--dry-run``: the integrator, on a clock that waits for nobody."""

    expired = 0

    def __init__(self, q0: Array, sink: Sink) -> None:
        self._t, self._q, self._sink = 0.0, q0, sink
        self._u = 0.0 * q0
        self.limits = published()

    def sample(self) -> Sample:
        """Where it is."""
        return Sample(self._t, self._q, self._u)

    def send(self, u: Array, hold: float) -> None:
        """Tell what is commanded."""
        self._sink(self._t, u, hold)
        self._u = u

    def wait(self, until: float) -> list[Sample]:
        """Move on to the time ``until`` (s)."""
        if until > self._t:
            self._q, self._t = self._q + (until - self._t) * self._u, until
        return [self.sample()]

    def close(self) -> float | None:
        """Nothing is to be stopped."""
        return None
