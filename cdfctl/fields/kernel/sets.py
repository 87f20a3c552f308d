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
from typing import NamedTuple, Protocol

import numpy as np

from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.vec import Vec
from cdfctl.types import Array, IntArray

SCAN_LIMIT = 24  # sets with more vertices than this climb; a scan of 24 takes as long as a climb


class ConvexSets(NamedTuple):
    """k convex sets over V vertices, E directed edges.

    Attributes:
        first: (k+1,) the vertices of set i are ``vertices[first[i]:first[i+1]]``.
        vertices: (V, 3) m.
        disc, radius: (k,) m.
        lower, upper: (k, 3) bounding box of the core.
        centre, reach: (k, 3), (k,) a ball around the core: the middle of that box, and the farthest core point from it.
        table: (k,) where the set's table of starts begins in ``start``, -1 for a set that scans.
        cells: (k,) number of table cells along an edge of the cube.
        start: (T,) vertex to start from, for each cell of each cube.
        edge: (V+1,) the neighbours of vertex v are ``neighbour[edge[v]:edge[v+1]]``.
        neighbour: (E,) vertex indices.
    """

    first: IntArray
    vertices: Array
    disc: Array
    radius: Array
    lower: Array
    upper: Array
    centre: Array
    reach: Array
    table: IntArray
    cells: IntArray
    start: IntArray
    edge: IntArray
    neighbour: IntArray


class ConvexSetLike(Protocol):
    """What :func:`pack` reads of a set: ``vertices`` (v, 3), ``disc``, ``radius``."""

    @property
    def vertices(self) -> Array: ...
    @property
    def disc(self) -> float: ...
    @property
    def radius(self) -> float: ...


def pack(sets: Sequence[ConvexSetLike]) -> ConvexSets:
    """The arrays of ``sets``, in their order."""
    k = len(sets)
    counts = [len(s.vertices) for s in sets]
    first = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)
    vertices = np.ascontiguousarray(np.concatenate([s.vertices for s in sets] or [np.zeros((0, 3))]), dtype=np.float64)
    disc = np.array([s.disc for s in sets], dtype=np.float64)
    lower, upper, reach = np.zeros((k, 3)), np.zeros((k, 3)), np.zeros(k)
    table, cells = np.full(k, -1, dtype=np.int64), np.zeros(k, dtype=np.int64)
    starts: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    neighbours: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    degree = np.zeros(len(vertices), dtype=np.int64)
    filled = 0
    for i, s in enumerate(sets):
        points, flat = np.asarray(s.vertices, dtype=np.float64), np.array([s.disc, s.disc, 0.0])
        lower[i], upper[i] = points.min(axis=0) - flat, points.max(axis=0) + flat
        offset = points - 0.5 * (lower[i] + upper[i])
        reach[i] = np.hypot(np.hypot(offset[:, 0], offset[:, 1]) + s.disc, offset[:, 2]).max()
        if len(points) <= SCAN_LIMIT:
            continue
        degrees, adjacent = _hull_edges(points)
        degree[first[i] : first[i + 1]] = degrees
        neighbours.append(adjacent + first[i])
        cells[i] = 8 if len(points) < 400 else 16 if len(points) < 2000 else 32
        table[i] = filled
        starts.append(_cube_table(points, degrees > 0, int(cells[i])) + first[i])
        filled += len(starts[-1])
    return ConvexSets(
        first=first,
        vertices=vertices,
        disc=disc,
        radius=np.array([s.radius for s in sets], dtype=np.float64),
        lower=lower,
        upper=upper,
        centre=0.5 * (lower + upper),
        reach=reach,
        table=table,
        cells=cells,
        start=np.concatenate(starts),
        edge=np.concatenate([[0], np.cumsum(degree)]).astype(np.int64),
        neighbour=np.concatenate(neighbours),
    )


def _hull_edges(points: Array) -> tuple[IntArray, IntArray]:
    """Number of neighbours of each vertex on the hull of ``points``, and the neighbours one after another.

    A flat set has no hull in space; then every vertex is the neighbour of every other.
    """
    from scipy.spatial import ConvexHull, QhullError

    count = len(points)
    try:
        triangles = ConvexHull(points).simplices
    except QhullError:
        i, j = np.nonzero(~np.eye(count, dtype=bool))
        pairs = np.stack([i, j], axis=1)
    else:
        pairs = np.concatenate([triangles[:, [i, j]] for i in range(3) for j in range(3) if i != j])
        pairs = np.unique(pairs, axis=0)
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


@njit
def support(sets: ConvexSets, i: int, s: Vec) -> Vec:
    """A point of core i farthest in direction ``s``, in the frame of the set."""
    v = _scan(sets.vertices, sets.first[i], sets.first[i + 1], s) if sets.table[i] < 0 else _climb(sets, i, s)
    x, y, z = sets.vertices[v, 0], sets.vertices[v, 1], sets.vertices[v, 2]
    if sets.disc[i] > 0.0:
        flat = sqrt(s[0] * s[0] + s[1] * s[1])
        if flat > 0.0:
            x += sets.disc[i] * s[0] / flat
            y += sets.disc[i] * s[1] / flat
    return (x, y, z)


@njit
def _scan(vertices: Array, first: int, last: int, s: Vec) -> int:
    best, value = first, -np.inf
    for v in range(first, last):
        along = vertices[v, 0] * s[0] + vertices[v, 1] * s[1] + vertices[v, 2] * s[2]
        if along > value:
            best, value = v, along
    return best


@njit
def _climb(sets: ConvexSets, i: int, s: Vec) -> int:
    vertices, edge, neighbour = sets.vertices, sets.edge, sets.neighbour
    best: int = sets.start[sets.table[i] + _cell(s, sets.cells[i])]
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


@njit
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
