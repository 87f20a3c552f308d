"""GJK: the distance of two convex cores (Gilbert, Johnson and Keerthi).

Two sets A and B are as far apart as the origin is from their difference D = { a - b }. A point of D farthest in
direction s is the farthest of A along s less the farthest of B along -s, so D is never built. GJK keeps a simplex of
at most four points of D. From v, the point of the simplex nearest to the origin, it asks for the point w of D farthest
in direction -v, adds it, and drops the vertices that no longer carry the nearest point.

When to stop is known exactly: every point of D has v·y >= v·w, so v·w/|v| is a lower bound of the distance and |v| an
upper one. All is done in the frame of A, in doubles; B is placed there by a rotation and a translation.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.jit import njit, njit_inline
from cdfctl.fields.kernel.sets import ConvexSets, support
from cdfctl.fields.kernel.simplex import nearest_on_segment, nearest_on_tetrahedron, nearest_on_triangle
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import ZERO, Rot, Vec, add, along, dot, rotate, rotate_back, scale, sub
from cdfctl.types import Array, IntArray

MAX_STEPS = 128  # polytopes need about ten; cylinders, whose edge is curved, up to about fifty
GAP = 1e-15  # relative gap of the bounds, and the rounding of a coordinate of size one
TOUCH = 1e-10  # cores nearer than this, relative to their size, count as touching: EPA finds the normal


class Simplex(Struct):
    """Workspace of GJK: the points of D, and the points of A they come from, (4, 3) each; how many there are, (1,)."""

    w: Array
    a: Array
    size: IntArray


class CoreDistance(NamedTuple):
    """What GJK found, in the frame of A.

    Attributes:
        distance: of the cores, 0 where they touch or overlap; no more than a lower bound where ``beyond``.
        a, b: nearest points.
        v: a - b.
        touching: the cores touch or overlap; a and b are then points they share.
        beyond: the distance is greater than the cutoff, and the search stopped there.
    """

    distance: float
    a: Vec
    b: Vec
    v: Vec
    touching: bool
    beyond: bool


@njit
def core_distance(
    sets_a: ConvexSets,
    i: int,
    sets_b: ConvexSets,
    j: int,
    r: Rot,
    t: Vec,
    guess: Vec,
    cutoff: float,
    simplex: Simplex,
) -> CoreDistance:
    """Distance of core i of A and core j of B, whose frame is (r, t) in that of A.

    ``guess`` is a direction from A to B, not zero. The search may stop when the distance is known to exceed ``cutoff``.
    """
    v = scale(-1.0, guess)
    a, w = support_of_difference(sets_a, i, sets_b, j, r, t, guess)
    v, size, simplex.size[0] = w, 1, 1
    store_vertex(simplex, 0, w, a)
    best_a, best_vv = a, dot(w, w)
    reach = sets_a.info[i].reach + sets_b.info[j].reach
    touch2 = (TOUCH * reach) ** 2
    for _ in range(MAX_STEPS):
        if best_vv <= touch2:
            return CoreDistance(0.0, best_a, sub(best_a, v), v, True, False)
        a, w = support_of_difference(sets_a, i, sets_b, j, r, t, scale(-1.0, v))
        lower = dot(v, w)
        if lower > 0.0 and lower * lower > cutoff * cutoff * best_vv:
            return CoreDistance(lower / sqrt(best_vv), best_a, sub(best_a, v), v, False, True)
        if best_vv - lower <= GAP * (best_vv + sqrt(best_vv) * reach) or has_vertex(simplex, size, w):
            break
        store_vertex(simplex, size, w, a)
        size, nearest, nearest_a = reduce(simplex, size + 1)
        simplex.size[0] = size
        if size == 4:
            return CoreDistance(0.0, nearest_a, nearest_a, ZERO, True, False)
        nearest2 = dot(nearest, nearest)
        if not nearest2 < best_vv:
            break  # rounding: no progress is possible any more
        v, best_a, best_vv = nearest, nearest_a, nearest2
    return CoreDistance(sqrt(best_vv), best_a, sub(best_a, v), v, False, False)


@njit_inline
def support_of_difference(
    sets_a: ConvexSets, i: int, sets_b: ConvexSets, j: int, r: Rot, t: Vec, s: Vec
) -> tuple[Vec, Vec]:
    """A point a of A and the point w = a - b of D = A - B farthest in direction ``s``."""
    a = support(sets_a, i, s)
    b = support(sets_b, j, scale(-1.0, rotate_back(r, s)))
    return a, sub(a, add(rotate(r, b), t))


@njit_inline
def store_vertex(simplex: Simplex, k: int, w: Vec, a: Vec) -> None:
    """Vertex k of the simplex."""
    simplex.w[k, 0], simplex.w[k, 1], simplex.w[k, 2] = w[0], w[1], w[2]
    simplex.a[k, 0], simplex.a[k, 1], simplex.a[k, 2] = a[0], a[1], a[2]


@njit_inline
def has_vertex(simplex: Simplex, size: int, w: Vec) -> bool:
    """Whether ``w`` is a vertex already: then it brings the search no further."""
    for k in range(size):  # noqa: SIM110 - numba compiles no generators here
        if simplex.w[k, 0] == w[0] and simplex.w[k, 1] == w[1] and simplex.w[k, 2] == w[2]:
            return True
    return False


@njit_inline
def reduce(simplex: Simplex, size: int) -> tuple[int, Vec, Vec]:
    """Drop the vertices that do not carry the point nearest to the origin; that point, and its partner on A."""
    w = simplex.w
    w0, w1 = (w[0, 0], w[0, 1], w[0, 2]), (w[1, 0], w[1, 1], w[1, 2])
    w2, w3 = (w[2, 0], w[2, 1], w[2, 2]), (w[3, 0], w[3, 1], w[3, 2])
    if size == 2:
        nearest, weights = nearest_on_segment(w0, w1)
    elif size == 3:
        nearest, weights = nearest_on_triangle(w0, w1, w2)
    else:
        nearest, weights = nearest_on_tetrahedron(w0, w1, w2, w3)
    kept, a = 0, ZERO
    for k in range(size):
        weight = weights[0] if k == 0 else weights[1] if k == 1 else weights[2] if k == 2 else weights[3]
        if weight > 0.0:
            a_k = (simplex.a[k, 0], simplex.a[k, 1], simplex.a[k, 2])
            a = along(a, weight, a_k)
            store_vertex(simplex, kept, (w[k, 0], w[k, 1], w[k, 2]), a_k)
            kept += 1
    return kept, nearest, a


def new_simplex() -> Simplex:
    """An empty workspace."""
    return Simplex(np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(1, dtype=np.int64))
