"""What is proved of a trial: against closed forms, brute force, the judge, and what controllers do."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from cdfctl.benchmark.solvable.bounds import problem_of, solvable
from cdfctl.benchmark.solvable.grid import axes_of
from cdfctl.benchmark.solvable.search import search
from cdfctl.robots.robot import Robot
from cdfctl.scenario import Scenario, load_scenario, resolve
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.checks import robot_of
from cdfctl.simulation.drawing import draw_trial

PLANAR = """\
version: 1
name: two-joints
robot: {name: planar, q0: [0.5, 0.5], limits: {velocity: 2.0}}
task: {type: joint-goal, goal: [2.03, -0.31]}
obstacles: OBSTACLES
simulation: {dt: 0.1, time_limit: 4.0, tolerance: 0.1}
"""
DISCS = "[{shape: {type: ball, radius: 0.3}, position: %s, velocity: %s}]"


@pytest.fixture
def make(tmp_path: Path):
    def scenario(obstacles: str = "[]", **edits: str) -> tuple[Scenario, Robot]:
        text = PLANAR.replace("OBSTACLES", obstacles)
        for old, new in edits.items():
            text = text.replace(old, new)
        (tmp_path / "mine.yaml").write_text(text)
        loaded = resolve(load_scenario(tmp_path / "mine.yaml").scenario)
        robot = robot_of(loaded.robot)
        return draw_trial(loaded, 0, robot), robot

    return scenario


def drawn(name: str, trial: int) -> tuple[Scenario, Robot]:
    scenario = resolve(load_scenario(name).scenario)
    robot = robot_of(scenario.robot)
    return draw_trial(scenario, trial, robot), robot


def test_without_obstacles_the_slower_joint_decides(make):
    scenario, robot = make()
    found = solvable(scenario, robot)
    assert found.answer == "yes"
    # joint 1 has 1.53 rad to go, less at most the tolerance, at 2 rad/s; a control step is 0.1 s
    assert found.verdict.time_to_reach == pytest.approx(0.8)
    assert search(problem_of(scenario, robot), 6, "outer").t == pytest.approx(0.8, abs=1e-9)


def brute_force(scenario: Scenario, margin: float) -> float | None:
    """Arrival on a grid of 0.2 rad by sets of cells and the closed-form distance of two segments to a disc."""
    (disc,) = scenario.obstacles
    start, goal = np.array(scenario.robot.q0), np.array(scenario.task.goal)

    def free(cell: tuple[int, int], t: float) -> bool:
        q1, q2 = start + 0.2 * np.array(cell)
        if max(abs(q1), abs(q2)) > math.pi:
            return False
        elbow = 2.0 * np.array([math.cos(q1), math.sin(q1)])
        tip = elbow + 2.0 * np.array([math.cos(q1 + q2), math.sin(q1 + q2)])
        c = np.array(disc.position[:2]) + t * np.array(disc.velocity[:2])
        gaps = []
        for a, b in ((np.zeros(2), elbow), (elbow, tip)):
            s = np.clip((c - a) @ (b - a) / 4.0, 0.0, 1.0)
            gaps.append(np.linalg.norm(a + s * (b - a) - c) - 0.3)
        return min(gaps) > margin

    alive = {(0, 0)}
    for k in range(41):
        t = 0.1 * k
        if k:
            alive = {(i + a, j + b) for i, j in alive for a in (-1, 0, 1) for b in (-1, 0, 1)}
        alive = {cell for cell in alive if free(cell, t)}
        if any(np.linalg.norm(start + 0.2 * np.array(cell) - goal) <= 0.1 for cell in alive):
            return t
    return None


def test_against_brute_force_on_a_coarse_grid(make):
    arrivals = set()
    for seed in range(4):
        rng = np.random.default_rng(seed)
        position = rng.uniform([-1.0, 1.5, 0.0], [3.0, 3.5, 0.0]).round(3).tolist()
        velocity = rng.uniform([-1.0, -1.5, 0.0], [1.0, 0.0, 0.0]).round(3).tolist()
        scenario, robot = make(DISCS % (position, velocity))
        expected = brute_force(scenario, 0.05)
        found = search(problem_of(scenario, robot), 1, "inner", 0.05)
        assert (None if found is None else found.t) == (None if expected is None else pytest.approx(expected))
        arrivals.add(expected)
    assert len(arrivals) > 1  # some discs are in the way, some are not


def test_the_motion_keeps_the_limits_and_the_judge_finds_it_free():
    for trial in (0, 3):
        scenario, robot = drawn("X1", trial)
        found = solvable(scenario, robot)
        assert found.answer == "yes"
        motion, verdict = found.motion, found.verdict
        assert verdict.contact is None
        assert verdict.min_clearance > 0.0
        assert motion.q[0] == pytest.approx(np.array(scenario.robot.q0), abs=1e-12)
        assert np.linalg.norm(motion.q[-1] - np.array(scenario.task.goal)) <= scenario.simulation.tolerance
        assert np.abs(motion.u).max() <= 2.0 + 1e-9
        assert np.diff(motion.q, axis=0) == pytest.approx(motion.u * np.diff(motion.t)[:, None])
        assert np.all((motion.q >= robot.lower) & (motion.q <= robot.upper))
        assert motion.t[-1] / 0.1 == pytest.approx(round(motion.t[-1] / 0.1))  # at a control step


def test_what_a_controller_does_is_never_called_impossible():
    for trial in range(3):
        wired = assemble(load_scenario("X2", ["controller.variant=sdf-tvcbf-qp", "seed=5"]), trial=trial)
        for _ in wired.run():
            pass
        verdict = wired.result().verdict
        bound = search(problem_of(wired.scenario, wired.robot), 6, "outer")
        if verdict.success:
            assert bound is not None
            assert bound.t <= verdict.time_to_reach + 1e-9


def test_a_disc_that_sweeps_all_the_arm_can_reach_is_impossible(make):
    wall = "[{shape: {type: box, size: [0.5, 20, 1]}, position: [6, 0, 0], velocity: [-9, 0, 0]}]"
    scenario, robot = make(wall, **{"goal: [2.03, -0.31]": "goal: [-2.5, 0.0]"})
    assert solvable(scenario, robot).answer == "no"
    still, robot = make(DISCS % ("[2.0, 2.0, 0.0]", "[0, 0, 0]"), **{"q0: [0.5, 0.5]": "q0: [0.5, 0.0]"})
    assert solvable(still, robot).answer == "yes"  # the second link folds


def test_a_goal_from_a_time_on_and_a_hold(make):
    scenario, robot = make(**{"-0.31]": "-0.31], not_before: 3.0"})
    assert solvable(scenario, robot).verdict.time_to_reach == pytest.approx(3.0)
    hold, robot = make(**{"joint-goal, goal: [2.03, -0.31]": "hold, pose: [0.5, 0.5]"})
    assert solvable(hold, robot).verdict.time_to_reach == pytest.approx(4.0)


def test_where_accelerations_are_limited_only_impossible_is_proved(make):
    slow, robot = make(**{"velocity: 2.0": "velocity: 2.0, acceleration: 5.0"})
    assert solvable(slow, robot).answer == "open"


WHEEL = """\
<robot name="wheels">
  <link name="base"/>
  <joint name="one" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><limit velocity="1.7" effort="1"/>
  </joint>
  <link name="arm"><collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.1 0.1"/></geometry></collision></link>
  <joint name="two" type="prismatic">
    <parent link="arm"/><child link="rod"/><axis xyz="0 0 1"/><limit velocity="0.5" effort="1" lower="0" upper="1"/>
  </joint>
  <link name="rod"><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>
</robot>
"""


def test_a_continuous_joint_goes_the_shorter_way_round(tmp_path: Path, make):
    (tmp_path / "wheels.urdf").write_text(WHEEL)
    robot = {"name: planar, q0: [0.5, 0.5], limits: {velocity: 2.0}": "urdf: wheels.urdf, q0: [3.0, 0.2]"}
    goal = {"goal: [2.03, -0.31]": "goal: [-3.0, 0.6]"}
    ball = "[{shape: {type: ball, radius: 0.1}, position: [3, 0, 0]}]"
    scenario, wheels = make(ball, **robot, **goal)
    found = solvable(scenario, wheels)
    # 0.283 rad at 1.7 rad/s; 0.4 m at 0.5 m/s, less the tolerance
    assert found.verdict.time_to_reach == pytest.approx(0.7)
    first, second = axes_of(wheels, np.array([3.0, 0.2]), 0.1, "outer")
    assert first.wraps
    assert first.width >= 0.17
    assert len(first.centres) * first.width == pytest.approx(2.0 * math.pi)
    assert (second.wraps, second.width) == (False, 0.05)
    inner = axes_of(wheels, np.array([3.0, 0.2]), 0.1, "inner")[0]
    assert inner.width <= 0.17
