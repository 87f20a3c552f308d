"""Acceleration limits: one joint against the closed form, and what holds for every joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.control.rows import acceleration_box, joint_limit_box, stopping_speed
from cdfctl.control.safety_filter import SafetyFilter
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.types import Array, Scene


def way_to_stop(v: float, a: float, dt: float) -> float:
    """Step by step, by hand: the velocity is held for dt and falls by a dt."""
    way = 0.0
    while v > 0.0:
        way += v * dt
        v -= a * dt
    return way


@given(st.floats(0.0, 10.0), st.floats(0.1, 50.0), st.sampled_from([0.001, 0.01, 0.1]))
def test_the_stopping_speed_uses_the_room_and_no_more(room: float, a: float, dt: float) -> None:
    v = float(stopping_speed(np.array([room]), np.array([a]), dt)[0])
    if v / (a * dt) < 1e5:
        assert way_to_stop(v, a, dt) == pytest.approx(room, rel=1e-6, abs=1e-9)


def test_the_stopping_speed_in_the_limits() -> None:
    speed = stopping_speed(np.array([-0.1, 0.0, np.inf, 1.0]), np.array([1.0, 1.0, 1.0, np.inf]), 0.1)
    assert speed.tolist() == [0.0, 0.0, np.inf, np.inf]
    # a short step: v^2 = 2 a s
    assert stopping_speed(np.array([2.0]), np.array([4.0]), 1e-5) == pytest.approx([4.0], rel=1e-4)


def box(
    q: float, u_last: float, a: float, dt: float = 0.1, alpha: float = 3.0, speed: float = 2.0
) -> tuple[float, float]:
    one = np.ones(1)
    low, high = joint_limit_box(q * one, -one, one, -speed * one, speed * one, alpha)
    low, high = acceleration_box(low, high, (q + 1) * one, (1 - q) * one, u_last * one, a * one, dt)
    return float(low[0]), float(high[0])


def test_one_joint_by_hand() -> None:
    assert box(0.0, 0.0, a=2.0) == pytest.approx((-0.2, 0.2))
    assert box(0.0, 1.0, a=2.0) == pytest.approx((0.8, 1.2))
    assert box(0.0, 0.5, a=np.inf) == pytest.approx((-2.0, 2.0))
    # 0.12 rad before the limit at a = 2, dt = 0.1: 0.12 = a dt^2 (3 * 4 / 2), so v_stop = 3 a dt = 0.6; the barrier
    # allows 3 * 0.12 = 0.36, and the last command of 0.5 can fall to 0.3 only
    assert box(0.88, 0.6, a=2.0) == pytest.approx((0.4, 0.4))
    assert box(0.88, 0.5, a=2.0) == pytest.approx((0.3, 0.36))


@settings(max_examples=30)
@given(
    st.floats(0.2, 50.0),
    st.sampled_from([0.005, 0.02, 0.1]),
    st.floats(0.5, 10.0),
    st.floats(0.1, 4.0),
    st.integers(0, 2**32 - 1),
)
def test_whatever_is_asked_the_joint_keeps_acceleration_speed_and_position(
    a: float, dt: float, alpha: float, speed: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    q, u = 0.0, 0.0
    for k in range(120):
        low, high = box(q, u, a, dt, alpha, speed)
        assert low <= high
        # mostly full speed one way for long, the worst there is
        wish = speed if (k // 40) % 2 == 0 else -speed
        command = min(max(wish if rng.random() < 0.9 else rng.uniform(-speed, speed), low), high)
        assert abs(command - u) <= a * dt * (1 + 1e-12)
        assert abs(command) <= speed * (1 + 1e-12)
        q, u = q + command * dt, command
        assert -1.0 - 1e-9 <= q <= 1.0 + 1e-9


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("planar", acceleration_limits=5.0)


def test_the_filter_ramps_up_and_brakes(arm: Robot) -> None:
    safe = SafetyFilter(arm, "sdf-tvcbf-qp", dt=0.01)
    u = np.array([safe.step([0.0, 0.0], Scene(), [1.0, -0.02]).u for _ in range(30)])
    assert u[:3] == pytest.approx(np.array([[0.05, -0.02], [0.10, -0.02], [0.15, -0.02]]))
    assert u[-1] == pytest.approx([1.0, -0.02])
    assert np.abs(np.diff(u, axis=0)).max() <= 0.05 + 1e-9
    down = np.array([safe.step([0.0, 0.0], Scene(), [0.0, 0.0]).u for _ in range(25)])
    assert down[0] == pytest.approx([0.95, 0.0])
    assert down[-1] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_the_last_command_may_be_told(arm: Robot) -> None:
    safe = SafetyFilter(arm, "sdf-tvcbf-qp", dt=0.01)
    assert safe.step([0, 0], Scene(), [2, 2], u_last=[1.0, 0.5]).u == pytest.approx([1.05, 0.55])
    safe.reset(u_last=[-1.0, 0.0])
    assert safe.step([0, 0], Scene(), [2, 2]).u == pytest.approx([-0.95, 0.05])


def test_limits_by_name_of_one_joint_only() -> None:
    robot = load_robot("planar", acceleration_limits={"joint2": 1.0})
    assert robot.acceleration_limit.tolist() == [np.inf, 1.0]
    decision = SafetyFilter(robot, "sdf-tvcbf-qp", dt=0.01).step([0, 0], Scene(), [2, 2])
    assert decision.u == pytest.approx([2.0, 0.01])
    assert decision.active == ("bound of joint2",)


def test_a_robot_without_limits_is_commanded_as_before(arm: Robot) -> None:
    free = replace(arm, acceleration_limit=np.full(2, np.inf))
    u: Array = SafetyFilter(free, "sdf-tvcbf-qp", dt=0.01).step([0, 0], Scene(), [1.5, -1.5]).u
    assert u == pytest.approx([1.5, -1.5])
