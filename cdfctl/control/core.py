"""The core that a scenario's controller and a user's safety filter share: field, rows, box, quadratic program."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cdfctl.control.parameters import Parameters
from cdfctl.control.qp import StepQP
from cdfctl.control.rows import cbf_rows, hyperplane_rows, joint_limit_box, stack, tvcbf_rows
from cdfctl.errors import InputError
from cdfctl.fields.field import Field, make_field
from cdfctl.robots.robot import Robot
from cdfctl.scenario.variants import FieldKind, Variant
from cdfctl.types import Array, Decision, FieldQuery, Rows, Scene

# The fields a variant asks, the one whose barrier is reported as h first.
FIELDS_OF: Mapping[FieldKind, tuple[str, ...]] = {"sdf": ("sdf",), "cdf": ("cdf",), "dual": ("cdf", "sdf")}


@dataclass(frozen=True)
class RowSource:
    """One field and what is made of its answer: ``ask`` gives the rows' distances, ``rows`` the constraints."""

    field: Field
    ask: Callable[[Array, Scene], FieldQuery]
    rows: Callable[[FieldQuery], Rows]


class Core:
    """Velocities that keep a robot clear of a moving scene, as near as can be to those asked for.

    It keeps the field's warm starts and ``u_last`` from step to step: one instance a loop.
    """

    def __init__(self, robot: Robot, variant: Variant, parameters: Parameters, dt: float) -> None:
        """``dt`` is the control period, s. Raises :class:`InputError` for weights that do not fit the robot."""
        if not (np.isfinite(dt) and dt > 0.0):
            raise InputError(f"dt must be a number of seconds greater than 0, found {dt}")
        n = robot.n
        for name in ("effort_weight", "smoothness_weight"):
            weight = getattr(parameters, name)
            if isinstance(weight, tuple) and len(weight) != n:
                raise InputError(f"{name} must be one number or {n}, one a joint, found {len(weight)}")
        self.robot, self.variant, self.parameters, self.dt = robot, variant, parameters, dt
        self._sources: Sequence[RowSource] = [
            _source(name, robot, variant, parameters, dt) for name in FIELDS_OF[variant.field]
        ]
        self._qp = StepQP(
            n,
            effort_weight=parameters.effort_weight,
            smoothness_weight=parameters.smoothness_weight,
            slack_weight=parameters.slack_weight,
            violation_weight=parameters.violation_weight,
            on_infeasible=parameters.on_infeasible,
            solver=parameters.solver,
        )
        self._u_last = np.zeros(n)

    def reset(self) -> None:
        """Forget the steps so far."""
        self._u_last = np.zeros(self.robot.n)
        for source in self._sources:
            source.field.reset()

    def follow(self, q: Array, scene: Scene, u: Array) -> Decision:
        """``u`` (n,) as the command, no row asked; what is reported is that of :meth:`step`."""
        self._u_last = u
        h = least_barrier(self._sources[0].ask(q, scene), len(scene), self.parameters.margin)
        return Decision(u=u, h=h, slack=float("nan"), status="optimal", infeasible=False, residual=0.0)

    def step(self, q: Array, scene: Scene, u_ref: Array, task: Rows | None = None) -> Decision:
        """The command at configuration ``q`` (n,) in ``scene``, as near as can be to ``u_ref`` (n,), rad/s.

        ``q`` and ``u_ref`` are finite: the caller, who knows what they are called, has checked. ``task`` are rows the
        task adds.

        Raises:
            InputError: a pose or velocity of ``scene`` is not finite.
        """
        robot, p = self.robot, self.parameters
        check_scene(scene)
        answers = [source.ask(q, scene) for source in self._sources]
        parts = [source.rows(a) for source, a in zip(self._sources, answers, strict=True)]
        rows = stack(parts if task is None else [*parts, task], robot.n)
        slowest, fastest = robot.velocity_bounds(q, self.dt)
        low, high = joint_limit_box(q, robot.lower, robot.upper, slowest, fastest, p.limit_alpha)
        command = self._qp.solve(u_ref, self._u_last, rows, low, high)
        self._u_last = command.u
        first = answers[0]
        return Decision(
            u=command.u,
            h=least_barrier(first, len(scene), p.margin),
            slack=command.slack,
            status=command.status,
            infeasible=command.infeasible,
            residual=command.residual,
            h_sdf=least_barrier(answers[1], len(scene), p.margin) if len(answers) > 1 else None,
            contact_q=nearest_contact(first, len(scene)) if first.unit == "rad" else None,
        )


def core_of(robot: Robot, variant: Variant, parameters: Parameters, dt: float) -> Core:
    """The core that a variant asks for. Raises :class:`InputError` as :class:`Core`."""
    if variant.plans:
        from cdfctl.control.predictive import PredictiveCore

        return PredictiveCore(robot, variant, parameters, dt)
    return Core(robot, variant, parameters, dt)


def least_barrier(query: FieldQuery, m: int, margin: float) -> Array:
    """h (m,): the least ``d - margin`` over each obstacle's rows, +inf where it has none."""
    h = np.full(m, np.inf)
    np.minimum.at(h, query.obstacle, query.d - margin)
    return h


def nearest_contact(query: FieldQuery, m: int) -> Array:
    """(m, n) the contact configuration of each obstacle's nearest row, NaN where it has none."""
    contact = np.full((m, query.dq.shape[1]), np.nan)
    for row in np.argsort(-query.d, kind="stable"):  # the nearest comes last and stays
        if np.isfinite(query.d[row]):
            contact[query.obstacle[row]] = query.contact_q[row]
    return contact


def _source(field_name: str, robot: Robot, variant: Variant, p: Parameters, dt: float) -> RowSource:
    field = make_field(field_name, robot)
    several = p.links == "all" if field_name == "sdf" else p.sheets > 1

    def ask(q: Array, scene: Scene) -> FieldQuery:
        return field.contacts(q, scene, sheets=p.sheets) if several else field.query(q, scene)

    def rows(query: FieldQuery) -> Rows:
        match variant.safety:
            case "tvcbf":
                return tvcbf_rows(query, p.alpha, p.margin)
            case "cbf":
                return cbf_rows(query, p.alpha, p.margin)
            case "hyperplane":
                return hyperplane_rows(query, p.hyperplane_offset, dt)

    return RowSource(field, ask, rows)


def check_scene(scene: Scene) -> None:
    """Raise :class:`InputError` naming the first obstacle whose pose or velocity is not finite."""
    if np.isfinite(scene.poses).all() and np.isfinite(scene.twists).all():
        return
    for name, pose, twist in zip(scene.names, scene.poses, scene.twists, strict=True):
        if not (np.isfinite(pose).all() and np.isfinite(twist).all()):
            raise InputError(f"obstacle '{name}' has a pose or velocity that is not finite")
