"""Every controller of the table, one step each, on the one-joint arm of ``test_controller``, by hand.

A link of 4 m along q; a ball of radius r at distance rho < 4 and angle theta, Delta = theta - q in (0, pi/2):

    d_s = rho sin(Delta) - r                       dd_s/dq = -rho cos(Delta)
    d_c = Delta - asin(r / rho)                    dd_c/dq = -1
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdfctl.control.controller import build
from cdfctl.control.reaching import Reaching, moved
from cdfctl.errors import InputError
from cdfctl.fields.field import make_field
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.scenario.schema import ControllerConfig, JointGoalTask, ReachTask, TargetConfig
from cdfctl.scenario.shapes import BallShape
from cdfctl.types import Box, Decision, Obstacle, Scene, Sphere, State

RHO, R, LIMIT, DT = 2.0, 0.3, 2.0, 0.1
GAIN, B, GAMMA, P = 4.0, 0.3, 1.5, 100.0


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("planar", lock={"joint2": 0.0}, velocity_limits=LIMIT)


def ball(theta: float, velocity: tuple[float, float] = (0.0, 0.0)) -> Scene:
    place = [RHO * math.cos(theta), RHO * math.sin(theta), 0.0]
    return Scene([Obstacle(Sphere(R), position=place, velocity=[*velocity, 0.0])])


def distance(field: str, q: float, x: float, y: float) -> tuple[float, float]:
    """(d, dd/dq) to a ball at (x, y) ahead of the link."""
    rho, delta = math.hypot(x, y), math.atan2(y, x) - q
    if field == "sdf":
        return rho * math.sin(delta) - R, -rho * math.cos(delta)
    return delta - math.asin(R / rho), -1.0


@pytest.mark.parametrize("field", ["sdf", "cdf"])
@pytest.mark.parametrize(("q", "goal", "theta"), [(0.2, 1.2, 0.45), (0.2, 0.25, 0.9), (0.1, 1.0, 0.3)])
def test_separating_hyperplane(arm: Robot, field: str, q: float, goal: float, theta: float) -> None:
    """u = min(K (goal - q), v, ln(d + b) / (-dd/dq Dt)); the ball's velocity does not matter."""
    config = ControllerConfig(variant=f"{field}-sh-qp", gain=GAIN, hyperplane_offset=B, on_infeasible="brake")
    controller = build(arm, config, JointGoalTask(type="joint-goal", goal=(goal,)), DT)
    decision = controller.step(State(0.0, np.array([q])), ball(theta, (0.0, -1.0)))
    d, slope = distance(field, q, RHO * math.cos(theta), RHO * math.sin(theta))
    bound = math.log(d + B) / (-slope * DT)
    if bound < -LIMIT:
        assert decision.infeasible
        assert decision.u == pytest.approx([0.0])
    else:
        assert decision.u == pytest.approx([min(GAIN * (goal - q), LIMIT, bound)], abs=1e-5)


def test_hyperplane_offset_defaults_to_0_3(arm: Robot) -> None:
    """Where d + b = 1 the row reads u <= 0."""
    theta = 0.2 + math.asin((0.7 + R) / RHO)
    controller = build(arm, ControllerConfig(variant="sdf-sh-qp"), JointGoalTask(type="joint-goal", goal=(1.0,)), DT)
    assert controller.step(State(0.0, np.array([0.2])), ball(theta)).u == pytest.approx([0.0], abs=1e-6)


def reach(arm: Robot, variant: str, q: float, target: Scene, scene: Scene) -> Decision:
    config = ControllerConfig(variant=variant, gamma=GAMMA, slack_weight=P)
    body = TargetConfig(shape=BallShape(type="ball", radius=R), position=(2.0, 2.0, 0.0))
    controller = build(arm, config, ReachTask(type="reach", target=body), DT)
    return controller.step(State(0.0, np.array([q])), scene, target)


@pytest.mark.parametrize("field", ["sdf", "cdf"])
@pytest.mark.parametrize(("q", "theta", "v"), [(0.2, 0.9, (0.0, 0.0)), (0.2, 0.9, (0.6, -0.8)), (0.3, 0.6, (0.3, 0.3))])
def test_lyapunov_row(arm: Robot, field: str, q: float, theta: float, v: tuple[float, float]) -> None:
    """min u^2/2 + p delta^2 with g u - delta <= c, g = dV+/dq, c = -gamma V - (V+ - V)/Dt:  u = 2 p g c / (1 + 2 p g^2)
    where c < 0, and 0 elsewhere."""
    x, y = RHO * math.cos(theta), RHO * math.sin(theta)
    V, _ = distance(field, q, x, y)
    V_next, g = distance(field, q, x + v[0] * DT, y + v[1] * DT)
    c = -GAMMA * V - (V_next - V) / DT
    u = 2 * P * g * c / (1 + 2 * P * g * g) if c < 0 else 0.0
    decision = reach(arm, f"{field}-tvcbf-tvclf-qp", q, ball(theta, v), Scene())
    assert decision.u == pytest.approx([u], abs=1e-4)
    assert decision.slack == pytest.approx(max(0.0, g * u - c), abs=1e-4)
    assert pytest.approx(V, abs=1e-5) == decision.V
    assert decision.status == "optimal"


def test_safety_comes_before_the_target(arm: Robot) -> None:
    """A ball just ahead, on the way to the target: the barrier's row bounds u, and the slack pays."""
    x, y = RHO * math.cos(0.4), RHO * math.sin(0.4)
    d, slope = distance("sdf", 0.2, x, y)
    decision = reach(arm, "sdf-tvcbf-tvclf-qp", 0.2, ball(1.2), ball(0.4))
    assert decision.u == pytest.approx([(d - 0.05) / -slope], abs=1e-5)
    assert decision.slack > 1.0


def test_a_target_out_of_reach_asks_for_nothing(arm: Robot) -> None:
    far = Scene([Obstacle(Sphere(R), position=[5.0, 0.0, 0.0])])
    decision = reach(arm, "cdf-tvcbf-tvclf-qp", 0.2, far, Scene())
    assert decision.u == pytest.approx([0.0])
    assert math.isinf(decision.V)
    assert math.isnan(decision.slack)


def test_a_task_and_a_controller_that_do_not_go_together(arm: Robot) -> None:
    with pytest.raises(InputError, match="cannot do task 'reach'"):
        reach(arm, "sdf-tvcbf-qp", 0.2, ball(0.9), Scene())
    config = ControllerConfig(variant="sdf-tvcbf-tvclf-qp")
    with pytest.raises(InputError, match="cannot do task 'joint-goal'"):
        build(arm, config, JointGoalTask(type="joint-goal", goal=(1.0,)), DT)


def test_a_reach_task_needs_its_target(arm: Robot) -> None:
    body = TargetConfig(shape=BallShape(type="ball", radius=R), position=(2.0, 2.0, 0.0))
    controller = build(arm, ControllerConfig(variant="sdf-tvcbf-tvclf-qp"), ReachTask(type="reach", target=body), DT)
    with pytest.raises(InputError, match="needs its target"):
        controller.step(State(0.0, np.array([0.2])), Scene())
    with pytest.raises(InputError, match="one body, found 0"):
        Reaching(make_field("sdf", arm), 1.0, DT).value(np.array([0.2]), Scene())


def test_a_moved_scene_turns_about_its_axis() -> None:
    turning = Obstacle(Box((1, 1, 1)), [1, 2, 3], velocity=[1, 0, -1], angular_velocity=[0, 0, math.pi])
    still = Obstacle(Box((1, 1, 1)), [0, 0, 0], orientation=[0.5, 0.5, 0.5, 0.5])
    after = moved(Scene([turning, still]), 0.5)
    half = math.sqrt(0.5)
    assert after.poses[0] == pytest.approx([1.5, 2, 2.5, 0, 0, half, half])
    assert after.poses[1] == pytest.approx([0, 0, 0, 0.5, 0.5, 0.5, 0.5])
    twice = moved(after, 0.5)
    assert abs(twice.poses[0, 5]) == pytest.approx(1.0)
