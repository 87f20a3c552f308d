"""The shipped robots: our arrays against Pinocchio and coal."""

from __future__ import annotations

import os
import subprocess
import sys

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.robots.robot import Robot, load_robot
from cdfctl.robots.robot_file import shipped_names


@pytest.fixture(scope="module", params=shipped_names())
def robot(request) -> Robot:
    return load_robot(request.param)


def random_q(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(np.maximum(robot.lower, -7.0), np.minimum(robot.upper, 7.0))


def joint_frames(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """X_i = X_parent * (rotation, translation) * (turn or slide), by Rodrigues' formula."""
    chain = robot.chain
    rotations, origins = np.zeros((robot.n, 3, 3)), np.zeros((robot.n, 3))
    for i in range(robot.n):
        R, p = chain.rotation[i], chain.translation[i]
        x, y, z = chain.axis[i]
        if chain.prismatic[i]:
            p = p + R @ chain.axis[i] * q[i]
        else:
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            R = R @ (np.eye(3) + np.sin(q[i]) * K + (1 - np.cos(q[i])) * K @ K)
        if chain.parent[i] >= 0:
            R0, p0 = rotations[chain.parent[i]], origins[chain.parent[i]]
            R, p = R0 @ R, p0 + R0 @ p
        rotations[i], origins[i] = R, p
    return rotations, origins


def test_the_chain_gives_pinocchios_frames(robot):
    data, rng = robot.model.createData(), np.random.default_rng(0)
    assert robot.model.nq == robot.model.nv == robot.n == len(robot.joint_names)
    np.testing.assert_allclose(np.linalg.norm(robot.chain.axis, axis=1), 1.0, atol=1e-12)
    for _ in range(20):
        q = random_q(robot, rng)
        pin.forwardKinematics(robot.model, data, q)
        rotations, origins = joint_frames(robot, q)
        for i in range(robot.n):
            np.testing.assert_allclose(rotations[i], data.oMi[i + 1].rotation, atol=1e-12)
            np.testing.assert_allclose(origins[i], data.oMi[i + 1].translation, atol=1e-12)


def test_moves_is_the_pattern_of_the_jacobians(robot):
    data, q = robot.model.createData(), random_q(robot, np.random.default_rng(1))
    pin.computeJointJacobians(robot.model, data, q)
    for i in range(robot.n):
        jacobian = pin.getJointJacobian(robot.model, data, i + 1, pin.ReferenceFrame.LOCAL)
        np.testing.assert_array_equal(np.any(jacobian != 0.0, axis=0), robot.chain.moves[:, i])


def coal_support(geometry, direction: np.ndarray) -> float:
    """Support function through coal: minus the distance of a far half-space from the geometry."""
    far = 10.0
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    plane = coal.Halfspace(-direction, -far)  # all x with direction . x >= far
    here = coal.Transform3s.Identity()
    return far - coal.distance(geometry, here, plane, here, request, coal.DistanceResult())


def test_pieces_are_the_geometry_of_the_moving_links(robot):
    rng = np.random.default_rng(2)
    data, placed, q = robot.model.createData(), robot.geometry.createData(), random_q(robot, rng)
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, q)
    rotations, origins = joint_frames(robot, q)
    moving = [k for k, body in enumerate(robot.geometry.geometryObjects) if body.parentJoint > 0]
    assert len(moving) == len(robot.pieces)
    assert len(robot.geometry_links) == len(robot.geometry.geometryObjects)
    for k, piece in zip(moving, robot.pieces, strict=True):
        body = robot.geometry.geometryObjects[k]
        assert (body.name, robot.geometry_links[k]) == (piece.name, robot.links[piece.link])
        assert body.parentJoint == piece.joint + 1
        R = rotations[piece.joint] @ piece.rotation
        p = origins[piece.joint] + rotations[piece.joint] @ piece.translation
        np.testing.assert_allclose(R, placed.oMg[k].rotation, atol=1e-12)
        np.testing.assert_allclose(p, placed.oMg[k].translation, atol=1e-12)
        for direction in rng.normal(size=(5, 3)):
            d = direction / np.linalg.norm(direction)
            ours = (piece.vertices @ d).max() + piece.disc * np.hypot(d[0], d[1]) + piece.radius
            assert ours == pytest.approx(coal_support(body.geometry, d), abs=1e-6)


def test_a_small_ball_inside_any_link_is_in_penetration(robot):
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    for body in robot.geometry.geometryObjects:
        geometry = body.geometry
        points = np.array(geometry.points()) if isinstance(geometry, coal.Convex) else np.zeros((1, 3))
        there = coal.Transform3s(np.eye(3), points.mean(axis=0))
        result.clear()
        d = coal.distance(geometry, coal.Transform3s.Identity(), coal.Sphere(1e-3), there, request, result)
        assert d < -0.9e-3


def test_home_is_inside_the_limits_and_out_of_self_contact(robot):
    assert np.all(robot.lower <= robot.home)
    assert np.all(robot.home <= robot.upper)
    data, placed = robot.model.createData(), robot.geometry.createData()
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, robot.home)
    bodies = list(robot.geometry.geometryObjects)
    for i, first in enumerate(bodies):
        for j, second in enumerate(bodies[:i]):
            if abs(first.parentJoint - second.parentJoint) < 2:  # neighbours' hulls overlap at their joint
                continue
            placements = [coal.Transform3s(placed.oMg[k].rotation, placed.oMg[k].translation) for k in (i, j)]
            arguments = (first.geometry, placements[0], second.geometry, placements[1])
            assert coal.distance(*arguments, coal.DistanceRequest(), coal.DistanceResult()) > 0.0


def test_limits_are_usable(robot):
    assert np.all(robot.lower < robot.upper)
    assert np.all(robot.velocity_limit > 0.0)
    assert np.array_equal(robot.continuous, np.isinf(robot.upper))
    np.testing.assert_array_equal(robot.model.lowerPositionLimit, robot.lower)


def test_franka_is_as_the_documents_say():
    robot = load_robot("franka")
    assert robot.links == (*(f"panda_link{i}" for i in range(1, 8)), "panda_hand", "fingers")
    assert robot.base_links == ("panda_link0",)
    assert len(robot.pieces) == 9
    assert "panda_finger_joint1 locked at 0 m" in robot.notes
    assert [piece.joint for piece in robot.pieces] == [0, 1, 2, 3, 4, 5, 6, 6, 6]
    # the closed fingers are about the tool centre point
    tip = robot.tip_position(robot.home)
    data, placed = robot.model.createData(), robot.geometry.createData()
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, robot.home)
    fingers = robot.pieces[-1]
    world = fingers.vertices @ placed.oMg[9].rotation.T + placed.oMg[9].translation
    assert np.abs(world - tip).max() < 0.1


def test_franka_locked_open_is_another_robot():
    closed = load_robot("franka")
    opened = load_robot("franka", lock={"panda_finger_joint1": 0.04, "panda_finger_joint2": 0.04})
    hand = closed.model.frames[closed.model.getFrameId("panda_hand")].placement
    across = [np.ptp(robot.pieces[-1].vertices @ hand.rotation[:, 1]) for robot in (closed, opened)]
    assert across[1] - across[0] == pytest.approx(0.08)
    assert opened.hash != closed.hash


@settings(max_examples=30, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_the_planar_arm_is_two_segments_of_two_metres(planar, a, b):
    elbow = np.array([2 * np.cos(a), 2 * np.sin(a), 0.0])
    tip = elbow + np.array([2 * np.cos(a + b), 2 * np.sin(a + b), 0.0])
    np.testing.assert_allclose(planar.tip_position(np.array([a, b])), tip, atol=1e-12)
    rotations, origins = joint_frames(planar, np.array([a, b]))
    ends = []
    for piece in planar.pieces:
        assert piece.radius == 1e-9
        local = piece.vertices @ piece.rotation.T + piece.translation
        ends.append(local @ rotations[piece.joint].T + origins[piece.joint])
    np.testing.assert_allclose(ends[0], [np.zeros(3), elbow], atol=1e-12)
    np.testing.assert_allclose(ends[1], [elbow, tip], atol=1e-12)


@pytest.fixture(scope="module")
def planar() -> Robot:
    return load_robot("planar")


def test_tip_path_is_row_by_row(planar):
    Q = np.random.default_rng(3).uniform(-3, 3, (4, 2))
    np.testing.assert_array_equal(planar.tip_path(Q), [planar.tip_position(q) for q in Q])
    assert planar.tip_path(np.zeros((0, 2))).shape == (0, 3)


def test_the_hash_is_the_same_in_another_process():
    code = "from cdfctl.robots.robot import load_robot; print(*(load_robot(r).hash for r in ('franka', 'planar')))"
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert result.stdout.split() == [load_robot("franka").hash, load_robot("planar").hash]


def test_the_hash_follows_what_a_contact_depends_on(planar):
    hashes = {
        planar.hash,
        load_robot("planar", position_limits={"joint1": (-1.0, 1.0)}).hash,
        load_robot("planar", lock={"joint1": 0.0}).hash,
        load_robot("planar", lock={"joint1": 0.5}).hash,
    }
    assert len(hashes) == 4
    assert load_robot("planar", velocity_limits=1.0).hash == planar.hash
    assert load_robot("planar", tip="link1").hash == planar.hash
