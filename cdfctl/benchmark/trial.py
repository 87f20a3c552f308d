"""One trial, as a worker runs it: nothing here prints, writes or knows of the others."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, Literal

from cdfctl.benchmark.plan import Cell, robot_for
from cdfctl.benchmark.tables import check_table
from cdfctl.errors import CdfctlError
from cdfctl.robots.robot import Robot
from cdfctl.simulation.assemble import assemble_scenario
from cdfctl.simulation.drawing import draw_trial
from cdfctl.simulation.result import RunResult
from cdfctl.types import TrialKey, TrialResult, Verdict

Keep = Literal["all", "failures", "none"]

_ROBOTS: dict[str, Robot] = {}
"""This process's robots: loading one takes as long as several trials."""


@dataclass(frozen=True)
class Answer:
    """What a worker hands back: the result, how long the trial took (s), and the run where it is to be kept."""

    result: TrialResult
    wall: float
    run: RunResult | None = None


def run_trial(cell: Cell, trial: int, keep: Keep) -> Answer:
    """Run one trial of a cell to its end and judge it. A scenario that cannot be run, or a plant that fails, is a
    result too: its outcome is ``error``.

    Raises:
        MissingError: this process would use another contact table than the plan says.
    """
    began = time.perf_counter()
    key = cell.key(trial)
    robot = robot_for(cell.scenario, _ROBOTS)
    check_table(cell.scenario, robot, cell.table)
    try:
        scenario = draw_trial(cell.scenario, trial, robot)
        wired = assemble_scenario(scenario, trial=trial, robot=robot)
        for _ in wired.run():
            pass
        run = wired.result()
    except CdfctlError as error:
        return Answer(failed(key, " ".join(error.message.split())), time.perf_counter() - began)
    result = TrialResult(
        key=key,
        verdict=run.verdict,
        steps=len(run.trajectory.u),
        infeasible_steps=run.infeasible_steps,
        step_times=run.trajectory.step_time.tolist(),
        reason=run.reason,
    )
    kept = keep == "all" or (keep == "failures" and not run.verdict.success)
    return Answer(result, time.perf_counter() - began, run if kept else None)


def failed(key: TrialKey, reason: str) -> TrialResult:
    """The result of a trial that has none."""
    verdict = Verdict("error", "error", None, math.nan, math.nan, math.nan, None, None)
    return TrialResult(key, verdict, steps=0, infeasible_steps=0, reason=reason)


def record_of(result: TrialResult) -> dict[str, Any]:
    """A line of ``trials.jsonl``: deterministic columns only. Numbers that are not finite are None."""
    key, verdict = result.key, result.verdict
    return {
        "scenario": key.scenario,
        "controller": key.controller,
        "on_infeasible": key.on_infeasible,
        "seed": key.seed,
        "trial": key.trial,
        "outcome": verdict.outcome,
        "outcome_sampled": verdict.outcome_sampled,
        "time_to_reach_s": verdict.time_to_reach,
        "path_length_m": _finite(verdict.path_length),
        "joint_path_rad": _finite(verdict.joint_path),
        "min_clearance_m": _finite(verdict.min_clearance),
        "collision_time_s": verdict.contact.time if verdict.contact is not None else None,
        "steps": result.steps,
        "infeasible_steps": result.infeasible_steps,
        "reason": result.reason,
    }


def timing_of(answer: Answer) -> dict[str, Any]:
    """A line of ``timing.jsonl``: the key, the whole trial (s), and every control step (microseconds)."""
    key = answer.result.key
    return {
        "scenario": key.scenario,
        "controller": key.controller,
        "on_infeasible": key.on_infeasible,
        "trial": key.trial,
        "wall_s": round(answer.wall, 6),
        "step_us": [round(1e6 * t) for t in answer.result.step_times],
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
