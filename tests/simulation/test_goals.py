"""A goal that counts from a time on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdfctl.scenario import JointGoalTask, load_scenario
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.goals import goal_of
from cdfctl.types import Scene, State


def test_being_there_counts_from_the_time_on_rounded_sums_included():
    trial = assemble(load_scenario("X1"))
    goal = goal_of(JointGoalTask(type="joint-goal", goal=(1.0, 0.5), not_before=7.0), trial.robot, 0.1)
    q, scene = np.array([1.0, 0.55]), Scene()
    t = sum([0.1] * 70)
    assert t < 7.0
    assert goal.reached(State(t, q), scene, at_end=False)
    assert not goal.reached(State(6.9, q), scene, at_end=False)
    assert not goal.reached(State(6.9, q), scene, at_end=True)
    assert not goal.reached(State(7.1, q + 0.1), scene, at_end=False)
    without = goal_of(JointGoalTask(type="joint-goal", goal=(1.0, 0.5)), trial.robot, 0.1)
    assert without.reached(State(0.0, q), scene, at_end=False)


def test_a_run_waits_at_its_goal(tmp_path: Path):
    path = tmp_path / "wait.yaml"
    path.write_text(
        "version: 1\nname: wait\nrobot: {name: planar, q0: [0.0, 0.5]}\n"
        "task: {type: joint-goal, goal: [0.5, 0.5], not_before: 1.5}\n"
        "controller: {variant: sdf-tvcbf-qp}\nsimulation: {dt: 0.1, tolerance: 0.1}\n"
    )
    trial = assemble(load_scenario(path))
    assert sum(1 for _ in trial.run()) == 15
    assert trial.result().verdict.outcome == "reached"
