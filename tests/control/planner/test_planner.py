"""Plans: judged by coal, the same for a seed, within a budget; and what happens where there is none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from cdfctl.control.planner import planner as module
from cdfctl.control.planner.march import STEP
from cdfctl.control.planner.planner import Planner, Settings
from cdfctl.control.prediction import Prediction, Predictor
from cdfctl.robots.robot import load_robot
from cdfctl.simulation.clearance import Clearance
from cdfctl.simulation.judge import judge
from cdfctl.types import Obstacle, Scene, Sphere, Trajectory

pytestmark = pytest.mark.xdist_group("planner")  # one worker compiles it, not two at once

MARGIN = 0.03
GOAL = np.array([-2.7, 0.5])
Q0 = np.array([2.5, 0.5])
SETTINGS = Settings(segments=8, horizon=4.0, candidates=512, budget=math.inf, seed=1)


class Discs:
    """Two discs that cross the straight way, as a motion for the judge."""

    names = ("a", "b")
    shapes = (Sphere(0.3), Sphere(0.3))
    place = np.array([[2.2, -3.0, 0.0], [5.0, 3.0, 0.0]])
    velocity = np.array([[0.0, 1.5, 0.0], [0.3, -1.0, 0.0]])

    def poses(self, t):
        return np.hstack([self.place + t * self.velocity, np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))])

    def scene(self, t):
        return Scene.from_arrays(self.shapes, self.names, self.poses(t), np.hstack([self.velocity, np.zeros((2, 3))]))

    def max_speed(self, i, t0, t1):
        return float(np.linalg.norm(self.velocity[i]))

    def max_angular_speed(self, i, t0, t1):
        return 0.0


@pytest.fixture(scope="module")
def robot():
    return load_robot("planar", velocity_limits=2.0)


def planned(planner, robot, q, scene, stay=0.0):
    return planner.plan(q, Predictor(Prediction(MARGIN)).course(scene), GOAL, robot.velocity_limit, stay)


def test_a_free_plan_is_free_to_the_judge_and_arrives(robot):
    motion = Discs()
    found = planned(Planner(robot, SETTINGS, 0.1), robot, Q0, motion.scene(0.0))
    real = np.isfinite(found.t)
    t, q = found.t[real], found.q[real]
    u = np.diff(q, axis=0) / np.diff(t)[:, None]
    nothing = np.full(len(u), np.nan)
    run = Trajectory(t, q, u, np.zeros(0), np.zeros(0), np.zeros(0), nothing, nothing, nothing > 0, nothing)
    verdict = judge(robot, motion, run, "reached")
    assert found.hit == math.inf
    assert verdict.outcome == "reached"
    assert verdict.min_clearance >= MARGIN - STEP - 1e-4
    np.testing.assert_allclose(q[-1], GOAL, atol=1e-9)
    assert np.abs(u).max() <= 2.0 + 1e-9
    assert np.all((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9))
    straight = np.abs(GOAL - Q0).max() / 2.0
    assert straight <= t[-1] < 2.0 * straight


def test_its_first_velocity_leads_along_the_plan(robot):
    found = planned(Planner(robot, SETTINGS, 0.1), robot, Q0, Discs().scene(0.0))
    real = np.isfinite(found.t)
    after = [np.interp(0.1, found.t[real], found.q[real, j]) for j in range(2)]
    np.testing.assert_allclose(Q0 + 0.1 * found.u, after, atol=1e-12)


def test_the_same_seed_gives_the_same_plans_and_reset_begins_again(robot):
    planners = [Planner(robot, SETTINGS, 0.1), Planner(robot, SETTINGS, 0.1)]
    other = Planner(robot, replace(SETTINGS, seed=2), 0.1)
    runs = [[planned(p, robot, Q0, Discs().scene(0.1 * k)).q for k in range(3)] for p in (*planners, other)]
    planners[0].reset()
    runs.append([planned(planners[0], robot, Q0, Discs().scene(0.1 * k)).q for k in range(3)])
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[3])
    assert not np.array_equal(runs[0], runs[2], equal_nan=True)


def test_a_plan_is_carried_on_from_step_to_step(robot):
    """With no candidates of its own a step keeps to the last plan: it arrives when that said."""
    planner, motion = Planner(robot, SETTINGS, 0.1), Discs()
    first = planned(planner, robot, Q0, motion.scene(0.0))
    planner._settings = replace(SETTINGS, candidates=1)
    second = planned(planner, robot, Q0 + 0.1 * first.u, motion.scene(0.1))
    assert np.nanmax(second.t) == pytest.approx(np.nanmax(first.t) - 0.1, abs=1e-6) or second.hit == math.inf


def test_the_budget_ends_the_search(robot, monkeypatch):
    """On a clock that moves 1 ms a look, a budget of 3.5 ms leaves three looks, and the best plan so far."""
    looks = []
    monkeypatch.setattr(module.time, "perf_counter", lambda: looks.append(0) or 1e-3 * len(looks))
    monkeypatch.setattr(module, "SLICE", 1.0)
    found = planned(Planner(robot, replace(SETTINGS, budget=3.5e-3), 0.1), robot, Q0, Discs().scene(0.0))
    assert len(looks) == 4
    assert np.isfinite(found.u).all()


def test_no_plan_is_free_where_a_disc_comes_onto_the_base(robot):
    scene = Scene([Obstacle(Sphere(0.5), [2.0, -1.0, 0.0], velocity=[-2.0, 1.0, 0.0])])
    found = planned(Planner(robot, SETTINGS, 0.1), robot, Q0, scene)
    contact = (math.sqrt(5.0) - 0.5 - MARGIN) / math.sqrt(5.0)  # with the base's axis, which cannot give way
    assert 0.5 * contact < found.hit <= contact + 0.01


def test_where_no_plan_keeps_its_margins_one_that_keeps_a_third_will_do(robot):
    """At the start a disc stands nearer than the margin: away from it, and no nearer than a sixth of the margin."""
    clearance = Clearance(robot, (Sphere(0.3),))
    pose = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    middle, aside = 2.0 * np.array([np.cos(2.5), np.sin(2.5)]), np.array([-np.sin(2.5), np.cos(2.5)])

    def distance(x):
        pose[0, :2] = 0.5 * middle + x * aside
        clearance.place(Q0, pose)
        return clearance.distances().min()

    x = brentq(lambda x: distance(x) - 0.5 * MARGIN, 0.3, 0.6)
    assert distance(x) == pytest.approx(0.5 * MARGIN)
    found = planned(Planner(robot, SETTINGS, 0.1), robot, Q0, Scene([Obstacle(Sphere(0.3), pose[0, :3])]))
    assert found.hit == math.inf
    real = np.isfinite(found.t)
    for now in np.linspace(0.0, found.t[real][-1], 300):
        q = np.array([np.interp(now, found.t[real], found.q[real, j]) for j in range(2)])
        clearance.place(q, pose)
        assert clearance.distances().min() >= MARGIN / 6.0


def test_rest_at_the_goal_counts_where_the_task_says_so(robot):
    """A disc passes the goal pose after arrival: that is a hit only while being there must be free."""
    tip = 2.0 * np.array([math.cos(-2.7) + math.cos(-2.2), math.sin(-2.7) + math.sin(-2.2)])
    scene = Scene([Obstacle(Sphere(0.3), [tip[0] - 8.0, tip[1], 0.0], velocity=[2.0, 0.0, 0.0])])
    once = Settings(segments=1, horizon=6.0, candidates=1, budget=math.inf, seed=0)
    assert planned(Planner(robot, once, 0.1), robot, Q0, scene).hit == math.inf
    assert 2.7 < planned(Planner(robot, once, 0.1), robot, Q0, scene, stay=20.0).hit < 4.5
