"""The safety filter as a library: what goes in, what comes out, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import cdfctl
from cdfctl import Box, Capsule, ConvexMesh, Cylinder, Obstacle, PointCloud, SafetyFilter, Scene, Sphere
from cdfctl.control.rows import joint_limit_box
from cdfctl.errors import InputError
from cdfctl.simulation.clearance import nearest

TETRAHEDRON = [[0.1, 0, 0], [-0.05, 0.09, 0], [-0.05, -0.09, 0], [0, 0, 0.12]]
SHAPES = [
    Sphere(0.08),
    Box((0.1, 0.15, 0.12)),
    Capsule(0.05, 0.2),
    Cylinder(0.06, 0.15),
    ConvexMesh(TETRAHEDRON),
    PointCloud(np.random.default_rng(0).uniform(-0.08, 0.08, (60, 3)), 0.01),
]


@pytest.fixture(scope="module")
def franka():
    return cdfctl.load_robot("franka", acceleration_limits=20.0)


@pytest.fixture(scope="module")
def planar():
    return cdfctl.load_robot("planar")


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_every_shape_moving_and_turning_is_kept_off(franka, shape):
    """It flies at the hand of an arm that is told to fly at it."""
    safe = SafetyFilter(franka, "sdf-tvcbf-qp", dt=0.02, alpha=5.0, margin=0.02, links="all", self_collision=4)
    q, hand = franka.home.copy(), franka.tip_position(franka.home)
    position, velocity, omega = (
        hand + np.array([0.35, 0.21, 0.0]),
        np.array([-0.25, -0.15, 0.0]),
        np.array([0.0, 0.0, 1.0]),
    )
    least = np.inf
    for k in range(100):
        angle = 0.5 * 0.02 * k
        turn = [0.0, 0.0, math.sin(angle), math.cos(angle)]
        scene = Scene([Obstacle(shape, position, turn, velocity, omega, name="it")])
        decision = safe.step(q, scene, [0.5, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0])
        q, position = q + 0.02 * decision.u, position + 0.02 * velocity
        found = nearest(franka, q, scene)
        least = min(least, found.distance)
    assert 0.0 < least < 0.08
    assert safe.counts["optimal"] + safe.counts["least-violation"] == 100


@settings(max_examples=20)
@given(arrays(np.float64, 7, elements=st.floats(-1e300, 1e300)))
def test_any_finite_nominal_gives_a_command_within_the_limits(franka, u_nominal):
    safe = SafetyFilter(franka, "sdf-tvcbf-qp", dt=0.1)
    decision = safe.step(franka.home, Scene(), u_nominal)
    low, high = joint_limit_box(
        franka.home, franka.lower, franka.upper, -franka.velocity_limit, franka.velocity_limit, 3.0
    )
    assert decision.status == "optimal"
    assert np.all(decision.u >= np.maximum(low, -2.0) - 1e-9)
    assert np.all(decision.u <= np.minimum(high, 2.0) + 1e-9)
    inside = np.clip(u_nominal, np.maximum(low, -2.0), np.minimum(high, 2.0))
    assert decision.u == pytest.approx(inside, abs=1e-6)


BAD: list[tuple[Any, Any, str]] = [
    ([0.0, math.nan], [0.0, 0.0], "q must be finite"),
    ([0.0, 0.0], [math.inf, 0.0], "u_nominal must be finite"),
]
WRONG: list[tuple[Any, Any, str]] = [
    ([0.0], [0.0, 0.0], "q must have 2 numbers"),
    ([0.0, 0.0], [0.0, 0.0, 0.0], "u_nominal must have 2 numbers"),
    ([0.0, 0.0], [[0.0, 0.0]], r"u_nominal must have 2 numbers, found shape \(1, 2\)"),
    ([0.0, 0.0], "fast", "u_nominal must be a list of numbers, found 'fast'"),
    ([0.0, 0.0], None, "u_nominal must have 2 numbers"),
]


@pytest.mark.parametrize(("q", "u", "message"), BAD + WRONG)
def test_what_is_refused(planar, q, u, message):
    with pytest.raises(InputError, match=message):
        SafetyFilter(planar, "sdf-tvcbf-qp").step(q, Scene(), u)


@pytest.mark.parametrize(("q", "u", "message"), WRONG)
def test_a_wrong_length_is_an_error_also_where_bad_numbers_brake(planar, q, u, message):
    with pytest.raises(InputError, match=message):
        SafetyFilter(planar, "sdf-tvcbf-qp", on_bad_input="brake").step(q, Scene(), u)


@pytest.mark.parametrize(("q", "u", "message"), BAD)
def test_bad_numbers_brake_and_are_counted(q, u, message):
    arm = cdfctl.load_robot("planar", acceleration_limits=10.0)
    safe = SafetyFilter(arm, "sdf-tvcbf-qp", dt=0.1, on_bad_input="brake")
    scene = Scene([Obstacle(Sphere(0.1), [9, 9, 0])])
    assert safe.step([0, 0], scene, [1.5, -0.5]).u == pytest.approx([1.0, -0.5])
    decision = safe.step(q, scene, u)
    assert decision.status == "brake"
    assert decision.reason is not None
    assert message in decision.reason
    assert not decision.infeasible
    assert np.isnan(decision.h).tolist() == [True]
    assert decision.u.tolist() == [0.0, 0.0]
    assert safe.counts == {"optimal": 1, "brake": 1, "bad-input": 1}
    # the next good step goes on from standstill
    assert safe.step([0, 0], scene, [1.5, 0.0]).u == pytest.approx([1.0, 0.0])


def test_a_brake_keeps_the_acceleration_limit():
    arm = cdfctl.load_robot("planar", acceleration_limits=2.0)
    safe = SafetyFilter(arm, "sdf-tvcbf-qp", dt=0.1, on_bad_input="brake")
    safe.reset(u_last=[1.0, -0.3])
    commands = [safe.step([0, 0], Scene(), [math.nan, 0.0]).u.tolist() for _ in range(6)]
    assert commands[0] == pytest.approx([0.8, -0.1])
    assert commands[1] == pytest.approx([0.6, 0.0])
    assert commands[-1] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_scene_that_is_not_finite(planar):
    scene = Scene([Obstacle(Sphere(0.1), [1, 1, 0], name="ball")])
    scene.twists[0, 0] = math.nan
    with pytest.raises(InputError, match="obstacle 'ball' has a pose or velocity that is not finite"):
        SafetyFilter(planar, "sdf-tvcbf-qp").step([0, 0], scene, [0, 0])
    decision = SafetyFilter(planar, "sdf-tvcbf-qp", on_bad_input="brake").step([0, 0], scene, [1, 0])
    assert decision.status == "brake"
    assert decision.reason is not None
    assert "ball" in decision.reason


def test_arguments_that_are_refused(planar):
    with pytest.raises(InputError, match=r"scene must be a cdfctl.Scene, found list"):
        SafetyFilter(planar, "sdf-tvcbf-qp").step([0, 0], [], [0, 0])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="unknown on_bad_input 'stop'"):
        SafetyFilter(planar, on_bad_input="stop")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="self_collision"):
        SafetyFilter(planar, self_collision=-1)
    with pytest.raises(InputError, match="u_last must be finite"):
        SafetyFilter(planar).reset(u_last=[math.nan, 0.0])


def test_from_a_reset_on_the_same_calls_give_the_same_answers(franka):
    safe = SafetyFilter(franka, "dual-tvcbf-qp", dt=0.02, self_collision=6)
    rng = np.random.default_rng(5)
    scene = Scene([Obstacle(Sphere(0.1), [0.5, 0.1, 0.5], velocity=[0.0, -0.2, 0.0])])
    calls = [(franka.home + 0.02 * k * rng.uniform(-1, 1, 7), rng.uniform(-1, 1, 7)) for k in range(10)]
    answers = []
    for _ in range(2):
        safe.reset()
        answers.append([safe.step(q, scene, u) for q, u in calls])
    for first, second in zip(*answers, strict=True):
        assert first.u.tolist() == second.u.tolist()
        assert first.h.tolist() == second.h.tolist()
        assert first.active == second.active


def test_the_caller_may_change_the_command_it_got():
    safe = SafetyFilter(cdfctl.load_robot("planar", acceleration_limits=10.0), "sdf-tvcbf-qp", dt=0.1)
    decision = safe.step([0, 0], Scene(), [0.5, 0.5])
    decision.u[:] = 1e9
    assert safe.step([0, 0], Scene(), [9.0, 9.0]).u == pytest.approx([1.5, 1.5])


def test_a_scene_made_anew_keeps_its_shapes():
    """What a field converts them for, once instead of at every step."""
    cloud = PointCloud([[0.0, 0.0, 0.0]], 0.1)

    def scene(radius=0.3, points=cloud):
        return Scene([Obstacle(Sphere(radius), [2.0, 2.5, 0.0]), Obstacle(points, [0, 0, 0])])

    assert scene().shapes is scene().shapes
    assert scene(0.2).shapes is not scene().shapes
    assert scene(points=PointCloud([[0.0, 0.0, 0.0]], 0.1)).shapes is not scene().shapes
    assert scene(np.array(0.3)).shapes[0].radius == 0.3


def test_it_says_what_holds_it(planar):
    scene = Scene([Obstacle(Sphere(0.3), [2.0, 2.5, 0.0], name="disc")])
    safe = SafetyFilter(planar, "sdf-tvcbf-qp", dt=0.1)
    held = safe.step([0.0, 0.9], scene, [1.0, 1.0])
    assert held.active == ("disc near link2",)
    assert safe.step([0.0, 0.9], scene, [-1.0, -1.0]).active == ()
    assert safe.step([0.0, 0.9], scene, [-3.0, -1.0]).active == ("bound of joint1",)
    assert safe.parameters.margin == 0.05
    assert (safe.dt, safe.robot) == (0.1, planar)
