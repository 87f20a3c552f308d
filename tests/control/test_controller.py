"""The controller and the safety filter on a one-joint arm whose every step can be computed by hand.

The arm is the planar one with its second joint locked straight: a link of 4 m along q. The ball, radius r, is at
distance rho and angle theta, beside the link (rho < 4), at Delta = theta - q in (0, pi/2):

    d = rho sin(Delta) - r,        dd/dq = -rho cos(Delta),        dd/dt = (-sin q, cos q) . v
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdfctl.control.controller import build, difference
from cdfctl.control.safety_filter import SafetyFilter
from cdfctl.errors import InputError
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.scenario.schema import ControllerConfig, HoldTask, JointGoalTask
from cdfctl.types import Obstacle, Scene, Sphere, State

RHO, RADIUS = 2.0, 0.3
ALPHA, MARGIN, GAIN, LIMIT = 1.5, 0.05, 4.0, 2.0


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("planar", lock={"joint2": 0.0}, velocity_limits=LIMIT)


def ball(theta: float, velocity: tuple[float, float] = (0.0, 0.0)) -> Scene:
    place = [RHO * math.cos(theta), RHO * math.sin(theta), 0.0]
    return Scene([Obstacle(Sphere(RADIUS), position=place, velocity=[*velocity, 0.0])])


def by_hand(
    q: float, goal: float, theta: float, v: tuple[float, float], *, time_term: bool = True
) -> tuple[float, float]:
    """(u, h): u = min(K (goal - q), v, (alpha h + dd/dt) / (rho cos Delta)), for a ball ahead of the link."""
    delta = theta - q
    h = RHO * math.sin(delta) - RADIUS - MARGIN
    rate = -math.sin(q) * v[0] + math.cos(q) * v[1] if time_term else 0.0
    row = (ALPHA * h + rate) / (RHO * math.cos(delta))
    return max(-LIMIT, min(GAIN * (goal - q), LIMIT, row)), h


CASES = [
    (0.2, 1.2, 0.9, (0.0, 0.0)),
    (0.2, 1.2, 0.9, (0.6, -0.8)),
    (0.2, 1.2, 0.45, (0.0, -1.0)),
    (-0.4, 0.0, 0.3, (0.3, 0.3)),
    (0.2, 0.25, 0.9, (0.0, 0.0)),
]


@pytest.mark.parametrize(("q", "goal", "theta", "v"), CASES)
@pytest.mark.parametrize("variant", ["sdf-tvcbf-qp", "sdf-cbf-qp"])
def test_step_by_hand(arm: Robot, q: float, goal: float, theta: float, v: tuple[float, float], variant: str) -> None:
    config = ControllerConfig(variant=variant, alpha=ALPHA, margin=MARGIN, gain=GAIN)
    controller = build(arm, config, JointGoalTask(type="joint-goal", goal=(goal,)), 0.1)
    decision = controller.step(State(0.0, np.array([q])), ball(theta, v))
    u, h = by_hand(q, goal, theta, v, time_term=variant == "sdf-tvcbf-qp")
    assert decision.u == pytest.approx([u], abs=1e-6)
    assert decision.h == pytest.approx([h], abs=1e-7)
    assert decision.status == "optimal"
    assert not decision.infeasible
    assert decision.residual <= 1e-6
    assert decision.contact_q is None
    assert decision.h_sdf is None
    assert math.isnan(decision.slack)
    assert math.isnan(decision.V)


def test_filter_and_controller_are_one_core(arm: Robot) -> None:
    q, goal, theta, v = CASES[1]
    safe = SafetyFilter(arm, variant="sdf-tvcbf-qp", dt=0.1, alpha=ALPHA, margin=MARGIN)
    decision = safe.step([q], ball(theta, v), [GAIN * (goal - q)])
    assert decision.u == pytest.approx([by_hand(q, goal, theta, v)[0]], abs=1e-6)


def test_reference_is_not_clipped_before_the_program(arm: Robot) -> None:
    """With smoothness, u is the mean of reference and last command: a clipped reference would give another one."""
    config = ControllerConfig(variant="sdf-tvcbf-qp", gain=10.0, smoothness_weight=9.0)
    controller = build(arm, config, JointGoalTask(type="joint-goal", goal=(1.0,)), 0.1)
    state = State(0.0, np.zeros(1))
    assert controller.step(state, Scene()).u == pytest.approx([1.0])  # (10 + 9 * 0) / 10
    assert controller.step(state, Scene()).u == pytest.approx([1.9])  # (10 + 9 * 1) / 10
    controller.reset()
    assert controller.step(state, Scene()).u == pytest.approx([1.0])


def test_hold_task_pulls_back_to_its_pose(arm: Robot) -> None:
    controller = build(arm, ControllerConfig(gain=2.0), HoldTask(type="hold", pose=(0.5,)), 0.1)
    assert controller.step(State(0.0, np.array([0.2])), Scene()).u == pytest.approx([0.6])


def test_joint_limits_hold_without_obstacles(arm: Robot) -> None:
    controller = build(arm, ControllerConfig(limit_alpha=3.0), JointGoalTask(type="joint-goal", goal=(3.0,)), 0.1)
    assert controller.step(State(0.0, np.array([3.0])), Scene()).u == pytest.approx([0.0])
    beyond = build(arm, ControllerConfig(limit_alpha=3.0), JointGoalTask(type="joint-goal", goal=(3.3,)), 0.1)
    assert beyond.step(State(0.0, np.array([math.pi + 0.1])), Scene()).u == pytest.approx([-0.3])


def test_links_all_gives_a_row_a_link() -> None:
    planar = load_robot("planar")
    scene = Scene([Obstacle(Sphere(0.3), position=[2.0, 1.0, 0.0])])
    answers = [
        SafetyFilter(planar, variant="sdf-tvcbf-qp", links=links).step([0.0, 0.9], scene, [2.0, -2.0])
        for links in ("nearest", "all")
    ]
    assert answers[0].h == pytest.approx(answers[1].h)
    # Only the row of the first link, the farther one, sees that it is being driven into the ball: 2 u_1 <= 0.65.
    assert answers[0].u[0] > 0.4
    assert answers[1].u[0] == pytest.approx(0.325)


def test_many_obstacles_far_away_change_nothing(arm: Robot) -> None:
    far = Scene([Obstacle(Sphere(0.1), position=[100.0 + i, 0.0, 0.0]) for i in range(40)])
    decision = SafetyFilter(arm, variant="sdf-tvcbf-qp").step([0.1], far, [1.25])
    assert decision.u == pytest.approx([1.25])
    assert decision.h.shape == (40,)


@pytest.mark.parametrize("rule", ["fail", "brake", "least-violation"])
def test_penetration_too_deep_to_leave_is_marked(arm: Robot, rule: str) -> None:
    """The ball rushes into the link faster than the joint can retreat."""
    scene = ball(0.5, (0.0, -50.0))
    decision = SafetyFilter(arm, variant="sdf-tvcbf-qp", on_infeasible=rule).step([0.2], scene, [1.0])
    assert decision.infeasible
    assert decision.status == {"fail": "infeasible"}.get(rule, rule)
    assert decision.u == pytest.approx([-LIMIT if rule == "least-violation" else 0.0])
    assert decision.residual > 10.0


@pytest.mark.parametrize(
    ("q", "u", "text"),
    [
        ([math.nan], [0.0], "q must be finite"),
        ([0.0, 0.0], [0.0], "q must have 1 numbers"),
        ([0.0], [math.inf], "u_nominal must be finite"),
        ([0.0], [0.0, 1.0], "u_nominal must have 1 numbers"),
        (["a"], [0.0], "q must be a list of numbers"),
    ],
)
def test_bad_input_never_reaches_the_solver(arm: Robot, q: list[float], u: list[float], text: str) -> None:
    with pytest.raises(InputError, match=text):
        SafetyFilter(arm, variant="sdf-tvcbf-qp").step(q, Scene(), u)


def test_controller_refuses_a_state_that_is_not_finite(arm: Robot) -> None:
    controller = build(arm, ControllerConfig(), JointGoalTask(type="joint-goal", goal=(1.0,)), 0.1)
    for q in ([math.nan], [0.0, 0.0]):
        with pytest.raises(InputError, match="q must"):
            controller.step(State(0.0, np.array(q)), Scene())


def test_scene_that_is_not_finite_is_refused_by_name(arm: Robot) -> None:
    scene = Scene([Obstacle(Sphere(0.1), [0, 0, 0], name="a"), Obstacle(Sphere(0.1), [1, 0, 0], name="b")])
    scene.twists[1, 4] = math.nan
    with pytest.raises(InputError, match="obstacle 'b'"):
        SafetyFilter(arm, variant="sdf-tvcbf-qp").step([0.0], scene, [0.0])


def test_parameters_are_checked(arm: Robot) -> None:
    with pytest.raises(InputError, match="unknown controller parameter 'alhpa'") as caught:
        SafetyFilter(arm, alhpa=1.0)
    assert "did you mean alpha?" in str(caught.value)
    with pytest.raises(InputError, match="unknown controller 'sdf-tvcbf'"):
        SafetyFilter(arm, variant="sdf-tvcbf")
    with pytest.raises(InputError, match=r"controller\.alpha: .*greater than 0"):
        SafetyFilter(arm, alpha=-1.0)
    with pytest.raises(InputError, match=r"controller\.margin"):
        SafetyFilter(arm, margin=math.nan)
    with pytest.raises(InputError, match="one a joint, found 2"):
        SafetyFilter(arm, effort_weight=[1.0, 2.0])
    with pytest.raises(InputError, match="dt must be"):
        SafetyFilter(arm, dt=0.0)
    SafetyFilter(arm, effort_weight=np.array([2.0]))


def test_shorter_way_round_for_continuous_joints() -> None:
    goal, q = np.array([3.0, 3.0]), np.array([-3.0, -3.0])
    assert difference(goal, q, np.array([False, True])) == pytest.approx([6.0, 6.0 - 2 * math.pi])
    turns = difference(np.array([20 * math.pi + 0.1]), np.array([0.0]), np.array([True]))
    assert turns == pytest.approx([0.1])
