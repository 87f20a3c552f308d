"""The march against closed forms, dense samples and coal: it never steps over a contact."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.control.planner.arm import arm_of
from cdfctl.control.planner.march import FULL, STEP, march, new_space
from cdfctl.control.prediction import Prediction, Predictor
from cdfctl.robots.robot import load_robot
from cdfctl.simulation.clearance import nearest
from cdfctl.types import Box, Capsule, Cylinder, Obstacle, PointCloud, Scene, Sphere

pytestmark = pytest.mark.xdist_group("planner")  # one worker compiles it, not two at once

MARGIN, RADIUS = 0.03, 0.3


def marched(robot, scene, q, u, end, margin=MARGIN):
    arm, course = arm_of(robot), Predictor(Prediction(margin)).course(scene)
    space = new_space(arm, len(course.block))
    return march(arm, course, np.asarray(q, float), np.asarray(u, float), 0.0, end, 0.15, FULL, space)


@pytest.fixture(scope="module")
def planar():
    return load_robot("planar")


@pytest.mark.parametrize(
    ("place", "velocity", "contact"),
    [
        ((1.0, 3.0), (0.0, -1.0), 3.0 - RADIUS - MARGIN),  # onto the side of the first link
        ((6.0, 0.0), (-2.0, 0.0), (2.0 - RADIUS - MARGIN) / 2.0),  # onto the tip, along the arm
        # past the tip: a ray against a circle of R = radius + margin about (4, 0), offset 0.2
        ((5.5, 0.2), (-1.0, 0.0), 1.5 - math.sqrt((RADIUS + MARGIN) ** 2 - 0.2**2)),
        ((5.0, 2.0), (0.0, -1.0), math.inf),  # by the tip, a metre off
    ],
)
def test_time_of_a_disc_at_a_still_arm_in_closed_form(planar, place, velocity, contact):
    scene = Scene([Obstacle(Sphere(RADIUS), [*place, 0.0], velocity=[*velocity, 0.0])])
    hit, least = marched(planar, scene, [0.0, 0.0], [0.0, 0.0], 4.0)
    if math.isinf(contact):
        assert hit == math.inf
        assert least == 0.15
    else:
        assert contact <= hit <= contact + STEP / np.linalg.norm(velocity) + 1e-9
        assert MARGIN - STEP - 1e-9 <= least < MARGIN


def test_a_still_scene_and_a_turning_arm_in_closed_form(planar):
    """A straight arm of 4 m at 1 rad/s against a disc at 2 m, 90 degrees ahead: contact at sin(Delta) = R / 2."""
    scene = Scene([Obstacle(Sphere(RADIUS), [0.0, 2.0, 0.0])])
    contact = math.pi / 2.0 - math.asin((RADIUS + MARGIN) / 2.0)
    hit, _ = marched(planar, scene, [0.0, 0.0], [1.0, 0.0], 3.0)
    assert contact <= hit <= contact + STEP


def arm_to_discs(q, places):
    """(k, m) distances of the planar arm at configurations (k, 2) to disc centres (k, m, 2), less the radius."""
    a1, a2 = q[:, 0], q[:, 0] + q[:, 1]
    elbow = 2.0 * np.stack([np.cos(a1), np.sin(a1)], axis=-1)
    ends = (np.zeros_like(elbow), elbow), (elbow, elbow + 2.0 * np.stack([np.cos(a2), np.sin(a2)], axis=-1))
    least = np.full(places.shape[:2], np.inf)
    for a, b in ends:
        along = np.clip(np.einsum("kmi,ki->km", places - a[:, None], b - a) / 4.0, 0.0, 1.0)
        nearest_point = a[:, None] + along[..., None] * (b - a)[:, None]
        least = np.minimum(least, np.linalg.norm(places - nearest_point, axis=-1))
    return least - RADIUS


@cache
def arm():
    return load_robot("planar")


number = st.floats(-1.0, 1.0)
disc = st.tuples(number, number, number, number)


@given(st.tuples(number, number), st.tuples(number, number), st.lists(disc, min_size=1, max_size=4))
@settings(max_examples=40, deadline=None)
def test_it_never_steps_over_a_contact(q, u, discs):
    robot = arm()
    q, u, discs = math.pi * np.array(q), 3.0 * np.array(u), np.array(discs)
    p, v = 4.0 * discs[:, :2], 4.0 * discs[:, 2:]
    scene = Scene([Obstacle(Sphere(RADIUS), [*a, 0.0], velocity=[*b, 0.0]) for a, b in zip(p, v, strict=True)])
    hit, least = marched(robot, scene, q, u, 1.5)
    t = np.linspace(0.0, min(hit, 1.5), 3000)
    d = arm_to_discs(q + t[:, None] * u, p + t[:, None, None] * v).min(axis=1)
    assert d[:-1].min(initial=np.inf) >= MARGIN - STEP - 1e-9 or hit == 0.0
    if hit < math.inf:
        assert d[-1] < MARGIN + 1e-9
    assert least >= min(0.15, d.min()) - 1e-7  # the least it saw is one of those there were


def test_every_shape_against_coal_on_the_arm():
    """Turning boxes, capsules, cylinders and clouds: no sample of coal's is nearer than the margin less STEP."""
    robot = load_robot("franka")
    rng = np.random.default_rng(3)
    cloud = PointCloud(rng.uniform(-0.15, 0.15, (40, 3)), 0.02)
    shapes = (Box((0.3, 0.2, 0.1)), Capsule(0.05, 0.3), Cylinder(0.1, 0.2), cloud, Sphere(0.08))
    hits = 0
    for _ in range(6):
        q = robot.home + rng.uniform(-0.3, 0.3, 7)
        u = rng.uniform(-1.0, 1.0, 7)
        obstacles = [
            Obstacle(
                shape,
                np.array([0.3, 0.0, 0.5]) + rng.uniform(-1.0, 1.0, 3),
                orientation=rng.normal(size=4),
                velocity=rng.uniform(-0.6, 0.6, 3),
                angular_velocity=rng.uniform(-1.0, 1.0, 3),
            )
            for shape in shapes
        ]
        scene = Scene(obstacles)
        hit, _ = marched(robot, scene, q, u, 1.0)
        hits += hit < math.inf
        for t in np.linspace(0.0, min(hit, 1.0), 15):
            found = nearest(robot, q + u * t, _at(obstacles, t))
            assert found.distance >= MARGIN - STEP - 1e-6 or found.link in robot.base_links or t == hit
            if t == hit:
                assert found.distance < MARGIN + 1e-6
    assert 0 < hits < 6


def _at(obstacles, t):
    import pinocchio as pin

    moved = []
    for o in obstacles:
        R = pin.exp3(t * o.angular_velocity) @ pin.Quaternion(*o.orientation[[3, 0, 1, 2]]).matrix()
        moved.append(Obstacle(o.shape, o.position + t * o.velocity, pin.Quaternion(R).coeffs()))
    return Scene(moved)


def test_covers_hold_their_pieces():
    robot = load_robot("franka")
    arm, rng = arm_of(robot), np.random.default_rng(0)
    for k, piece in enumerate(sorted(robot.pieces, key=lambda p: p.link)):
        weights = rng.dirichlet(np.full(len(piece.vertices), 0.05), 500)
        points = (weights @ piece.vertices) @ piece.rotation.T + piece.translation
        balls = arm.ball[arm.first_ball[k] : arm.first_ball[k + 1]]
        gaps = np.linalg.norm(points[:, None] - balls[None, :, :3], axis=2) - balls[:, 3]
        assert gaps.min(axis=1).max() <= 1e-9
        assert np.all(np.linalg.norm(points - arm.centre[k], axis=1) <= arm.radius[k] + 1e-9)
