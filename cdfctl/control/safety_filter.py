"""The safety filter for someone's own control loop: the same core as a scenario's controller, without a task."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from cdfctl.control.core import core_of
from cdfctl.control.parameters import config_of, resolved
from cdfctl.robots.robot import Robot
from cdfctl.scenario.variants import DEFAULT_VARIANT
from cdfctl.types import Decision, Scene, as_vector


class SafetyFilter:
    """The joint velocity nearest to the one asked for that keeps the robot clear of a moving scene.

        safe = SafetyFilter(robot, dt=0.01)
        decision = safe.step(q, scene, u_nominal)

    It keeps warm starts and the last command from step to step: one instance a loop, :meth:`reset` between runs.
    """

    def __init__(self, robot: Robot, variant: str = DEFAULT_VARIANT, dt: float = 0.01, **parameters: Any) -> None:
        """A filter for ``robot``.

        Args:
            robot: from :func:`cdfctl.load_robot`.
            variant: the controller whose rows to use; its task part is left out.
            dt: period of the loop, s.
            parameters: any controller parameter of a scenario file (``alpha``, ``margin``, ``on_infeasible``, …).

        Raises:
            InputError: an unknown variant or parameter, or a value that is not allowed.
        """
        self._core = core_of(robot, *resolved(config_of(variant, parameters)), dt)

    def step(self, q: ArrayLike, scene: Scene, u_nominal: ArrayLike) -> Decision:
        """The safe velocity now.

        Args:
            q: configuration (n,), rad (m for prismatic joints).
            scene: the obstacles now, with their velocities; it may be empty.
            u_nominal: the velocity asked for (n,), rad/s.

        Returns:
            The decision: ``u`` (n,), ``infeasible``, ``h`` (m,) in the scene's order, and what was done.

        Raises:
            InputError: a wrong length, or a number that is not finite.
        """
        n = self._core.robot.n
        return self._core.step(as_vector(q, n, "q"), scene, as_vector(u_nominal, n, "u_nominal"))

    def reset(self) -> None:
        """Forget the steps so far."""
        self._core.reset()
