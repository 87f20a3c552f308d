"""Shapes as convex sets, for the distance kernels.

Every convex part, of a link or of an obstacle, is described by three things in a frame of its own:

    conv(vertices)  (+)  disc of radius `disc` in the local xy plane  (+)  ball of radius `radius`

where (+) is the Minkowski sum. A ball is one vertex and a radius, a capsule two vertices and a radius, a cylinder two
vertices and a disc, a box eight vertices, a mesh the vertices of its convex hull. The support function of such a set is
a maximum over the vertices plus two terms in closed form, so one GJK serves all of them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cdfctl.errors import InputError
from cdfctl.robots.kept_hulls import Facets, kept_facets
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, IntArray, PointCloud, Shape, Sphere

# A point set whose extent along a direction is below this share of its greatest extent counts as flat there.
FLATNESS = 1e-9


@dataclass(frozen=True, eq=False)
class ConvexSet:
    """``conv(vertices) (+) disc (+) ball``: ``vertices`` (k, 3), ``disc`` and ``radius`` in m, in the shape's frame.

    ``faces`` (t, 3) are those of :func:`convex_hull`, None where they are not known.
    """

    vertices: Array
    disc: float = 0.0
    radius: float = 0.0
    faces: IntArray | None = None


@dataclass(frozen=True, eq=False)
class ConvexPiece:
    """A convex piece of a moving link: ``placement * (conv(vertices) (+) disc (+) ball)``.

    Attributes:
        name: the link's name, with ``/1``, ``/2``, … where the link has several pieces.
        link: index into ``Robot.links``.
        joint: index of the joint the piece hangs on, 0 … n-1.
        rotation: (3, 3) and
        translation: (3,) m, the placement in the frame of that joint.
        vertices: (k, 3) m.
        disc: radius of the disc in the local xy plane, m.
        radius: radius of the ball, m.
        faces: (t, 3) triangles of the hull of ``vertices``, counter-clockwise seen from outside; (0, 3) where the
            vertices span no volume.
    """

    name: str
    link: int
    joint: int
    rotation: Array
    translation: Array
    vertices: Array
    disc: float
    radius: float
    faces: IntArray


def convex_sets(shape: Shape) -> tuple[ConvexSet, ...]:
    """The convex parts of an obstacle's shape in the obstacle's frame; a point cloud has one part a point."""
    match shape:
        case Sphere(radius):
            return (ConvexSet(np.zeros((1, 3)), radius=radius),)
        case Box(size):
            return (ConvexSet(box_vertices(size)),)
        case Capsule(radius, length):
            return (ConvexSet(segment_vertices(length), radius=radius),)
        case Cylinder(radius, length):
            return (ConvexSet(segment_vertices(length), disc=radius),)
        case ConvexMesh():
            vertices, faces = convex_hull(shape.vertices)
            return (ConvexSet(vertices, faces=faces),)
        case PointCloud():
            return tuple(ConvexSet(point[None, :], radius=shape.radius) for point in shape.points)


def box_vertices(size: Iterable[float]) -> Array:
    """The eight corners (8, 3) of a box of full side lengths ``size`` (m), centred at the origin."""
    return 0.5 * np.array(list(itertools.product(*((-side, side) for side in size))))


def segment_vertices(length: float) -> Array:
    """The two ends (2, 3) of a segment of ``length`` (m) along z, centred at the origin."""
    return np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])


def convex_hull(points: Array, *, keep: bool = False) -> tuple[Array, IntArray]:
    """Vertices (k, 3) and faces (t, 3) of the hull of ``points`` (p, 3), in an order that depends on the set only.

    Vertices are sorted by x, then y, then z. Faces are triangles, counter-clockwise from outside. Points that all lie
    in a plane, on a line or in one place give the corners of the polygon, the two ends or the one point, and no faces.

    With ``keep`` a hull with faces is looked for in the user cache, and put there: for the bodies of a robot, which are
    the same at every start. The answer is the same bit for bit.

    Raises:
        InputError: a point is not finite, or there is none.
    """
    points = np.unique(np.asarray(points, dtype=np.float64).reshape(-1, 3), axis=0)
    if points.shape[0] == 0 or not np.all(np.isfinite(points)):
        raise InputError("a convex hull needs at least one point, and finite ones")
    centred = points - points.mean(axis=0)
    spread, axes = np.linalg.svd(centred, full_matrices=False)[1:]
    rank = int(np.sum(spread > FLATNESS * max(float(spread[0]), np.finfo(np.float64).tiny)))
    if rank == 3:
        corners, faces = kept_facets(points, _facets) if keep else _facets(points)
        return points[corners], faces
    if rank == 2:
        corners = np.sort(_qhull(centred @ axes[:2].T)[0])
    elif rank == 1:
        along = centred @ axes[0]
        corners = np.sort([np.argmin(along), np.argmax(along)])
    else:
        corners = np.array([0])
    return points[corners], np.zeros((0, 3), dtype=np.int64)


def _facets(points: Array) -> Facets:
    """The hull of sorted points that span a volume."""
    corners, triangles, normals = _qhull(points)
    corners = np.sort(corners)  # points are sorted, so the vertices stay so
    faces = np.searchsorted(corners, triangles)
    vertices = points[corners]
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    first = np.argmin(faces, axis=1)  # each face begins with its least vertex, faces sorted: one order for one hull
    faces = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
    return Facets(corners, faces[np.lexsort(faces.T[::-1])].astype(np.int64))


def _qhull(points: Array) -> tuple[IntArray, IntArray, Array]:
    """Indices of the hull's corners, its facets and their outward normals."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError as error:
        reason = str(error).strip().splitlines()[0]
        raise InputError(f"no convex hull could be built of {points.shape[0]} points: {reason}") from None
    return (
        np.asarray(hull.vertices, dtype=np.int64),
        np.asarray(hull.simplices, dtype=np.int64),
        np.asarray(hull.equations[:, :-1], dtype=np.float64),
    )
