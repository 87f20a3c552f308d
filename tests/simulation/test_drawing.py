"""Draws that rules refuse: every rule kept as an independent measure sees it, and what can never be drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdfctl.robots.robot import load_robot
from cdfctl.scenario import Scenario, ScenarioErrors, dump, floats, load_scenario
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.checks import robot_of
from cdfctl.simulation.clearance import nearest_each
from cdfctl.simulation.drawing import draw_trial, ray_to_segment
from cdfctl.simulation.motion import SceneMotion

points = arrays(np.float64, 3, elements=st.floats(-3.0, 3.0).map(lambda x: round(x, 3)))


def point_to_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances of points (..., 3) to a segment."""
    s = np.clip((p - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0.0, 1.0)
    return np.linalg.norm(a + s[..., None] * (b - a) - p, axis=-1)


@given(points, points, points, points)
def test_a_ray_and_a_segment_against_sampling(p, v, a, b):
    exact = ray_to_segment(p, v, a, b)
    times = np.concatenate([np.linspace(0.0, 2.0, 400), np.geomspace(2.0, 1e4, 400)])
    gaps = point_to_segment(p + times[:, None] * v, a, b)
    best = int(gaps.argmin())
    step = np.diff(times)[max(0, best - 1) : best + 1].max()
    assert exact - 1e-9 <= gaps[best] <= exact + step * np.linalg.norm(v) + 1e-9


def planar_distance(scenario: Scenario) -> float:
    """Least distance of two drawn segments to the discs at t = 0, in closed form."""
    q1, q2 = floats(scenario.robot.q0)
    elbow = 2.0 * np.array([np.cos(q1), np.sin(q1), 0.0])
    tip = elbow + 2.0 * np.array([np.cos(q1 + q2), np.sin(q1 + q2), 0.0])
    centres = [np.array(floats(o.position)) for o in scenario.obstacles]
    links = [(np.zeros(3), elbow), (elbow, tip)]
    return min(float(point_to_segment(c, a, b)) for c in centres for a, b in links) - 0.3


def test_the_planar_suites_keep_their_distance_and_their_draws():
    robot = load_robot("planar")
    for name, count in (("X1", 4), ("X2", 8)):
        scenario = load_scenario(name).scenario
        for trial in range(20):
            drawn = draw_trial(scenario, trial, robot)
            assert len(drawn.obstacles) == count
            assert planar_distance(drawn) >= 0.5 - 1e-6
            for obstacle in drawn.obstacles:
                p, v = np.array(floats(obstacle.position)), np.array(floats(obstacle.velocity))
                t = -(p @ v) / (v @ v)  # closest approach to the base
                assert 0.8 - 1e-9 <= np.linalg.norm(p + t * v) <= 2.8 + 1e-9
                assert 0.5 - 1e-9 <= t <= (3.5 if name == "X1" else 7.0) + 1e-9
    refused = [t for t in range(20) if planar_distance(draw_first(t)) < 0.5]
    assert refused  # the rule had something to do


def draw_first(trial: int) -> Scenario:
    from cdfctl.scenario import draw
    from cdfctl.simulation.drawing import without_rules

    return draw(without_rules(load_scenario("X1").scenario), 0, trial)


def test_the_franka_suites_keep_their_distances():
    for name, count in (("X3", 60), ("X4", 28)):
        scenario = load_scenario(name).scenario
        robot = robot_of(scenario.robot)
        drawn = draw_trial(scenario, 1, robot)
        assert len(drawn.obstacles) == count
        scene = SceneMotion(drawn.obstacles).at(0.0)
        start = [found.distance for found in nearest_each(robot, np.array(floats(drawn.robot.q0)), scene)]
        balls = [i for i, o in enumerate(drawn.obstacles) if (o.name or "").startswith("ball")]
        assert min(start[i] for i in balls) >= 0.15
        for i in balls:
            radius = drawn.obstacles[i].shape.radius
            path = scene.poses[i, :3] + np.linspace(0.0, 30.0, 3001)[:, None] * scene.twists[i, :3]
            axis = np.stack([np.zeros(3001), np.zeros(3001), np.clip(path[:, 2], 0.0, 0.45)], axis=1)
            assert np.linalg.norm(path - axis, axis=1).min() >= 0.25 + radius
        if name == "X4":
            goal = [found.distance for found in nearest_each(robot, np.array(floats(drawn.task.goal)), scene)]
            assert min(min(start[:16]), min(goal[:16])) >= 0.1
            panel = np.array([floats(o.position) for o in drawn.obstacles[:16]])
            assert np.ptp(panel, axis=0) == pytest.approx([0.27, 0.0, 0.27])


def test_the_set_up_as_written_is_the_set_up(tmp_path: Path):
    trial = assemble(load_scenario("X2"), trial=7)
    path = tmp_path / "as-drawn.yaml"
    path.write_text(dump(trial.scenario))
    again = assemble(load_scenario(path), trial=3)
    assert again.scenario == trial.scenario
    assert (again.motion.poses(1.3) == trial.motion.poses(1.3)).all()


TIGHT = """\
version: 1
name: tight
robot: {name: planar, q0: [0.0, 0.0]}
task: {type: joint-goal, goal: [1.0, 0.0]}
obstacles:
  - {shape: {type: ball, radius: 0.1}, position: [9.0, 9.0, 0.0]}
  - name: disc
    shape: {type: ball, radius: 0.3}
    position: [{uniform: [1.0, 2.0]}, 0.5, 0.0]
    redraw_within: {start: 0.5}
"""


def refusal(path: Path, text: str) -> str:
    path.write_text(text)
    with pytest.raises(ScenarioErrors) as caught:
        assemble(load_scenario(path))
    return str(caught.value)


def test_what_can_never_be_drawn_names_the_rule(tmp_path: Path):
    said = refusal(tmp_path / "tight.yaml", TIGHT)
    reason = "'disc' was drawn 1000 times and refused each time: 1000 times within 0.5 m of the robot at the start"
    assert f"tight.yaml:10:20: error: {reason}" in said
    assert "field  obstacles[1].redraw_within" in said
    whole = TIGHT.replace("    redraw_within: {start: 0.5}\n", "redraw_within: {start: 0.1, goal: 0.1}\n")
    whole = whole.replace("0.5, 0.0]", "{uniform: [0.3, 0.39]}, 0.0]")
    said = refusal(tmp_path / "tight.yaml", whole)
    assert "tight.yaml:10:16: error: the set-up was drawn 1000 times" in said
    assert "within 0.1 m of the robot at the start" in said


def test_a_problem_of_a_member_is_placed_at_its_group(tmp_path: Path):
    text = TIGHT.replace("    redraw_within: {start: 0.5}\n", "    count: 3\n").replace("0.5, 0.0]", "0.1, 0.0]")
    said = refusal(tmp_path / "tight.yaml", text)
    assert "at the start 'disc-2' is in contact with" in said
    assert said.count("field  obstacles[1].position") == 3


def test_a_start_of_another_robot_is_said_as_ever(tmp_path: Path):
    said = refusal(
        tmp_path / "tight.yaml", TIGHT.replace("q0: [0.0, 0.0]", "q0: [0.0]").replace("goal: [1.0, 0.0]", "goal: [1.0]")
    )
    assert "expected 2 numbers, one a joint of planar, found 1" in said
