"""Runs made for a figure, without a run folder."""

from __future__ import annotations

from collections.abc import Sequence

from cdfctl.report.figures.run_view import RunView
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.overrides import Override
from cdfctl.scenario.schema import ReachTask
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.motion import SceneMotion


def made_run(name: str, overrides: Sequence[Override]) -> RunView:
    """The run of a shipped scenario, made now: no folder is written."""
    trial = assemble(load_scenario(name, overrides))
    for _ in trial.run():
        pass
    result = trial.result()
    task = trial.scenario.task
    target = SceneMotion((task.target,)) if isinstance(task, ReachTask) else None
    return RunView(trial.scenario, result.document(""), result.trajectory, trial.robot, trial.motion, target)
