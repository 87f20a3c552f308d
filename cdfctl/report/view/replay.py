"""A run as something to look at: what stands where at any instant between its control steps.

The arm moves along the finest record of its motion; between two entries of that, in a straight line, as the judge has
it. An obstacle moves in a straight line from step to step and turns by the shortest way. What a controller says (h, V,
q*) holds from its control step to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdfctl.robots.robot import frame_index
from cdfctl.scenario.schema import HoldTask, JointGoalTask, ReachTask, Scenario
from cdfctl.simulation.checks import robot_of
from cdfctl.simulation.clearance import Clearance, Closest
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.run_folder import Run, check_fits
from cdfctl.simulation.shapes import vector_of
from cdfctl.types import Array, Shape, Trajectory


@dataclass(frozen=True)
class Instant:
    """What there is to see at time ``t`` (s).

    Attributes:
        step: the control step that holds then.
        q: (n,) configuration.
        obstacle_pose: (m, 7).
        target_pose: (7,) of a reach task's target.
        contact_q: (n,) nearest contact configuration of the nearest obstacle, ``contact_obstacle``; None where there is
            none.
        closest: the judge's least distance robot-obstacle, and the points it lies between; None without obstacles.
        plan: (k, 3) where the tip is planned to go; None where there is no plan.
        infeasible: no velocity satisfies all rows.
    """

    t: float
    step: int
    q: Array
    obstacle_pose: Array
    target_pose: Array | None
    contact_q: Array | None
    contact_obstacle: int | None
    closest: Closest | None
    plan: Array | None
    infeasible: bool


class Body:
    """What does not change with time: the robot, the obstacles' shapes, the task.

    Attributes:
        scenario: as resolved.
        robot: the robot.
        shapes, names: of the m obstacles; one without a name is ``obstacle`` and its number, from 1.
        target: shape of a reach task's target, None for another task.
        goal: (n,) configuration to be at, None for a reach task.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Raises :class:`cdfctl.errors.InputError` where the robot or a shape's file is not there any more."""
        import pinocchio as pin

        self.scenario, self.robot = scenario, robot_of(scenario.robot)
        motion = SceneMotion(scenario.obstacles)
        self.shapes = motion.shapes
        self.names = tuple(f"obstacle {int(name) + 1}" if name.isdecimal() else name for name in motion.names)
        self._target = SceneMotion((scenario.task.target,)) if isinstance(scenario.task, ReachTask) else None
        self.target: Shape | None = None if self._target is None else self._target.shapes[0]
        self.goal = _goal(scenario)
        self.clearance = Clearance(self.robot, self.shapes)
        self._pin, self._data = pin, self.robot.model.createData()
        self._tip = frame_index(self.robot.model, self.robot.tip)

    def target_pose(self, t: float) -> Array | None:
        """(7,) of the target at ``t`` (s)."""
        return None if self._target is None else self._target.poses(t)[0]

    def joint_placements(self, q: Array) -> list[Any]:
        """``pinocchio.SE3`` of each joint's frame in the world at ``q`` (n,); last the world's own, for joint -1."""
        self._pin.forwardKinematics(self.robot.model, self._data, q)
        frames = list(self._data.oMi)
        return [*(frame.copy() for frame in frames[1:]), self._pin.SE3.Identity()]

    def skeleton(self, q: Array) -> Array:
        """(n + 1, 3) origins of the joints, and the tip, at ``q``."""
        self._pin.framesForwardKinematics(self.robot.model, self._data, q)
        origins = [frame.translation for frame in self._data.oMi][1:]
        return np.array([*origins, self._data.oMf[self._tip].translation])


def _goal(scenario: Scenario) -> Array | None:
    match scenario.task:
        case JointGoalTask(goal=goal):
            return vector_of(goal)
        case HoldTask(pose=pose):
            return vector_of(pose)
        case _:
            return None


class Replay:
    """A body and the arrays of its run.

    Attributes:
        body: the robot and the obstacles' shapes.
        trajectory: the run's arrays.
        duration: time of the last state, s.
        tip: (P+1, 3) positions of the tip at the times ``path_t`` (P+1,) of the finest record.
    """

    def __init__(self, body: Body, trajectory: Trajectory) -> None:
        self.body, self.trajectory = body, trajectory
        self.path_t, self.path_q = trajectory.path
        self.duration = float(trajectory.t[-1])
        self.tip = body.robot.tip_path(self.path_q)
        self.plan_q = trajectory.plan_q

    @classmethod
    def of(cls, run: Run) -> Replay:
        """The replay of a run folder.

        Raises:
            InputError: its arrays are not of its scenario, or the robot or a shape's file is not there any more.
        """
        body = Body(run.scenario)
        check_fits(run, body.robot.name, body.robot.n, len(body.shapes))
        return cls(body, run.trajectory)

    @property
    def steps(self) -> int:
        """Number of control steps, N."""
        return len(self.trajectory.u)

    def step_at(self, t: float) -> int:
        """The control step that holds at ``t``: the last one begun, 0 where there is none."""
        return max(0, min(int(np.searchsorted(self.trajectory.t, t + 1e-9, side="right")) - 1, self.steps - 1))

    def at(self, t: float) -> Instant:
        """What there is to see at ``t`` (s), held within the run."""
        run = self.trajectory
        t = min(max(t, float(run.t[0])), self.duration)
        q = np.array([np.interp(t, self.path_t, column) for column in self.path_q.T])
        poses = self._poses(t)
        step = self.step_at(t)
        contact_q, obstacle = self._contact(step)
        self.body.clearance.place(q, poses)
        return Instant(
            t=t,
            step=step,
            q=q,
            obstacle_pose=poses,
            target_pose=self.body.target_pose(t),
            contact_q=contact_q,
            contact_obstacle=obstacle,
            closest=self.body.clearance.closest(),
            plan=self._plan(step),
            infeasible=bool(self.steps and run.infeasible[step]),
        )

    def _poses(self, t: float) -> Array:
        run = self.trajectory
        k = min(max(int(np.searchsorted(run.t, t, side="right")) - 1, 0), max(len(run.t) - 2, 0))
        if len(run.t) == 1:
            return np.array(run.obstacle_pose[0])
        share = (t - run.t[k]) / (run.t[k + 1] - run.t[k])
        a, b = run.obstacle_pose[k], run.obstacle_pose[k + 1]
        poses = np.array((1.0 - share) * a + share * b)
        for pose, first, second in zip(poses, a[:, 3:], b[:, 3:], strict=True):
            pose[3:] = slerp(first, second, share)
        return poses

    def _contact(self, step: int) -> tuple[Array | None, int | None]:
        """q* of the obstacle that is nearest in joint space: whose barrier is least, of those that have a q*."""
        contacts = self.trajectory.contact_q
        if contacts is None or not self.steps or not len(self.body.shapes):
            return None, None
        known = np.isfinite(contacts[step]).all(axis=1)
        if not known.any():
            return None, None
        obstacle = int(np.where(known, self.trajectory.h[step], np.inf).argmin())
        return (contacts[step, obstacle], obstacle) if known[obstacle] else (None, None)

    def _plan(self, step: int) -> Array | None:
        if self.plan_q is None or not self.steps:
            return None
        planned = self.plan_q[step]
        planned = planned[np.isfinite(planned).all(axis=1)]
        return self.body.robot.tip_path(planned) if len(planned) > 1 else None


def slerp(first: Array, second: Array, share: float) -> Array:
    """The rotation ``share`` of the shortest way from one unit quaternion to another."""
    cosine = float(first @ second)
    if cosine < 0.0:
        second, cosine = -second, -cosine  # q and -q are one rotation; this is the shorter way
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        mixed = (1.0 - share) * first + share * second
    else:
        mixed = (np.sin((1.0 - share) * angle) * first + np.sin(share * angle) * second) / np.sin(angle)
    unit: Array = mixed / np.linalg.norm(mixed)
    return unit
