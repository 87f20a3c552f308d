"""The signed distances of a robot to itself: the nearest pairs of its own bodies, and how they change.

For bodies A and B with witness points a on A, b on B and the unit normal ν from A to B, b = a + d ν,

    ∂d/∂q_j = s_j [ν; a × ν]ᵀ J_j

with J_j = [v_j; ω_j] the joint's column of the spatial Jacobian at the world's origin, and s_j = +1 if j moves B alone,
-1 if A alone, 0 if both or neither. a × ν = b × ν, since both points lie on one line along ν: so one product serves
both bodies. In penetration d < 0, and ν is still the direction in which B leaves A soonest. ∂d/∂t = 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cdfctl.robots.coal_geometry import bounding_ball, exact_request
from cdfctl.robots.robot import Robot
from cdfctl.robots.self_pairs import pair_geometry, self_pairs
from cdfctl.types import Array, SelfQuery

STILL = 1e-9  # a gradient shorter than this, m/rad, means that no joint can change the distance


class SelfDistance:
    """The nearest ``most`` pairs of ``robot``'s own bodies. It keeps workspaces: one instance a thread.

    Attributes:
        pairs: (p, 2) indices into ``robot.geometry.geometryObjects`` of all pairs that are looked at.
        links: (p,) their two links by name.
    """

    def __init__(self, robot: Robot, most: int, margin: float) -> None:
        """``margin`` (m): the least distance asked for; pairs proved to stay farther apart are not looked at."""
        import coal
        import pinocchio as pin

        checked = self_pairs(robot).within(margin)
        self.robot, self.most = robot, min(most, len(checked))
        self.pairs = np.array(checked, dtype=np.int64).reshape(-1, 2)
        self.links = tuple((robot.geometry_links[i], robot.geometry_links[j]) for i, j in checked)
        self._checked, self._pin, self._coal, self._data = checked, pin, coal, robot.model.createData()
        self._request = exact_request(coal.DistanceRequest())
        self.reset()
        objects = list(robot.geometry.geometryObjects)
        moves = np.zeros((len(objects), robot.n))
        for i, body in enumerate(objects):
            if body.parentJoint > 0:
                moves[i] = robot.chain.moves[:, body.parentJoint - 1]
        self._sign = moves[self.pairs[:, 1]] - moves[self.pairs[:, 0]]
        # No depth is greater than both radii; where coal's EPA gives up it says -1.8e308, and no row can be made.
        radii = np.array([bounding_ball(body.geometry)[3] for body in objects])
        self._deepest = -radii[self.pairs].sum(axis=1)
        self._distances, self._wrench = np.zeros(len(checked)), np.zeros((self.most, 6))

    def query(self, q: Array) -> SelfQuery:
        """The nearest pairs at the configuration ``q`` (n,), finite; nearest first."""
        pin, model = self._pin, self.robot.model
        distances, results = self._distances, self._results.copy()
        pin.computeJointJacobians(model, self._data, q)
        pin.updateGeometryPlacements(model, self._data, self._geometry, self._placed)
        pin.computeDistances(self._geometry, self._placed)
        for p, result in enumerate(results):
            distances[p] = result.min_distance
            if distances[p] < 0.0:
                results[p] = self._depth(p)
                distances[p] = results[p].min_distance
        nearest = np.argsort(distances, kind="stable")[: self.most]
        wrench = self._wrench
        for row, p in enumerate(nearest):
            result = results[p]
            if distances[p] < self._deepest[p]:
                wrench[row] = 0.0
                continue
            normal, point = result.normal, result.getNearestPoint1()
            wrench[row, :3] = normal
            wrench[row, 3] = point[1] * normal[2] - point[2] * normal[1]
            wrench[row, 4] = point[2] * normal[0] - point[0] * normal[2]
            wrench[row, 5] = point[0] * normal[1] - point[1] * normal[0]
        d = np.maximum(distances[nearest], self._deepest[nearest])
        dq = (wrench @ self._data.J) * self._sign[nearest]
        lengths = np.sqrt(np.einsum("ij,ij->i", dq, dq))
        return SelfQuery(pair=nearest, d=d, dq=dq, valid=lengths >= STILL)  # NaN is not

    def reset(self) -> None:
        """Forget earlier queries: coal starts its search where the last one ended."""
        self._geometry, self._placed = pair_geometry(self.robot, self._checked)
        # views: pinocchio fills them anew at every call
        self._results: list[Any] = list(self._placed.distanceResults)

    def _depth(self, p: int) -> Any:
        """coal's result for a pair in penetration. Asked afresh: a solver that has been used before may be wrong by
        centimetres there, for cylinders."""
        result = self._coal.DistanceResult()
        i, j = self._checked[p]
        first, second = (self._geometry.geometryObjects[k].geometry for k in (i, j))
        here, there = (
            self._coal.Transform3s(frame.rotation, frame.translation)
            for frame in (self._placed.oMg[i], self._placed.oMg[j])
        )
        self._coal.distance(first, here, second, there, self._request, result)
        return result
