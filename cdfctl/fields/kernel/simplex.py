"""The point of a simplex nearest to the origin: the inner step of GJK.

In exact arithmetic this is Johnson's sub-algorithm. Done by signed areas and volumes (as Montanari and co-workers
propose) it stays accurate for flat simplices: the origin is first projected on the plane or line, and barycentric
coordinates are taken of the projection. A face is searched only where the coordinate of the vertex opposite is not
positive; the nearest of the faces searched is the answer.

Every function returns the nearest point and four barycentric coordinates, zero for vertices that do not carry it.
"""

from __future__ import annotations

from typing import TypeAlias

from cdfctl.fields.kernel.jit import njit, njit_inline
from cdfctl.fields.kernel.vec import ZERO, Vec, along, cross, dot, scale, sub

Weights: TypeAlias = tuple[float, float, float, float]

VOLUME_TRUST = 1e-6  # barycentric coordinates of a tetrahedron that do not add up to one so well are not believed


@njit_inline
def nearest_on_segment(a: Vec, b: Vec) -> tuple[Vec, Weights]:
    """The nearest point of segment ab."""
    ab = sub(b, a)
    length2 = dot(ab, ab)
    t = -dot(a, ab) / length2 if length2 > 0.0 else 0.0
    if not t > 0.0:
        return a, (1.0, 0.0, 0.0, 0.0)
    if t >= 1.0:
        return b, (0.0, 1.0, 0.0, 0.0)
    return along(a, t, ab), (1.0 - t, t, 0.0, 0.0)


@njit_inline
def nearest_on_triangle(a: Vec, b: Vec, c: Vec) -> tuple[Vec, Weights]:
    """The nearest point of triangle abc."""
    n = cross(sub(b, a), sub(c, a))
    area2 = dot(n, n)
    alpha, beta, gamma = -1.0, -1.0, -1.0
    if area2 > 0.0:
        p = scale(dot(n, a) / area2, n)
        pa, pb, pc = sub(a, p), sub(b, p), sub(c, p)
        alpha, beta, gamma = dot(n, cross(pb, pc)), dot(n, cross(pc, pa)), dot(n, cross(pa, pb))
        if alpha > 0.0 and beta > 0.0 and gamma > 0.0:
            total = alpha + beta + gamma
            return p, (alpha / total, beta / total, gamma / total, 0.0)
    best, weights, least = a, (1.0, 0.0, 0.0, 0.0), dot(a, a)
    if not alpha > 0.0:
        p, w = nearest_on_segment(b, c)
        if dot(p, p) < least:
            best, weights, least = p, (0.0, w[0], w[1], 0.0), dot(p, p)
    if not beta > 0.0:
        p, w = nearest_on_segment(a, c)
        if dot(p, p) < least:
            best, weights, least = p, (w[0], 0.0, w[1], 0.0), dot(p, p)
    if not gamma > 0.0:
        p, w = nearest_on_segment(a, b)
        if dot(p, p) < least:
            best, weights, least = p, (w[0], w[1], 0.0, 0.0), dot(p, p)
    return best, weights


@njit
def nearest_on_tetrahedron(a: Vec, b: Vec, c: Vec, d: Vec) -> tuple[Vec, Weights]:
    """The nearest point of tetrahedron abcd; the origin itself, with four positive weights, if it is inside."""
    alpha, beta = opposite(b, c, d, a), opposite(a, c, d, b)
    gamma, delta = opposite(a, b, d, c), opposite(a, b, c, d)
    # Without a volume the coordinates are noise: search all faces.
    flat = not abs(alpha + beta + gamma + delta - 1.0) < VOLUME_TRUST
    if not flat and alpha > 0.0 and beta > 0.0 and gamma > 0.0 and delta > 0.0:
        return ZERO, (alpha, beta, gamma, delta)
    best, weights, least = a, (1.0, 0.0, 0.0, 0.0), dot(a, a)
    if flat or not alpha > 0.0:
        p, w = nearest_on_triangle(b, c, d)
        if dot(p, p) < least:
            best, weights, least = p, (0.0, w[0], w[1], w[2]), dot(p, p)
    if flat or not beta > 0.0:
        p, w = nearest_on_triangle(a, c, d)
        if dot(p, p) < least:
            best, weights, least = p, (w[0], 0.0, w[1], w[2]), dot(p, p)
    if flat or not gamma > 0.0:
        p, w = nearest_on_triangle(a, b, d)
        if dot(p, p) < least:
            best, weights, least = p, (w[0], w[1], 0.0, w[2]), dot(p, p)
    if flat or not delta > 0.0:
        p, w = nearest_on_triangle(a, b, c)
        if dot(p, p) < least:
            best, weights, least = p, (w[0], w[1], w[2], 0.0), dot(p, p)
    return best, weights


@njit_inline
def opposite(a: Vec, b: Vec, c: Vec, d: Vec) -> float:
    """Barycentric coordinate of the origin with respect to d: its height over face abc by that of d."""
    n = cross(sub(b, a), sub(c, a))
    return -dot(n, a) / dot(n, sub(d, a))
