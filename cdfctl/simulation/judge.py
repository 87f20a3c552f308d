"""The judge: scores a rollout by conservative advancement, apart from every field.

Between the recorded states (the control steps, or finer where the plant says what it did in between) the configuration
moves in a straight line and the obstacles along their closed-form motion. For a pair of bodies whose relative speed is
at most L, the signed distance d obeys

    | d(t) - d(s) | <= L |t - s|         so on [a, b]         d >= ( d(a) + d(b) - L (b - a) ) / 2

The least clearance follows by halving the intervals whose bound is below the best value seen, until none is lower by
more than ``CLEARANCE_TOLERANCE``. The first contact follows by stepping ahead by d / L, which cannot jump over one.
"""

from __future__ import annotations

import heapq
import itertools
import math
from typing import Literal, Protocol, TypeAlias

import numpy as np

from cdfctl.robots.robot import Robot
from cdfctl.simulation.clearance import Clearance
from cdfctl.simulation.speed_bounds import speed_bounds
from cdfctl.types import Array, Contact, Outcome, Shape, Trajectory, Verdict

CONTACT = 1e-6  # m: contact is d <= CONTACT
CLEARANCE_TOLERANCE = 1e-4  # m: accuracy of the least clearance
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


def judge(robot: Robot, motion: Motion, trajectory: Trajectory, stop: Stop) -> Verdict:
    """Score a rollout up to the instant at which it stopped, for the reason ``stop``.

    A plant that failed is ``error``; otherwise the order is collision (the judge's, or one the plant felt), infeasible,
    reached, timeout. A continuous joint must not jump by a turn in ``trajectory.q``.
    """
    sweep = Sweep(robot, motion, trajectory)
    sampled = bool(np.any(sweep.at_steps[sweep.control] <= CONTACT))
    sweep.find_least()
    contact = sweep.first_contact() if sweep.best - CLEARANCE_TOLERANCE <= CONTACT else None
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


class Sweep:
    """The distances of one run: known at N+1 recorded states, searched in between.

    Attributes:
        at_steps: (N+1, pairs) signed distances at the recorded states, m.
        control: which of them are the control steps.
        best, best_time, best_pair: the least distance evaluated so far (m), when (s), and of which pair.
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
        self.best, self.best_time, self.best_pair = math.inf, 0.0, -1
        if self.at_steps.size:
            k, pair = divmod(int(np.argmin(self.at_steps)), self.at_steps.shape[1])
            self._note(float(self.at_steps[k, pair]), float(self.t[k]), pair)
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

    def _bounds(self, k: int) -> Array:
        """Lower bounds (pairs,) of the distances within step ``k``."""
        bounds: Array = 0.5 * (self.at_steps[k] + self.at_steps[k + 1] - self.speed[k] * (self.t[k + 1] - self.t[k]))
        return bounds

    def _measure(self, k: int, pair: int, t: float) -> float:
        """Distance of a pair at time ``t`` within step ``k``; the least one is kept."""
        t0, t1 = self.t[k], self.t[k + 1]
        q = self.q[k] + (self.q[k + 1] - self.q[k]) * ((t - t0) / (t1 - t0))
        self.clearance.place(q, self.motion.poses(t))
        d = self.clearance.distance(pair)
        self._note(d, t, pair)
        return d

    def _note(self, distance: float, t: float, pair: int) -> None:
        if distance < self.best:
            self.best, self.best_time, self.best_pair = distance, t, pair

    def find_least(self) -> None:
        """Search between the recorded states until ``best`` is within ``CLEARANCE_TOLERANCE`` of the run's least."""
        heap: list[tuple[float, int, int, float, float, float, float]] = []

        def push(k: int, pair: int, a: float, b: float, d_a: float, d_b: float, speed: float) -> None:
            bound = 0.5 * (d_a + d_b - speed * (b - a))
            if bound < self.best - CLEARANCE_TOLERANCE:
                heapq.heappush(heap, (bound, k, pair, a, b, d_a, d_b))

        for k in range(len(self.t) - 1):
            for pair in np.flatnonzero(self._bounds(k) < self.best - CLEARANCE_TOLERANCE).tolist():
                before, after = float(self.at_steps[k, pair]), float(self.at_steps[k + 1, pair])
                push(k, pair, float(self.t[k]), float(self.t[k + 1]), before, after, float(self.speed[k, pair]))
        while heap and heap[0][0] < self.best - CLEARANCE_TOLERANCE:
            _, k, pair, a, b, d_a, d_b = heapq.heappop(heap)
            middle, speed = 0.5 * (a + b), float(self.speed[k, pair])
            d = self._measure(k, pair, middle)
            push(k, pair, a, middle, d_a, d, speed)
            push(k, pair, middle, b, d, d_b, speed)

    def first_contact(self) -> Contact | None:
        """The first contact of the run: every pair advances by steps of ``d / L``, one interval after the other."""
        for k in range(len(self.t) - 1):
            start, end = float(self.t[k]), float(self.t[k + 1])
            found: tuple[float, int] | None = None
            for pair in np.flatnonzero(self._bounds(k) <= CONTACT).tolist():
                time = self._advance(k, pair, start, end if found is None else found[0])
                if time is not None:
                    found = (time, pair)
            if found is not None:
                return self._contact(*found)
        # what is left: contact at the very end, or one that touches by less than CONTACT
        return self._contact(self.best_time, self.best_pair) if self.best <= CONTACT else None

    def _advance(self, k: int, pair: int, start: float, end: float) -> float | None:
        """The first contact of a pair in [start, end), None where there is none."""
        t = start
        while t < end:
            d = self._measure(k, pair, t)
            if d <= CONTACT:
                return t
            # at least CONTACT / L, within which a distance above CONTACT cannot fall below zero
            t += max(d - CONTACT, CONTACT) / max(float(self.speed[k, pair]), 1e-12)
        return None

    def _contact(self, time: float, pair: int) -> Contact:
        m = self.clearance.obstacles
        return Contact(time, self.robot.geometry_links[pair // m], self.motion.names[pair % m])
