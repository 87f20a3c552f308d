"""Where the contact search starts: q itself, swings of one joint, samples, remembered contacts, a table.

Samples are configurations spread over the limits, with the pieces' placements at each: a bound of the gap tells at once
which of them are near an obstacle.

A table holds contact configurations for a ball at every point of a grid over the workspace, as starts only: what the
search returns is refined on the real shapes. Every start is moved by whole turns of each revolute joint to come as near
to q as the limits allow, and joints that do not move the touching piece are taken from q.
"""

from __future__ import annotations

from math import atan2, floor, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from cdfctl.fields.kernel.body import Body, Frames, forward, new_frames, piece_pose
from cdfctl.fields.kernel.distance import gap_to_ball
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import copy, distance2
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import (
    Vec,
    add,
    along,
    cross,
    dot,
    norm,
    rot,
    rotate,
    rotate_back,
    store,
    store_rot,
    sub,
    vec,
    vec3,
)
from cdfctl.types import Array, IntArray

SAMPLED_PIECES = 1200  # samples times pieces: about 30 µs to go through
SPACING = 0.3  # rad between starts of one piece
REACH = 0.5  # m/rad: how fast a piece moves, to weigh a gap in metres against an angle; only ranks starts


class Table(Struct):
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


class Samples(Struct):
    """s configurations spread over the limits and where the k pieces are there.

    Attributes:
        q: (s, n).
        rotation, translation: (s, k, 3, 3), (s, k, 3) the pieces' frames in the world.
    """

    q: Array
    rotation: Array
    translation: Array


def spread_samples(body: Body) -> Samples:
    """Samples on a Halton sequence; an infinite limit spreads over one turn, or one metre either way."""
    n, k = len(body.chain.parent), len(body.joint)
    half = np.where(body.chain.prismatic, 1.0, pi)
    lower = np.where(np.isfinite(body.chain.lower), body.chain.lower, -half)
    upper = np.where(np.isfinite(body.chain.upper), body.chain.upper, half)
    s = -(-SAMPLED_PIECES // max(k, 1))
    q = np.ascontiguousarray(lower + halton(s, n) * (upper - lower))
    samples = Samples(q, np.zeros((s, k, 3, 3)), np.zeros((s, k, 3)))
    place_samples(body, samples, new_frames(body))
    return samples


def halton(count: int, n: int) -> Array:
    """The first points (count, n) of the Halton sequence in the unit cube: coordinate j of point i is the digits of i
    to the base of the j-th prime, mirrored at the point.

    SciPy has it too, but importing ``scipy.stats`` takes a quarter of the time to a first answer.
    """
    points, base = np.zeros((count, n)), 1
    for j in range(n):
        base += 1
        while any(base % divisor == 0 for divisor in range(2, base)):
            base += 1
        left, digit = np.arange(count), 1.0
        while left.any():
            digit /= base
            points[:, j] += digit * (left % base)
            left //= base
    return points


@njit
def place_samples(body: Body, samples: Samples, frames: Frames) -> None:
    """Fill in where the pieces are at every sample."""
    for i in range(samples.q.shape[0]):
        forward(body, samples.q[i], frames, 0)
        for k in range(body.joint.shape[0]):
            r, t = piece_pose(body, frames, 0, k)
            store_rot(samples.rotation[i], k, r)
            store(samples.translation[i], k, t)


@njit
def sample_starts(body: Body, q: Array, p: Vec, size: float, samples: Samples, starts: Starts) -> int:
    """The samples nearest to q and to contact with a ball of radius ``size`` around ``p``; how many there are."""
    chain = body.chain
    count = 0
    for i in range(samples.q.shape[0]):
        for j in range(q.shape[0]):
            starts.turned[j] = _turned(body, samples.q[i, j], j, q)
            moved2 = (starts.turned[j] - q[j]) ** 2
            starts.moved2[j] = moved2 + starts.moved2[chain.parent[j]] if chain.parent[j] >= 0 else moved2
        for k in range(body.joint.shape[0]):
            cost = sqrt(starts.moved2[body.joint[k]])
            if not wanted(starts, count, cost):
                continue  # most end here, before the pieces' placements, a megabyte of them, are read
            here = rotate_back(rot(samples.rotation[i], k), sub(p, vec(samples.translation[i], k)))
            cost += max(0.0, gap_to_ball(body, k, here, size, 0.0)) / REACH
            if wanted(starts, count, cost):
                for j in range(q.shape[0]):
                    starts.offer[j] = starts.turned[j] if chain.moves[j, body.joint[k]] else q[j]
                count = keep_offer(starts, count, k, cost)
    return count


class Starts(Struct):
    """Workspace: the best starts found so far: ``piece`` (s,), ``x`` (s, n), ``cost`` (s,), least first; ``offer`` (n,)
    is the one to be kept or not, ``turned`` (n,) a configuration by whole turns as near to q as can be, ``moved2`` (n,)
    the squared distance of the two over a joint and those that carry it."""

    piece: IntArray
    x: Array
    cost: Array
    offer: Array
    turned: Array
    moved2: Array


def new_starts(s: int, n: int) -> Starts:
    """Places for ``s`` starts."""
    return Starts(np.zeros(s, dtype=np.int64), np.zeros((s, n)), np.zeros(s), np.zeros(n), np.zeros(n), np.zeros(n))


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
def wanted(starts: Starts, count: int, cost: float) -> bool:
    """Whether a start of this cost may be kept beside the ``count`` kept so far."""
    size: int = starts.cost.shape[0]
    return count < size or cost < starts.cost[size - 1]


@njit
def keep_offer(starts: Starts, count: int, piece: int, cost: float) -> int:
    """Keep ``starts.offer`` among the ``count`` kept so far; how many there are then.

    Of starts of one piece within :data:`SPACING` of each other only the cheapest stays.
    """
    place = min(count, starts.cost.shape[0] - 1)  # the one that gives way
    for i in range(count):
        if starts.piece[i] == piece and distance2(starts.x[i], starts.offer) < SPACING * SPACING:
            if starts.cost[i] <= cost:
                return count
            place = i
            break
    grown: int = max(count, place + 1)
    while place > 0 and starts.cost[place - 1] > cost:
        starts.cost[place], starts.piece[place] = starts.cost[place - 1], starts.piece[place - 1]
        copy(starts.x[place - 1], starts.x[place])
        place -= 1
    starts.cost[place], starts.piece[place] = cost, piece
    copy(starts.offer, starts.x[place])
    return grown


@njit
def swing_starts(body: Body, q: Array, frames: Frames, place: int, p: Vec, size: float, starts: Starts) -> int:
    """Turns of one joint that bring the middle of a piece up to a ball of radius ``size`` around ``p``; how many.

    A turn of joint j carries the middle c of a piece around the joint's axis; it is nearest to p where both lie in one
    half-plane through the axis, and meets the ball a little before. The joints at q are at
    ``place`` of ``frames``.
    """
    chain = body.chain
    count = 0
    for k in range(body.joint.shape[0]):
        r, t = piece_pose(body, frames, place, k)
        c = add(rotate(r, vec3(body.sets.info[k].centre)), t)
        for j in range(q.shape[0]):
            if not chain.moves[j, body.joint[k]] or chain.prismatic[j]:
                continue
            z, o = vec(frames.axis[place], j), vec(frames.translation[place], j)
            from_c, from_p = sub(c, o), sub(p, o)
            height_c, height_p = dot(z, from_c), dot(z, from_p)
            across_c, across_p = along(from_c, -height_c, z), along(from_p, -height_p, z)
            radius_c, radius_p = norm(across_c), norm(across_p)
            if radius_c < 0.02 or radius_p < 0.02:
                continue
            whole = atan2(dot(z, cross(across_c, across_p)), dot(across_c, across_p))
            before = min(abs(whole), size / radius_p)
            turn = whole - before if whole > 0.0 else whole + before
            x_j = nearest_turn(q[j] + turn, q[j], chain.lower[j], chain.upper[j])
            short = x_j - q[j] - turn  # of the turn, but for whole ones
            missing = abs(short - 2.0 * pi * floor(short / (2.0 * pi) + 0.5)) * radius_c
            gap = sqrt((radius_c - radius_p) ** 2 + (height_c - height_p) ** 2) + missing
            cost = abs(x_j - q[j]) + gap / REACH
            if wanted(starts, count, cost):
                copy(q, starts.offer)
                starts.offer[j] = x_j
                count = keep_offer(starts, count, k, cost)
    return count


@njit
def table_starts(body: Body, q: Array, table: Table, p: Vec, starts: Starts) -> int:
    """The entries of the grid point nearest to ``p`` that are nearest to q; how many starts there are.

    Where that point has none, at the rim of the reach, those of the points around it.
    """
    if table.piece.shape[0] == 0:
        return 0
    x = floor((p[0] - table.origin[0]) / table.spacing + 0.5)
    y = floor((p[1] - table.origin[1]) / table.spacing + 0.5)
    z = floor((p[2] - table.origin[2]) / table.spacing + 0.5)
    count = _point_starts(body, q, table, x, y, z, starts, 0)
    if count == 0:
        for i in range(x - 1, x + 2):
            for j in range(y - 1, y + 2):
                for k in range(z - 1, z + 2):
                    count = _point_starts(body, q, table, i, j, k, starts, count)
    return count


@njit
def _point_starts(body: Body, q: Array, table: Table, x: int, y: int, z: int, starts: Starts, count: int) -> int:
    """The entries of one grid point, beside the ``count`` starts there are; how many then."""
    if not (0 <= x < table.shape[0] and 0 <= y < table.shape[1] and 0 <= z < table.shape[2]):
        return count
    index = (x * table.shape[1] + y) * table.shape[2] + z
    chain = body.chain
    n = q.shape[0]
    for e in range(table.first[index], table.first[index + 1]):
        joint = body.joint[table.piece[e]]
        moved2 = 0.0
        for j in range(n):
            if chain.moves[j, joint]:
                moved2 += (_turned(body, table.q[e, j], j, q) - q[j]) ** 2
        if wanted(starts, count, sqrt(moved2)):
            for j in range(n):
                starts.offer[j] = _turned(body, table.q[e, j], j, q) if chain.moves[j, joint] else q[j]
            count = keep_offer(starts, count, table.piece[e], sqrt(moved2))
    return count


@njit
def _turned(body: Body, value: float, j: int, q: Array) -> float:
    """``value`` of joint j moved by whole turns to come near to q, within the limits."""
    chain = body.chain
    lower: float = chain.lower[j]
    upper: float = chain.upper[j]
    if chain.prismatic[j]:
        return min(max(value, lower), upper)
    if upper - lower < 2.0 * pi and lower <= value <= upper:
        return value  # the limits leave room for no other turn of it
    return nearest_turn(value, q[j], lower, upper)
