"""What a run comes to: its arrays, the judge's word on them, and the document of ``cdfctl run --json``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdfctl.scenario.schema import Scenario
from cdfctl.simulation.judge import Stop
from cdfctl.simulation.plants import Report
from cdfctl.types import Trajectory, Verdict


@dataclass(frozen=True)
class RunResult:
    """One finished, failed or interrupted run.

    Attributes:
        scenario: as resolved, every default and draw written out.
        robot: its name.
        trial: which draw of the scenario's seed.
        trajectory: the arrays of the steps completed.
        verdict: the judge's.
        stop: why the rollout ended.
        reason: what went wrong where ``stop`` is ``error``, what the plant said where it is ``contact``, else None.
        plant: what the plant has to say of the run.
        measured: what became of the measurements of obstacles; None where they are not measured.
    """

    scenario: Scenario
    robot: str
    trial: int
    trajectory: Trajectory
    verdict: Verdict
    stop: Stop
    reason: str | None = None
    plant: Report = field(default_factory=lambda: {"type": "kinematic"})
    measured: Report | None = None

    @property
    def infeasible_steps(self) -> int:
        """Steps at which no velocity satisfied all rows; the one that ended the run under ``fail`` counts too."""
        return int(self.trajectory.infeasible.sum()) + (self.stop == "infeasible")

    def document(self, run_dir: str) -> dict[str, Any]:
        """The keys of ``cdfctl run --json``; a number that is not finite is None."""
        verdict, trajectory = self.verdict, self.trajectory
        document = {
            "scenario": self.scenario.name,
            "controller": self.scenario.controller.variant,
            "robot": self.robot,
            "seed": self.scenario.seed,
            "outcome": verdict.outcome,
            "success": verdict.success,
            "time_to_reach_s": _number(verdict.time_to_reach),
            "steps": len(trajectory.u),
            "path_length_m": _number(verdict.path_length),
            "joint_path_rad": _number(verdict.joint_path),
            "min_clearance_m": _number(verdict.min_clearance),
            "collision_time_s": _number(verdict.contact.time if verdict.contact is not None else None),
            "infeasible_steps": self.infeasible_steps,
            "step_ms": step_milliseconds(trajectory),
            "run_dir": run_dir,
            "plant": {name: _number(x) if isinstance(x, float) else x for name, x in self.plant.items()},
            "min_self_clearance_m": _number(verdict.min_self_clearance),
            "self_contact_time_s": _number(verdict.self_contact.time if verdict.self_contact is not None else None),
        }
        return document if self.measured is None else {**document, "measured": dict(self.measured)}


def step_milliseconds(trajectory: Trajectory) -> Mapping[str, float | None]:
    """Median, 99 % and greatest wall-clock time of the controller's step, ms; None where there was no step."""
    times = 1e3 * trajectory.step_time
    if not len(times):
        return {"p50": None, "p99": None, "max": None}
    p50, p99 = np.percentile(times, [50, 99])
    return {"p50": float(p50), "p99": float(p99), "max": float(times.max())}


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
