"""Both fields in one pass against each of them alone."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from cdfctl.errors import InputError
from cdfctl.fields.cdf import CDF
from cdfctl.fields.sdf import SDF
from cdfctl.robots.robot import load_robot
from cdfctl.types import Box, ConvexMesh, Cylinder, FieldQuery, Obstacle, PointCloud, Scene, Sphere


def assert_same(found: FieldQuery, expected: FieldQuery, atol: float = 0.0) -> None:
    for field in fields(FieldQuery):
        a, b = getattr(found, field.name), getattr(expected, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_allclose(a, b, rtol=0.0, atol=atol, err_msg=field.name)
        else:
            assert a == b


def scenes(random: np.random.Generator, count: int):
    """Obstacles of all kinds that drift, some of them into the robot; the last scenes have none."""
    shapes = (
        Sphere(0.05),
        Box((0.1, 0.2, 0.3)),
        Cylinder(0.05, 0.3),
        ConvexMesh(random.normal(size=(20, 3)) * 0.05),
        PointCloud(random.normal(size=(60, 3)) * 0.2, 0.01),
    )
    places = random.uniform([-0.7, -0.7, 0.0], [0.7, 0.7, 1.0], (len(shapes), 3))
    drifts = random.normal(size=(len(shapes), 3)) * 0.005
    for k in range(count):
        yield Scene(
            Obstacle(shape, place + k * drift, velocity=drift / 0.01, name=str(i))
            for i, (shape, place, drift) in enumerate(zip(shapes, places, drifts, strict=True))
            if k < count - 2
        )


@pytest.mark.parametrize("robot_name", ["planar", "franka", "ur5"])
@pytest.mark.parametrize("every_link", [False, True])
@pytest.mark.parametrize("sheets", [1, 4])
def test_each_answers_as_alone(robot_name: str, every_link: bool, sheets: int) -> None:
    robot, random = load_robot(robot_name), np.random.default_rng(sheets)
    together, alone, sdf, own = CDF(robot), CDF(robot), SDF(robot), SDF(robot)
    towards, inside = random.normal(size=robot.n) * 0.02, 0
    for k, scene in enumerate(scenes(random, 25)):
        q = robot.home + k * towards
        if k % 7 == 5:
            q[-1] = robot.upper[-1] + 0.1  # outside the limits the contact search begins on them, distances at q itself
        inside += bool(np.all((q >= robot.lower) & (q <= robot.upper)))
        contacts, distances = together.beside(sdf, q, scene, sheets=sheets, every_link=every_link)
        assert_same(contacts, alone.query(q, scene) if sheets == 1 else alone.contacts(q, scene, sheets=sheets))
        assert_same(distances, own.per_link(q, scene) if every_link else own.query(q, scene), atol=1e-12)
    assert 10 < inside < 25


def test_another_shape_under_the_same_name_is_searched_widely_at_once() -> None:
    """A long box in the place of a small ball out of reach: a field that has seen the ball finds it in that query."""
    robot = load_robot("franka")
    for draw in range(5):
        random = np.random.default_rng(draw)
        warm, q = CDF(robot), robot.home + random.normal(size=robot.n) * 0.3
        position = [random.uniform(1.0, 3.0), random.uniform(-0.3, 0.3), 0.5]
        for _ in range(10):
            warm.query(q, Scene([Obstacle(Sphere(0.01), position, name="o")]))
        changed = Scene([Obstacle(Box((5.0, 0.2, 0.2)), position, name="o")])
        expected = CDF(robot).query(q, changed).d[0]
        assert warm.query(q, changed).d[0] == pytest.approx(expected, abs=0.05)


def test_an_orientation_that_is_none_is_refused() -> None:
    robot = load_robot("planar")
    poses = np.array([[0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]])
    scene = Scene.from_arrays((Sphere(0.1),), ("ball",), poses, np.zeros((1, 6)))
    for field in (CDF(robot), SDF(robot)):
        with pytest.raises(InputError, match="orientation of obstacle 'ball'"):
            field.query(robot.home, scene)
