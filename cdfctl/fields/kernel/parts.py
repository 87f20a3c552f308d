"""The obstacles: convex parts with poses and twists, and how their points move in time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdfctl.errors import InputError
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.sets import ConvexSets, pack
from cdfctl.fields.kernel.vec import Rot, Vec, add, cross, dot, rot, store_rot, sub, vec
from cdfctl.robots.convex import ConvexSet, convex_sets
from cdfctl.types import Array, IntArray, Scene, Shape


class Parts(NamedTuple):
    """m obstacles of p convex parts. Only the poses and twists change from step to step.

    Attributes:
        sets: the p parts, in the frame of their obstacle.
        obstacle: (p,) the obstacle a part belongs to.
        first: (m+1,) the parts of obstacle o are first[o] … first[o+1] - 1.
        pose: (m, 7) of the obstacles in the world: origin (m), quaternion x y z w.
        rotation: (m, 3, 3) the matrix of that quaternion.
        twist: (m, 6) velocity of the origin (m/s), angular velocity (rad/s), world axes.
    """

    sets: ConvexSets
    obstacle: IntArray
    first: IntArray
    pose: Array
    rotation: Array
    twist: Array


class SceneParts:
    """The parts of the latest scene. Shapes are converted again only when the scene has another ``shapes`` tuple."""

    def __init__(self) -> None:
        self._shapes: tuple[Shape, ...] | None = None
        self._parts: Parts | None = None

    def of(self, scene: Scene) -> Parts:
        """The arrays of ``scene``; they are overwritten by the next call.

        Raises:
            InputError: a number of the scene is not finite.
        """
        if self._parts is None or scene.shapes is not self._shapes:
            self._parts, self._shapes = parts_of(scene.shapes), scene.shapes
        parts = self._parts
        parts.pose[:], parts.twist[:] = scene.poses, scene.twists
        if not (np.isfinite(parts.pose).all() and np.isfinite(parts.twist).all()):
            raise InputError("the poses and twists of the obstacles must be finite")
        turn_obstacles(parts.pose, parts.rotation)
        return parts


def parts_of(shapes: tuple[Shape, ...]) -> Parts:
    """The arrays of ``shapes``, all at the origin and at rest."""
    of_shape = [convex_sets(shape) for shape in shapes]
    sets: list[ConvexSet] = [part for parts in of_shape for part in parts]
    counts = np.array([len(parts) for parts in of_shape], dtype=np.int64)
    m = len(shapes)
    return Parts(
        sets=pack(sets),
        obstacle=np.repeat(np.arange(m, dtype=np.int64), counts),
        first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        pose=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (m, 1)),
        rotation=np.tile(np.eye(3), (m, 1, 1)),
        twist=np.zeros((m, 6)),
    )


@njit
def turn_obstacles(pose: Array, rotation: Array) -> None:
    """The rotation matrices (m, 3, 3) of the quaternions of ``pose`` (m, 7)."""
    for o in range(pose.shape[0]):
        x, y, z, w = pose[o, 3], pose[o, 4], pose[o, 5], pose[o, 6]
        s = 2.0 / (x * x + y * y + z * z + w * w)
        r = (
            (1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
            (s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)),
            (s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)),
        )
        store_rot(rotation, o, r)


@njit
def obstacle_pose(parts: Parts, o: int) -> tuple[Rot, Vec]:
    """Rotation and translation of obstacle o in the world."""
    return rot(parts.rotation, o), vec(parts.pose, o)


@njit
def time_derivative(parts: Parts, o: int, b: Vec, normal: Vec) -> float:
    """∂d/∂t = νᵀ (v + ω × (b - origin)) for a witness ``b`` (world) on obstacle o; ν is ``normal``."""
    origin, v = vec(parts.pose, o), vec(parts.twist, o)
    angular = (parts.twist[o, 3], parts.twist[o, 4], parts.twist[o, 5])
    return dot(normal, add(v, cross(angular, sub(b, origin))))
