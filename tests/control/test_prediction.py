"""Predicted obstacles against the scenario's own motion, and margins that widen."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from cdfctl.control.planner.course import pose_at
from cdfctl.control.prediction import WIDEST, Prediction, Predictor
from cdfctl.scenario.shapes import ObstacleConfig
from cdfctl.simulation.motion import SceneMotion
from cdfctl.types import Obstacle, Scene, Sphere

BALL = {"type": "ball", "radius": 0.1}


def at(course, o, t):
    R, p = pose_at(course.knot, course.rotation, course.position, course.twist, o, t)
    return np.array(R), np.array(p)


def motion_of(*obstacles):
    return SceneMotion([ObstacleConfig.model_validate({"shape": BALL, **o}) for o in obstacles])


def test_a_constant_twist_with_delay_is_the_obstacles_own_motion():
    twist = {"velocity": [1.0, 0.5, 0.0], "angular_velocity": [0.3, 0.0, -1.0]}
    motion = motion_of({"position": [1.0, 2.0, 0.0], **twist})
    course = Predictor(Prediction(0.03, delay=0.2)).course(motion.at(1.0), 1.0)
    for t in (0.0, 0.7, 2.5):
        R, p = at(course, 0, t)
        pose = motion.poses(1.2 + t)[0]
        np.testing.assert_allclose(p, pose[:3], atol=1e-12)
        np.testing.assert_allclose(R, pin.Quaternion(pose[3:]).matrix(), atol=1e-12)


def test_a_known_motion_is_followed_round_its_corners():
    times, positions = [0.5, 1.0, 2.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    turns = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.6, 0.8], [0.6, 0.0, 0.0, 0.8]]
    way = {"motion": {"type": "waypoints", "times": times, "positions": positions, "orientations": turns}}
    straight = {"position": [0.0, 3.0, 0.0], "velocity": [0.0, -1.0, 0.0]}
    motion = motion_of(way, straight)
    known = Predictor(Prediction(0.03), motion).course(motion.at(0.7), 0.7)
    blind = Predictor(Prediction(0.03)).course(motion.at(0.7), 0.7)
    for t in np.linspace(0.0, 2.0, 21):
        for o in range(2):
            R, p = at(known, o, t)
            np.testing.assert_allclose(p, motion.poses(0.7 + t)[o, :3], atol=1e-12)
            np.testing.assert_allclose(R, pin.Quaternion(motion.poses(0.7 + t)[o, 3:]).matrix(), atol=1e-9)
    assert np.linalg.norm(at(blind, 0, 1.0)[1] - motion.poses(1.7)[0, :3]) > 0.5
    assert known.pace[0] >= 2.0  # as fast as its fastest stretch


def test_a_known_sinusoid_is_near():
    sway = {"type": "sinusoid", "amplitude": [0.2, 0.0, 0.1], "frequency": 0.8, "phase": 0.3}
    motion = motion_of({"position": [1.0, 0.0, 0.0], "motion": sway})
    known = Predictor(Prediction(0.03), motion).course(motion.at(0.4), 0.4)
    for t in np.linspace(0.0, 3.0, 61):
        # a chord of h is off by at most A w^2 h^2 / 8
        bound = np.hypot(0.2, 0.1) * (2.0 * np.pi * 0.8 * 0.05) ** 2 / 8.0
        np.testing.assert_allclose(at(known, 0, t)[1], motion.poses(0.4 + t)[0, :3], atol=bound + 1e-12)


@pytest.mark.parametrize("t", [0.0, 1.0, 50.0])
def test_the_margin_widens_with_time_and_speed_up_to_a_bound(t):
    scene = Scene(
        [Obstacle(Sphere(0.1), [2.0, 0.0, 0.0], velocity=[0.0, 0.2, 0.0]), Obstacle(Sphere(0.1), [3.0, 0, 0])]
    )
    course = Predictor(Prediction(0.03, delay=0.1, position_error=0.01, velocity_error=0.25)).course(scene)
    first, rate, widest = course.margin.T
    margin = np.minimum(first + t * rate, widest)
    np.testing.assert_allclose(margin, [0.04 + min(0.25 * 0.2 * (t + 0.1), WIDEST), 0.04], atol=1e-12)
    assert course.pace[0] == pytest.approx(0.2 * 1.25)


def test_the_same_shapes_are_packed_once():
    motion, predictor = (
        motion_of({"position": [1.0, 0.0, 0.0], "velocity": [1.0, 0.0, 0.0]}),
        Predictor(Prediction(0.03)),
    )
    assert predictor.course(motion.at(0.0)).sets is predictor.course(motion.at(1.0)).sets
