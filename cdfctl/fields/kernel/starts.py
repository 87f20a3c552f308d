"""Where the contact search starts: the configuration itself, swings of one joint, remembered contacts, a table.

A table holds contact configurations for a ball at every point of a grid over the workspace, as starts only: what the
search returns is refined on the real shapes. Every start is moved by whole turns of each revolute joint to come as near
to q as the limits allow, and joints that do not move the touching piece are taken from q.
"""

from __future__ import annotations

from math import atan2, floor, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdfctl.fields.kernel.body import Body, Frames, piece_pose
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.projection import copy
from cdfctl.fields.kernel.vec import Vec, add, along, cross, dot, norm, rotate, sub, vec, vec3
from cdfctl.types import Array, IntArray

REACH = 0.5  # m/rad: how fast a piece moves, to weigh a gap in metres against an angle; only ranks starts


class Table(NamedTuple):
    """Contact configurations on a grid of points; empty without a table.

    Attributes:
        origin: (3,) m, the first grid point.
        spacing: m.
        shape: (3,) number of points along x, y, z.
        first: (points+1,) the entries of point i are first[i] … first[i+1] - 1, x slowest.
        piece: (e,) the piece that touches.
        q: (e, n) the contact configuration.
    """

    origin: Array
    spacing: float
    shape: IntArray
    first: IntArray
    piece: NDArray[np.int16]
    q: NDArray[np.float32]


def empty_table(n: int) -> Table:
    """A table without entries."""
    return Table(
        np.zeros(3),
        1.0,
        np.zeros(3, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
        np.zeros(0, dtype=np.int16),
        np.zeros((0, n), dtype=np.float32),
    )


class Starts(NamedTuple):
    """Workspace: the best starts found so far: ``piece`` (s,), ``x`` (s, n), ``cost`` (s,), least first."""

    piece: IntArray
    x: Array
    cost: Array


def new_starts(s: int, n: int) -> Starts:
    """Places for ``s`` starts."""
    return Starts(np.zeros(s, dtype=np.int64), np.zeros((s, n)), np.zeros(s))


@njit
def nearest_turn(value: float, target: float, lower: float, upper: float) -> float:
    """``value`` plus whole turns, as near to ``target`` as the limits allow; clipped where none is inside."""
    turned = value + 2.0 * pi * floor((target - value) / (2.0 * pi) + 0.5)
    if turned > upper:
        turned -= 2.0 * pi
    elif turned < lower:
        turned += 2.0 * pi
    return min(max(turned, lower), upper)


@njit
def keep_start(starts: Starts, count: int, cost: float) -> int:
    """The place for a start of this cost among the ``count`` kept so far, others moved down; -1 if it is not kept."""
    size: int = starts.cost.shape[0]
    if count == size and not cost < starts.cost[size - 1]:
        return -1
    place = min(count, size - 1)
    while place > 0 and starts.cost[place - 1] > cost:
        starts.cost[place], starts.piece[place] = starts.cost[place - 1], starts.piece[place - 1]
        copy(starts.x[place - 1], starts.x[place])
        place -= 1
    starts.cost[place] = cost
    return place


@njit
def swing_starts(body: Body, q: Array, frames: Frames, p: Vec, starts: Starts) -> int:
    """Turns of one joint that bring the middle of a piece nearest to the point ``p``; how many starts there are.

    A turn of joint j carries the middle c of a piece around the joint's axis; it is nearest to p where both lie in one
    half-plane through the axis. All joints must have been placed at q.
    """
    chain = body.chain
    count = 0
    for k in range(body.joint.shape[0]):
        r, t = piece_pose(body, frames, k)
        c = add(rotate(r, vec3(body.sets.info[k].centre)), t)
        for j in range(q.shape[0]):
            if not chain.moves[j, body.joint[k]] or chain.prismatic[j]:
                continue
            z, o = vec(frames.axis, j), vec(frames.translation, j)
            from_c, from_p = sub(c, o), sub(p, o)
            height_c, height_p = dot(z, from_c), dot(z, from_p)
            across_c, across_p = along(from_c, -height_c, z), along(from_p, -height_p, z)
            radius_c, radius_p = norm(across_c), norm(across_p)
            if radius_c < 0.02 or radius_p < 0.02:
                continue
            turn = atan2(dot(z, cross(across_c, across_p)), dot(across_c, across_p))
            x_j = nearest_turn(q[j] + turn, q[j], chain.lower[j], chain.upper[j])
            missing = abs(x_j - q[j] - turn) * radius_c
            gap = sqrt((radius_c - radius_p) ** 2 + (height_c - height_p) ** 2) + missing
            place = keep_start(starts, count, abs(x_j - q[j]) + gap / REACH)
            if place >= 0:
                count = min(count + 1, starts.cost.shape[0])
                starts.piece[place] = k
                copy(q, starts.x[place])
                starts.x[place, j] = x_j
    return count


@njit
def table_starts(body: Body, q: Array, table: Table, p: Vec, starts: Starts) -> int:
    """The entries of the grid point nearest to ``p`` that are nearest to q; how many starts there are."""
    count = 0
    if table.piece.shape[0] == 0:
        return count
    index = 0
    for axis in range(3):
        i = floor((p[axis] - table.origin[axis]) / table.spacing + 0.5)
        if i < -1 or i > table.shape[axis]:
            return count  # out of reach, but for the rim
        index = index * table.shape[axis] + min(max(i, 0), table.shape[axis] - 1)
    chain = body.chain
    n = q.shape[0]
    for e in range(table.first[index], table.first[index + 1]):
        joint = body.joint[table.piece[e]]
        distance2 = 0.0
        for j in range(n):
            if chain.moves[j, joint]:
                distance2 += (_turned(body, table, e, j, q) - q[j]) ** 2
        place = keep_start(starts, count, sqrt(distance2))
        if place >= 0:
            count = min(count + 1, starts.cost.shape[0])
            starts.piece[place] = table.piece[e]
            for j in range(n):
                starts.x[place, j] = _turned(body, table, e, j, q) if chain.moves[j, joint] else q[j]
    return count


@njit
def _turned(body: Body, table: Table, e: int, j: int, q: Array) -> float:
    chain = body.chain
    value: float = table.q[e, j]
    lower: float = chain.lower[j]
    upper: float = chain.upper[j]
    if chain.prismatic[j]:
        return min(max(value, lower), upper)
    return nearest_turn(value, q[j], lower, upper)
