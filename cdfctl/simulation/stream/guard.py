"""No command without knowledge: while an obstacle's last measurement is too old, the arm brakes."""

from __future__ import annotations

import numpy as np

from cdfctl.control.controller import Controller
from cdfctl.simulation.plants import Report
from cdfctl.simulation.stream.motion import MeasuredMotion
from cdfctl.types import Decision, Scene, State


class Guard:
    """A controller whose command is u = 0, or as near as acceleration limits allow, while the scene is not known.

    Attributes:
        braked: steps at which it was.
    """

    def __init__(self, controller: Controller, motion: MeasuredMotion) -> None:
        self._controller, self._motion = controller, motion
        self._warm = False
        self.braked = 0

    def step(self, state: State, scene: Scene, target: Scene | None = None) -> Decision:
        """The controller's command, or u = 0; the first call, before the clock runs, is the controller's alone."""
        if self._warm and self._motion.stale(state.t):
            self.braked += 1
            return Decision(
                u=self._controller.core.brake(),
                h=np.full(len(scene), np.nan),  # nobody knows
                slack=float("nan"),
                status="brake",
                infeasible=False,
                residual=0.0,
            )
        self._warm = True
        return self._controller.step(state, scene, target)

    def report(self) -> Report:
        """What became of the messages, and how often the arm braked for want of them."""
        return {**self._motion.counts, "braked_steps": self.braked}

    def reset(self) -> None:
        """Forget the steps so far."""
        self._controller.reset()
        self.braked = 0
