"""A robot's distances to itself: against coal asked pair by pair, finite differences and a closed form."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.fields.self_distance import SelfDistance
from cdfctl.robots.robot import load_robot
from cdfctl.types import Array

K = 6


@pytest.fixture(scope="module", params=["franka", "ur5", "z1"])
def field(request):
    return SelfDistance(load_robot(request.param), K, 0.02)


def configuration(field: SelfDistance, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(field.robot.lower, field.robot.upper)


def truth(field: SelfDistance, q: Array, pair: int) -> float:
    """coal's signed distance of one pair, placed by hand, without a gradient."""
    robot = field.robot
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    bodies = [robot.geometry.geometryObjects[int(i)] for i in field.pairs[pair]]
    placed = [data.oMi[body.parentJoint] * body.placement for body in bodies]
    frames = [coal.Transform3s(frame.rotation, frame.translation) for frame in placed]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = request.epa_tolerance = 1e-10
    request.epa_max_iterations = 1000
    request.enable_signed_distance = True
    return float(coal.distance(bodies[0].geometry, frames[0], bodies[1].geometry, frames[1], request, result))


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_nearest_pairs_are_those_of_all_pairs(field, seed):
    q = configuration(field, seed)
    answer = field.query(q)
    everything = np.array([truth(field, q, pair) for pair in range(len(field.pairs))])
    if field.robot.name == "z1":  # cylinders: coal's depths are worth little, the distances are exact
        everything, found = np.maximum(everything, 0.0), np.maximum(answer.d, 0.0)
    else:
        found = answer.d
    assert found == pytest.approx(np.sort(everything)[:K], abs=1e-6)
    assert found == pytest.approx(everything[answer.pair], abs=1e-6)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_gradients_are_those_of_finite_differences(field, seed):
    q, e = configuration(field, seed), 1e-5
    answer = field.query(q)
    for pair, d, dq, valid in zip(answer.pair, answer.d, answer.dq, answer.valid, strict=True):
        if not valid or (d < 0.0 and field.robot.name == "z1"):
            continue
        steps = np.eye(field.robot.n) * e
        ahead, behind = (np.array([truth(field, q + s * step, pair) for step in steps]) for s in (1, -1))
        difference = (ahead - behind) / (2 * e)
        second = np.abs(ahead + behind - 2 * truth(field, q, pair)) / e  # the jump of the slope where d has an edge
        assert dq == pytest.approx(difference, abs=2e-3 + float(second.max())), (pair, d)


def test_gradients_in_penetration():
    """The hand pressed into the base: the rows that matter most."""
    field = SelfDistance(load_robot("franka"), K, 0.02)
    rng, seen, e = np.random.default_rng(0), 0, 1e-5
    while seen < 10:
        q = rng.uniform(field.robot.lower, field.robot.upper)
        answer = field.query(q)
        if answer.d[0] > -0.005:
            continue
        seen += 1
        difference = [
            (truth(field, q + step, answer.pair[0]) - truth(field, q - step, answer.pair[0])) / (2 * e)
            for step in np.eye(field.robot.n) * e
        ]
        assert answer.valid[0]
        assert answer.dq[0] == pytest.approx(difference, abs=1e-3)


def test_after_a_reset_the_same_calls_give_the_same_answers(field):
    Q = [configuration(field, seed) for seed in range(20)]
    field.reset()
    first = [field.query(q) for q in Q]
    field.reset()
    for q, expected in zip(Q, first, strict=True):
        answer = field.query(q)
        assert answer.d.tolist() == expected.d.tolist()
        assert answer.dq.tolist() == expected.dq.tolist()


def test_only_the_joints_between_two_bodies_count():
    field = SelfDistance(load_robot("franka"), 16, 0.02)
    answer = field.query(np.array([0.3, 0.9, -0.4, -2.6, 0.2, 1.0, 0.5]))
    for pair, dq in zip(answer.pair, answer.dq, strict=True):
        first, second = (field.robot.geometry.geometryObjects[int(i)].parentJoint for i in field.pairs[pair])
        assert not dq[:first].any()
        assert not dq[second:].any()
        assert dq[first:second].any()


def test_rows_far_apart_and_robots_without_pairs():
    field = SelfDistance(load_robot("planar"), K, 0.02)
    answer = field.query(np.zeros(2))
    assert answer.d.shape == (0,)
    assert answer.dq.shape == (0, 2)


def test_where_coal_gives_up_the_row_is_invalid_and_finite():
    field = SelfDistance(load_robot("z1"), K, 0.02)
    rng = np.random.default_rng(1)
    given_up = 0
    for _ in range(3000):
        q = rng.uniform(field.robot.lower, field.robot.upper)
        answer = field.query(q)
        assert np.isfinite(answer.d).all()
        assert np.isfinite(answer.dq).all()
        given_up += int((~answer.valid).sum())
        if given_up >= 3:
            return
    raise AssertionError("nothing was shown: coal found every depth")
