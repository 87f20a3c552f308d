"""The obstacles: convex parts with poses and twists, and how their points move in time."""

from __future__ import annotations

from math import isfinite
from operator import is_

import numpy as np

from cdfctl.errors import InputError
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.sets import ConvexSets, Records, pack
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Rot, Vec, add, cross, dot, rot, store_rot, sub, vec
from cdfctl.robots.convex import ConvexSet, convex_sets
from cdfctl.types import Array, IntArray, Scene, Shape

BLOCK_SIZE = 16  # most parts in a block
SHORTEST, LONGEST = 0.5, 2.0  # lengths of what passes for a unit quaternion; of zero no rotation can be made

_BLOCK = np.dtype(
    [
        ("first", np.int64),  # the parts of the block are first … last - 1
        ("last", np.int64),
        ("reach", np.float64),  # of a ball that holds the cores of the parts, m
        ("radius", np.float64),  # greatest of the parts' radii, m
        ("centre", np.float64, 3),  # of that ball, in the frame of the obstacle
    ],
    align=True,
)
BLOCK = np.dtype((np.record, _BLOCK))
"""Some parts of one obstacle that lie together."""


class Parts(Struct):
    """m obstacles of p convex parts. Only the poses and twists change from step to step.

    Attributes:
        sets: the p parts, in the frame of their obstacle.
        obstacle: (p,) the obstacle a part belongs to.
        first: (m+1,) the parts of obstacle o are first[o] … first[o+1] - 1.
        block: (B,) of :data:`BLOCK`: neighbouring parts, so that far ones are left out together.
        first_block: (m+1,) the blocks of obstacle o are first_block[o] … first_block[o+1] - 1.
        pose: (m, 7) of the obstacles in the world: origin (m), quaternion x y z w.
        rotation: (m, 3, 3) the matrix of that quaternion.
        twist: (m, 6) velocity of the origin (m/s), angular velocity (rad/s), world axes.
    """

    sets: ConvexSets
    obstacle: IntArray
    first: IntArray
    block: Records
    first_block: IntArray
    pose: Array
    rotation: Array
    twist: Array


class SceneParts:
    """The parts of the latest scene. Shapes are converted again only when the scene has others."""

    def __init__(self) -> None:
        self._shapes: tuple[Shape, ...] = ()
        self._parts: Parts | None = None

    def of(self, scene: Scene) -> Parts:
        """The arrays of ``scene``; they are overwritten by the next call.

        Raises:
            InputError: a number of the scene is not finite, or an orientation is none.
        """
        if self._parts is None or not _same(scene.shapes, self._shapes):
            self._parts = parts_of(scene.shapes)
        self._shapes = scene.shapes
        parts = self._parts
        parts.pose[:], parts.twist[:] = scene.poses, scene.twists
        turn_obstacles(parts.pose, parts.rotation)
        if not (all_finite(parts.pose) and all_finite(parts.twist)):
            raise InputError("the poses and twists of the obstacles must be finite")
        wrong = first_not_turned(parts.pose)
        if wrong >= 0:
            raise InputError(f"the orientation of obstacle '{scene.names[wrong]}' is no unit quaternion")
        return parts


def _same(shapes: tuple[Shape, ...], others: tuple[Shape, ...]) -> bool:
    """Whether these are the same shapes, each the very object: a mesh is not compared vertex by vertex."""
    return shapes is others or (len(shapes) == len(others) and all(map(is_, shapes, others)))


def parts_of(shapes: tuple[Shape, ...]) -> Parts:
    """The arrays of ``shapes``, all at the origin and at rest. A shape's parts may come in another order."""
    groups_of_shape = [_groups(list(convex_sets(shape))) for shape in shapes]
    groups = [group for groups in groups_of_shape for group in groups]
    sets = pack([part for group in groups for part in group])
    parts_in_shape = np.array([sum(map(len, groups)) for groups in groups_of_shape], dtype=np.int64)
    blocks_in_shape = np.array([len(groups) for groups in groups_of_shape], dtype=np.int64)
    m = len(shapes)
    return Parts(
        sets=sets,
        obstacle=np.repeat(np.arange(m, dtype=np.int64), parts_in_shape),
        first=_starts(parts_in_shape),
        block=_bound_blocks(sets.info, _starts(np.array([len(group) for group in groups], dtype=np.int64))),
        first_block=_starts(blocks_in_shape),
        pose=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (m, 1)),
        rotation=np.tile(np.eye(3), (m, 1, 1)),
        twist=np.zeros((m, 6)),
    )


def _groups(parts: list[ConvexSet]) -> list[list[ConvexSet]]:
    """Halved across the longest side, again and again, until no group has more than ``BLOCK_SIZE`` parts."""
    if len(parts) <= BLOCK_SIZE:
        return [parts]
    middles = np.array([part.vertices.mean(axis=0) for part in parts])
    order = np.argsort(middles[:, np.argmax(np.ptp(middles, axis=0))], kind="stable")
    half = len(parts) // 2
    return _groups([parts[i] for i in order[:half]]) + _groups([parts[i] for i in order[half:]])


def _starts(counts: IntArray) -> IntArray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _bound_blocks(info: Records, starts: IntArray) -> Records:
    block = np.zeros(len(starts) - 1, dtype=BLOCK)
    for record, first, last in zip(block, starts[:-1], starts[1:], strict=True):
        part = info[first:last]
        centre = part["centre"].mean(axis=0)
        record["first"], record["last"], record["centre"] = first, last, centre
        record["reach"] = (np.linalg.norm(part["centre"] - centre, axis=1) + part["reach"]).max()
        record["radius"] = part["radius"].max()
    return block


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
def first_not_turned(pose: Array) -> int:
    """The first of ``pose`` (m, 7) whose quaternion is nowhere near a unit one, -1 where there is none."""
    for o in range(pose.shape[0]):
        length2 = pose[o, 3] ** 2 + pose[o, 4] ** 2 + pose[o, 5] ** 2 + pose[o, 6] ** 2
        if not SHORTEST * SHORTEST < length2 < LONGEST * LONGEST:
            return o
    return -1


@njit
def all_finite(numbers: Array) -> bool:
    """Whether no number of a (k, l) array is infinite or NaN."""
    for i in range(numbers.shape[0]):
        for j in range(numbers.shape[1]):
            if not isfinite(numbers[i, j]):
                return False
    return True


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
