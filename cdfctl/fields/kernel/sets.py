"""Convex sets, packed into arrays: the one description of geometry the kernel knows.

Every set, of the robot or of an obstacle, is in its own frame

    conv(vertices)  (+)  disc of radius ``disc`` in the xy plane  (+)  ball of radius ``radius``

so a ball is one vertex and a radius, a capsule two vertices and a radius, a cylinder two vertices and a disc, a box
eight vertices, a mesh its hull. The first two terms are the *core*: GJK and EPA see cores only, and radii are
subtracted from the distance afterwards, which is exact.

All a core has to answer is: which of its points is farthest in direction s? A small set scans its vertices. A large
hull climbs along its edges, and starts from a table of answers for the cells of a cube around it, so that it arrives
after a step or two however many vertices there are.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cdfctl.fields.kernel.jit import njit_inline
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Vec
from cdfctl.types import Array, IntArray

Records: TypeAlias = NDArray[Any]

SCAN_LIMIT = 24  # sets with more vertices than this climb; a scan of 24 takes as long as a climb


_INFO = np.dtype(
    [
        ("first", np.int64),  # the vertices of the set are first … last - 1
        ("last", np.int64),
        ("table", np.int64),  # where its table of starts begins in ``start``, -1 for a set that scans
        ("cells", np.int64),  # number of table cells along an edge of the cube
        ("disc", np.float64),  # m
        ("radius", np.float64),  # m
        ("reach", np.float64),  # radius of a ball around the core, m; its centre is the middle of the box
        ("lower", np.float64, 3),  # bounding box of the core
        ("upper", np.float64, 3),
        ("centre", np.float64, 3),
    ],
    align=True,
)
INFO = np.dtype((np.record, _INFO))
"""What is known of one set. A record, not an array for each: few arguments keep calls and their compilation short."""


class ConvexSets(Struct):
    """k convex sets over V vertices, E directed edges.

    Attributes:
        info: (k,) of :data:`INFO`.
        vertices: (V, 3) m.
        start: (T,) vertex to start from, for each cell of each cube.
        edge: (V+1,) the neighbours of vertex v are ``neighbour[edge[v]:edge[v+1]]``.
        neighbour: (E,) vertex indices.
    """

    info: Records
    vertices: Array
    start: IntArray
    edge: IntArray
    neighbour: IntArray


class ConvexSetLike(Protocol):
    """What :func:`pack` reads of a set: ``vertices`` (v, 3), ``disc``, ``radius``, and ``faces`` (t, 3), triangles of
    the hull of the vertices, none where it is flat; None where they are not known."""

    @property
    def vertices(self) -> Array: ...
    @property
    def disc(self) -> float: ...
    @property
    def radius(self) -> float: ...
    @property
    def faces(self) -> IntArray | None: ...


def pack(sets: Sequence[ConvexSetLike]) -> ConvexSets:
    """The arrays of ``sets``, in their order."""
    info = np.zeros(len(sets), dtype=INFO)
    vertices = np.concatenate([np.asarray(s.vertices, dtype=np.float64) for s in sets] or [np.zeros((0, 3))])
    starts: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    neighbours: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    degree = np.zeros(len(vertices), dtype=np.int64)
    first = filled = 0
    for record, s in zip(info, sets, strict=True):
        points, flat = np.asarray(s.vertices, dtype=np.float64), np.array([s.disc, s.disc, 0.0])
        count = len(points)
        lower, upper = points.min(axis=0) - flat, points.max(axis=0) + flat
        x, y, z = (points - 0.5 * (lower + upper)).T
        record["first"], record["last"], record["table"] = first, first + count, -1
        record["disc"], record["radius"] = s.disc, s.radius
        record["lower"], record["upper"], record["centre"] = lower, upper, 0.5 * (lower + upper)
        record["reach"] = np.hypot(np.hypot(x, y) + s.disc, z).max()
        if count > SCAN_LIMIT:
            degrees, adjacent = _hull_edges(count, _triangles(points) if s.faces is None else s.faces)
            cells = 8 if count < 400 else 16 if count < 2000 else 32
            record["table"], record["cells"] = filled, cells
            degree[first : first + count] = degrees
            neighbours.append(adjacent + first)
            starts.append(_cube_table(points, degrees > 0, cells) + first)
            filled += len(starts[-1])
        first += count
    return ConvexSets(
        info=info,
        vertices=np.ascontiguousarray(vertices),
        start=np.concatenate(starts),
        edge=np.concatenate([[0], np.cumsum(degree)]).astype(np.int64),
        neighbour=np.concatenate(neighbours),
    )


def _triangles(points: Array) -> IntArray:
    """Those of the hull of ``points``; a flat set has no hull in space, and none."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(ConvexHull(points).simplices, dtype=np.int64)
    except QhullError:
        return np.zeros((0, 3), dtype=np.int64)


def _hull_edges(count: int, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Number of neighbours of each of the vertices, and the neighbours one after another.

    Without triangles every vertex is the neighbour of every other.
    """
    if len(triangles):
        pairs = np.concatenate([triangles[:, [i, j]] for i in range(3) for j in range(3) if i != j])
        pairs = np.unique(pairs, axis=0)
    else:
        i, j = np.nonzero(~np.eye(count, dtype=bool))
        pairs = np.stack([i, j], axis=1)
    return np.bincount(pairs[:, 0], minlength=count).astype(np.int64), pairs[:, 1].astype(np.int64)


def _cube_table(points: Array, usable: np.typing.NDArray[np.bool_], cells: int) -> IntArray:
    """Farthest usable vertex in the direction of each cell's middle, in the order of :func:`_cell`."""
    middle = (np.arange(cells) + 0.5) * (2.0 / cells) - 1.0
    u, v = (x.ravel() for x in np.meshgrid(middle, middle, indexing="ij"))
    candidates = np.flatnonzero(usable)
    table = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            s = np.empty((cells * cells, 3))
            s[:, axis], s[:, (axis + 1) % 3], s[:, (axis + 2) % 3] = sign, u, v
            table.append(candidates[np.argmax(s @ points[candidates].T, axis=1)])
    return np.concatenate(table).astype(np.int64)


@njit_inline
def support(sets: ConvexSets, i: int, s: Vec) -> Vec:
    """A point of core i farthest in direction ``s``, in the frame of the set."""
    info = sets.info[i]
    if info.table < 0:
        v = _scan(sets.vertices, info.first, info.last, s)
    else:
        v = _climb(sets, sets.start[info.table + _cell(s, info.cells)], s)
    x, y, z = sets.vertices[v, 0], sets.vertices[v, 1], sets.vertices[v, 2]
    if info.disc > 0.0:
        flat = sqrt(s[0] * s[0] + s[1] * s[1])
        if flat > 0.0:
            x += info.disc * s[0] / flat
            y += info.disc * s[1] / flat
    return (x, y, z)


@njit_inline
def _scan(vertices: Array, first: int, last: int, s: Vec) -> int:
    best, value = first, -np.inf
    for v in range(first, last):
        along = vertices[v, 0] * s[0] + vertices[v, 1] * s[1] + vertices[v, 2] * s[2]
        if along > value:
            best, value = v, along
    return best


@njit_inline
def _climb(sets: ConvexSets, start: int, s: Vec) -> int:
    vertices, edge, neighbour = sets.vertices, sets.edge, sets.neighbour
    best = start
    value = vertices[best, 0] * s[0] + vertices[best, 1] * s[1] + vertices[best, 2] * s[2]
    here = -1
    while best != here:
        here = best
        for e in range(edge[here], edge[here + 1]):
            v = neighbour[e]
            along = vertices[v, 0] * s[0] + vertices[v, 1] * s[1] + vertices[v, 2] * s[2]
            if along > value:
                best, value = v, along
    return best


@njit_inline
def _cell(s: Vec, cells: int) -> int:
    """The cell of the cube around the origin that direction ``s`` goes through."""
    x, y, z = abs(s[0]), abs(s[1]), abs(s[2])
    if x >= y and x >= z:
        face, u, v, w = (0 if s[0] >= 0.0 else 1), s[1], s[2], x
    elif y >= z:
        face, u, v, w = (2 if s[1] >= 0.0 else 3), s[2], s[0], y
    else:
        face, u, v, w = (4 if s[2] >= 0.0 else 5), s[0], s[1], z
    half = 0.5 * cells
    grow = half / w if w > 0.0 else 0.0
    i = min(cells - 1, max(0, int(u * grow + half)))
    j = min(cells - 1, max(0, int(v * grow + half)))
    return (face * cells + i) * cells + j
