"""The paper's real experiment: passing close to what is slow, keeping away from what is fast, on both plants."""

from __future__ import annotations

import numpy as np
import pytest

from cdfctl.robots.robot import Robot, load_robot
from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.result import RunResult

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def fr3() -> Robot:
    return load_robot("fr3", velocity_limits=0.5)


def run(name: str, plant: str, robot: Robot) -> tuple[RunResult, float, float]:
    """The result, when the arm is first at its goal, and how far it leaves it again, rad. At 10 Hz, for time."""
    trial = assemble(load_scenario(name, [f"plant={plant}", "simulation.dt=0.1"]), robot=robot)
    for _ in trial.run():
        pass
    result = trial.result()
    off = np.linalg.norm(result.trajectory.q - np.array(trial.scenario.task.pose), axis=1)
    first = int(np.argmax(off <= 0.05))
    return result, float(result.trajectory.t[first]), float(off[first:].max())


@pytest.mark.parametrize("plant", ["kinematic", "mujoco"])
def test_slow_passes_close_and_fast_keeps_away(plant: str, fr3: Robot) -> None:
    slow, slow_there, slow_yields = run("real-slow", plant, fr3)
    fast, fast_there, _ = run("real-fast", plant, fr3)
    assert slow.verdict.outcome == fast.verdict.outcome == "reached"
    # slow: at the goal early, gives way to the ball, comes back
    assert slow_there < 3.0
    assert slow_yields > 0.1
    # fast: not there before the ball has gone by, and never as close
    assert fast_there > slow_there + 1.5
    assert slow.verdict.min_clearance == pytest.approx(0.05, abs=0.003)
    assert fast.verdict.min_clearance > slow.verdict.min_clearance + 0.02
    if plant == "mujoco":
        assert slow.plant["contact"] == fast.plant["contact"] == "none"
