"""coal on our convex geometry, against closed forms and a QP over the hull's vertices."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from qpsolvers import solve_qp

from cdfctl.robots.coal_geometry import coal_convex, coal_shape
from cdfctl.robots.convex import convex_hull
from cdfctl.types import Box, Capsule, ConvexMesh, Cylinder, PointCloud, Sphere


def distance(first, second, position, rotation=None):
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    placement = coal.Transform3s(np.eye(3) if rotation is None else rotation, np.asarray(position, dtype=float))
    return coal.distance(first, coal.Transform3s.Identity(), second, placement, request, coal.DistanceResult())


def distance_by_qp(vertices, point):
    """min | V^T w - p |, w in the simplex: the definition of the distance to a convex hull."""
    k = len(vertices)
    P = vertices @ vertices.T + 1e-12 * np.eye(k)
    w = solve_qp(P, -vertices @ point, A=np.ones((1, k)), b=np.ones(1), lb=np.zeros(k), solver="daqp")
    return float(np.linalg.norm(vertices.T @ w - point))


@pytest.mark.parametrize("seed", range(8))
def test_hull_to_ball_equals_the_qp_over_its_vertices(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(60, 3)) * 0.2
    vertices, faces = convex_hull(points)
    point = rng.normal(size=3)
    expected = distance_by_qp(points, point) - 0.05
    assert distance(coal_convex(vertices, faces), coal.Sphere(0.05), point) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_a_box_as_a_mesh_is_the_box(seed):
    rng = np.random.default_rng(seed)
    size = (0.2, 0.3, 0.4)
    corners = 0.5 * np.array(size) * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    mesh, box = coal_shape(ConvexMesh(corners)), coal_shape(Box(size))
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    position = rng.uniform(-0.3, 0.3, 3)
    for shape in (Sphere(0.05), Capsule(0.05, 0.2), Cylinder(0.05, 0.2)):
        other = coal_shape(shape)
        expected = distance(box, other, position, rotation)
        assert distance(mesh, other, position, rotation) == pytest.approx(expected, abs=2e-5)


def test_a_ball_wholly_inside_a_hull_is_in_penetration():
    corners = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    cube = coal_shape(ConvexMesh(corners))
    assert distance(cube, coal.Sphere(0.1), [0.0, 0.0, 0.2]) == pytest.approx(-(0.3 + 0.1), abs=1e-6)


def test_a_flat_mesh_is_a_plate():
    plate = coal_shape(ConvexMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]]))
    assert distance(plate, coal.Sphere(0.1), [0.4, 0.6, 0.7]) == pytest.approx(0.6, abs=1e-6)
    assert distance(plate, coal.Sphere(0.1), [1.3, 1.4, 0.0]) == pytest.approx(0.4, abs=1e-6)
    assert distance(plate, coal.Sphere(0.1), [0.4, 0.6, 0.05]) == pytest.approx(-0.05, abs=1e-6)


def test_primitives_keep_their_size():
    assert coal_shape(Sphere(0.1)).radius == 0.1
    assert coal_shape(Capsule(0.1, 0.6)).halfLength == pytest.approx(0.3)
    assert coal_shape(Cylinder(0.1, 0.6)).halfLength == pytest.approx(0.3)
    np.testing.assert_allclose(coal_shape(Box((0.2, 0.4, 0.6))).halfSide, [0.1, 0.2, 0.3])


def test_a_point_cloud_is_not_one_geometry():
    with pytest.raises(TypeError, match="PointCloud"):
        coal_shape(PointCloud([[0, 0, 0]]))
