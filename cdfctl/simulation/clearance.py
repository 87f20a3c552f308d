"""Signed distances between a robot's collision geometry and obstacles, by coal: the referee's measure.

It shares no code with the distance fields: placements are Pinocchio's, distances coal's, on convex geometry and
primitives, the base links included. Depths in penetration are those of coal's EPA.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from cdfctl.robots.coal_geometry import bounding_ball, coal_shape, exact_request
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, PointCloud, Scene, Shape


class Nearest(NamedTuple):
    """The least signed distance (m) of a robot to the obstacles of a scene, and between which two."""

    distance: float
    link: str
    obstacle: str


class Closest(NamedTuple):
    """The pair of least signed distance (m): the robot's object, the obstacle's index, and their nearest points (3,).

    In penetration the points are those of deepest penetration; of a cloud in penetration, those of its first point
    found inside.
    """

    distance: float
    object: int
    obstacle: int
    on_robot: Array
    on_obstacle: Array


class Clearance:
    """Distances of all pairs (object of the robot's geometry, obstacle); pair p is (p // m, p % m).

    Attributes:
        objects: number of geometry objects of the robot, base included.
        obstacles: number of obstacles, m.
        robot_spheres: (objects, 4) centre in the object's frame and radius of a ball around it, m.
        reach: (m,) greatest distance of a point of the obstacle from its origin, m.
    """

    def __init__(self, robot: Robot, shapes: tuple[Shape, ...]) -> None:
        self.robot = robot
        self.objects, self.obstacles = len(robot.geometry.geometryObjects), len(shapes)
        self._clouds = {i: shape for i, shape in enumerate(shapes) if isinstance(shape, PointCloud)}
        self._geometry = pin.GeometryModel(robot.geometry)
        for i, shape in enumerate(shapes):
            solid = _cloud_tree(shape.points) if isinstance(shape, PointCloud) else coal_shape(shape)
            self._geometry.addGeometryObject(pin.GeometryObject(f"obstacle/{i}", 0, pin.SE3.Identity(), solid))
        for a in range(self.objects):
            for i in range(self.obstacles):
                self._geometry.addCollisionPair(pin.CollisionPair(a, self.objects + i))
        self._bodies = list(self._geometry.geometryObjects)
        self._data, self._placed = robot.model.createData(), pin.GeometryData(self._geometry)
        self._request = exact_request(coal.DistanceRequest())
        for request in self._placed.distanceRequests:
            exact_request(request)
        self.robot_spheres = np.array([bounding_ball(body.geometry) for body in self._bodies[: self.objects]])
        spheres = np.array([bounding_ball(body.geometry) for body in self._bodies[self.objects :]]).reshape(-1, 4)
        radius = np.array([shape.radius if isinstance(shape, PointCloud) else 0.0 for shape in shapes])
        self.reach: Array = np.linalg.norm(spheres[:, :3], axis=1) + spheres[:, 3] + radius

    def place(self, q: Array, poses: Array) -> None:
        """Move the robot to ``q`` (n,) and the obstacles to ``poses`` (m, 7)."""
        for body, pose in zip(self._bodies[self.objects :], poses, strict=True):
            body.placement = pin.XYZQUATToSE3(pose)
        pin.updateGeometryPlacements(self.robot.model, self._data, self._geometry, self._placed, q)

    def distance(self, pair: int) -> float:
        """Signed distance of one pair as placed, m."""
        return self._value(pair, pin.computeDistance(self._geometry, self._placed, pair))

    def distances(self) -> Array:
        """Signed distances (objects * m,) of all pairs as placed, m."""
        pin.computeDistances(self._geometry, self._placed)
        return np.array([self._value(pair, result) for pair, result in enumerate(self._placed.distanceResults)])

    def closest(self) -> Closest | None:
        """The least distance as placed, and where; None where there is no obstacle, or no geometry."""
        distances = self.distances()
        if not distances.size:
            return None
        pair = int(distances.argmin())
        result = self._placed.distanceResults[pair]
        a, b = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
        cloud = self._clouds.get(pair % self.obstacles)
        if cloud is not None and result.min_distance > 0.0:
            b = b + (a - b) * (cloud.radius / result.min_distance)
        return Closest(float(distances[pair]), pair // self.obstacles, pair % self.obstacles, a, b)

    def joint_frames(self) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) and origins (n, 3) of the joints as placed, world frame."""
        frames = np.array([frame.homogeneous for frame in self._data.oMi])[1:]
        return frames[:, :3, :3], frames[:, :3, 3]

    def robot_centres(self) -> Array:
        """Centres (objects, 3) of the balls around the robot's objects as placed, world frame."""
        frames = np.array([frame.homogeneous for frame in list(self._placed.oMg)[: self.objects]])
        centres: Array = np.einsum("gij,gj->gi", frames[:, :3, :3], self.robot_spheres[:, :3]) + frames[:, :3, 3]
        return centres

    def _value(self, pair: int, result: Any) -> float:
        cloud = self._clouds.get(pair % self.obstacles)
        d = float(result.min_distance)
        if d < 0.0:
            # Deep inside, coal's EPA may give up and say -1.8e308. The balls around two bodies come apart after a way
            # of both radii at most, so no depth is greater.
            d = max(d, -float(self.robot_spheres[pair // self.obstacles, 3] + self.reach[pair % self.obstacles]))
        if cloud is None:
            return d
        # coal's search over a tree stops at the first point inside, not at the deepest
        return (d if d > 0.0 else self._deepest(pair, cloud.points)) - cloud.radius

    def _deepest(self, pair: int, points: Array) -> float:
        """Least signed distance of an object to the points that may lie inside it."""
        index = pair // self.obstacles
        body, frame = self._bodies[index].geometry, self._placed.oMg[index]
        world = self._placed.oMg[self.objects + pair % self.obstacles]
        local = (points @ world.rotation.T + world.translation - frame.translation) @ frame.rotation
        centre, radius = self.robot_spheres[index, :3], self.robot_spheres[index, 3]
        near = local[np.linalg.norm(local - centre, axis=1) <= radius + 1e-9]
        point, here, result = coal.Sphere(0.0), coal.Transform3s.Identity(), coal.DistanceResult()
        least = 0.0
        for position in near:
            result.clear()
            there = coal.Transform3s(np.eye(3), position)
            least = min(least, float(coal.distance(body, here, point, there, self._request, result)))
        return least


def nearest(robot: Robot, q: Array, scene: Scene) -> Nearest | None:
    """The least signed distance of ``robot`` at ``q`` to the obstacles of ``scene``; None for an empty scene."""
    return min(nearest_each(robot, q, scene), key=lambda found: found.distance, default=None)


def nearest_each(robot: Robot, q: Array, scene: Scene) -> list[Nearest]:
    """The least signed distance of ``robot`` at ``q`` (n,) to each obstacle of ``scene``; empty where the robot has no
    geometry."""
    clearance = Clearance(robot, scene.shapes)
    if not len(scene) or not clearance.objects:
        return []
    clearance.place(np.asarray(q, dtype=np.float64), scene.poses)
    distances = clearance.distances().reshape(clearance.objects, len(scene))
    links = distances.argmin(axis=0)
    return [
        Nearest(float(distances[link, i]), robot.geometry_links[link], scene.names[i]) for i, link in enumerate(links)
    ]


def _cloud_tree(points: Array) -> Any:
    """coal's bounding volume tree over the points, each as a triangle without extent."""
    tree, vertices, triangles = coal.BVHModelOBBRSS(), coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for i, point in enumerate(points):
        vertices.append(point)
        triangles.append(coal.Triangle(i, i, i))
    tree.beginModel(len(points), len(points))
    tree.addSubModel(vertices, triangles)
    tree.endModel()
    return tree
