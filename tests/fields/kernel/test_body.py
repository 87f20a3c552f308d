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
        forward(body, q, frames)
        pin.forwardKinematics(robot.model, data, q)
        for i in range(robot.n):
            np.testing.assert_allclose(frames.rotation[i], data.oMi[i + 1].rotation, atol=1e-12)
            np.testing.assert_allclose(frames.translation[i], data.oMi[i + 1].translation, atol=1e-12)
            np.testing.assert_allclose(frames.axis[i], data.oMi[i + 1].rotation @ robot.chain.axis[i], atol=1e-12)


def test_forward_to_places_the_ancestors_and_no_others(robot):
    body, q = body_of(robot), random_q(robot, np.random.default_rng(1))
    everything = new_frames(body)
    forward(body, q, everything)
    for joint in range(robot.n):
        frames = Frames(*(np.full_like(part, np.nan) for part in everything))
        forward_to(body, q, joint, frames)
        moved = robot.chain.moves[:, joint]
        np.testing.assert_array_equal(frames.rotation[moved], everything.rotation[moved])
        np.testing.assert_array_equal(frames.translation[moved], everything.translation[moved])
        assert np.all(np.isnan(frames.translation[~moved]))


def test_gradient_is_minus_the_normal_times_the_jacobian(robot):
    body, data, rng = body_of(robot), robot.model.createData(), np.random.default_rng(2)
    frames, out = new_frames(body), np.empty(robot.n)
    for joint in range(robot.n):
        q, local, normal = random_q(robot, rng), rng.normal(size=3), rng.normal(size=3)
        forward(body, q, frames)
        point = frames.rotation[joint] @ local + frames.translation[joint]
        gradient(body, frames, joint, tuple(point), tuple(normal), out)
        J = pin.computeJointJacobian(robot.model, data, q, joint + 1)
        velocities = frames.rotation[joint] @ (J[:3] - np.cross(local, J[3:], axisb=0, axisc=0))
        np.testing.assert_allclose(out, -normal @ velocities, atol=1e-12)


def test_pieces_are_where_the_robot_says(robot):
    body, data, q = body_of(robot), robot.model.createData(), random_q(robot, np.random.default_rng(3))
    frames = new_frames(body)
    forward(body, q, frames)
    pin.forwardKinematics(robot.model, data, q)
    assert list(body.link) == sorted(p.link for p in robot.pieces)
    for k, piece in enumerate(sorted(robot.pieces, key=lambda p: p.link)):
        r, t = (np.array(x) for x in piece_pose(body, frames, k))
        joint = data.oMi[piece.joint + 1]
        np.testing.assert_allclose(r, joint.rotation @ piece.rotation, atol=1e-12)
        np.testing.assert_allclose(t, joint.act(piece.translation), atol=1e-12)
        assert body.first[piece.link] <= k < body.first[piece.link + 1]
