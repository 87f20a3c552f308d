"""The judge's look at a robot's contact with itself: the pairs of its own links that may not touch.

Between recorded states the joints move in straight lines. With r_j the greatest distance of a body's points from the
axis of joint j, the distance of two bodies changes by at most sum_j r_j |dq_j| over an interval, j over the joints
between them.

It shares the list of pairs with the controller's rows, and no distance: coal is asked here pair by pair.
"""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pinocchio as pin

from cdfctl.robots.coal_geometry import bounding_ball, exact_request
from cdfctl.robots.robot import Robot
from cdfctl.robots.self_pairs import self_pairs
from cdfctl.robots.stay_apart import reaches
from cdfctl.simulation.advancement import Advancement
from cdfctl.types import Array, Contact


class OwnDistances:
    """Signed distances of the pairs of ``robot``'s own links that can come near each other.

    Attributes:
        pairs: of indices into ``robot.geometry.geometryObjects``.
        links: their links by name.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.pairs = robot, self_pairs(robot).checked
        self.links = [(robot.geometry_links[i], robot.geometry_links[j]) for i, j in self.pairs]
        self._data, self._placed = robot.model.createData(), pin.GeometryData(robot.geometry)
        self._bodies = [body.geometry for body in robot.geometry.geometryObjects]
        radii = [float(bounding_ball(body)[3]) for body in self._bodies]
        self._deepest = [-(radii[i] + radii[j]) for i, j in self.pairs]
        self._request, self._result = exact_request(coal.DistanceRequest()), coal.DistanceResult()

    def place(self, q: Array) -> None:
        """Move the robot to ``q`` (n,)."""
        pin.updateGeometryPlacements(self.robot.model, self._data, self.robot.geometry, self._placed, q)
        self._frames: list[Any] = [coal.Transform3s(frame.rotation, frame.translation) for frame in self._placed.oMg]

    def distance(self, pair: int) -> float:
        """Signed distance of one pair as placed, m; where coal gives up the depth, no more than both radii."""
        i, j = self.pairs[pair]
        self._result.clear()
        frames, bodies = self._frames, self._bodies
        d = coal.distance(bodies[i], frames[i], bodies[j], frames[j], self._request, self._result)
        return max(float(d), self._deepest[pair])

    def distances(self) -> Array:
        """Signed distances (pairs,) as placed, m."""
        return np.array([self.distance(pair) for pair in range(len(self.pairs))])


class SelfSweep(Advancement):
    """The distances of a robot to itself along a recorded motion; ``t`` (N+1,) s, ``q`` (N+1, n)."""

    def __init__(self, robot: Robot, t: Array, q: Array) -> None:
        self.t, self.q, self._own = t, q, OwnDistances(robot)
        self.at_steps = np.zeros((len(t), len(self._own.pairs)))
        for k, configuration in enumerate(q) if self._own.pairs else ():
            self._own.place(configuration)
            self.at_steps[k] = self._own.distances()
        self.speed = np.zeros((len(t) - 1, len(self._own.pairs)))
        rate = np.abs(np.diff(q, axis=0)) / np.diff(t)[:, None]
        for p, pair in enumerate(self._own.pairs):
            joints, reach = reaches(robot, pair)
            self.speed[:, p] = rate[:, joints] @ reach
        self.start()

    def distance_at(self, k: int, pair: int, t: float) -> float:
        """Signed distance of a pair at time ``t`` within interval ``k``, m."""
        share = (t - self.t[k]) / (self.t[k + 1] - self.t[k])
        self._own.place(self.q[k] + (self.q[k + 1] - self.q[k]) * share)
        return self._own.distance(pair)

    def contact_of(self, time: float, pair: int) -> Contact:
        """The contact of a pair at ``time``: one link touches the other."""
        return Contact(time, *self._own.links[pair])
