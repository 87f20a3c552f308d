"""The predictive controller: follow the best plan; where it is about to fail, rows around its first step.

A plan is followed as it is while it keeps its margins for :data:`REACT` at least. Where none does, the mean velocity of
the one that lasts longest is the reference of the quadratic program, whose TVCBF rows are then violated least. The rows
are not asked at other times: a free plan may pass nearer, and faster, than they allow, and leaving it loses it. Every
step without a plan that is free to its end is marked infeasible.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from cdfctl.control.core import Core, check_scene
from cdfctl.control.parameters import Parameters
from cdfctl.control.planner.planner import Planner, Settings
from cdfctl.control.prediction import KnownMotion, Prediction, Predictor
from cdfctl.control.reaching import moved
from cdfctl.control.tracking import Tracker
from cdfctl.robots.robot import Robot
from cdfctl.scenario.variants import Variant
from cdfctl.types import Array, Decision, Rows, Scene

REACT = 0.5
"""s: the rows act where the best plan fails within this; until then it is followed while the search goes on."""


class PredictiveCore(Core):
    """Plans over predicted obstacles, and the rows of :class:`Core` behind them."""

    def __init__(
        self, robot: Robot, variant: Variant, parameters: Parameters, dt: float, known: KnownMotion | None = None
    ) -> None:
        """``dt`` is the control period, s; ``known`` the motion of the obstacles where the scenario gives it away."""
        super().__init__(robot, variant, parameters, dt)
        p = parameters
        assert p.segments is not None  # the variant has defaults for these
        assert p.horizon is not None
        assert p.candidates is not None
        self._delay, self._horizon = p.delay, p.horizon
        budget = inf if p.budget_ms is None else 1e-3 * p.budget_ms
        settings = Settings(p.segments, p.horizon, p.candidates, budget, p.planner_seed)
        self._planner = Planner(robot, settings, dt)
        self._tracker = Tracker(dt)
        self._predictor = Predictor(Prediction(p.margin, p.delay, p.position_error, p.velocity_error), known)

    def reset(self) -> None:
        """Forget the steps so far."""
        super().reset()
        self._planner.reset()
        self._tracker.reset()

    def step(self, q: Array, scene: Scene, u_ref: Array, task: Rows | None = None) -> Decision:
        """The command nearest to going on at ``u_ref`` (n,) for the horizon: the safety filter's way to use plans.

        Raises:
            InputError: a pose or velocity of ``scene`` is not finite.
        """
        limit = self.robot.velocity_limit
        asked = np.minimum(np.maximum(u_ref, -limit), limit)
        share = float(np.max(np.abs(asked) / limit))
        goal = np.minimum(np.maximum(q + asked * self._horizon, self.robot.lower), self.robot.upper)
        speed = limit * share if share > 0.0 else limit
        return self.pursue(q, scene, goal, speed=speed, stay=self._horizon)

    def pursue(
        self, q: Array, scene: Scene, goal: Array, *, speed: Array | None = None, stay: float = 0.0, t: float = 0.0
    ) -> Decision:
        """The command on the way from ``q`` (n,) to ``goal`` (n,), rad.

        Args:
            q: configuration.
            scene: the obstacles now, or ``delay`` ago.
            goal: configuration to go to.
            speed: (n,) greatest speeds on the straight way there; without it the robot's.
            stay: until when the goal must be free too, s from now.
            t: time now, s, for motions that are known.

        Raises:
            InputError: a pose or velocity of ``scene`` is not finite.
        """
        check_scene(scene)
        speed = self.robot.velocity_limit if speed is None else speed
        scene = self._tracker.update(scene)
        found = self._planner.plan(q, self._predictor.course(scene, t - self._delay), goal, speed, stay)
        now = moved(scene, self._delay) if self._delay > 0.0 else scene
        decision = (super().step if found.hit < REACT else self.follow)(q, now, found.u)
        if found.hit < inf:
            status = "least-violation" if decision.status == "optimal" else decision.status
            decision = replace(decision, infeasible=True, status=status)
        return replace(decision, plan_q=found.q, plan_t=found.t)
