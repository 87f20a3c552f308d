"""A simulated plant in real time: measurements from outside do not wait for it, nor it for them."""

from __future__ import annotations

import time

from cdfctl.simulation.plants import Plant, Report, Track
from cdfctl.types import Array, State


class PacedPlant(Plant):
    """Another plant whose steps end when the wall clock says so; late ones are counted, none is made up for."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._began = 0.0
        self._late = 0

    def start(self, q0: Array) -> State:
        """The plant's; real time begins now."""
        state = self._plant.start(q0)
        self._began = time.monotonic() - state.t
        return state

    def step(self, state: State, u: Array, dt: float) -> State:
        """The plant's, at the time it is for."""
        after = self._plant.step(state, u, dt)
        ahead = self._began + after.t - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        else:
            self._late += 1
            self._began -= ahead  # the plant's clock stood still meanwhile
        return after

    def between(self) -> Track:
        """The plant's."""
        return self._plant.between()

    def stopped(self) -> str | None:
        """The plant's."""
        return self._plant.stopped()

    def close(self) -> None:
        """The plant's."""
        self._plant.close()

    def report(self) -> Report:
        """The plant's, and how many steps took longer than real time."""
        return {**self._plant.report(), "late_steps": self._late}
