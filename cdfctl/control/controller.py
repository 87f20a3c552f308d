"""A scenario's controller: the velocity its task asks for, made safe.

Joint goal (also the hold task, whose goal is the pose to hold):

    u_ref = K (q_goal - q)

not clipped: the velocity bounds are the QP's. A continuous joint goes the shorter way round.

Reach: u_ref = 0, and the Lyapunov row of :mod:`cdfctl.control.reaching` does the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from cdfctl.control.core import Core, core_of
from cdfctl.control.parameters import resolved
from cdfctl.control.reaching import Reaching
from cdfctl.errors import InputError
from cdfctl.fields.field import make_field
from cdfctl.robots.robot import Robot
from cdfctl.scenario.schema import ControllerConfig, HoldTask, JointGoalTask, ReachTask, Task
from cdfctl.scenario.variants import TASKS_OF
from cdfctl.types import Array, BoolArray, Decision, Scene, State, as_vector

if TYPE_CHECKING:
    from cdfctl.control.prediction import KnownMotion

Nominal = Callable[[State, Scene], Array]
Pursuit = Callable[[State, Scene], Decision]


class Controller:
    """A task's nominal velocity and the core that makes it safe. Build it by :func:`build`.

    Attributes:
        core: field, rows and QP.
        reaching: what draws the robot to a target, None for a task without one.
    """

    def __init__(
        self, core: Core, nominal: Nominal, reaching: Reaching | None = None, pursuit: Pursuit | None = None
    ) -> None:
        self.core = core
        self.reaching = reaching
        self._nominal, self._pursuit = nominal, pursuit

    def step(self, state: State, scene: Scene, target: Scene | None = None) -> Decision:
        """What to command now; ``target`` is a scene of the one body to reach, for a reach task.

        Raises:
            InputError: ``state``, ``scene`` or ``target`` is not finite, or there is no target where one is needed.
        """
        as_vector(state.q, self.core.robot.n, "q")
        if self._pursuit is not None:
            return self._pursuit(state, scene)
        u_ref = self._nominal(state, scene)
        if self.reaching is None:
            return self.core.step(state.q, scene, u_ref)
        if target is None:
            raise InputError("a reach task needs its target at every step")
        row, V = self.reaching.row(state.q, target)
        return replace(self.core.step(state.q, scene, u_ref, row), V=V)

    def reset(self) -> None:
        """Forget the steps so far: warm starts and ``u_last``."""
        self.core.reset()
        if self.reaching is not None:
            self.reaching.reset()


def build(
    robot: Robot, config: ControllerConfig, task: Task, dt: float, motion: KnownMotion | None = None
) -> Controller:
    """Wire field, rows, QP and task as the controller section says; ``dt`` is the control period, s.

    ``motion`` is that of the obstacles: it reaches the controller only under ``prediction: known``.

    Raises:
        InputError: a solver that is not installed, a goal or weights that do not fit the robot, a task the variant
            does not do.
    """
    variant, parameters = resolved(config)
    if task.type not in TASKS_OF[variant.task]:
        allowed = ", ".join(TASKS_OF[variant.task])
        raise InputError(f"controller '{variant.name}' cannot do task '{task.type}'", hint=f"allowed: {allowed}")
    reaching = None
    if isinstance(task, ReachTask):
        reaching = Reaching(make_field(variant.field, robot), parameters.gamma, dt)
    core = core_of(robot, variant, parameters, dt, motion if parameters.prediction == "known" else None)
    return Controller(core, nominal(robot, task, parameters.gain), reaching, _pursuit(core, task))


def nominal(robot: Robot, task: Task, gain: float) -> Nominal:
    """The velocity the task asks for, as a function of state and scene."""
    if isinstance(task, ReachTask):
        still = np.zeros(robot.n)
        return lambda state, scene: still
    goal = _goal(robot, task)

    def toward_goal(state: State, scene: Scene) -> Array:
        return gain * difference(goal, state.q, robot.continuous)

    return toward_goal


def _goal(robot: Robot, task: JointGoalTask | HoldTask) -> Array:
    match task:
        case JointGoalTask():
            return as_vector(cast("tuple[float, ...]", task.goal), robot.n, "task.goal")
        case HoldTask():
            return as_vector(cast("tuple[float, ...]", task.pose), robot.n, "task.pose")


def _pursuit(core: Core, task: Task) -> Pursuit | None:
    """What a controller that plans does at every step; None for one that does not."""
    if not core.variant.plans:
        return None
    from cdfctl.control.predictive import PredictiveCore

    assert isinstance(core, PredictiveCore)
    assert not isinstance(task, ReachTask)  # build() has seen to it
    goal, planner = _goal(core.robot, task), core
    until = math.inf if isinstance(task, HoldTask) else task.not_before or 0.0

    def pursue(state: State, scene: Scene) -> Decision:
        return planner.pursue(state.q, scene, goal, stay=max(0.0, until - state.t), t=state.t)

    return pursue


def difference(goal: Array, q: Array, continuous: BoolArray) -> Array:
    """goal - q (n,), the shorter way round where a joint is continuous: within [-pi, pi)."""
    delta: Array = goal - q
    if continuous.any():
        delta = np.where(continuous, (delta + math.pi) % (2.0 * math.pi) - math.pi, delta)
    return delta
