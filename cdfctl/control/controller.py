"""A scenario's controller: the velocity its task asks for, made safe.

Joint goal (also the hold task, whose goal is the pose to hold):

    u_ref = K (q_goal - q)

not clipped: the velocity bounds are the QP's. A continuous joint goes the shorter way round.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import cast

import numpy as np

from cdfctl.control.core import Core
from cdfctl.control.parameters import resolved
from cdfctl.errors import InputError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.schema import ControllerConfig, HoldTask, JointGoalTask, Task
from cdfctl.types import Array, BoolArray, Decision, Scene, State, as_vector

Nominal = Callable[[State, Scene], Array]


class Controller:
    """A task's nominal velocity and the core that makes it safe. Build it by :func:`build`."""

    def __init__(self, core: Core, nominal: Nominal) -> None:
        self.core = core
        self._nominal = nominal

    def step(self, state: State, scene: Scene) -> Decision:
        """What to command now. Raises :class:`cdfctl.errors.InputError` where ``state`` or ``scene`` is not finite."""
        as_vector(state.q, self.core.robot.n, "q")
        return self.core.step(state.q, scene, self._nominal(state, scene))

    def reset(self) -> None:
        """Forget the steps so far: warm starts and ``u_last``."""
        self.core.reset()


def build(robot: Robot, config: ControllerConfig, task: Task, dt: float) -> Controller:
    """Wire field, rows, QP and task as the controller section says; ``dt`` is the control period, s.

    Raises:
        InputError: a solver that is not installed, a goal or weights that do not fit the robot, a task the variant
            does not do.
    """
    variant, parameters = resolved(config)
    return Controller(Core(robot, variant, parameters, dt), nominal(robot, task, parameters.gain))


def nominal(robot: Robot, task: Task, gain: float) -> Nominal:
    """The velocity the task asks for, as a function of state and scene."""
    match task:
        case JointGoalTask():
            goal = as_vector(cast("tuple[float, ...]", task.goal), robot.n, "task.goal")
        case HoldTask():
            goal = as_vector(cast("tuple[float, ...]", task.pose), robot.n, "task.pose")
        case _:
            raise InputError(f"no controller here does the task '{task.type}'", hint="allowed: joint-goal, hold")

    def toward_goal(state: State, scene: Scene) -> Array:
        return gain * difference(goal, state.q, robot.continuous)

    return toward_goal


def difference(goal: Array, q: Array, continuous: BoolArray) -> Array:
    """goal - q (n,), the shorter way round where a joint is continuous: within [-pi, pi)."""
    delta: Array = goal - q
    if continuous.any():
        delta = np.where(continuous, (delta + math.pi) % (2.0 * math.pi) - math.pi, delta)
    return delta
