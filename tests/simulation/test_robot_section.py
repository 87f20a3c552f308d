"""Acceleration limits and an SRDF of a scenario's robot section reach the robot, and their mistakes their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.problems import ScenarioErrors
from cdfctl.simulation.assemble import assemble

DOCUMENT = {
    "version": 1,
    "name": "mine",
    "robot": {"name": "planar", "q0": [0.0, 1.0]},
    "task": {"type": "joint-goal", "goal": [1.0, 1.0]},
    "controller": {"variant": "sdf-tvcbf-qp"},
    "simulation": {"dt": 0.05, "time_limit": 4.0},
}


def scenario(folder: Path, **robot: object):
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump({**DOCUMENT, "robot": {**DOCUMENT["robot"], **robot}}))
    return load_scenario(str(path))


def test_a_run_keeps_its_acceleration_limits(tmp_path):
    trial = assemble(scenario(tmp_path, limits={"acceleration": {"joint1": 2.0}}))
    for _ in trial.run():
        pass
    result = trial.result()
    u = np.vstack([np.zeros(2), result.trajectory.u])
    assert result.verdict.outcome == "reached"
    assert np.abs(np.diff(u[:, 0])).max() == pytest.approx(2.0 * 0.05)
    assert trial.robot.acceleration_limit.tolist() == [2.0, np.inf]


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ({"limits": {"acceleration": {"joint3": 2.0}}}, "unknown joint 'joint3' of planar"),
        ({"limits": {"acceleration": -1.0}}, "must be greater than 0, found -1.0"),
        ({"limits": {"acceleration": "fast"}}, "expected a number or a mapping of numbers, found text 'fast'"),
        ({"srdf": "none.srdf"}, "no such file: none.srdf"),
        ({"srdf": "wrong.srdf"}, "names no link of this robot, but 'a'"),
    ],
)
def test_what_is_refused(tmp_path, robot, message):
    (tmp_path / "wrong.srdf").write_text('<robot name="x"><disable_collisions link1="a" link2="b"/></robot>')
    with pytest.raises(ScenarioErrors) as caught:
        assemble(scenario(tmp_path, **robot))
    assert message in str(caught.value)
    assert "mine.yaml:" in str(caught.value)
    assert f"field  robot.{'limits.acceleration' if 'limits' in robot else 'srdf'}" in str(caught.value)
