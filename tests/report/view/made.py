"""A run of a Franka written by hand, with everything a run can have: no controller, no compiler."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.resolve import resolve
from cdfctl.scenario.schema import Scenario
from cdfctl.simulation.checks import robot_of
from cdfctl.simulation.judge import judge
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.recorder import STATE_ARRAYS
from cdfctl.simulation.result import RunResult
from cdfctl.simulation.run_folder import write_run
from cdfctl.types import Trajectory

FRANKA = """\
version: 1
name: by-hand
robot: {name: franka, q0: [-1.09, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20]}
task: {type: joint-goal, goal: [1.09, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20]}
obstacles:
  - {name: ball, shape: {type: ball, radius: 0.05}, position: [0.5, 0.8, 0.6], velocity: [0.0, -0.15, 0.0]}
  - {name: a/box, shape: {type: box, size: [0.1, 0.2, 0.3]}, position: [0.3, -0.8, 0.4], angular_velocity: [0, 0, 1]}
controller: {variant: dual-tvcbf-qp}
simulation: {dt: 0.1, time_limit: 20.0, tolerance: 0.05}
assumptions: [None of it was run.]
"""
INFEASIBLE = 5
"""The one step without a solution."""


def franka_scenario(folder: Path) -> Scenario:
    """The scenario, resolved."""
    path = folder / "by-hand.yaml"
    path.write_text(FRANKA)
    return resolve(load_scenario(path).scenario)


def by_hand(scenario: Scenario, steps: int) -> Trajectory:
    """So many steps of 0.1 s from the start to the goal, every joint on its way."""
    q0, goal = np.array(scenario.robot.q0), np.array(scenario.task.goal)
    motion, share = SceneMotion(scenario.obstacles), np.linspace(0.0, 1.0, steps + 1)
    t = 0.1 * np.arange(steps + 1)
    q = q0 + share[:, None] * (goal - q0) + 0.3 * np.sin(3.0 * share)[:, None] * np.arange(7) / 7.0
    contact_q = np.stack([q[:-1] + 0.2, q[:-1] - 0.4], axis=1)
    contact_q[steps // 2 :, 1] = np.nan
    h = np.stack([np.linspace(1.0, 0.1, steps), np.linspace(0.5, 0.4, steps)], axis=1)
    h[steps // 2 :, 1] = np.inf
    return Trajectory(
        t=t,
        q=q,
        u=np.diff(q, axis=0) / 0.1,
        obstacle_pose=np.array([motion.poses(s) for s in t]),
        obstacle_twist=np.array([motion.twists(s) for s in t]),
        h=h,
        V=np.linspace(1.0, 0.0, steps),
        slack=np.full(steps, np.nan),
        infeasible=np.arange(steps) == INFEASIBLE,
        step_time=np.full(steps, 1e-3),
        h_sdf=0.5 * h,
        contact_q=contact_q,
        plan_q=np.stack([q[:-1], q[:-1] + 0.1, np.full_like(q[:-1], np.nan)], axis=1),
        plan_t=np.tile([0.0, 0.1, np.nan], (steps, 1)),
    )


def first_steps(run: Trajectory, steps: int) -> Trajectory:
    """The first so many steps of ``run``."""
    given = {name: value for name, value in vars(run).items() if value is not None}
    return Trajectory(**{name: value[: steps + (name in STATE_ARRAYS)] for name, value in given.items()})


def write_by_hand(folder: Path, steps: int) -> Path:
    """The run folder of it, judged."""
    scenario = franka_scenario(folder)
    robot, trajectory = robot_of(scenario.robot), by_hand(scenario, steps)
    verdict = judge(robot, SceneMotion(scenario.obstacles), trajectory, "timeout")
    result = RunResult(scenario, robot.name, 0, trajectory, verdict, "timeout")
    write_run(folder / "run", result)
    return folder / "run"
