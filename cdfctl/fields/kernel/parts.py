"""The obstacles: convex parts with poses and twists, and how their points move in time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.sets import ConvexSets, pack
from cdfctl.fields.kernel.vec import Rot, Vec, add, cross, dot, rot, sub, vec
from cdfctl.robots.convex import ConvexSet, convex_sets
from cdfctl.types import Array, IntArray, Scene, Shape


class Parts(NamedTuple):
    """m obstacles of p convex parts. Only poses and twists change from step to step.

    Attributes:
        sets: the p parts, in the frame of their obstacle.
        obstacle: (p,) the obstacle a part belongs to.
        first: (m+1,) the parts of obstacle o are first[o] … first[o+1] - 1.
        rotation: (m, 3, 3) and
        origin: (m, 3) m, the obstacle's frame in the world.
        velocity: (m, 3) m/s, of that origin.
        angular: (m, 3) rad/s, world axes.
    """

    sets: ConvexSets
    obstacle: IntArray
    first: IntArray
    rotation: Array
    origin: Array
    velocity: Array
    angular: Array


class SceneParts:
    """The parts of the latest scene. Shapes are converted again only when the scene has another ``shapes`` tuple."""

    def __init__(self) -> None:
        self._shapes: tuple[Shape, ...] | None = None
        self._parts: Parts | None = None

    def of(self, scene: Scene) -> Parts:
        """The arrays of ``scene``; they are overwritten by the next call."""
        if self._parts is None or scene.shapes is not self._shapes:
            self._parts, self._shapes = parts_of(scene.shapes), scene.shapes
        parts = self._parts
        parts.origin[:] = scene.poses[:, :3]
        parts.velocity[:] = scene.twists[:, :3]
        parts.angular[:] = scene.twists[:, 3:]
        x, y, z, w = scene.poses[:, 3:].T
        r = parts.rotation
        r[:, 0, 0], r[:, 0, 1], r[:, 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
        r[:, 1, 0], r[:, 1, 1], r[:, 1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
        r[:, 2, 0], r[:, 2, 1], r[:, 2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
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
        rotation=np.tile(np.eye(3), (m, 1, 1)),
        origin=np.zeros((m, 3)),
        velocity=np.zeros((m, 3)),
        angular=np.zeros((m, 3)),
    )


@njit
def obstacle_pose(parts: Parts, o: int) -> tuple[Rot, Vec]:
    """Rotation and translation of obstacle o in the world."""
    return rot(parts.rotation, o), vec(parts.origin, o)


@njit
def time_derivative(parts: Parts, o: int, b: Vec, normal: Vec) -> float:
    """∂d/∂t = νᵀ (v + ω × (b - origin)) for a witness ``b`` (world) on obstacle o; ν is ``normal``."""
    v = add(vec(parts.velocity, o), cross(vec(parts.angular, o), sub(b, vec(parts.origin, o))))
    return dot(normal, v)
