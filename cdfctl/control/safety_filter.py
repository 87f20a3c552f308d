"""The safety filter for someone's own control loop: the same core as a scenario's controller, without a task."""

from __future__ import annotations

from collections import Counter
from math import hypot
from threading import get_ident
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from cdfctl.control.core import check_scene, core_of
from cdfctl.control.parameters import Parameters, config_of, resolved
from cdfctl.errors import InputError, unknown_name
from cdfctl.fields.kernel.parts import first_not_turned
from cdfctl.robots.robot import Robot
from cdfctl.scenario.variants import DEFAULT_VARIANT
from cdfctl.types import Decision, Scene, as_numbers, as_vector, check_finite

OnBadInput = Literal["error", "brake"]

MOST_OVER = 1e3
"""A nominal velocity is taken as at most this many times the velocity limit: farther out no answer changes, but the
solver's numbers would."""


class SafetyFilter:
    """The joint velocity nearest to the one asked for that keeps the robot clear of a moving scene, and of itself.

        safe = SafetyFilter(robot, dt=0.01, self_collision=6)
        decision = safe.step(q, scene, u_nominal)

    What it holds: every obstacle row of the variant; position and velocity limits, and acceleration limits where the
    robot has any (:func:`cdfctl.load_robot`); with ``self_collision=K``, the K nearest pairs of the robot's own links.
    A nominal velocity over the limits is no error: the answer is the nearest one within them.

    It keeps warm starts and the last command from step to step: one instance a loop, :meth:`reset` between runs. From a
    reset on, the same calls give the same answers. A step while another thread is in one is refused.

    Attributes:
        counts: how many steps ended in each ``status``, and how many of them in a brake for ``bad-input``.
    """

    def __init__(
        self,
        robot: Robot,
        variant: str = DEFAULT_VARIANT,
        dt: float = 0.01,
        *,
        on_bad_input: OnBadInput = "error",
        **parameters: Any,
    ) -> None:
        """A filter for ``robot``.

        Args:
            robot: from :func:`cdfctl.load_robot`.
            variant: the controller whose rows to use; its task part is left out.
            dt: period of the loop, s.
            on_bad_input: what a number that is not finite comes to, in q, in the scene or in the nominal velocity:
                ``error`` raises; ``brake`` commands standstill, as fast as the acceleration limits allow, says so in
                ``status`` and ``reason`` and counts it. A wrong length is always an error.
            parameters: any controller parameter of a scenario file (``alpha``, ``margin``, ``self_collision``,
                ``on_infeasible``, …).

        Raises:
            InputError: an unknown variant or parameter, or a value that is not allowed.
        """
        if not isinstance(robot, Robot):
            raise InputError(f"robot must be a cdfctl.Robot, found {type(robot).__name__}", "see cdfctl.load_robot")
        if on_bad_input not in get_args(OnBadInput):
            raise unknown_name("on_bad_input", str(on_bad_input), get_args(OnBadInput))
        period = as_vector([dt], 1, "dt").item()
        self._core = core_of(robot, *resolved(config_of(variant, parameters)), period)
        self._brakes = on_bad_input == "brake"
        self._most = MOST_OVER * robot.velocity_limit
        self._in_step: int | None = None  # the thread that is
        self.counts: Counter[str] = Counter()

    @property
    def robot(self) -> Robot:
        """The robot it is for."""
        return self._core.robot

    @property
    def dt(self) -> float:
        """Period of the loop, s."""
        return self._core.dt

    @property
    def parameters(self) -> Parameters:
        """Every controller parameter, the variant's defaults where none was given."""
        return self._core.parameters

    def step(self, q: ArrayLike, scene: Scene, u_nominal: ArrayLike, *, u_last: ArrayLike | None = None) -> Decision:
        """The safe velocity now.

        Args:
            q: configuration (n,), rad (m for prismatic joints).
            scene: the obstacles now, with their velocities; it may be empty.
            u_nominal: the velocity asked for (n,), rad/s.
            u_last: the velocity commanded last (n,), rad/s, where that was not this filter's own answer.

        Returns:
            The decision: ``u`` (n,), ``infeasible``, ``h`` (m,) in the scene's order, what holds it (``active``), and
            what was done (``status``).

        Raises:
            InputError: a wrong length or type; another thread is in a step; a number that is not finite, or an
                orientation that is none, unless ``on_bad_input`` is ``brake``.
        """
        if not isinstance(scene, Scene):
            raise InputError(f"scene must be a cdfctl.Scene, found {type(scene).__name__}")
        thread = get_ident()
        if self._in_step is not None and self._in_step != thread:
            raise InputError("another thread is in a step of this filter", "one filter a loop")
        self._in_step = thread
        try:
            return self._step(q, scene, u_nominal, u_last)
        finally:
            self._in_step = None

    def _step(self, q: ArrayLike, scene: Scene, u_nominal: ArrayLike, u_last: ArrayLike | None) -> Decision:
        n = self.robot.n
        given = {"q": q, "u_nominal": u_nominal} | ({} if u_last is None else {"u_last": u_last})
        vectors = {name: as_numbers(value, n, name) for name, value in given.items()}
        try:
            _check_orientations(scene)
            for name, vector in vectors.items():
                check_finite(vector, name)
            if u_last is not None:
                self._core.u_last = vectors["u_last"]
            nominal = np.minimum(np.maximum(vectors["u_nominal"], -self._most), self._most)
            decision = self._core.step(vectors["q"], scene, nominal)
        except (InputError, ArithmeticError) as error:
            wrong = error if isinstance(error, InputError) else InputError(f"the numbers are too large: {error}")
            if not self._brakes:
                raise wrong from None
            decision = self._brake(len(scene), wrong.message)
        self.counts[decision.status] += 1
        return decision

    def reset(self, u_last: ArrayLike | None = None) -> None:
        """Forget the steps so far, and the counts. The robot stands, or moves at ``u_last`` (n,), rad/s."""
        self._core.reset()
        self.counts.clear()
        if u_last is not None:
            self._core.u_last = as_vector(u_last, self.robot.n, "u_last")

    def _brake(self, m: int, reason: str) -> Decision:
        """Toward standstill; of the scene nothing is known, so ``h`` (m,) is NaN."""
        self.counts["bad-input"] += 1
        u = self._core.brake()
        return Decision(
            u=u,
            h=np.full(m, np.nan),
            slack=float("nan"),
            status="brake",
            infeasible=False,
            residual=float("nan"),
            reason=reason,
        )


def _check_orientations(scene: Scene) -> None:
    """Raise :class:`InputError` naming the first obstacle whose orientation is none."""
    poses = np.array(scene.poses, dtype=np.float64, order="C")
    o = first_not_turned(poses)
    if o >= 0:
        check_scene(scene)
        found = f"its length is {hypot(*poses[o, 3:].tolist()):g}"
        raise InputError(f"the orientation of obstacle '{scene.names[o]}' is no unit quaternion: {found}")
