"""When a task is done: the test the rollout makes at every control step.

joint goal   |q_goal - q|_2 <= tolerance, at or after ``not_before``
hold         the same for the pose, and all obstacles' origins beyond the plane of ``until``; without ``until``, at
             the time limit only
reach        V <= reach_tolerance, V the distance of robot and target in the controller's field
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cdfctl.control.controller import difference
from cdfctl.control.reaching import Reaching
from cdfctl.robots.robot import Robot
from cdfctl.scenario.schema import BeyondConfig, HoldTask, JointGoalTask
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.shapes import vector_of
from cdfctl.types import Array, Scene, State

ROUNDING = 1e-9
"""s: a sum of control steps may fall short of a time by its rounding."""


class Goal(Protocol):
    """The test of a task."""

    def reached(self, state: State, scene: Scene, *, at_end: bool) -> bool:
        """Whether the task is done in this ``state`` and ``scene``; ``at_end`` at the time limit."""
        ...


@dataclass(frozen=True)
class Touch:
    """A target to be touched: V within ``tolerance`` (in the unit of the field)."""

    reaching: Reaching
    target: SceneMotion
    tolerance: float

    def reached(self, state: State, scene: Scene, *, at_end: bool) -> bool:
        """Whether V <= tolerance at the target's place now."""
        return self.reaching.value(state.q, self.target.at(state.t)) <= self.tolerance


@dataclass(frozen=True)
class Configuration:
    """A configuration to be at, and what else must be so.

    Attributes:
        robot: whose joints they are (a continuous one is compared the shorter way round).
        q: (n,) the configuration, rad.
        tolerance: greatest 2-norm of the difference, rad.
        beyond: the plane all obstacles must have passed, or None.
        only_at_end: the goal counts at the time limit only.
        not_before: the goal counts from this time on, s.
    """

    robot: Robot
    q: Array
    tolerance: float
    beyond: BeyondConfig | None = None
    only_at_end: bool = False
    not_before: float = 0.0

    def reached(self, state: State, scene: Scene, *, at_end: bool) -> bool:
        """Whether the task is done in this ``state`` and ``scene``; ``at_end`` at the time limit."""
        if self.only_at_end and not at_end:
            return False
        if state.t < self.not_before - ROUNDING:
            return False
        if self.beyond is not None and not passed(scene, self.beyond):
            return False
        return float(np.linalg.norm(difference(self.q, state.q, self.robot.continuous))) <= self.tolerance


def goal_of(task: JointGoalTask | HoldTask, robot: Robot, tolerance: float) -> Configuration:
    """The goal of a task that ends at a configuration, within ``tolerance`` (rad)."""
    match task:
        case JointGoalTask():
            return Configuration(robot, vector_of(task.goal), tolerance, not_before=task.not_before or 0.0)
        case HoldTask():
            beyond = task.until.obstacles_beyond if task.until is not None else None
            return Configuration(robot, vector_of(task.pose), tolerance, beyond, only_at_end=beyond is None)


def passed(scene: Scene, beyond: BeyondConfig) -> bool:
    """Whether every obstacle's origin is on the named side of the plane."""
    along = scene.poses[:, "xyz".index(beyond.axis)]
    value = float(vector_of([beyond.value])[0])
    return bool(np.all(along < value) if beyond.side == "below" else np.all(along > value))
