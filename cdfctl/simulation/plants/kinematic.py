"""The single integrator of the paper."""

from __future__ import annotations

from cdfctl.simulation.plants import Plant, Report
from cdfctl.types import Array, State


class KinematicPlant(Plant):
    """It does what it is told, and contact does not stop it.

    q(t + dt) = q(t) + u dt
    """

    def step(self, state: State, u: Array, dt: float) -> State:
        """The state after ``dt`` (s) at joint velocity ``u`` (n,), rad/s."""
        # Times are sums of dt: rounding to a picosecond keeps 0.1 + 0.2 from reading 0.30000000000000004.
        return State(t=round(state.t + dt, 12), q=state.q + u * dt)

    def report(self) -> Report:
        """Its type: there is nothing else to say."""
        return {"type": "kinematic"}
