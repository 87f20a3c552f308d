"""The judge's look at a robot that touches itself: against a closed form, and as it is told."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from cdfctl.errors import InputError
from cdfctl.report.run_summary import headline, self_clearance
from cdfctl.robots.robot import load_robot
from cdfctl.robots.self_pairs import self_distances, self_pairs
from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.advancement import CLEARANCE_TOLERANCE
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.judge import judge
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.self_contact import OwnDistances, SelfSweep
from cdfctl.types import Trajectory

BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'


def joint(name: str, parent: str, child: str, x: float) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{x} 0 0"/>'
        '<axis xyz="0 0 1"/><limit lower="-3.2" upper="3.2" velocity="100" effort="1"/></joint>'
    )


@pytest.fixture
def folding(tmp_path: Path) -> Path:
    """Balls of 0.1 m at base, elbow and hand of two links of 1 m: base and hand are 2 cos(q2 / 2) - 0.2 apart."""
    path = tmp_path / "arm.urdf"
    links = f'<link name="base">{BALL}</link><link name="elbow">{BALL}</link><link name="hand">{BALL}</link>'
    fixed = '<joint name="tip" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="1 0 0"/></joint>'
    joints = joint("j1", "base", "elbow0", 0.0) + joint("j2", "elbow", "fore", 0.0)
    elbow = '<joint name="e" type="fixed"><parent link="elbow0"/><child link="elbow"/><origin xyz="1 0 0"/></joint>'
    path.write_text(f'<robot name="arm">{links}<link name="elbow0"/><link name="fore"/>{joints}{elbow}{fixed}</robot>')
    return path


def run(q: list[list[float]], dt: float = 1.0) -> Trajectory:
    points = np.array(q, dtype=float)
    n = len(points) - 1
    return Trajectory(
        t=dt * np.arange(n + 1),
        q=points,
        u=np.diff(points, axis=0) / dt,
        obstacle_pose=np.zeros((n + 1, 0, 7)),
        obstacle_twist=np.zeros((n + 1, 0, 6)),
        h=np.zeros((n, 0)),
        V=np.full(n, np.nan),
        slack=np.full(n, np.nan),
        infeasible=np.zeros(n, dtype=bool),
        step_time=np.zeros(n),
    )


def test_contact_between_control_steps_is_found_when_it_is(folding):
    """From one side of the fold to the other within a step: apart at both ends, through each other in between."""
    robot = load_robot(folding)
    q2 = 2 * math.acos(0.5)  # 0.8 m apart
    trajectory = run([[0.0, q2], [0.3, 2 * math.pi - q2]])
    verdict = judge(robot, SceneMotion(()), trajectory, "reached")
    touch = (2 * math.acos(0.1) - q2) / (2 * math.pi - 2 * q2)
    assert verdict.self_contact is not None
    assert verdict.self_contact.time == pytest.approx(touch, abs=1e-5)
    assert {verdict.self_contact.link, verdict.self_contact.obstacle} == {"base", "hand"}
    assert verdict.min_self_clearance == pytest.approx(-0.2, abs=CLEARANCE_TOLERANCE)
    # reported, and no collision unless that is asked for
    assert (verdict.outcome, verdict.contact) == ("reached", None)
    counted = judge(robot, SceneMotion(()), trajectory, "reached", self_collision=True)
    assert (counted.outcome, counted.contact) == ("collision", verdict.self_contact)
    assert counted.outcome_sampled == "reached"


def test_a_near_miss_is_no_contact(folding):
    robot = load_robot(folding)
    folded = 2 * math.acos(0.11)  # 0.02 m apart
    verdict = judge(robot, SceneMotion(()), run([[0, 1.0], [0.2, folded], [0, 1.0]]), "reached", self_collision=True)
    assert verdict.outcome == "reached"
    assert verdict.self_contact is None
    assert verdict.min_self_clearance == pytest.approx(0.02, abs=CLEARANCE_TOLERANCE)


def test_distances_are_those_of_pinocchio_and_change_no_faster_than_the_bound():
    robot = load_robot("franka")
    rng = np.random.default_rng(0)
    q = np.array([rng.uniform(robot.lower, robot.upper) for _ in range(8)])
    q[1::2] = q[::2] + 0.2 * rng.uniform(-1, 1, (4, 7))
    sweep = SelfSweep(robot, 0.1 * np.arange(8), q)
    pairs = self_pairs(robot).checked
    expected = np.array([self_distances(robot, pairs, configuration) for configuration in q])
    assert sweep.at_steps == pytest.approx(expected, abs=1e-6)
    for k in range(7):
        for share in (0.3, 0.7):
            between = np.array([sweep.distance_at(k, p, 0.1 * (k + share)) for p in range(len(pairs))])
            assert np.all(np.abs(between - sweep.at_steps[k]) <= sweep.speed[k] * 0.1 * share + 1e-6)


def test_a_robot_without_pairs():
    own = OwnDistances(load_robot("planar"))
    own.place(np.zeros(2))
    assert own.distances().shape == (0,)
    verdict = judge(load_robot("planar"), SceneMotion(()), run([[0, 0], [1, 3]]), "reached", self_collision=True)
    assert (verdict.outcome, verdict.min_self_clearance) == ("reached", math.inf)


def scenario(folding: Path, q2: float, **controller: object):
    document = {
        "version": 1,
        "name": "fold",
        "robot": {"urdf": "arm.urdf", "q0": [0.0, q2]},
        "task": {"type": "joint-goal", "goal": [0.0, 3.0]},
        "controller": {"variant": "sdf-tvcbf-qp", "alpha": 3.0, **controller},
        "simulation": {"dt": 0.05, "time_limit": 3.0},
    }
    path = folding.parent / "fold.yaml"
    path.write_text(yaml.safe_dump(document))
    return load_scenario(str(path))


def test_a_scenario_that_folds_the_arm(folding):
    """Told to fold through itself: it does, or it stops short, as the scenario asks."""
    ends = []
    for count in (0, 6):
        trial = assemble(scenario(folding, 1.0, self_collision=count, self_collision_margin=0.03))
        for _ in trial.run():
            pass
        ends.append(trial.result())
    free, held = ends
    assert free.verdict.outcome == "reached"
    assert headline(free).endswith("without contact but with itself")
    ((_, text),) = self_clearance(free.verdict, counts=False)
    assert "base touches hand" in text
    assert "(not counted: controller.self_collision is 0)" in text
    assert held.verdict.outcome == "timeout"
    assert held.verdict.min_self_clearance == pytest.approx(0.03, abs=2e-3)
    assert held.document("x")["self_contact_time_s"] is None


def test_a_start_in_contact_with_itself_is_refused_where_it_would_count(folding):
    with pytest.raises(InputError, match=r"at the start base is in contact with hand \(85\.\d mm deep\)"):
        assemble(scenario(folding, 2 * math.acos(0.0572), self_collision=6))
    assemble(scenario(folding, 2 * math.acos(0.0572)))
