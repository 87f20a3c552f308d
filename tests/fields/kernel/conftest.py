"""Convex sets to measure, and plain numpy versions of what the kernel compiles."""

from __future__ import annotations

import itertools
from functools import cache
from types import SimpleNamespace

import coal
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from cdfctl.fields.kernel.distance import Contact, new_work, signed_distance
from cdfctl.fields.kernel.sets import ConvexSets, pack
from cdfctl.robots.convex import ConvexSet

WORK = new_work()
NO_GUESS = (0.0, 0.0, 0.0)


def box(*size: float) -> ConvexSet:
    return ConvexSet(0.5 * np.array(list(itertools.product(*((-x, x) for x in size)))))


def segment(length: float, disc: float = 0.0, radius: float = 0.0) -> ConvexSet:
    return ConvexSet(np.array([[0, 0, -length / 2], [0, 0, length / 2]]), disc, radius)


def ball(radius: float) -> ConvexSet:
    return ConvexSet(np.zeros((1, 3)), 0.0, radius)


def hull(count: int, seed: int = 0, size: float = 0.1) -> ConvexSet:
    points = np.random.default_rng(seed).normal(size=(count, 3)) * [1.0, 0.7, 0.4]
    return ConvexSet(size * points / np.linalg.norm(points / [1.0, 0.7, 0.4], axis=1)[:, None])


def lattice(count: int, side: float = 0.2) -> ConvexSet:
    """A box whose faces are full of vertices: what a subdivided mesh gives, all coplanar."""
    grid = np.linspace(-side / 2, side / 2, count)
    points = np.array(list(itertools.product(grid, grid, grid)))
    return ConvexSet(points[np.abs(points).max(axis=1) > 0.499 * side])


def measure(a: ConvexSet, b: ConvexSet, rotation: np.ndarray, translation: np.ndarray, **options: object) -> Contact:
    """The kernel's answer for ``a`` at the origin and ``b`` placed by rotation and translation."""
    r = tuple(tuple(float(x) for x in row) for row in rotation)
    t = tuple(float(x) for x in translation)
    guess, cutoff = options.get("guess", NO_GUESS), options.get("cutoff", np.inf)
    return signed_distance(packed(a), 0, packed(b), 0, r, t, guess, cutoff, WORK)


@cache
def packed(s: ConvexSet) -> ConvexSets:
    return pack([s])


def height(s: ConvexSet, n: np.ndarray) -> float:
    """Greatest extent of the set along ``n``, its ball included."""
    return float((s.vertices @ n).max() + s.disc * np.hypot(n[0], n[1]) + s.radius * np.linalg.norm(n))


def separation(a: ConvexSet, b: ConvexSet, rotation: np.ndarray, translation: np.ndarray, n: np.ndarray) -> float:
    """How far ``n`` separates the sets (negative: they overlap along it). The distance is the greatest over unit n."""
    return float(n @ translation) - height(a, n) - height(b, -rotation.T @ n)


def hull_distance(a: ConvexSet, b: ConvexSet, rotation: np.ndarray, translation: np.ndarray) -> float:
    """Signed distance of overlapping polytopes: the nearest facet of the hull of all differences (qhull)."""
    differences = a.vertices[:, None] - (b.vertices @ rotation.T + translation)[None]
    facets = ConvexHull(differences.reshape(-1, 3)).equations
    return float(facets[:, 3].max()) - a.radius - b.radius


@cache
def coal_object(s: ConvexSet) -> coal.CollisionGeometry:
    length = float(np.ptp(s.vertices[:, 2]))
    if s.disc > 0:
        return coal.Cylinder(s.disc, length)
    if len(s.vertices) == 1:
        return coal.Sphere(s.radius)
    if len(s.vertices) == 2:
        return coal.Capsule(s.radius, length)
    if len(s.vertices) == 8:
        return coal.Box(*np.ptp(s.vertices, axis=0))
    solid = ConvexHull(s.vertices)
    corners = {v: i for i, v in enumerate(solid.vertices)}
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for v in solid.vertices:
        points.append(s.vertices[v])
    for triangle, equation in zip(solid.simplices, solid.equations, strict=True):
        i, j, k = triangle
        u, v, w = s.vertices[triangle]
        if np.cross(v - u, w - u) @ equation[:3] < 0:
            j, k = k, j
        faces.append(coal.Triangle(corners[i], corners[j], corners[k]))
    return coal.Convex(points, faces)


def coal_distance(a: ConvexSet, b: ConvexSet, rotation: np.ndarray, translation: np.ndarray) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = request.epa_tolerance = 1e-13
    request.gjk_max_iterations = request.epa_max_iterations = 1000
    here, there = coal.Transform3s.Identity(), coal.Transform3s(rotation, translation)
    return coal.distance(coal_object(a), here, coal_object(b), there, request, result)


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    return Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()


@pytest.fixture(scope="session")
def geometry() -> SimpleNamespace:
    """Builders of sets (``ball``, ``box``, …), ``measure`` and independent measures to hold it against."""
    return SimpleNamespace(
        ball=ball,
        box=box,
        segment=segment,
        hull=hull,
        lattice=lattice,
        measure=measure,
        height=height,
        separation=separation,
        hull_distance=hull_distance,
        coal_distance=coal_distance,
        random_rotation=random_rotation,
        work=WORK,
    )
