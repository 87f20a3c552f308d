"""Outlines seen from above, against closed forms; the skeleton of the planar arm."""

from __future__ import annotations

import numpy as np
import pytest

from cdfctl.report.figures.outline import Skeleton, patches, radius_of
from cdfctl.robots.robot import load_robot
from cdfctl.types import Box, Capsule, ConvexMesh, Cylinder, PointCloud, Sphere

HALF = np.sqrt(0.5)
UPRIGHT, QUARTER_Z, LYING = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, HALF, HALF), (0.0, HALF, 0.0, HALF)


def corners(shape, quaternion, position=(1.0, 2.0, 0.0)):
    return np.concatenate([p.get_path().vertices for p in patches(shape, np.array([*position, *quaternion]))])


@pytest.mark.parametrize(
    ("shape", "quaternion", "half"),
    [
        (Box((4.0, 2.0, 1.0)), UPRIGHT, (2.0, 1.0)),
        (Box((4.0, 2.0, 1.0)), QUARTER_Z, (1.0, 2.0)),
        (Cylinder(0.5, 3.0), UPRIGHT, (0.5, 0.5)),
        (Cylinder(0.5, 3.0), LYING, (1.5, 0.5)),
        (Capsule(0.5, 3.0), LYING, (2.0, 0.5)),
        (Capsule(0.5, 3.0), UPRIGHT, (0.5, 0.5)),
        (ConvexMesh([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]), UPRIGHT, (1.0, 1.0)),
    ],
)
def test_an_outline_reaches_as_far_as_the_shape(shape, quaternion, half):
    found = corners(shape, quaternion)
    np.testing.assert_allclose(np.abs(found - (1.0, 2.0)).max(axis=0), half, atol=1e-9)


def test_a_lying_cylinder_is_a_rectangle():
    found = np.abs(corners(Cylinder(0.5, 3.0), LYING) - (1.0, 2.0)) / (1.5, 0.5)
    np.testing.assert_allclose(found.max(axis=1), 1.0, atol=1e-9)
    assert np.isclose(found, 1.0).all(axis=1).sum() >= 4, "its corners"


def test_balls_are_circles():
    (ball,) = patches(Sphere(0.3), np.array([1.0, 2.0, 5.0, *UPRIGHT]))
    assert (ball.center, ball.radius) == ((1.0, 2.0), 0.3)
    cloud = patches(PointCloud([(0, 0, 0), (1, 0, 0)], 0.1), np.array([1.0, 2.0, 5.0, *QUARTER_Z]))
    np.testing.assert_allclose([circle.center for circle in cloud], [(1.0, 2.0), (1.0, 3.0)], atol=1e-12)
    assert radius_of(PointCloud([(0, 0, 0), (1, 0, 0)], 0.1)) == pytest.approx(1.1)


def test_the_skeleton_of_the_planar_arm():
    skeleton = Skeleton(load_robot("planar"))
    points = skeleton.points(np.array([[0.0, np.pi / 2], [np.pi, 0.0]]))
    np.testing.assert_allclose(points[0], [(0, 0), (2, 0), (2, 2)], atol=1e-12)
    np.testing.assert_allclose(points[1], [(0, 0), (-2, 0), (-4, 0)], atol=1e-12)
    assert not list(skeleton.links(np.zeros(2))), "its links have no thickness"
