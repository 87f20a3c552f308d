"""The predictive controller in a closed loop, as a safety filter, and where nothing helps."""

from __future__ import annotations

import math

import numpy as np
import pytest

import cdfctl
from cdfctl.errors import InputError
from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import assemble
from cdfctl.types import Box, Obstacle, Scene, Sphere

pytestmark = pytest.mark.xdist_group("planner")  # one worker compiles it, not two at once

NAME = "predictive-tvcbf"
FEW = ["controller.candidates=64"]


@pytest.fixture(scope="module")
def robot():
    return cdfctl.load_robot("planar", velocity_limits=2.0)


def run(name, *changes, trial=0):
    trial = assemble(load_scenario(name, [f"controller.variant={NAME}", *FEW, *changes]), trial=trial)
    for _ in trial.run():
        pass
    return trial.result()


def test_it_solves_a_suite_of_the_paper_and_records_its_plans():
    result = run("S3")
    trajectory = result.trajectory
    assert result.verdict.outcome == "reached"
    N = len(trajectory.u)
    assert trajectory.plan_q.shape[:1] + trajectory.plan_t.shape[:1] == (N, N)
    np.testing.assert_allclose(trajectory.plan_t[:, 0], trajectory.t[:-1])
    np.testing.assert_array_equal(trajectory.plan_q[:, 0], trajectory.q[:-1])
    np.testing.assert_array_equal(np.isnan(trajectory.plan_t), np.isnan(trajectory.plan_q).any(axis=2))
    ends = [plan[np.isfinite(t)][-1] for plan, t in zip(trajectory.plan_q, trajectory.plan_t, strict=True)]
    np.testing.assert_allclose(ends, [[-2.7, 0.5]] * N, atol=1e-9)


def test_it_finds_a_narrow_way_that_random_motions_miss():
    """The one plan that solves this set-up goes at full speed from the first step on."""
    assert run("X1", "seed=1", trial=98).verdict.outcome == "reached"


ERRORS = [f"measurement.{e}" for e in ("position_noise=0.01", "speed_error=0.2", "heading_error_deg=10", "delay=0.1")]


def test_it_finds_out_how_wrong_its_velocities_are():
    """X2, all errors at once: the plan of step 20 ends where the discs then are, not where they are said to go."""
    trial = assemble(load_scenario("X2", [f"controller.variant={NAME}", *FEW, *ERRORS]), trial=2)
    planner, told = trial.rollout._controller.core, []
    for step in trial.run():
        told.append(planner._predictor._course.line.copy())
        if step.index == 20:
            break

    def error(k):
        truth = trial.motion.at(0.1 * k)
        return np.abs(told[k] - np.hstack([truth.poses[:, :3], truth.twists[:, :3]])).max(axis=0)

    assert error(0)[3:].max() > 0.1
    assert error(20)[3:].max() < 0.05
    assert error(20)[:3].max() < 0.03


def test_a_scenario_gives_the_same_run_twice():
    first, second = (run("S2", trial=3).trajectory for _ in range(2))
    np.testing.assert_array_equal(first.q, second.q)
    np.testing.assert_array_equal(first.plan_q, second.plan_q)


def test_where_no_plan_is_free_the_rows_act(robot):
    """A disc comes onto the base: nothing helps, the rows are violated least, and every such step says so."""
    scene = Scene([Obstacle(Sphere(0.5), [0.52, -0.26, 0.0], velocity=[-2.0, 1.0, 0.0])])
    safe = cdfctl.SafetyFilter(robot, variant=NAME, dt=0.1, candidates=64)
    decision = safe.step([2.5, 0.5], scene, [0.0, 0.0])
    assert (decision.status, decision.infeasible) == ("least-violation", True)
    assert np.all(np.abs(decision.u) <= 2.0 + 1e-9)


def test_a_filter_lets_a_safe_velocity_pass(robot):
    safe = cdfctl.SafetyFilter(robot, variant=NAME, dt=0.1, horizon=1.0, candidates=64)
    far = Scene([Obstacle(Box((0.2, 0.2, 0.2)), [0.0, 7.0, 0.0], velocity=[0.1, 0.0, 0.0])])
    for scene in (far, Scene()):
        decision = safe.step([0.5, 0.5], scene, [0.3, -0.2])
        np.testing.assert_allclose(decision.u, [0.3, -0.2], atol=1e-9)
        assert not decision.infeasible


def test_a_filter_turns_from_a_wall_in_the_way(robot):
    """Asked to swing into a disc, it stays clear of it over twenty steps."""
    safe = cdfctl.SafetyFilter(robot, variant=NAME, dt=0.1, horizon=1.0, candidates=64)
    angle = 0.8
    disc = Scene([Obstacle(Sphere(0.3), [3.0 * math.cos(angle), 3.0 * math.sin(angle), 0.0])])
    q, field = np.zeros(2), cdfctl.make_field("sdf", robot)
    for _ in range(20):
        q = q + 0.1 * safe.step(q, disc, [0.8, 0.0]).u
        assert field.query(q, disc).d[0] > 0.015


def test_it_takes_no_target_and_no_budget_of_nothing(robot):
    with pytest.raises(InputError, match="cannot do task 'reach'"):
        assemble(load_scenario("reach", [f"controller.variant={NAME}"]))
    with pytest.raises(InputError, match=r"budget_ms.*greater than 0"):
        cdfctl.SafetyFilter(robot, variant=NAME, budget_ms=0.0)
    scene = Scene.from_arrays((Sphere(0.1),), ("a",), np.full((1, 7), np.nan), np.zeros((1, 6)))
    safe = cdfctl.SafetyFilter(robot, variant=NAME)
    with pytest.raises(InputError, match="not finite"):
        safe.step([0.0, 0.0], scene, [0.0, 0.0])
