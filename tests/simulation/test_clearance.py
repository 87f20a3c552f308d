"""Distances of a robot to a scene."""

from __future__ import annotations

import numpy as np
import pytest

from cdfctl.robots.robot import load_robot
from cdfctl.simulation.clearance import nearest
from cdfctl.types import Box, Capsule, ConvexMesh, Cylinder, Obstacle, PointCloud, Scene, Sphere

CORNERS = 0.1 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


@pytest.mark.parametrize(
    ("shape", "above"),
    [
        (Sphere(0.2), 0.2),
        (Box((0.2, 0.2, 0.2)), 0.1),
        (Capsule(0.1, 0.4), 0.1),
        (Cylinder(0.1, 0.4), 0.1),
        (ConvexMesh(CORNERS), 0.1),
        (PointCloud(CORNERS, 0.05), 0.15),
    ],
)
def test_each_shape_beside_the_arm(shape, above):
    robot = load_robot("planar")
    scene = Scene([Obstacle(Sphere(0.1), [0, 3, 0]), Obstacle(shape, [3.0, 1.0, 0.0], name="it")])
    found = nearest(robot, np.zeros(2), scene)
    assert found is not None
    assert (found.link, found.obstacle) == ("link2", "it")
    corner = np.hypot(0.9, 0.1) - 0.05  # the points stand 0.1 m off the plane
    expected = corner if isinstance(shape, PointCloud) else 1.0 - above
    assert found.distance == pytest.approx(expected, abs=1e-6)


def test_an_orientation_counts():
    scene = Scene([Obstacle(Capsule(0.1, 0.4), [3.0, 1.0, 0.0], [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])])
    found = nearest(load_robot("planar"), np.zeros(2), scene)
    assert found is not None
    assert found.distance == pytest.approx(1.0 - 0.2 - 0.1, abs=1e-6)


@pytest.mark.parametrize("depth", [0.0, 0.05, 0.1])
def test_depth_of_a_segment_in_a_cylinder(depth):
    # along the axis itself EPA converges slowest: the curved wall is 0.2 m away on every side
    scene = Scene([Obstacle(Cylinder(0.2, 1.0), [1.0, depth, 0.0], [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)])])
    found = nearest(load_robot("planar"), np.zeros(2), scene)
    assert found is not None
    assert found.distance == pytest.approx(-(0.2 - depth), abs=1e-4)


def test_an_empty_scene_has_no_nearest():
    assert nearest(load_robot("planar"), np.zeros(2), Scene()) is None


def test_a_cloud_of_one_point():
    found = nearest(load_robot("planar"), np.zeros(2), Scene([Obstacle(PointCloud([[0, 0, 0]], 0.1), [1.0, 0.5, 0.0])]))
    assert found is not None
    assert found.distance == pytest.approx(0.4, abs=1e-6)
