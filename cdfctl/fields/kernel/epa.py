"""EPA: how deep two overlapping cores are in each other (expanding polytope, van den Bergen).

Where the origin is inside the difference D = A - B, the depth is the distance from the origin to the boundary of D:
the least over unit directions n of h(n) = max { n·y : y in D }. EPA holds a polytope inside D, takes its face nearest
to the origin, asks for the point of D farthest along that face's normal, and lets the polytope grow to it. The nearest
face is a lower bound of the depth, h(n) of any normal tried an upper one; the search stops where they meet.

Face offsets are signed, so the start need not hold the origin: a face the origin lies beyond has the least offset and
grows first. That makes the search independent of how GJK ended, and right for cores that only just touch. A core
without thickness (ball against capsule, two crossing capsules) has a flat D: its depth is zero, along the flat side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.gjk import Simplex, store_vertex, support_of_difference
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.sets import ConvexSets
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Rot, Vec, cross, dot, norm, perpendicular, scale, sub, vec
from cdfctl.types import Array, IntArray

MAX_POINTS = 256
MAX_FACES = 4 * MAX_POINTS
FLAT = 1e-12  # D thinner than this, relative to its size, has no inside
GAP = 1e-11  # of the bounds, relative to the size of D
COPLANAR = 1e-11  # a point nearer to a face's plane than this, relative to that size, lies in it


class Polytope(Struct):
    """Workspace of EPA.

    Attributes:
        w: (MAX_POINTS, 3) points of D.
        a: (MAX_POINTS, 3) the points of A they come from.
        face: (MAX_FACES, 3) vertices of each face, anticlockwise seen from outside.
        normal: (MAX_FACES, 3) outward unit normals.
        offset: (MAX_FACES,) signed distance of the face's plane from the origin; +inf for a face without area.
        edge: (MAX_FACES, 2) rim of the faces a new point sees.
    """

    w: Array
    a: Array
    face: IntArray
    normal: Array
    offset: Array
    edge: IntArray


class CoreDepth(NamedTuple):
    """What EPA found, in the frame of A.

    Attributes:
        depth: at least 0 but for rounding.
        normal: unit; moving B along it by ``depth`` frees it.
        a: point of A, deepest in B.
        flat: D has no inside: the depth is zero, ``normal`` is at right angles to D, and ``a`` is not set.
    """

    depth: float
    normal: Vec
    a: Vec
    flat: bool


@njit
def core_depth(
    sets_a: ConvexSets, i: int, sets_b: ConvexSets, j: int, r: Rot, t: Vec, simplex: Simplex, polytope: Polytope
) -> CoreDepth:
    """Penetration depth of core i of A and core j of B, whose frame is (r, t) in that of A.

    ``simplex`` becomes the face of D that is nearest to the origin; it has no points where D is flat.
    """
    simplex.size[0] = 0
    size = sets_a.info[i].reach + sets_b.info[j].reach
    flat, flat_normal = _start(sets_a, i, sets_b, j, r, t, FLAT * size, polytope)
    if flat:
        return CoreDepth(0.0, flat_normal, (0.0, 0.0, 0.0), True)
    points, faces = 4, 4
    depth, normal = np.inf, flat_normal
    while True:
        nearest = _nearest_face(polytope, faces)
        n = vec(polytope.normal, nearest)
        a, w = support_of_difference(sets_a, i, sets_b, j, r, t, n)
        height = dot(n, w)
        if height < depth:
            depth, normal = height, n
        if not height - polytope.offset[nearest] > GAP * size:
            break
        _put_point(polytope, points, w, a)
        grown = _grow(polytope, points, faces, COPLANAR * size)
        if grown < 0:
            break
        points, faces = points + 1, grown
        if points == MAX_POINTS:
            # As on the axis of a cylinder, where no direction is the nearest. The best of all faces is near enough.
            for f in range(faces):
                if polytope.offset[f] < depth:
                    n = vec(polytope.normal, f)
                    a, w = support_of_difference(sets_a, i, sets_b, j, r, t, n)
                    if dot(n, w) < depth:
                        depth, normal, nearest = dot(n, w), n, f
            break
    face = _face_of_foot(polytope, faces, nearest, 10.0 * COPLANAR * size)
    simplex.size[0] = 3
    for k in range(3):
        v = polytope.face[face, k]
        store_vertex(simplex, k, vec(polytope.w, v), vec(polytope.a, v))
    return CoreDepth(depth, normal, _witness(polytope, face), False)


@njit
def _start(
    sets_a: ConvexSets, i: int, sets_b: ConvexSets, j: int, r: Rot, t: Vec, thin: float, polytope: Polytope
) -> tuple[bool, Vec]:
    """A tetrahedron as fat as four searches make it. Where D is thinner than ``thin``: True and the thin direction."""
    w = polytope.w
    # An edge, along the widest of the three axes.
    widest, width = 0, -1.0
    for axis in range(3):
        _search(sets_a, i, sets_b, j, r, t, _axis(axis), 0, polytope)
        _search(sets_a, i, sets_b, j, r, t, scale(-1.0, _axis(axis)), 1, polytope)
        if w[0, axis] - w[1, axis] > width:
            widest, width = axis, w[0, axis] - w[1, axis]
    if width <= thin:
        return True, _axis(2)  # D is a point
    _search(sets_a, i, sets_b, j, r, t, _axis(widest), 0, polytope)
    _search(sets_a, i, sets_b, j, r, t, scale(-1.0, _axis(widest)), 1, polytope)
    # The vertex farthest from that edge, along either of two directions across it.
    edge = sub(vec(w, 1), vec(w, 0))
    across = perpendicular(edge)
    if not _farthest(sets_a, i, sets_b, j, r, t, across, thin, 2, polytope):
        across = cross(edge, across)
        across = scale(1.0 / norm(across), across)
        if not _farthest(sets_a, i, sets_b, j, r, t, across, thin, 2, polytope):
            return True, across  # D is a segment
    # The vertex farthest from that triangle.
    up = cross(edge, sub(vec(w, 2), vec(w, 0)))
    up = scale(1.0 / norm(up), up)
    if not _farthest(sets_a, i, sets_b, j, r, t, up, thin, 3, polytope):
        return True, up  # D is flat
    if dot(up, sub(vec(w, 3), vec(w, 0))) > 0.0:
        _put_face(polytope, 0, 0, 2, 1)
        _put_face(polytope, 1, 0, 1, 3)
        _put_face(polytope, 2, 1, 2, 3)
        _put_face(polytope, 3, 2, 0, 3)
    else:
        _put_face(polytope, 0, 0, 1, 2)
        _put_face(polytope, 1, 1, 0, 3)
        _put_face(polytope, 2, 2, 1, 3)
        _put_face(polytope, 3, 0, 2, 3)
    return False, up


@njit
def _axis(k: int) -> Vec:
    return (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)


@njit
def _search(
    sets_a: ConvexSets, i: int, sets_b: ConvexSets, j: int, r: Rot, t: Vec, s: Vec, k: int, polytope: Polytope
) -> None:
    """The point of D farthest along ``s`` becomes point k."""
    a, w = support_of_difference(sets_a, i, sets_b, j, r, t, s)
    _put_point(polytope, k, w, a)


@njit
def _farthest(
    sets_a: ConvexSets,
    i: int,
    sets_b: ConvexSets,
    j: int,
    r: Rot,
    t: Vec,
    s: Vec,
    thin: float,
    k: int,
    polytope: Polytope,
) -> bool:
    """Point k becomes the one farthest from point 0 along ``s`` or against it; whether that is more than ``thin``."""
    origin = vec(polytope.w, 0)
    _search(sets_a, i, sets_b, j, r, t, s, k, polytope)
    forward = dot(s, sub(vec(polytope.w, k), origin))
    _search(sets_a, i, sets_b, j, r, t, scale(-1.0, s), k, polytope)
    backward = -dot(s, sub(vec(polytope.w, k), origin))
    if forward > backward:
        _search(sets_a, i, sets_b, j, r, t, s, k, polytope)
    return max(forward, backward) > thin


@njit
def _put_point(polytope: Polytope, k: int, w: Vec, a: Vec) -> None:
    polytope.w[k, 0], polytope.w[k, 1], polytope.w[k, 2] = w[0], w[1], w[2]
    polytope.a[k, 0], polytope.a[k, 1], polytope.a[k, 2] = a[0], a[1], a[2]


@njit
def _put_face(polytope: Polytope, f: int, i: int, j: int, k: int) -> None:
    polytope.face[f, 0], polytope.face[f, 1], polytope.face[f, 2] = i, j, k
    p = vec(polytope.w, i)
    n = cross(sub(vec(polytope.w, j), p), sub(vec(polytope.w, k), p))
    area = norm(n)
    if area > 0.0:
        n = scale(1.0 / area, n)
        polytope.offset[f] = dot(n, p)
    else:
        polytope.offset[f] = np.inf
    polytope.normal[f, 0], polytope.normal[f, 1], polytope.normal[f, 2] = n[0], n[1], n[2]


@njit
def _nearest_face(polytope: Polytope, faces: int) -> int:
    best = 0
    for f in range(1, faces):
        if polytope.offset[f] < polytope.offset[best]:
            best = f
    return best


@njit
def _grow(polytope: Polytope, point: int, faces: int, coplanar: float) -> int:
    """Take away the faces ``point`` sees and join it to their rim; the new number of faces, -1 if there is no room.

    Faces in whose plane it lies go too. So every edge of the rim belongs to a face the point is truly below, is not in
    line with the point, and the new faces have an area and a normal to trust.
    """
    p = vec(polytope.w, point)
    rim, f = 0, 0
    while f < faces:
        if dot(vec(polytope.normal, f), p) > polytope.offset[f] - coplanar:
            for k in range(3):
                rim = _toggle(polytope.edge, rim, polytope.face[f, k], polytope.face[f, (k + 1) % 3])
            faces -= 1
            for k in range(3):
                polytope.face[f, k] = polytope.face[faces, k]
                polytope.normal[f, k] = polytope.normal[faces, k]
            polytope.offset[f] = polytope.offset[faces]
        else:
            f += 1
    if faces + rim > MAX_FACES:
        return -1
    for e in range(rim):
        _put_face(polytope, faces + e, polytope.edge[e, 0], polytope.edge[e, 1], point)
    return faces + rim


@njit
def _toggle(edge: IntArray, rim: int, i: int, j: int) -> int:
    """Add edge ij to the rim; an edge met from both sides is inside, and goes."""
    for e in range(rim):
        if edge[e, 0] == j and edge[e, 1] == i:
            edge[e, 0], edge[e, 1] = edge[rim - 1, 0], edge[rim - 1, 1]
            return rim - 1
    edge[rim, 0], edge[rim, 1] = i, j
    return rim + 1


@njit
def _face_of_foot(polytope: Polytope, faces: int, nearest: int, tolerance: float) -> int:
    """The face in the plane of the ``nearest`` one in which the foot of the origin lies.

    Faces in one plane share an offset and the foot lies in one of them only: the one whose least barycentric coordinate
    is greatest.
    """
    limit = polytope.offset[nearest] + tolerance
    best, inside = nearest, -np.inf
    for f in range(faces):
        if polytope.offset[f] <= limit:
            least = min(*_foot(polytope, f))
            if least > inside:
                best, inside = f, least
    return best


@njit
def _witness(polytope: Polytope, face: int) -> Vec:
    """The point of A behind the foot of the origin on a face."""
    alpha, beta, gamma = _foot(polytope, face)
    i, j, k = polytope.face[face, 0], polytope.face[face, 1], polytope.face[face, 2]
    a = polytope.a
    return (
        alpha * a[i, 0] + beta * a[j, 0] + gamma * a[k, 0],
        alpha * a[i, 1] + beta * a[j, 1] + gamma * a[k, 1],
        alpha * a[i, 2] + beta * a[j, 2] + gamma * a[k, 2],
    )


@njit
def _foot(polytope: Polytope, f: int) -> Vec:
    """Barycentric coordinates in face f of the foot of the origin on its plane."""
    n, offset = vec(polytope.normal, f), polytope.offset[f]
    foot = scale(offset, n)
    pa = sub(vec(polytope.w, polytope.face[f, 0]), foot)
    pb = sub(vec(polytope.w, polytope.face[f, 1]), foot)
    pc = sub(vec(polytope.w, polytope.face[f, 2]), foot)
    alpha, beta, gamma = dot(n, cross(pb, pc)), dot(n, cross(pc, pa)), dot(n, cross(pa, pb))
    total = alpha + beta + gamma
    return (alpha / total, beta / total, gamma / total)


def new_polytope() -> Polytope:
    """An empty workspace."""
    return Polytope(
        w=np.zeros((MAX_POINTS, 3)),
        a=np.zeros((MAX_POINTS, 3)),
        face=np.zeros((MAX_FACES, 3), dtype=np.int64),
        normal=np.zeros((MAX_FACES, 3)),
        offset=np.zeros(MAX_FACES),
        edge=np.zeros((MAX_FACES, 2), dtype=np.int64),
    )
