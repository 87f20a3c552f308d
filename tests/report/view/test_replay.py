"""What stands where at an instant, against the run's arrays and against other ways to the same numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation, Slerp

from cdfctl.errors import InputError
from cdfctl.report.view.replay import Replay, slerp
from cdfctl.simulation.clearance import nearest
from cdfctl.simulation.run_folder import read_run
from cdfctl.types import Box, Scene, Sphere

from .made import INFEASIBLE


def test_at_a_control_step_it_is_what_the_arrays_say(replay):
    run = replay.trajectory
    for k in (0, 7, 20):
        instant = replay.at(float(run.t[k]))
        np.testing.assert_allclose(instant.q, run.q[k], atol=1e-12)
        np.testing.assert_allclose(instant.obstacle_pose, run.obstacle_pose[k], atol=1e-9)
        assert instant.step == min(k, 19)
    assert [k for k in range(20) if replay.at(0.1 * k).infeasible] == [INFEASIBLE]


def test_between_steps_the_arm_moves_straight_and_the_box_turns_evenly(replay):
    run, t = replay.trajectory, 0.737
    instant = replay.at(t)
    np.testing.assert_allclose(instant.q, 0.63 * run.q[7] + 0.37 * run.q[8], atol=1e-9)
    turn = Slerp(run.t[7:9], Rotation.from_quat(run.obstacle_pose[7:9, 1, 3:]))(t)
    assert (turn.inv() * Rotation.from_quat(instant.obstacle_pose[1, 3:])).magnitude() < 1e-9
    np.testing.assert_allclose(instant.obstacle_pose[0, :3], [0.5, 0.8 - 0.15 * t, 0.6], atol=1e-9)


def test_a_turn_goes_the_shorter_way_whatever_the_sign_of_a_quaternion():
    first, second = Rotation.from_rotvec([0.0, 0.0, 0.2]).as_quat(), Rotation.from_rotvec([0.0, 0.0, 0.6]).as_quat()
    for sign in (1.0, -1.0):
        half = Rotation.from_quat(slerp(first, sign * second, 0.5))
        np.testing.assert_allclose(half.as_rotvec(), [0.0, 0.0, 0.4], atol=1e-12)
    np.testing.assert_allclose(slerp(first, first, 0.3), first)


def test_time_is_held_within_the_run(replay):
    assert (replay.at(-1.0).t, replay.at(9.0).t) == (0.0, pytest.approx(2.0))


def test_a_plant_s_own_states_are_shown_between_the_steps(replay):
    run = replay.trajectory
    t = np.insert(run.t, 1, 0.05)
    q = np.insert(run.q, 1, run.q[0] + 0.2, axis=0)
    finer = Replay(replay.body, replace(run, plant_t=t, plant_q=q))
    np.testing.assert_allclose(finer.at(0.05).q, run.q[0] + 0.2)


def test_the_contact_shown_is_that_of_the_least_barrier_which_has_one(replay):
    early, late = replay.at(0.0), replay.at(1.5)
    assert (early.contact_obstacle, late.contact_obstacle) == (1, 0)
    np.testing.assert_allclose(early.contact_q, replay.trajectory.q[0] - 0.4)
    np.testing.assert_allclose(late.contact_q, replay.trajectory.q[15] + 0.2)


def test_the_distance_line_lies_between_the_two_surfaces(replay):
    body, run = replay.body, replay.trajectory
    for t in (0.0, 0.4, 1.1, 2.0):
        instant = replay.at(t)
        found = instant.closest
        scene = Scene.from_arrays(body.shapes, body.names, instant.obstacle_pose, run.obstacle_twist[0])
        judged = nearest(body.robot, instant.q, scene)
        assert found.distance == pytest.approx(judged.distance)
        assert body.robot.geometry_links[found.object] == judged.link
        assert body.names[found.obstacle] == judged.obstacle
        assert np.linalg.norm(found.on_obstacle - found.on_robot) == pytest.approx(abs(found.distance), abs=1e-6)
        pose, shape = instant.obstacle_pose[found.obstacle], body.shapes[found.obstacle]
        local = Rotation.from_quat(pose[3:]).inv().apply(found.on_obstacle - pose[:3])
        if isinstance(shape, Sphere):
            assert np.linalg.norm(local) == pytest.approx(shape.radius, abs=1e-6)
        else:
            assert isinstance(shape, Box)
            assert np.abs(local / (0.5 * np.array(shape.size))).max() == pytest.approx(1.0, abs=1e-6)


def test_the_plan_is_the_tip_s_way_through_it(replay):
    robot, run = replay.body.robot, replay.trajectory
    data = robot.model.createData()
    expected = []
    for q in (run.q[3], run.q[3] + 0.1):  # the third entry is NaN: the plan ends before
        pin.framesForwardKinematics(robot.model, data, q)
        expected.append(data.oMf[robot.model.getFrameId("panda_hand_tcp")].translation.copy())
    np.testing.assert_allclose(replay.at(0.3).plan, expected, atol=1e-12)


def test_a_run_without_steps_stands_still(replay):
    run = replay.trajectory
    cut = {name: getattr(run, name)[:0] for name in ("u", "h", "h_sdf", "contact_q", "V", "slack", "infeasible")}
    first = {name: getattr(run, name)[:1] for name in ("t", "q", "obstacle_pose", "obstacle_twist")}
    still = Replay(replay.body, replace(run, **cut, **first, step_time=run.step_time[:0], plan_q=None, plan_t=None))
    instant = still.at(1.0)
    np.testing.assert_allclose(instant.q, run.q[0])
    assert (instant.t, instant.contact_q, instant.plan, instant.infeasible) == (0.0, None, None, False)
    assert instant.closest is not None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"q": np.zeros((21, 6))}, "is of 6 joints, but the scenario's robot 'franka' has 7"),
        ({"h": np.zeros((20, 3))}, "is of 3 obstacles, but the scenario has 2"),
        ({"t": np.full(21, np.nan)}, "not finite"),
    ],
)
def test_arrays_of_another_run_are_refused(run_folder, change, words):
    run = read_run(run_folder)
    with pytest.raises(InputError, match=words):
        Replay.of(replace(run, trajectory=replace(run.trajectory, **change)))
