"""A run folder as the figures need it: the arrays, the robot that moved, and what follows from both."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cdfctl.fields.field import Field, make_field
from cdfctl.report.figures.style import signed
from cdfctl.robots.robot import Robot
from cdfctl.scenario.resolve import resolve
from cdfctl.scenario.schema import HoldTask, JointGoalTask, ReachTask, Scenario
from cdfctl.scenario.variants import variant_named
from cdfctl.simulation.checks import robot_of
from cdfctl.simulation.clearance import Clearance
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.run_folder import check_fits, read_run
from cdfctl.simulation.shapes import vector_of
from cdfctl.types import Array, Scene, Trajectory

MOST_INSTANTS = 400
"""At so many instants, evenly spread, the clearance is measured: of a short run between its control steps too."""

LONGEST_LABEL = 40
"""Characters of an obstacle's name in a figure."""


@dataclass
class RunView:
    """One run to be shown.

    Attributes:
        scenario: as resolved.
        document: ``result.json``.
        trajectory: the arrays.
        robot: the robot.
        motion: the obstacles: their shapes and names.
        target: what a reach task touches, None for another task.
    """

    scenario: Scenario
    document: dict[str, Any]
    trajectory: Trajectory
    robot: Robot
    motion: SceneMotion
    target: SceneMotion | None

    @property
    def t(self) -> Array:
        """(N+1,) s."""
        return self.trajectory.t

    @property
    def steps(self) -> int:
        """N, the number of control steps; it may be 0."""
        return len(self.trajectory.u)

    @property
    def margin(self) -> float:
        """ε of h = d − ε, in the unit of the field."""
        return float(self.scenario.controller.margin or 0.0)

    @property
    def goal(self) -> Array | None:
        """(n,) the configuration to be at, None for a reach task."""
        match self.scenario.task:
            case JointGoalTask(goal=goal):
                return vector_of(goal)
            case HoldTask(pose=pose):
                return vector_of(pose)
            case ReachTask():
                return None

    @cached_property
    def field_names(self) -> tuple[str, ...]:
        """The fields of the controller's safety rows: ``cdf``, ``sdf`` or both."""
        kind = variant_named(self.scenario.controller.variant).field
        return ("cdf", "sdf") if kind == "dual" else (kind,)

    def field(self, name: str) -> Field:
        """A field of this robot."""
        return make_field(name, self.robot)

    def scene(self, k: int) -> Scene:
        """The obstacles at control step ``k``, as recorded."""
        arrays = self.trajectory
        return Scene.from_arrays(
            self.motion.shapes, self.motion.names, arrays.obstacle_pose[k], arrays.obstacle_twist[k]
        )

    def obstacle(self, i: int) -> str:
        """What obstacle ``i`` is called in a figure."""
        name = self.motion.names[i]
        if name.isdecimal():
            return f"obstacle {int(name) + 1}"
        if name.startswith("_"):  # such a line has no place in matplotlib's legends
            name = f"obstacle {name}"
        return name if len(name) <= LONGEST_LABEL else name[: LONGEST_LABEL - 1] + "…"

    @cached_property
    def clearance(self) -> tuple[Array, Array]:
        """Instants (s, k) and the least signed distance (k, m) robot–obstacle there, m: by coal, as the judge."""
        instants = self._instants()
        measure = Clearance(self.robot, self.motion.shapes)
        if not measure.objects:
            return instants, np.full((len(instants), measure.obstacles), np.inf)
        t, q = self.trajectory.path
        found = []
        for now in instants.tolist():
            measure.place(np.array([np.interp(now, t, column) for column in q.T]), self._poses(now))
            found.append(measure.distances().reshape(measure.objects, measure.obstacles).min(axis=0))
        return instants, np.array(found)

    def _instants(self) -> Array:
        """Every control step, and as many instants between two as there is room for; or some of the steps."""
        between = MOST_INSTANTS // max(self.steps, 1)
        if between > 1:
            return np.interp(np.arange(self.steps * between + 1) / between, np.arange(self.steps + 1), self.t)
        picked: Array = self.t[
            np.unique(np.linspace(0, self.steps, min(self.steps + 1, MOST_INSTANTS)).round().astype(int))
        ]
        return picked

    def _poses(self, now: float) -> Array:
        """Poses (m, 7) of the obstacles at ``now``: as declared, or as they were at the last step where measured."""
        if self.scenario.feed is None:
            return self.motion.poses(now)
        k = int(np.searchsorted(self.t, now + 1e-9, side="right")) - 1
        recorded: Array = self.trajectory.obstacle_pose[k]
        return recorded

    @cached_property
    def plan(self) -> tuple[Array, Array] | None:
        """What a predictive controller planned at each step: q (N, K, n) and t (N, K), NaN where nothing; or None."""
        q, t = self.trajectory.plan_q, self.trajectory.plan_t
        if q is None or t is None or not np.isfinite(q).all(axis=2).any():
            return None
        return q, t

    @cached_property
    def in_plane(self) -> bool:
        """Whether the robot moves in planes z = constant: every joint turns about z or slides along x and y."""
        import pinocchio as pin

        data = self.robot.model.createData()
        pin.forwardKinematics(self.robot.model, data, np.zeros(self.robot.n))
        chain = self.robot.chain
        along_z = [abs(float((data.oMi[i + 1].rotation @ chain.axis[i])[2])) for i in range(self.robot.n)]
        return all(z < 1e-9 if slides else z > 1.0 - 1e-9 for z, slides in zip(along_z, chain.prismatic, strict=True))

    @property
    def two_joints(self) -> bool:
        """Whether configurations are points of a plane."""
        return self.robot.n == 2 and not self.robot.prismatic.any()

    def step_at(self, t: float) -> int:
        """The control step nearest to ``t`` (s)."""
        return int(np.argmin(np.abs(self.t - t)))

    def title(self) -> str:
        """What was run and how it ended, in one line."""
        record = self.document
        parts = [f"{self.scenario.name}, {self.scenario.controller.variant}: {record.get('outcome', 'no outcome')}"]
        contact = record.get("collision_time_s")
        if contact is not None:
            parts[0] += f" at {contact:.2f} s"
        elif record.get("time_to_reach_s") is not None:
            parts[0] += f" in {record['time_to_reach_s']:.2f} s"
        if record.get("min_clearance_m") is not None:
            parts.append(f"least clearance {signed(record['min_clearance_m'])} m")
        parts.append(f"{int(self.trajectory.infeasible.sum())} of {self.steps} steps infeasible")
        return "; ".join(parts)

    def until(self, k: int) -> RunView:
        """The first ``k`` steps of the run, as a run."""
        ends = {"t", "q", "obstacle_pose", "obstacle_twist"}
        fine = self.trajectory.plant_t
        moments = 0 if fine is None else int(np.searchsorted(fine, self.t[k] + 1e-9, side="right"))
        arrays: dict[str, Any] = {field.name: getattr(self.trajectory, field.name) for field in fields(self.trajectory)}
        cut: dict[str, Any] = {name: a if a is None else a[: k + (name in ends)].copy() for name, a in arrays.items()}
        cut |= {name: arrays[name][:moments].copy() for name in ("plant_t", "plant_q") if arrays[name] is not None}
        return replace(self, trajectory=Trajectory(**cut))


def view_run(folder: Path) -> RunView:
    """The run in ``folder``.

    Raises:
        InputError: it is no run folder, or it is damaged, or its robot cannot be loaded, in one line.
    """
    run = read_run(folder)
    scenario = resolve(run.scenario)
    robot, motion = robot_of(scenario.robot), SceneMotion(scenario.obstacles)
    check_fits(run, robot.name, robot.n, len(motion))
    task = scenario.task
    target = SceneMotion((task.target,)) if isinstance(task, ReachTask) else None
    return RunView(scenario, run.document, run.trajectory, robot, motion, target)
