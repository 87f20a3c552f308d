"""Kinematics and derivatives of points against Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from cdfctl.fields.kernel.body import Frames, body_of, forward, forward_to, gradient, new_frames, piece_pose
from cdfctl.robots.robot import Robot, load_robot


@pytest.fixture(scope="module", params=["planar", "franka", "ur5", "kinova", "z1"])
def robot(request) -> Robot:
    return load_robot(request.param)


def random_q(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(np.maximum(robot.lower, -7.0), np.minimum(robot.upper, 7.0))


def test_forward_places_every_joint(robot):
    body, data, rng = body_of(robot), robot.model.createData(), np.random.default_rng(0)
    frames = new_frames(body)
    for _ in range(20):
        q = random_q(robot, rng)
        forward(body, q, frames, 0)
        pin.forwardKinematics(robot.model, data, q)
        for i in range(robot.n):
            np.testing.assert_allclose(frames.rotation[0, i], data.oMi[i + 1].rotation, atol=1e-12)
            np.testing.assert_allclose(frames.translation[0, i], data.oMi[i + 1].translation, atol=1e-12)
            np.testing.assert_allclose(frames.axis[0, i], data.oMi[i + 1].rotation @ robot.chain.axis[i], atol=1e-12)


def test_forward_to_places_the_ancestors_and_no_others(robot):
    body, q = body_of(robot), random_q(robot, np.random.default_rng(1))
    everything = new_frames(body)
    forward(body, q, everything, 0)
    for joint in range(robot.n):
        frames = Frames(**{name: np.full_like(part, np.nan) for name, part in everything.members().items()})
        forward_to(body, q, joint, frames, 0)
        moved = robot.chain.moves[:, joint]
        np.testing.assert_array_equal(frames.rotation[0, moved], everything.rotation[0, moved])
        np.testing.assert_array_equal(frames.translation[0, moved], everything.translation[0, moved])
        assert np.all(np.isnan(frames.translation[0, ~moved]))


def test_gradient_is_minus_the_normal_times_the_jacobian(robot):
    body, data, rng = body_of(robot), robot.model.createData(), np.random.default_rng(2)
    frames, out = new_frames(body), np.empty(robot.n)
    for joint in range(robot.n):
        q, local, normal = random_q(robot, rng), rng.normal(size=3), rng.normal(size=3)
        forward(body, q, frames, 0)
        point = frames.rotation[0, joint] @ local + frames.translation[0, joint]
        gradient(body, frames, 0, joint, tuple(point), tuple(normal), out)
        J = pin.computeJointJacobian(robot.model, data, q, joint + 1)
        velocities = frames.rotation[0, joint] @ (J[:3] - np.cross(local, J[3:], axisb=0, axisc=0))
        np.testing.assert_allclose(out, -normal @ velocities, atol=1e-12)


def test_pieces_are_where_the_robot_says(robot):
    body, data, q = body_of(robot), robot.model.createData(), random_q(robot, np.random.default_rng(3))
    frames = new_frames(body)
    forward(body, q, frames, 0)
    pin.forwardKinematics(robot.model, data, q)
    assert list(body.link) == sorted(p.link for p in robot.pieces)
    for k, piece in enumerate(sorted(robot.pieces, key=lambda p: p.link)):
        r, t = (np.array(x) for x in piece_pose(body, frames, 0, k))
        joint = data.oMi[piece.joint + 1]
        np.testing.assert_allclose(r, joint.rotation @ piece.rotation, atol=1e-12)
        np.testing.assert_allclose(t, joint.act(piece.translation), atol=1e-12)
        assert body.first[piece.link] <= k < body.first[piece.link + 1]
