"""Whether a trial can be solved, as far as that can be proved: no, or yes with a motion to show.

yes   a motion on an inner grid that the judge passes;
no    an outer grid on which the goal is never reached;
else  a finer grid, and in the end: not known.

Over many trials, the share of yes bounds the solvable share from below, and that of no from above. Both are proofs up
to rounding, whatever the grid; a finer one leaves fewer trials open. Motions may change their velocity at any time, a
controller only every control step: what it can do at best may be less than the lower bound.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from cdfctl.benchmark.solvable.search import GoalAt, Problem, Reached, search
from cdfctl.control.controller import difference
from cdfctl.robots.robot import Robot
from cdfctl.scenario.schema import HoldTask, JointGoalTask, Scenario
from cdfctl.simulation.goals import ROUNDING, Configuration, goal_of, passed
from cdfctl.simulation.judge import judge
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.shapes import vector_of
from cdfctl.types import Array, BoolArray, Trajectory, Verdict

WIDTHS = (0.034, 0.017, 0.0085)
"""Greatest width of a cell on each grid tried, rad or m: 190, 380 and 750 cells a turn."""

MARGIN = 0.6
"""An inner grid keeps this share of its width (in m) from the obstacles, for what happens between its instants."""


@dataclass(frozen=True)
class Solvable:
    """What is proved of one trial.

    Attributes:
        answer: ``yes``, ``no`` or ``open``.
        verdict: the judge's on the motion, where the answer is yes.
        motion: that motion.
        width: greatest width of a cell on the grid that decided, rad or m.
    """

    answer: str
    width: float
    verdict: Verdict | None = None
    motion: Trajectory | None = None


def solvable(scenario: Scenario, robot: Robot) -> Solvable:
    """What can be proved of a drawn and resolved ``scenario``, for a robot with two joints and a task that
    ends at a configuration.

    The motions considered start at ``robot.q0``, keep joint and speed limits, and end at the first control step at
    which the task is done.
    """
    problem = problem_of(scenario, robot)
    fastest = float(robot.velocity_limit.max()) * problem.dt
    width = math.inf
    # The motions turn at once: where accelerations are limited they prove nothing, but impossible stays impossible.
    abrupt = bool(np.isinf(robot.acceleration_limit).all())
    for greatest in WIDTHS:
        parts = math.ceil(fastest / greatest)
        width = fastest / parts
        found = search(problem, parts, "inner", MARGIN * width) if abrupt else None
        if found is not None:
            motion = driven(found, problem)
            own = bool(scenario.controller.self_collision)
            verdict = judge(robot, problem.motion, motion, "reached", self_collision=own)
            if verdict.success:
                return Solvable("yes", width, verdict, motion)
        if search(problem, parts, "outer") is None:
            return Solvable("no", width)
    return Solvable("open", width)


def problem_of(scenario: Scenario, robot: Robot) -> Problem:
    """The set-up of a drawn and resolved scenario."""
    assert isinstance(scenario.task, JointGoalTask | HoldTask)
    motion, simulation = SceneMotion(scenario.obstacles), scenario.simulation
    steps = math.floor(simulation.time_limit / simulation.dt + ROUNDING)
    goal = _goal_at(goal_of(scenario.task, robot, simulation.tolerance), motion, simulation.dt * steps)
    return Problem(robot, motion, vector_of(scenario.robot.q0), goal, simulation.dt, steps)


def _goal_at(goal: Configuration, motion: SceneMotion, end: float) -> GoalAt:
    def reached(t: float, first: Array, second: Array, slack: float) -> BoolArray | None:
        at_end = t >= end - ROUNDING
        if (goal.only_at_end and not at_end) or t < goal.not_before - ROUNDING:
            return None
        if goal.beyond is not None and not passed(motion.at(t), goal.beyond):
            return None
        q = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1)
        gap = np.linalg.norm(difference(goal.q, q, goal.robot.continuous), axis=-1)
        near: BoolArray = gap <= goal.tolerance + slack
        return near

    return reached


def driven(found: Reached, problem: Problem) -> Trajectory:
    """The chain of cells as a motion, its steps as long as the velocity stays the same."""
    steps = np.diff(found.q, axis=0)
    continuous = problem.robot.continuous
    steps[:, continuous] -= 2.0 * math.pi * np.round(steps[:, continuous] / (2.0 * math.pi))
    q = problem.q0 + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    corner = np.abs(np.diff(steps, axis=0)).max(axis=1, initial=0.0) > 1e-9
    at = np.array([0, *(np.flatnonzero(corner) + 1), len(steps)])
    t = at * found.step
    u = np.array([(q[b] - q[a]) / ((b - a) * found.step) for a, b in itertools.pairwise(at)])
    N, m = len(u), len(problem.motion)
    scenes = [problem.motion.at(float(x)) for x in t]
    return Trajectory(
        t=t,
        q=q[at],
        u=u,
        obstacle_pose=np.array([scene.poses for scene in scenes]),
        obstacle_twist=np.array([scene.twists for scene in scenes]),
        h=np.full((N, m), math.inf),
        V=np.full(N, math.nan),
        slack=np.full(N, math.nan),
        infeasible=np.zeros(N, dtype=np.bool_),
        step_time=np.zeros(N),
    )
