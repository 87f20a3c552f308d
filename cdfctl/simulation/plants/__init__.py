"""What becomes of a commanded velocity: the integrator, physics, or an arm.

A plant is one file of this folder, a model in :mod:`cdfctl.scenario.plant`, and a case in
:mod:`cdfctl.simulation.assemble`. The rollout calls, in this order: ``start`` once, ``step`` and ``between`` at every
control step, ``close`` at the end however it comes about (also after an interrupt or a failure), ``report`` after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from cdfctl.types import Array, State

Report: TypeAlias = Mapping[str, float | int | str | None]
"""What a plant has to say of a run, by name; a name ends in its unit (``position_error_max_rad``)."""


class Track(NamedTuple):
    """States of a plant: times ``t`` (k,), s, ascending, and configurations ``q`` (k, n)."""

    t: Array
    q: Array


class Plant(Protocol):
    """Anything that moves as commanded, more or less. A plant derives from it and keeps the defaults that suit."""

    def start(self, q0: Array) -> State:
        """Put the arm at ``q0`` (n,), or check that it is there; the state the run begins in, at time 0.

        Raises:
            PlantError: it cannot be there.
        """
        return State(0.0, q0)

    def step(self, state: State, u: Array, dt: float) -> State:
        """The state after ``dt`` (s) at joint velocity ``u`` (n,), rad/s. Its time is the plant's own clock.

        Raises:
            PlantError: it fails.
        """
        ...

    def between(self) -> Track:
        """What is known of the last step strictly between its ends. Without it the judge takes a straight line."""
        return Track(np.zeros(0), np.zeros((0, 0)))

    def stopped(self) -> str | None:
        """Why the run must end with the last step (a contact, in words), None where it may go on."""
        return None

    def close(self) -> None:
        """Stop the arm and let it go. Called once, however the run ended."""
        return

    def report(self) -> Report:
        """What there is to say of the run so far; its first entry is ``type``."""
        ...
