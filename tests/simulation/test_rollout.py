"""The closed loop: by hand on a one-joint arm, its ways to stop, and that nothing is lost when it is cut short."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cdfctl.errors import PlantError
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.schema import BeyondConfig
from cdfctl.simulation.assemble import Trial, assemble
from cdfctl.simulation.goals import passed
from cdfctl.simulation.plants.kinematic import KinematicPlant
from cdfctl.simulation.recorder import FIRST_CAPACITY, Recorder
from cdfctl.simulation.run_folder import arrays_of
from cdfctl.types import Array, Decision, Obstacle, Scene, Sphere, State, Trajectory

ONE_JOINT = """\
version: 1
name: one-joint
robot: {{name: planar, lock: {{joint2: 0.0}}, limits: {{velocity: 2.0}}, q0: [0.0]}}
task: {task}
obstacles:
  - shape: {{type: ball, radius: 0.3}}
    position: [-0.8322936730942848, 1.8185948536513634, 0.0]
    velocity: {velocity}
controller: {{variant: sdf-tvcbf-qp, alpha: 1.5, margin: 0.05, gain: 4.0, on_infeasible: {rule}}}
simulation: {{dt: 0.1, time_limit: {limit}, tolerance: 0.05}}
"""

Make = Callable[..., Trial]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def one_joint(
        task: str = "{type: joint-goal, goal: [1.5]}",
        velocity: str = "[0.0, 0.0, 0.0]",
        rule: str = "least-violation",
        limit: float = 2.0,
    ) -> Trial:
        path = tmp_path / "one-joint.yaml"
        path.write_text(ONE_JOINT.format(task=task, velocity=velocity, rule=rule, limit=limit))
        return assemble(load_scenario(path))

    return one_joint


def run(trial: Trial) -> Trajectory:
    for _ in trial.run():
        pass
    return trial.rollout.trajectory()


def test_closed_loop_by_hand(make: Make) -> None:
    """A ball of 0.3 m at 2 m and angle 2.0: u = min(4 (1.5 - q), 2, 1.5 h / (2 cos(2 - q)))."""
    trajectory = run(make(limit=1.0))
    q = 0.0
    for k in range(10):
        assert trajectory.q[k] == pytest.approx([q], abs=1e-6)
        h = 2.0 * math.sin(2.0 - q) - 0.3 - 0.05
        u = min(4.0 * (1.5 - q), 2.0)
        if 2.0 - q < math.pi / 2 - 1e-9:  # beside the link; behind it the row pushes forward
            u = min(u, 1.5 * h / (2.0 * math.cos(2.0 - q)))
            assert trajectory.h[k] == pytest.approx([h], abs=1e-6)
        assert trajectory.u[k] == pytest.approx([u], abs=1e-5)
        q += 0.1 * u
    assert trajectory.t.tolist() == [round(0.1 * k, 12) for k in range(11)]


def test_reached_at_a_control_step(make: Make) -> None:
    trial = make("{type: joint-goal, goal: [0.3]}")
    trajectory = run(trial)
    assert trial.rollout.stop == "reached"
    assert trial.rollout.reason is None
    error = np.abs(trajectory.q[:, 0] - 0.3)
    assert error[-1] <= 0.05
    assert np.all(error[:-1] > 0.05)
    verdict = trial.result().verdict
    assert verdict.outcome == "reached"
    assert verdict.time_to_reach == trajectory.t[-1]


def test_reached_at_the_start_takes_no_step(make: Make) -> None:
    trial = make("{type: joint-goal, goal: [0.01]}")
    trajectory = run(trial)
    assert trial.rollout.stop == "reached"
    assert trajectory.u.shape == (0, 1)
    assert trajectory.q.shape == (1, 1)
    assert trial.result().verdict.time_to_reach == 0.0


@pytest.mark.parametrize(("limit", "steps"), [(2.0, 20), (0.3, 3), (0.25, 2)])
def test_timeout_after_the_steps_that_fit(make: Make, limit: float, steps: int) -> None:
    trial = make("{type: joint-goal, goal: [-2.5]}", limit=limit)
    trajectory = run(trial)
    if limit < 1.0:
        assert trial.rollout.stop == "timeout"
        assert trial.result().verdict.outcome == "timeout"
        assert len(trajectory.u) == steps


def test_fail_ends_the_run_and_counts(make: Make) -> None:
    """The ball runs at the arm faster than it can retreat."""
    trial = make(velocity="[12.0, -12.0, 0.0]", rule="fail")
    trajectory = run(trial)
    assert trial.rollout.stop == "infeasible"
    result = trial.result()
    assert not trajectory.infeasible.any()
    assert result.infeasible_steps == 1
    violated = make(velocity="[12.0, -12.0, 0.0]", rule="least-violation")
    assert run(violated).infeasible.sum() == violated.result().infeasible_steps >= 1


def test_hold_until_the_obstacle_has_passed(make: Make) -> None:
    until = "until: {obstacles_beyond: {axis: x, side: below, value: -1.0}}"
    trial = make("{type: hold, pose: [0.0], " + until + "}", velocity="[-1.0, 0.0, 0.0]")
    trajectory = run(trial)
    assert trial.rollout.stop == "reached"
    assert trajectory.obstacle_pose[-1, 0, 0] < -1.0 <= trajectory.obstacle_pose[-2, 0, 0]


def test_hold_without_until_is_judged_at_the_limit(make: Make) -> None:
    held = make("{type: hold, pose: [0.0]}", limit=0.5)
    assert len(run(held).u) == 5
    assert held.rollout.stop == "reached"
    lost = make("{type: hold, pose: [-2.5]}", limit=0.5)
    run(lost)
    assert lost.rollout.stop == "timeout"


def test_passed() -> None:
    scene = Scene([Obstacle(Sphere(0.1), [0.0, -0.4, 0.0]), Obstacle(Sphere(0.1), [0.0, -0.31, 0.0])])
    assert passed(scene, BeyondConfig(axis="y", side="below", value=-0.3))
    assert not passed(scene, BeyondConfig(axis="y", side="below", value=-0.35))
    assert not passed(scene, BeyondConfig(axis="y", side="above", value=-0.35))
    assert passed(scene, BeyondConfig(axis="y", side="above", value=-0.5))


@pytest.mark.parametrize("name", ["S2", "C1"])
def test_same_scenario_and_seed_same_arrays_to_the_last_bit(name: str) -> None:
    # With smoothness the last command matters too: the warm-up's must be forgotten.
    file = load_scenario(name, ["simulation.time_limit=3.0", "controller.smoothness_weight=0.5"])
    first = assemble(file, trial=4)
    arrays = [arrays_of(run(first)), arrays_of(run(assemble(file, trial=4, robot=first.robot)))]
    # A second run of one set-up: nothing of the first must be left in the controller.
    arrays.append(arrays_of(run(first)))
    for other in arrays[1:]:
        assert list(arrays[0]) == list(other)
        for key, array in arrays[0].items():
            if key != "step_time":
                assert array.tobytes() == other[key].tobytes(), key


class FailingPlant(KinematicPlant):
    def __init__(self, after: int, error: BaseException) -> None:
        self.left, self.error = after, error

    def step(self, state: State, u: Array, dt: float) -> State:
        if self.left == 0:
            raise self.error
        self.left -= 1
        return super().step(state, u, dt)


def test_failing_plant_keeps_what_was_done(make: Make) -> None:
    trial = make()
    trial.rollout.plant = FailingPlant(3, PlantError("the drive is off"))
    trajectory = run(trial)
    assert len(trajectory.u) == 3
    result = trial.result()
    assert (result.stop, result.reason, result.verdict.outcome) == ("error", "the drive is off", "error")


def test_interrupt_keeps_what_was_done(make: Make) -> None:
    trial = make()
    trial.rollout.plant = FailingPlant(3, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        run(trial)
    result = trial.result()
    assert len(result.trajectory.u) == 3
    assert (result.stop, result.reason, result.verdict.outcome) == ("error", "interrupted", "error")


def test_steps_are_yielded_as_they_happen(make: Make) -> None:
    trial = make()
    seen = [(step.index, step.state.t) for step, _ in zip(trial.run(), range(3), strict=False)]
    assert seen == [(0, 0.0), (1, 0.1), (2, 0.2)]


def test_recorder_grows_and_keeps_optional_arrays() -> None:
    steps = 2 * FIRST_CAPACITY + 5
    recorder = Recorder(2, 1, 10 * steps)
    scene = Scene([Obstacle(Sphere(0.1), np.zeros(3))])
    recorder.start(State(0.0, np.zeros(2)), scene)
    for k in range(steps):
        decision = Decision(
            np.full(2, float(k)),
            np.zeros(1),
            math.nan,
            "optimal",
            k % 2 == 0,
            0.0,
            contact_q=np.full((1, 2), -float(k)),
        )
        recorder.add(decision, 1e-3, State(k + 1.0, np.full(2, k + 1.0)), scene)
    trajectory = recorder.trajectory()
    assert trajectory.t.tolist() == list(range(steps + 1))
    assert trajectory.u[:, 0].tolist() == list(range(steps))
    assert trajectory.infeasible.dtype == np.bool_
    assert trajectory.infeasible[:3].tolist() == [True, False, True]
    assert trajectory.contact_q is not None
    assert trajectory.contact_q.shape == (steps, 1, 2)
    assert trajectory.h_sdf is None
    assert np.isnan(trajectory.V).all()
