"""Velocity limits that fall towards the end stops: against Franka's printed numbers, and what they promise."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.control.core import Core
from cdfctl.control.parameters import config_of, resolved
from cdfctl.control.safety_filter import SafetyFilter
from cdfctl.errors import InputError
from cdfctl.robots.braking import Braking
from cdfctl.robots.robot import load_robot
from cdfctl.types import Scene

# Franka Robotics, limits for Franka Research 3, as in franka_description: v, 2 a, o, q_max, q_min.
PRINTED = [
    (2.62, 12.0, 0.652, 2.9007, -2.9007),
    (2.62, 5.17, 0.25, 1.8361, -1.8361),
    (2.62, 7.0, 0.2005, 2.9007, -2.9007),
    (2.62, 8.0, 0.3542, -0.1169, -3.077),
    (5.26, 34.0, 0.5738, 2.8763, -2.8763),
    (4.18, 11.0, 0.4885, 4.6216, 0.4398),
    (5.26, 34.0, 0.4592, 3.0508, -3.0508),
]


def test_the_fr3_has_frankas_limits():
    robot = load_robot("fr3")
    assert robot.lower[5] == pytest.approx(0.44, abs=1e-3)
    for share in np.linspace(0.0, 1.0, 23):
        q = robot.lower + share * (robot.upper - robot.lower)
        low, high = robot.velocity_bounds(q)
        for i, (v, a2, o, top, bottom) in enumerate(PRINTED):
            assert high[i] == pytest.approx(min(v, max(0.0, -o + math.sqrt(max(0.0, a2 * (top - q[i]))))), abs=1e-9)
            assert low[i] == pytest.approx(max(-v, min(0.0, o - math.sqrt(max(0.0, a2 * (q[i] - bottom))))), abs=1e-9)


def test_other_arms_are_bounded_alike_everywhere():
    robot = load_robot("franka")
    assert robot.braking is None
    low, high = robot.velocity_bounds(robot.upper, 0.1)
    assert (-low).tolist() == high.tolist() == robot.velocity_limit.tolist()


@settings(max_examples=300, deadline=None)
@given(st.floats(-0.2, 3.0), st.floats(0.1, 20.0), st.floats(0.0, 1.0), st.floats(0.001, 0.2))
def test_a_velocity_that_is_held_obeys_the_limit_where_it_ends(room: float, a: float, o: float, dt: float):
    """q = 0, the end stop at ``room``: to be at the limit at the end of the step, and not beyond it."""
    braking = Braking(np.array([-50.0]), np.array([room]), np.array([a]), np.array([o]))
    u = float(braking.bounds(np.zeros(1), dt)[1][0])
    at_the_end = float(braking.bounds(np.array([u * dt]))[1][0])
    assert u >= 0.0
    if u > 0.0:
        assert u == pytest.approx(at_the_end, abs=1e-7)
    assert braking.bounds(np.zeros(1))[1][0] >= u


def test_the_filter_keeps_to_it():
    """Full speed at the end stop of joint 2, at 10 Hz: the printed limit is never passed, the stop never touched."""
    robot = load_robot("fr3")
    safe = SafetyFilter(robot, variant="sdf-tvcbf-qp", dt=0.1, limit_alpha=100.0)
    q, nominal, fastest = robot.home.copy(), np.zeros(7), 0.0
    nominal[1] = 10.0
    for _ in range(40):
        u = safe.step(q, Scene([]), nominal).u
        q = q + 0.1 * u
        fastest = max(fastest, u[1])
        v, a2, o, top, _ = PRINTED[1]
        assert u[1] <= min(v, max(0.0, -o + math.sqrt(a2 * max(0.0, top - q[1])))) + 1e-6
    assert fastest == pytest.approx(2.62)
    assert 1.80 < q[1] < 1.8361


def test_a_plan_keeps_to_it_too():
    """A command that is followed as it is, but for what its plan does not know."""
    robot = load_robot("fr3")
    core = Core(robot, *resolved(config_of("sdf-tvcbf-qp", {})), 0.1)
    q, u = robot.home.copy(), np.zeros(7)
    q[1], u[1] = 1.6, 2.62
    followed = core.follow(q, Scene([]), u)
    assert followed.u[1] <= robot.velocity_bounds(q, 0.1)[1][1] + 1e-9
    q[1] = -1.0  # far from the stop
    assert core.follow(q, Scene([]), u).u == pytest.approx(u, abs=1e-6)


@pytest.mark.parametrize(
    ("braking", "message"),
    [
        ("{panda_joint8: {lower: 0, upper: 1, deceleration: 1}}", "braking: unknown joint 'panda_joint8'"),
        ("{panda_joint1: {lower: 1, upper: 1, deceleration: 1}}", "end stops of joint 'panda_joint1' must ascend"),
        ("{panda_joint1: {lower: 0, upper: 1, deceleration: 0}}", "greater than 0"),
    ],
)
def test_what_is_refused(tmp_path: Path, braking: str, message: str):
    shipped = Path(__file__).parents[2] / "cdfctl" / "robots" / "data" / "franka.yaml"
    (tmp_path / "mine.yaml").write_text(shipped.read_text() + f"braking: {braking}\n")
    with pytest.raises(InputError, match=message):
        load_robot(tmp_path / "mine.yaml")


def test_a_locked_joint_brakes_no_more():
    robot = load_robot("fr3", lock={"panda_joint1": 0.0})
    assert len(robot.velocity_bounds(robot.home)[0]) == 6
