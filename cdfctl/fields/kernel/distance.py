"""Signed distance of two convex sets with radii: GJK where their cores are apart, EPA where they overlap.

    d = |core distance| - r_a - r_b        cores apart
    d = -depth - r_a - r_b                 cores overlapping

with the witness points a on the surface of A and b on that of B, and the unit normal from A to B. In every case
b - a = d normal, and d grows by e when B moves by e along the normal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.body import Body, Frames, piece_pose
from cdfctl.fields.kernel.epa import Polytope, core_depth, new_polytope
from cdfctl.fields.kernel.gjk import Simplex, core_distance, new_simplex
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts, obstacle_pose
from cdfctl.fields.kernel.sets import ConvexSets, pack
from cdfctl.fields.kernel.structs import Struct, compiled
from cdfctl.fields.kernel.vec import (
    ZERO,
    Rot,
    Vec,
    add,
    along,
    compose,
    dot,
    norm,
    rotate,
    rotate_back,
    scale,
    sub,
    transpose,
    vec3,
)
from cdfctl.types import Array, IntArray


class Carrier(Struct):
    """The corners of two cores that carry their nearest points: ``a``, ``b`` (4, 3) in the frame of the first core, how
    many there are, ``size`` (1,), 0 where touching cores have a flat difference; the ``part`` (1,) of the obstacles."""

    a: Array
    b: Array
    size: IntArray
    part: IntArray


class Work(Struct):
    """Workspace of the distance functions: one for each thread, nothing is kept between calls.

    ``carrier`` is of the nearest pair that was measured last (see :func:`cdfctl.fields.kernel.rows.nearest_pair`).
    ``measure`` is :func:`_measure`, whose code is long and its callers many.
    """

    simplex: Simplex
    polytope: Polytope
    carrier: Carrier
    measure: Callable[[ConvexSets, int, ConvexSets, int, Rot, Vec, Vec, float, Simplex, Polytope], Contact]


class Contact(NamedTuple):
    """Signed distance of two sets, m, and where it is taken.

    Attributes:
        d: signed distance, negative in penetration.
        a, b: witness points on the two surfaces, m.
        normal: unit, from A to B; in penetration the direction in which B leaves A soonest.
    """

    d: float
    a: Vec
    b: Vec
    normal: Vec


@njit
def signed_distance(
    sets_a: ConvexSets,
    i: int,
    sets_b: ConvexSets,
    j: int,
    r: Rot,
    t: Vec,
    guess: Vec,
    cutoff: float,
    work: Work,
) -> Contact:
    """Set i of A against set j of B, whose frame is (r, t) in that of A; the answer is in the frame of A.

    ``guess`` is a direction from A to B to start from: the normal of a like query, or zero for none. Where the distance
    exceeds ``cutoff`` (m), the answer may be any d that is above the cutoff and not above the distance.
    """
    return work.measure(sets_a, i, sets_b, j, r, t, guess, cutoff, work.simplex, work.polytope)


@njit
def _measure(
    sets_a: ConvexSets,
    i: int,
    sets_b: ConvexSets,
    j: int,
    r: Rot,
    t: Vec,
    guess: Vec,
    cutoff: float,
    simplex: Simplex,
    polytope: Polytope,
) -> Contact:
    r_a, r_b = sets_a.info[i].radius, sets_b.info[j].radius
    if not dot(guess, guess) > 0.0:
        guess = sub(add(rotate(r, vec3(sets_b.info[j].centre)), t), vec3(sets_a.info[i].centre))
    if not dot(guess, guess) > 0.0:
        guess = (0.0, 0.0, 1.0)
    core_cutoff = max(0.0, cutoff + r_a + r_b)
    core = core_distance(sets_a, i, sets_b, j, r, t, guess, core_cutoff, simplex)
    if core.touching:
        return _touching(sets_a, i, sets_b, j, r, t, core.a, core.v, simplex, polytope)
    normal = scale(-1.0 / norm(core.v), core.v)
    d = core.distance - r_a - r_b
    return Contact(d, along(core.a, r_a, normal), along(core.b, -r_b, normal), normal)


@njit
def _touching(
    sets_a: ConvexSets,
    i: int,
    sets_b: ConvexSets,
    j: int,
    r: Rot,
    t: Vec,
    shared: Vec,
    v: Vec,
    simplex: Simplex,
    polytope: Polytope,
) -> Contact:
    """The contact of cores that touch (their nearest points ``v`` apart, or less than rounding) or overlap."""
    r_a, r_b = sets_a.info[i].radius, sets_b.info[j].radius
    core = core_depth(sets_a, i, sets_b, j, r, t, simplex, polytope)
    a, depth, normal = core.a, core.depth, core.normal
    if core.flat:
        a, depth = shared, 0.0
    d = -depth - r_a - r_b
    return Contact(d, along(a, r_a, normal), along(a, r_a + d, normal), normal)


@njit
def keep_carrier(work: Work, p: int) -> None:
    """Keep what carries the nearest points of the pair measured last, the obstacles' part p in it."""
    simplex, carrier = work.simplex, work.carrier
    carrier.size[0], carrier.part[0] = simplex.size[0], p
    for i in range(simplex.size[0]):
        for k in range(3):
            carrier.a[i, k] = simplex.a[i, k]
            carrier.b[i, k] = simplex.a[i, k] - simplex.w[i, k]


@njit
def piece_distance(
    body: Body, frames: Frames, c: int, k: int, parts: Parts, p: int, guess: Vec, cutoff: float, work: Work
) -> Contact:
    """Piece k of the robot, at configuration c, against part p of the obstacles, in the world.

    The joint of the piece must have been placed (:func:`forward` or :func:`forward_to`). ``guess`` and ``cutoff`` are
    those of :func:`signed_distance`, the guess in the world.
    """
    r_a, t_a = piece_pose(body, frames, c, k)
    r, t = relative_pose(r_a, t_a, parts, p)
    return to_world(r_a, t_a, signed_distance(body.sets, k, parts.sets, p, r, t, rotate_back(r_a, guess), cutoff, work))


@njit
def to_world(r: Rot, t: Vec, c: Contact) -> Contact:
    """Contact ``c``, known in a frame (r, t), in the world."""
    return Contact(c.d, add(t, rotate(r, c.a)), add(t, rotate(r, c.b)), rotate(r, c.normal))


@njit
def relative_pose(r_a: Rot, t_a: Vec, parts: Parts, p: int) -> tuple[Rot, Vec]:
    """The frame of part p in that of a piece at (r_a, t_a) in the world."""
    r_b, t_b = obstacle_pose(parts, parts.obstacle[p])
    return compose(transpose(r_a), r_b), rotate_back(r_a, sub(t_b, t_a))


@njit
def lower_bound(body: Body, k: int, parts: Parts, p: int, r: Rot, t: Vec) -> float:
    """A cheap lower bound of the signed distance of piece k and part p, whose frame is (r, t) in that of the piece."""
    part = parts.sets.info[p]
    return gap_to_ball(body, k, add(rotate(r, vec3(part.centre)), t), part.reach, part.radius)


@njit
def block_bound(body: Body, k: int, parts: Parts, block: int, r: Rot, t: Vec) -> float:
    """A lower bound of the signed distances of piece k and every part of the block, whose frame is (r, t) in that of
    the piece."""
    bounds = parts.block[block]
    return gap_to_ball(body, k, add(rotate(r, vec3(bounds.centre)), t), bounds.reach, bounds.radius)


@njit
def gap_to_ball(body: Body, k: int, c: Vec, reach: float, radius: float) -> float:
    """The gap between the bounding box of piece k and a ball that holds a core, less radii; -inf where they overlap."""
    piece = body.sets.info[k]
    lower, upper = piece.lower, piece.upper
    x = max(lower[0] - c[0], 0.0, c[0] - upper[0])
    y = max(lower[1] - c[1], 0.0, c[1] - upper[1])
    z = max(lower[2] - c[2], 0.0, c[2] - upper[2])
    gap = norm((x, y, z)) - reach
    return gap - piece.radius - radius if gap > 0.0 else -np.inf


def new_work() -> Work:
    """A workspace; about 150 kB."""
    sets, simplex, polytope = pack([]), new_simplex(), new_polytope()
    measure = compiled(_measure, sets, 0, sets, 0, (ZERO, ZERO, ZERO), ZERO, ZERO, 0.0, simplex, polytope)
    carrier = Carrier(np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))
    return Work(simplex, polytope, carrier, measure)


NO_CONTACT = Contact(np.inf, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
