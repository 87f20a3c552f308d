"""Self-collision rows: against hand-computed numbers, and in closed loops that want to collide."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.control.rows import self_collision_rows
from cdfctl.control.safety_filter import SafetyFilter
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.robots.self_pairs import self_distances, self_pairs
from cdfctl.types import Array, Scene, SelfQuery


@pytest.fixture(scope="module")
def franka() -> Robot:
    return load_robot("franka")


def nearest(robot: Robot, q: Array) -> float:
    return float(self_distances(robot, self_pairs(robot).checked, q).min())


def test_rows_symbol_by_symbol() -> None:
    query = SelfQuery(
        pair=np.array([4, 1, 0]),
        d=np.array([0.01, 0.03, 0.5]),
        dq=np.array([[1.0, -2.0], [0.0, 0.0], [0.0, 0.5]]),
        valid=np.array([True, False, True]),
    )
    rows = self_collision_rows(query, alpha=3.0, margin=0.02)
    assert rows.G.tolist() == [[-1.0, 2.0], [0.0, -0.5]]
    assert rows.rhs == pytest.approx([3.0 * (0.01 - 0.02), 3.0 * (0.5 - 0.02)])
    assert rows.soft.all()
    assert not rows.delta.any()


@settings(max_examples=3)
@given(st.integers(0, 2**32 - 1))
def test_a_nominal_that_folds_the_arm_onto_itself_is_held(franka: Robot, seed: int) -> None:
    """Toward a configuration in collision with itself, for four seconds."""
    rng = np.random.default_rng(seed)
    goal = franka.home
    while nearest(franka, goal) > -0.01:
        goal = rng.uniform(franka.lower, franka.upper)
    safe = SafetyFilter(franka, "sdf-tvcbf-qp", dt=0.02, alpha=3.0, self_collision=6)
    q, least = franka.home.copy(), np.inf
    for _ in range(200):
        decision = safe.step(q, Scene(), 2.0 * (goal - q))
        q = q + 0.02 * decision.u
        least = min(least, nearest(franka, q))
    assert decision.h_self is not None
    assert decision.h_self[0] == pytest.approx(nearest(franka, q - 0.02 * decision.u) - 0.02, abs=1e-6)
    assert least > 0.018  # the margin of 0.02 less what one step of 20 ms gets wrong
    assert least < 0.03  # it went there
    assert decision.self_pair is not None
    assert any(" near ".join(decision.self_pair) == name for name in decision.active)


def test_without_rows_the_same_nominal_collides(franka: Robot) -> None:
    q, goal = franka.home.copy(), np.array([0.0, 1.6, 0.0, -3.0, 0.0, 0.5, 0.0])
    safe = SafetyFilter(franka, "sdf-tvcbf-qp", dt=0.02)
    for _ in range(150):
        decision = safe.step(q, Scene(), 2.0 * (goal - q))
        q = q + 0.02 * decision.u
    assert nearest(franka, q) < 0.0
    assert decision.h_self is None
    assert decision.self_pair is None


def test_out_of_penetration(franka: Robot) -> None:
    rng, q = np.random.default_rng(3), franka.home
    while not -0.05 < nearest(franka, q) < -0.02:
        q = rng.uniform(franka.lower, franka.upper)
    safe = SafetyFilter(franka, "sdf-tvcbf-qp", dt=0.02, self_collision=6)
    for _ in range(250):
        q = q + 0.02 * safe.step(q, Scene(), np.zeros(7)).u
    assert nearest(franka, q) > 0.015


def test_a_robot_that_cannot_touch_itself_has_no_such_rows() -> None:
    decision = SafetyFilter(load_robot("planar"), "sdf-tvcbf-qp", self_collision=6).step([0, 1], Scene(), [1, 1])
    assert decision.h_self is None
    assert decision.u == pytest.approx([1.0, 1.0])
