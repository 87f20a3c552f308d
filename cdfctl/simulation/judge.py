"""The judge: scores a rollout by conservative advancement, apart from every field.

Between the recorded states (the control steps, or finer where the plant says what it did in between) the configuration
moves in a straight line and the obstacles along their closed-form motion. A pair of bodies has a bound on its relative
speed, which is what :class:`~cdfctl.simulation.advancement.Advancement` searches by.

Contact of the robot with itself is always looked for and reported. It is a collision in a scenario that asks its
controllers to avoid it (``controller.self_collision``); the paper does not speak of it.
"""

from __future__ import annotations

import itertools
import math
from typing import Literal, Protocol, TypeAlias

import numpy as np

from cdfctl.robots.robot import Robot
from cdfctl.simulation.advancement import CLEARANCE_TOLERANCE, CONTACT, Advancement
from cdfctl.simulation.clearance import Clearance
from cdfctl.simulation.self_contact import SelfSweep
from cdfctl.simulation.speed_bounds import speed_bounds
from cdfctl.types import Array, Contact, Outcome, Shape, Trajectory, Verdict

__all__ = ["CLEARANCE_TOLERANCE", "CONTACT", "Motion", "Stop", "Sweep", "clearance_curve", "judge"]

CHORD = 0.02  # rad (m for a prismatic joint): joint motion between two points of the tip's path

Stop: TypeAlias = Literal["reached", "timeout", "infeasible", "contact", "error"]
"""Why a rollout ended; ``contact``: the plant felt one."""


class Motion(Protocol):
    """How the obstacles move: ``poses`` (m, 7) at t, and bounds on the speed of an origin and on the angular speed."""

    @property
    def shapes(self) -> tuple[Shape, ...]: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    def poses(self, t: float, /) -> Array: ...
    def max_speed(self, i: int, t0: float, t1: float, /) -> float: ...
    def max_angular_speed(self, i: int, t0: float, t1: float, /) -> float: ...


def judge(robot: Robot, motion: Motion, trajectory: Trajectory, stop: Stop, *, self_collision: bool = False) -> Verdict:
    """Score a rollout up to the instant at which it stopped, for the reason ``stop``.

    With ``self_collision``, contact of the robot with itself is a collision too; without, it is reported only.

    A plant that failed is ``error``; otherwise the order is collision (the judge's, or one the plant felt), infeasible,
    reached, timeout. A continuous joint must not jump by a turn in ``trajectory.q``.
    """
    sweep = Sweep(robot, motion, trajectory)
    own = SelfSweep(robot, sweep.t, sweep.q)
    sampled = bool(np.any(sweep.at_steps[sweep.control] <= CONTACT))
    contact, self_contact = sweep.search(), own.search()
    if self_collision:
        sampled = sampled or bool(np.any(own.at_steps[sweep.control] <= CONTACT))
        contact = min(filter(None, (contact, self_contact)), key=lambda found: found.time, default=None)
    outcome = _outcome(stop, contact is not None)
    return Verdict(
        outcome=outcome,
        outcome_sampled=_outcome(stop, sampled),
        time_to_reach=float(trajectory.t[-1]) if outcome == "reached" else None,
        path_length=tip_path_length(robot, sweep.q),
        joint_path=joint_path_length(trajectory),
        min_clearance=sweep.best,
        min_clearance_time=None if math.isinf(sweep.best) else sweep.best_time,
        contact=contact,
        min_self_clearance=own.best,
        self_contact=self_contact,
    )


def clearance_curve(robot: Robot, motion: Motion, trajectory: Trajectory) -> Array:
    """Least signed distance (N+1,) robot-obstacle at the control steps, m; +inf without obstacles."""
    sweep = Sweep(robot, motion, trajectory)
    curve: Array = sweep.at_steps[sweep.control].min(axis=1, initial=math.inf)
    return curve


def tip_path_length(robot: Robot, q: Array) -> float:
    """Length (m) of the tip's path along the straight lines between the configurations ``q`` (N+1, n).

    Summed over chords of at most ``CHORD`` joint motion: too short by less than 2e-5 of itself.
    """
    points = [q[:1]]
    for a, b in itertools.pairwise(q):
        parts = max(1, math.ceil(float(np.abs(b - a).sum()) / CHORD))
        points.append(a + (b - a) * (np.arange(1, parts + 1) / parts)[:, None])
    tips = robot.tip_path(np.concatenate(points))
    return float(np.linalg.norm(np.diff(tips, axis=0), axis=1).sum())


def joint_path_length(trajectory: Trajectory) -> float:
    """Integral of the norm of the commanded joint velocity over time, rad."""
    return float(np.linalg.norm(trajectory.u, axis=1) @ np.diff(trajectory.t))


def _outcome(stop: Stop, collided: bool) -> Outcome:
    if stop == "error":
        return "error"
    return "collision" if collided or stop == "contact" else stop


class Sweep(Advancement):
    """The distances of robot and obstacles: known at N+1 recorded states, searched in between.

    Attributes:
        control: which of the states are the control steps.
    """

    def __init__(self, robot: Robot, motion: Motion, trajectory: Trajectory) -> None:
        self.robot, self.motion, (self.t, self.q) = robot, motion, trajectory.path
        self.control = np.searchsorted(self.t, trajectory.t)
        self.clearance = Clearance(robot, motion.shapes)
        self.at_steps = np.zeros((len(self.t), self.clearance.objects * self.clearance.obstacles))
        frames, centres = [], []
        for k, (t, q) in enumerate(zip(self.t, self.q, strict=True)):
            self.clearance.place(q, motion.poses(float(t)))
            self.at_steps[k] = self.clearance.distances()
            frames.append(self.clearance.joint_frames())
            centres.append(self.clearance.robot_centres())
        self.start()
        rotations, origins = (np.array(part) for part in zip(*frames, strict=True))
        self.speed = self._speeds(rotations, origins, np.array(centres))

    def _speeds(self, rotations: Array, origins: Array, centres: Array) -> Array:
        """Bounds (N, pairs) on the relative speed of each pair within each step, m/s."""
        axes = np.einsum("knij,nj->kni", rotations, self.robot.chain.axis)
        parents = [body.parentJoint - 1 for body in self.robot.geometry.geometryObjects]
        radii = self.clearance.robot_spheres[:, 3]
        robot = speed_bounds(self.robot.chain, parents, self.t, self.q, axes, origins, centres, radii)
        obstacle = np.zeros((len(self.t) - 1, self.clearance.obstacles))
        for k, (t0, t1) in enumerate(itertools.pairwise(self.t.tolist())):
            for i, reach in enumerate(self.clearance.reach):
                turning = self.motion.max_angular_speed(i, t0, t1)
                obstacle[k, i] = self.motion.max_speed(i, t0, t1) + turning * reach
        return (robot[:, :, None] + obstacle[:, None, :]).reshape(len(self.t) - 1, self.at_steps.shape[1])

    def distance_at(self, k: int, pair: int, t: float) -> float:
        """Signed distance of a pair at time ``t`` within interval ``k``, m."""
        t0, t1 = self.t[k], self.t[k + 1]
        q = self.q[k] + (self.q[k + 1] - self.q[k]) * ((t - t0) / (t1 - t0))
        self.clearance.place(q, self.motion.poses(t))
        return self.clearance.distance(pair)

    def contact_of(self, time: float, pair: int) -> Contact:
        """The contact of a pair at ``time``, by name."""
        m = self.clearance.obstacles
        return Contact(time, self.robot.geometry_links[pair // m], self.motion.names[pair % m])
