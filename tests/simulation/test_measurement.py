"""What the controller is told, against the definition of each error; and that the judge sees the truth."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.scenario import ObstacleConfig, ScenarioErrors, dump, load_scenario
from cdfctl.scenario.measurement import MeasurementConfig
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.measurement import OBSTACLES, TARGET, Sensor, turned
from cdfctl.simulation.motion import SceneMotion

VELOCITIES = [(1.0, 0.5, 0.2), (0.0, 0.0, 0.7), (0.0, 0.0, 0.0), (-0.3, 0.4, 0.0)]
MOTION = SceneMotion(
    [
        ObstacleConfig(
            shape={"type": "ball", "radius": 0.1}, position=(float(i), 0.0, 1.0), velocity=v,
            angular_velocity=(0.0, 0.0, 0.3 * i),
        )
        for i, v in enumerate(VELOCITIES)
    ]
)  # fmt: skip


def sensor(trial: int = 0, seed: int = 0, stream: int = OBSTACLES, **errors: object) -> Sensor:
    return Sensor(MOTION, MeasurementConfig(**errors), seed, trial, stream)


def test_without_errors_it_is_the_truth():
    truth = MOTION.at(1.3)
    assert sensor().see(1.3, truth) is truth
    assert (sensor(compensate_delay=False).see(1.3).poses == truth.poses).all()


def test_a_delay_is_the_past_and_a_constant_twist_makes_up_for_it():
    late = sensor(delay=0.25, compensate_delay=False).see(1.0)
    assert late.poses == pytest.approx(MOTION.at(0.75).poses)
    told = sensor(delay=0.25).see(1.0)
    assert told.poses == pytest.approx(MOTION.at(1.0).poses, abs=1e-12)  # the turn about z too
    assert told.twists == pytest.approx(MOTION.at(1.0).twists)


def test_noise_has_its_size_and_changes_every_step():
    eye = sensor(position_noise=0.02)
    seen = np.array([eye.see(0.1 * k).poses[:, :3] - MOTION.at(0.1 * k).poses[:, :3] for k in range(2000)])
    assert seen.std() == pytest.approx(0.02, rel=0.02)
    assert abs(seen.mean()) < 5 * 0.02 / math.sqrt(seen.size)
    assert abs(np.corrcoef(seen[:-1].ravel(), seen[1:].ravel())[0, 1]) < 0.03


def test_a_wrong_velocity_stays_wrong_within_its_bounds():
    found = []
    for trial in range(300):
        eye = sensor(trial, speed_error=0.2, heading_error_deg=10.0)
        first, later = eye.see(0.0).twists[:, :3], eye.see(1.0).twists[:, :3]
        assert (first == later).all()
        assert (first[2] == 0.0).all()
        assert first[1, :2] == pytest.approx([0.0, 0.0], abs=1e-12)  # a vertical velocity has no heading
        v = np.array(VELOCITIES)[[0, 3]]
        ratio = np.linalg.norm(first[[0, 3]], axis=1) / np.linalg.norm(v, axis=1)
        angle = np.arctan2(first[[0, 3], 1], first[[0, 3], 0]) - np.arctan2(v[:, 1], v[:, 0])
        found += list(zip(ratio, np.degrees(angle), strict=True))
        assert first[[0, 3], 2] == pytest.approx(v[:, 2] * ratio)
    ratio, angle = np.array(found).T
    assert 0.8 <= ratio.min() < 0.82
    assert 1.18 < ratio.max() <= 1.2
    assert -10.0 - 1e-9 <= angle.min() < -9.5
    assert 9.5 < angle.max() <= 10.0 + 1e-9
    assert ratio.std() == pytest.approx(0.2 / math.sqrt(3), rel=0.05)  # uniform


@given(st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2)), st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))
def test_turning_keeps_the_speed_and_adds_to_the_elevation(v, elevation, heading):
    v = np.array([v])
    out = turned(v, np.array([elevation]), np.array([heading]))
    assert np.linalg.norm(out) == pytest.approx(np.linalg.norm(v), abs=1e-9)
    level = float(np.linalg.norm(v[0, :2]))
    before = math.atan2(v[0, 2], level)
    if level > 1e-3 and abs(before + elevation) < 0.5 * math.pi - 1e-3:
        assert math.atan2(out[0, 2], float(np.linalg.norm(out[0, :2]))) == pytest.approx(before + elevation, abs=1e-6)
        turn = math.atan2(out[0, 1], out[0, 0]) - math.atan2(v[0, 1], v[0, 0]) - heading
        assert math.remainder(turn, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_what_drops_out_is_predicted_or_held():
    times = 0.1 * np.arange(400)
    for rule in ("predict", "hold"):
        eye, lost = sensor(dropout=0.3, on_dropout=rule), 0
        for k, t in enumerate(times):
            seen = eye.see(float(t)).poses[0, :3]
            truth = MOTION.at(float(t)).poses[0, :3]
            if rule == "predict":
                assert seen == pytest.approx(truth, abs=1e-9)  # the velocity is right
                continue
            behind = (truth - seen) / VELOCITIES[0] / 0.1  # whole steps, until it is measured again
            assert behind == pytest.approx(np.full(3, round(behind[0])), abs=1e-6)
            assert k > 0 or behind[0] == pytest.approx(0.0, abs=1e-9)
            lost += behind[0] > 0.5
        if rule == "hold":
            assert lost / len(times) == pytest.approx(0.3, abs=0.07)
    blind = sensor(dropout=1.0, on_dropout="hold", position_noise=0.1)
    assert (blind.see(0.0).poses == blind.see(3.0).poses).all()


def test_the_errors_are_those_of_the_trial_and_one_size_changes_no_other():
    def told(eye: Sensor) -> np.ndarray:
        return np.array([eye.see(0.1 * k).poses for k in range(5)])

    one = told(sensor(3, position_noise=0.01))
    eye = sensor(3, position_noise=0.01)
    told(eye)
    eye.restart()
    assert (told(eye) == one).all()
    assert (told(Sensor(MOTION, MeasurementConfig(position_noise=0.01, trial=3), 0, 9, OBSTACLES)) == one).all()
    for other in (sensor(4, position_noise=0.01), sensor(3, 1, position_noise=0.01)):
        assert not (told(other) == one)[..., :3].any()
    assert not (told(sensor(3, stream=TARGET, position_noise=0.01)) == one).all()
    both = told(sensor(3, position_noise=0.01, speed_error=0.3, delay=0.2, compensate_delay=False))
    shift = np.array([MOTION.at(0.1 * k).poses - MOTION.at(0.1 * k - 0.2).poses for k in range(5)])
    assert both[..., :3] == pytest.approx((one - shift)[..., :3], abs=1e-12)


CLOSE = """\
version: 1
name: close
robot: {name: planar, q0: [0.0, 0.5]}
task: {type: joint-goal, goal: [1.5, 0.5]}
obstacles:
  - {shape: {type: ball, radius: 0.3}, position: [1.0, 3.0, 0.0], velocity: [0.0, -0.5, 0.0]}
controller: {variant: sdf-tvcbf-qp}
measurement: {delay: 0.1, position_noise: 0.02, heading_error_deg: 10, dropout: 0.2}
simulation: {dt: 0.1, time_limit: 1.0, tolerance: 0.1}
"""


def run(path: Path, trial: int):
    wired = assemble(load_scenario(path), trial=trial)
    for _ in wired.run():
        pass
    return wired.scenario, wired.rollout.trajectory()


def test_the_run_folder_has_the_truth_and_runs_again(tmp_path: Path):
    path = tmp_path / "close.yaml"
    path.write_text(CLOSE)
    scenario, trajectory = run(path, 17)
    truth = SceneMotion(scenario.obstacles)
    assert trajectory.obstacle_pose[5] == pytest.approx(truth.poses(float(trajectory.t[5])))
    (tmp_path / "as-run.yaml").write_text(dump(scenario))
    again, same = run(tmp_path / "as-run.yaml", 0)
    assert again == scenario
    assert (same.u == trajectory.u).all()
    assert (same.h == trajectory.h).all()
    path.write_text(CLOSE.replace("position_noise: 0.02, ", ""))
    assert (run(path, 17)[1].h != trajectory.h).any()  # h is what the controller believed


@pytest.mark.parametrize(
    ("edit", "field", "message"),
    [
        ("dropout: 1.2", "measurement.dropout", "must be at most 1, found 1.2"),
        ("delay: -0.1", "measurement.delay", "must be at least 0, found -0.1"),
        ("delay: {uniform: [0, 1]}", "measurement.delay", "expected one number, found a mapping with uniform"),
        ("dalay: 0.1", "measurement.dalay", "unknown key 'dalay'"),
        ("on_dropout: guess", "measurement.on_dropout", "unknown value 'guess'"),
        ("compensate_delay: yes", "measurement.compensate_delay", "expected true or false, found text 'yes'"),
    ],
)
def test_what_a_file_may_not_say(tmp_path: Path, edit: str, field: str, message: str):
    path = tmp_path / "close.yaml"
    path.write_text(CLOSE.replace("delay: 0.1, position_noise: 0.02, heading_error_deg: 10, dropout: 0.2", edit))
    with pytest.raises(ScenarioErrors) as caught:
        load_scenario(path)
    (problem,) = caught.value.problems
    assert (problem.line, problem.field, problem.message) == (8, field, message)


def test_a_delay_is_made_up_for_once(tmp_path: Path):
    path = tmp_path / "close.yaml"
    path.write_text(CLOSE)
    with pytest.raises(ScenarioErrors, match="made up for already"):
        load_scenario(path, ["controller.delay=0.1"])
    load_scenario(path, ["controller.delay=0.1", "measurement.compensate_delay=false"])
