"""The exact second derivative of the distance of a piece of the robot and a part of an obstacle.

Let a and b be the nearest points of the two cores, D = |b - a|, ν the unit vector from a to b, u_j the tangential part
(at right angles to ν) of J_j, the velocity of a with joint j, and v_j that of D z_j × ν. If a and b were fixed to their
bodies, the second derivative of D would be

    H_ij = -ν·(z_i × J_j) + u_i·u_j / D,        i <= j.

But nearest points slide: a along the edge or face of the piece in which it lies, whose directions are the columns of
E, and b along those of the obstacle. What is least over both is

    H_ij = -ν·(z_i × J_j) + (u_iᵀ W u_j - y_iᵀ N y_j) / D,    y_j = W u_j + v_j,    N = E (Eᵀ W E + K)⁻¹ Eᵀ

with W the identity where b is a corner, the projection across its edge, zero in a face. Along the rim of a disc W is
κ / (1 + κ), κ = D cos β / radius, β the angle of ν to the plane of the disc; K holds the κ of the piece's own rim. All
is in coordinates of the tangential plane. D is that of the cores, radii do not matter, and is held above
:data:`SHARP`: corner to corner without radii is a kink.

Where nearest points are not unique, as of parallel edges, there is no second derivative; then N is zero, or W the
identity.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple, TypeAlias

from cdfctl.fields.kernel.body import Body, piece_pose
from cdfctl.fields.kernel.candidates import Candidates
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts, obstacle_pose
from cdfctl.fields.kernel.vec import (
    Rot,
    Vec,
    along,
    cross,
    dot,
    perpendicular,
    rotate,
    rotate_back,
    sub,
    vec,
)
from cdfctl.types import Array

SHARP = 1.0 / 60.0  # m
SAME = 1e-7  # m: corners nearer than this are one
IN_LINE = 1e-3  # sine of the angle of two edges that span no face
RIM = 1e-6  # share of a disc's radius by which a point lies inside it to lie on its flat side
UNIQUE = 0.02  # least determinant of Eᵀ W E + K

Plane: TypeAlias = tuple[float, float]


class Feature(NamedTuple):
    """The corner, edge or face of a core in which a nearest point lies: of ``size`` 0, 1 or 2.

    Attributes:
        size: how many directions the point can slide along.
        e: the first of them, in the tangential plane; the second is at right angles to it.
        kappa: κ along e, zero but for a rim.
    """

    size: int
    e: Plane
    kappa: float


class Curvature(NamedTuple):
    """What the second derivative is made of: the tangential plane spanned by ``s`` and ``t``, D, and W and N, of each
    the elements 11, 12 and 22."""

    s: Vec
    t: Vec
    D: float
    W: Vec
    N: Vec


UNIT: Vec = (1.0, 0.0, 1.0)
NONE: Vec = (0.0, 0.0, 0.0)


@njit
def curvature(body: Body, parts: Parts, found: Candidates, c: int, corners: bool) -> Curvature:
    """Of candidate c where it stands; as between two corners if ``corners``, or if nothing is known of the cores."""
    k, p = found.piece[c], found.part[c]
    normal = vec(found.normal, c)
    r_a, r_b = body.sets.info[k].radius, parts.sets.info[p].radius
    D = max(SHARP, found.f[c] + r_a + r_b)
    s = perpendicular(normal)
    t = cross(normal, s)
    count = found.corners[c]
    if corners or count == 0:
        return Curvature(s, t, D, UNIT, NONE)
    rotation, translation = piece_pose(body, found.frames, found.place[c], k)
    disc = body.sets.info[k].disc
    if disc > 0.0:
        a = sub(along(vec(found.a, c), -r_a, normal), translation)
        own = _rim(found.corner_a[c], count, rotation, rotation, a, disc, D, normal, s, t)
    else:
        own = _span(found.corner_a[c], count, rotation, s, t)
    disc = parts.sets.info[p].disc
    if disc > 0.0:
        r, origin = obstacle_pose(parts, parts.obstacle[p])
        b = sub(along(vec(found.b, c), r_b, normal), origin)
        other = _rim(found.corner_b[c], count, rotation, r, b, disc, D, normal, s, t)
    else:
        other = _span(found.corner_b[c], count, rotation, s, t)
    W = _given_up(other)
    N, unique = _slid(own, W)
    if not unique and own.size == 2:
        W = UNIT
        N, _ = _slid(own, W)
    return Curvature(s, t, D, W, N)


@njit
def _span(corners: Array, count: int, r: Rot, s: Vec, t: Vec) -> Feature:
    """Of a polytope, from ``count`` of its corners that carry the nearest point; ``r`` turns them into the world."""
    size, e = 0, (1.0, 0.0)
    first = vec(corners, 0)
    for i in range(1, count):
        edge = rotate(r, sub(vec(corners, i), first))
        x, y = dot(edge, s), dot(edge, t)
        length = sqrt(x * x + y * y)
        if length < SAME:
            continue
        if size == 0:
            size, e = 1, (x / length, y / length)
        elif abs(e[0] * y - e[1] * x) > IN_LINE * length:
            return Feature(2, e, 0.0)
    return Feature(size, e, 0.0)


@njit
def _rim(
    corners: Array, count: int, r: Rot, r_disc: Rot, point: Vec, disc: float, D: float, normal: Vec, s: Vec, t: Vec
) -> Feature:
    """Of a cylinder, whose frame is turned by ``r_disc``; from its origin the nearest point is at ``point`` (world)."""
    x, y, _ = rotate_back(r_disc, point)
    radius = sqrt(x * x + y * y)
    if radius < (1.0 - RIM) * disc:
        return Feature(2, (1.0, 0.0), 0.0)
    axis = (r_disc[0][2], r_disc[1][2], r_disc[2][2])
    outward = rotate(r_disc, (x / radius, y / radius, 0.0))
    tangent = cross(axis, outward)
    size = 1
    first = vec(corners, 0)
    for i in range(1, count):
        if abs(dot(axis, rotate(r, sub(vec(corners, i), first)))) > SAME:
            size = 2
    e, length = (dot(tangent, s), dot(tangent, t)), 0.0
    length = sqrt(e[0] * e[0] + e[1] * e[1])
    if not length > 0.5:
        return Feature(0, (1.0, 0.0), 0.0)
    return Feature(size, (e[0] / length, e[1] / length), D * abs(dot(normal, outward)) / disc)


@njit
def _given_up(feature: Feature) -> Vec:
    """W."""
    if feature.size == 0:
        return UNIT
    x, y = feature.e
    along_e, across = feature.kappa / (1.0 + feature.kappa), 0.0 if feature.size == 2 else 1.0
    return (
        along_e * x * x + across * y * y,
        (along_e - across) * x * y,
        along_e * y * y + across * x * x,
    )


@njit
def _slid(feature: Feature, W: Vec) -> tuple[Vec, bool]:
    """N, and whether the nearest points are unique."""
    if feature.size == 0:
        return NONE, True
    x, y = feature.e
    m11 = W[0] * x * x + 2.0 * W[1] * x * y + W[2] * y * y + feature.kappa
    if feature.size == 1:
        if not m11 > UNIQUE:
            return NONE, False
        return (x * x / m11, x * y / m11, y * y / m11), True
    m12 = (W[2] - W[0]) * x * y + W[1] * (x * x - y * y)
    m22 = W[0] * y * y - 2.0 * W[1] * x * y + W[2] * x * x
    det = m11 * m22 - m12 * m12
    if not det > UNIQUE:
        return NONE, False
    i11, i12, i22 = m22 / det, -m12 / det, m11 / det
    # E = (e, p) with p = (-y, x)
    return (
        i11 * x * x - 2.0 * i12 * x * y + i22 * y * y,
        i11 * x * y + i12 * (x * x - y * y) - i22 * x * y,
        i11 * y * y + 2.0 * i12 * x * y + i22 * x * x,
    ), True
