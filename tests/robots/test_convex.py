"""Hulls and convex parts, against half-spaces and closed forms."""

from __future__ import annotations

import itertools

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.errors import InputError
from cdfctl.robots.convex import ConvexSet, convex_hull, convex_sets
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, PointCloud, Sphere

clouds = arrays.arrays(
    np.float64, st.tuples(st.integers(5, 40), st.just(3)), elements=st.integers(-40, 40).map(lambda x: x / 8.0)
)


def support(part: ConvexSet, direction: Array) -> float:
    """The support function of a convex part for a unit direction, from its definition."""
    return float((part.vertices @ direction).max() + part.disc * np.hypot(direction[0], direction[1]) + part.radius)


@settings(max_examples=60, deadline=None)
@given(clouds, st.randoms(use_true_random=False))
def test_hull_contains_every_point_and_has_no_vertex_to_spare(points, random):
    vertices, faces = convex_hull(points)
    assert {tuple(v) for v in vertices} <= {tuple(p) for p in points}
    directions = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
    np.testing.assert_allclose((vertices @ directions.T).max(0), (points @ directions.T).max(0), atol=1e-12)
    if len(faces):
        a, b, c = (vertices[faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        offsets = np.einsum("ij,ij->i", normals, a)
        assert np.all(points @ normals.T <= offsets + 1e-9)
        edges = {frozenset(edge) for f in faces for edge in itertools.combinations(f.tolist(), 2)}
        assert len(vertices) - len(edges) + len(faces) == 2
    order = list(range(len(points)))
    random.shuffle(order)
    again, again_faces = convex_hull(points[order])
    np.testing.assert_array_equal(again, vertices)
    assert again_faces.shape == faces.shape


def test_hull_of_a_box_has_outward_faces():
    vertices, faces = convex_hull(convex_sets(Box((1.0, 2.0, 3.0)))[0].vertices)
    assert vertices.shape == (8, 3)
    assert faces.shape == (12, 3)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(6.0)


def test_flat_points_give_the_polygon_and_no_faces():
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0], [0.25, 0.5, 0]]) @ rotation + 7.0
    vertices, faces = convex_hull(square)
    assert {tuple(v) for v in vertices} == {tuple(p) for p in square[:4]}
    assert faces.shape == (0, 3)


def test_points_on_a_line_and_equal_points():
    line = np.linspace(0, 1, 7)[:, None] * np.array([1.0, 2.0, 3.0])
    vertices, faces = convex_hull(line)
    np.testing.assert_array_equal(vertices, line[[0, -1]])
    assert faces.shape == (0, 3)
    vertices, _ = convex_hull(np.ones((5, 3)))
    np.testing.assert_array_equal(vertices, np.ones((1, 3)))


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((4, 3), np.nan)])
def test_no_hull_of_nothing(points):
    with pytest.raises(InputError, match="at least one point"):
        convex_hull(points)


@pytest.mark.parametrize("seed", range(5))
def test_support_of_each_shape_in_closed_form(seed):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    radius, length = 0.1 + rng.random(2)
    size = 0.1 + rng.random(3)
    mesh = rng.normal(size=(30, 3))
    flat = float(np.hypot(direction[0], direction[1]))
    along = 0.5 * length * abs(direction[2])
    expected = [
        (Sphere(radius), radius),
        (Box(tuple(size)), 0.5 * float(size @ np.abs(direction))),
        (Capsule(radius, length), along + radius),
        (Cylinder(radius, length), along + radius * flat),
        (ConvexMesh(mesh), float((mesh @ direction).max())),
    ]
    for shape, value in expected:
        (part,) = convex_sets(shape)
        assert support(part, direction) == pytest.approx(value, abs=1e-12)


def test_a_point_cloud_has_one_part_a_point():
    points = np.random.default_rng(1).normal(size=(6, 3))
    parts = convex_sets(PointCloud(points, 0.02))
    assert [part.radius for part in parts] == [0.02] * 6
    np.testing.assert_array_equal(np.concatenate([part.vertices for part in parts]), points)
