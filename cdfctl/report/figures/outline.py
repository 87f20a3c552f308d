"""Outlines in the plane z = constant, seen from above: of obstacles, and of the links of a planar arm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.robots.convex import convex_sets
from cdfctl.robots.robot import Robot, frame_index
from cdfctl.types import Array, PointCloud, Shape, Sphere

if TYPE_CHECKING:
    from matplotlib.patches import Patch

CORNERS = 64
THIN = 1e-6  # m: a link of no greater thickness is a line


class Skeleton:
    """Where the joints and the tip of a robot are."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._data = robot.model.createData()
        self._tip = frame_index(robot.model, robot.tip)

    def points(self, Q: Array) -> Array:
        """Origins of the n joints, then the tip, (k, n + 1, 2), in m, at the configurations ``Q`` (k, n)."""
        import pinocchio as pin

        points = np.empty((len(Q), self.robot.n + 1, 2))
        for row, q in zip(points, Q, strict=True):
            pin.framesForwardKinematics(self.robot.model, self._data, q)
            row[:-1] = [frame.translation[:2] for frame in list(self._data.oMi)[1:]]
            row[-1] = self._data.oMf[self._tip].translation[:2]
        return points

    def links(self, q: Array) -> Iterator[Array]:
        """Outlines (c, 2) of the convex pieces that are thicker than a line, m."""
        import pinocchio as pin

        pin.forwardKinematics(self.robot.model, self._data, q)
        for piece in self.robot.pieces:
            frame = self._data.oMi[piece.joint + 1]
            rotation = frame.rotation @ piece.rotation
            origin = frame.rotation @ piece.translation + frame.translation
            corners = outline(piece.vertices, piece.disc, piece.radius, rotation, origin)
            if _thickness(corners) > THIN:
                yield corners


def outline(vertices: Array, disc: float, radius: float, rotation: Array, origin: Array) -> Array:
    """The outline (c, 2) of ``conv(vertices) (+) disc (+) ball``, turned and moved, seen along z, m.

    It is the polygon through the support points in :data:`CORNERS` directions of the plane.
    """
    angle = np.arange(CORNERS) * (2.0 * np.pi / CORNERS)
    direction = np.stack([np.cos(angle), np.sin(angle), np.zeros(CORNERS)], axis=1)
    local = direction @ rotation
    support = vertices[np.argmax(local @ vertices.T, axis=1)]
    if disc > 0.0:
        across = local.copy()
        across[:, 2] = 0.0
        length = np.linalg.norm(across, axis=1, keepdims=True)
        support = support + disc * np.divide(across, length, out=np.zeros_like(across), where=length > 1e-12)
    corners: Array = (support @ rotation.T + origin + radius * direction)[:, :2]
    return corners


def patches(shape: Shape, pose: Array, **style: Any) -> list[Patch]:
    """What is to be drawn for an obstacle at ``pose`` (7,): discs for balls, polygons for the rest."""
    from matplotlib.patches import Circle, Polygon

    rotation, origin = rotation_of(pose[3:]), pose[:3]
    if isinstance(shape, Sphere):
        return [Circle((origin[0], origin[1]), shape.radius, **style)]
    if isinstance(shape, PointCloud):
        centres = shape.points @ rotation.T + origin
        return [Circle((x, y), max(shape.radius, 0.01), **style) for x, y, _ in centres]
    return [
        Polygon(outline(part.vertices, part.disc, part.radius, rotation, origin), closed=True, **style)
        for part in convex_sets(shape)
    ]


def radius_of(shape: Shape) -> float:
    """Greatest distance (m) of a point of the shape from its origin."""
    return max(float(np.linalg.norm(p.vertices, axis=1).max()) + p.disc + p.radius for p in convex_sets(shape))


def rotation_of(quaternion: Array) -> Array:
    """The matrix (3, 3) of a unit quaternion x y z w."""
    import pinocchio as pin

    matrix: Array = pin.Quaternion(np.asarray(quaternion, dtype=np.float64)).toRotationMatrix()
    return matrix


def _thickness(corners: Array) -> float:
    """Least width (m) of a convex polygon."""
    centred = corners - corners.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][1]
    return float(np.ptp(centred @ axis))
