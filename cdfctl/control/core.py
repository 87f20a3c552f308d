"""The core that a scenario's controller and a user's safety filter share: field, rows, box, quadratic program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from cdfctl.control.nearest import least_barrier, nearest_contact
from cdfctl.control.parameters import Parameters
from cdfctl.control.qp import StepQP
from cdfctl.control.rows import (
    acceleration_box,
    cbf_rows,
    hyperplane_rows,
    joint_limit_box,
    self_collision_rows,
    stack,
    tvcbf_rows,
    usable,
)
from cdfctl.control.solvers import TOLERANCE
from cdfctl.errors import InputError
from cdfctl.fields.field import Field, make_field
from cdfctl.fields.self_distance import SelfDistance
from cdfctl.robots.robot import Robot
from cdfctl.scenario.variants import FieldKind, Variant
from cdfctl.types import Array, Decision, FieldQuery, IntArray, Rows, Scene, SelfQuery

if TYPE_CHECKING:
    from cdfctl.control.prediction import KnownMotion

# The fields a variant asks, the one whose barrier is reported as h first.
FIELDS_OF: Mapping[FieldKind, tuple[str, ...]] = {"sdf": ("sdf",), "cdf": ("cdf",), "dual": ("cdf", "sdf")}


class Core:
    """Velocities that keep a robot clear of a moving scene, as near as can be to those asked for.

    It keeps the field's warm starts and the last command, ``u_last`` (n,), from step to step: one instance a loop.
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
        p = parameters
        self._fields = [make_field(name, robot) for name in FIELDS_OF[variant.field]]
        self._at_once = _at_once(self._fields)
        self._rows = _rows_of(variant, parameters, dt)
        self._qp = StepQP(
            n,
            effort_weight=parameters.effort_weight,
            smoothness_weight=parameters.smoothness_weight,
            slack_weight=parameters.slack_weight,
            violation_weight=parameters.violation_weight,
            on_infeasible=parameters.on_infeasible,
            solver=parameters.solver,
        )
        _rehearse(n, p.solver)
        own = SelfDistance(robot, p.self_collision, p.self_collision_margin) if p.self_collision else None
        self._own = own if own is not None and own.most else None
        self._accelerates_freely = bool(np.isinf(robot.acceleration_limit).all())
        self.u_last = np.zeros(n)

    def reset(self) -> None:
        """Forget the steps so far; the robot stands."""
        self.u_last = np.zeros(self.robot.n)
        for field in self._fields:
            field.reset()
        if self._own is not None:
            self._own.reset()

    def follow(self, q: Array, scene: Scene, u: Array) -> Decision:
        """``u`` (n,) as the command, no row of an obstacle asked; what is reported is that of :meth:`step`.

        Only what a plan knows nothing of may change it: acceleration limits, velocity limits that fall towards the end
        stops, and the robot's own links.
        """
        h = least_barrier(self._ask(self._fields[0], q, scene), len(scene), self.parameters.margin)
        if self._accelerates_freely and self.robot.braking is None and self._own is None:
            self.u_last = u.copy()
            return Decision(u=u, h=h, slack=float("nan"), status="optimal", infeasible=False, residual=0.0)
        return self._decide(q, scene, u, h, [], [])

    def step(self, q: Array, scene: Scene, u_ref: Array, task: Rows | None = None) -> Decision:
        """The command at configuration ``q`` (n,) in ``scene``, as near as can be to ``u_ref`` (n,), rad/s.

        ``q`` and ``u_ref`` are finite: the caller, who knows what they are called, has checked. ``task`` are rows the
        task adds.

        Raises:
            InputError: a pose or velocity of ``scene`` is not finite.
        """
        p = self.parameters
        try:
            answers = self._answers(q, scene)
        except InputError:
            check_scene(scene)  # which says more than a field, that does not know the obstacles' names
            raise
        rows = self._rows(answers)
        h = least_barrier(answers[0], len(scene), p.margin)
        return self._decide(q, scene, u_ref, h, answers, [rows] if task is None else [rows, task])

    def _answers(self, q: Array, scene: Scene) -> Sequence[FieldQuery]:
        """What each field says, the one whose barrier is reported as h first."""
        if self._at_once is not None:
            p = self.parameters
            return self._at_once(q, scene, sheets=p.sheets, every_link=p.links == "all")
        return [self._ask(field, q, scene) for field in self._fields]

    def _ask(self, field: Field, q: Array, scene: Scene) -> FieldQuery:
        p = self.parameters
        several = p.links == "all" if field.unit == "m" else p.sheets > 1
        return field.contacts(q, scene, sheets=p.sheets) if several else field.query(q, scene)

    def _decide(
        self, q: Array, scene: Scene, u_ref: Array, h: Array, answers: Sequence[FieldQuery], parts: Sequence[Rows]
    ) -> Decision:
        """The command nearest to ``u_ref`` within the box, under ``parts`` and the rows of the robot's own links.

        ``parts`` begin with those of ``answers``, one after the other.
        """
        p, m = self.parameters, len(scene)
        near = self._own.query(q) if self._own is not None else None
        own = [] if near is None else [self_collision_rows(near, p.alpha, p.self_collision_margin)]
        low, high = self._box(q)
        command = self._qp.solve(u_ref, self.u_last, stack([*own, *parts], self.robot.n), low, high)
        self.u_last = command.u.copy()  # the caller may change the one it gets
        holders = self._holders(command.tight, near, answers, scene)
        return Decision(
            u=command.u,
            h=h,
            slack=command.slack,
            status=command.status,
            infeasible=command.infeasible,
            residual=command.residual,
            h_sdf=least_barrier(answers[1], m, p.margin) if len(answers) > 1 else None,
            contact_q=nearest_contact(answers[0], m) if answers and answers[0].unit == "rad" else None,
            h_self=near.d - p.self_collision_margin if near is not None else None,
            self_pair=self._own.links[near.pair[0]] if self._own is not None and near is not None else None,
            active=(*holders, *self._bounds(command.u, u_ref, low, high)),
        )

    def brake(self) -> Array:
        """Standstill, or the nearest to it that the acceleration limits allow: a command (n,) without a look at the
        scene."""
        step = self.robot.acceleration_limit * self.dt
        self.u_last = self.u_last - np.minimum(np.maximum(self.u_last, -step), step)
        return self.u_last.copy()

    def _box(self, q: Array) -> tuple[Array, Array]:
        """The velocity bounds (n,) at ``q``: joint limits, velocity limits, acceleration limits."""
        robot = self.robot
        slowest, fastest = robot.velocity_bounds(q, self.dt)
        low, high = joint_limit_box(q, robot.lower, robot.upper, slowest, fastest, self.parameters.limit_alpha)
        if self._accelerates_freely:
            return low, high
        below, above, limit = q - robot.lower, robot.upper - q, robot.acceleration_limit
        return acceleration_box(low, high, below, above, self.u_last, limit, self.dt)

    def _holders(
        self,
        tight: IntArray,
        near: SelfQuery | None,
        answers: Sequence[FieldQuery],
        scene: Scene,
    ) -> Iterable[str]:
        """The rows ``tight`` in words, each once; the task's are left out."""
        found: dict[str, None] = {}
        rows = tight.tolist()  # few, in ascending order
        if not rows:
            return found
        if near is not None and self._own is not None:
            pairs = near.pair[near.valid]
            for row in rows:
                if row < len(pairs):
                    found[" near ".join(self._own.links[pairs[row]])] = None
            rows = [row - len(pairs) for row in rows if row >= len(pairs)]
        for answer in answers:  # the task's rows come last
            used = np.flatnonzero(usable(answer))
            for row in rows:
                if row < len(used):
                    name, link = scene.names[answer.obstacle[used[row]]], answer.link[used[row]]
                    found[f"{name} near {self.robot.links[link]}"] = None
            rows = [row - len(used) for row in rows if row >= len(used)]
        return found

    def _bounds(self, u: Array, u_ref: Array, low: Array, high: Array) -> Iterable[str]:
        """The joints whose bounds keep ``u`` from ``u_ref``, in words."""
        held: list[str] = []
        if not np.count_nonzero(u != u_ref):
            return held
        names = self.robot.joint_names
        for name, v, v_ref, least, most in zip(names, *map(Array.tolist, (u, u_ref, low, high)), strict=True):
            if (v_ref < v <= least + TOLERANCE) or (v_ref > v >= most - TOLERANCE):
                held.append(f"bound of {name}")
        return held


def core_of(
    robot: Robot, variant: Variant, parameters: Parameters, dt: float, known: KnownMotion | None = None
) -> Core:
    """The core that a variant asks for; ``known`` is the obstacles' motion, where it is given away.

    Raises:
        InputError: as :class:`Core`.
    """
    if variant.plans:
        from cdfctl.control.predictive import PredictiveCore

        return PredictiveCore(robot, variant, parameters, dt, known)
    return Core(robot, variant, parameters, dt)


@cache
def _rehearse(n: int, solver: str) -> None:
    StepQP(n, solver=solver).rehearse()


def _at_once(fields: Sequence[Field]) -> Callable[..., tuple[FieldQuery, FieldQuery]] | None:
    """What asks both ``fields`` in one pass, where they are a CDF and an SDF; None elsewhere."""
    if [field.unit for field in fields] != ["rad", "m"]:
        return None
    from cdfctl.fields.cdf import CDF  # compiled code, which the fields have loaded, if these are they
    from cdfctl.fields.sdf import SDF

    cdf, sdf = fields
    return partial(cdf.beside, sdf) if isinstance(cdf, CDF) and isinstance(sdf, SDF) else None


def _rows_of(variant: Variant, p: Parameters, dt: float) -> Callable[[Sequence[FieldQuery]], Rows]:
    """What is made of the fields' answers, in their order."""
    match variant.safety:
        case "tvcbf":
            return lambda answers: tvcbf_rows(answers, p.alpha, p.margin)
        case "cbf":
            return lambda answers: cbf_rows(answers, p.alpha, p.margin)
        case "hyperplane":
            offset = p.hyperplane_offset
            return lambda answers: stack([hyperplane_rows(one, offset, dt) for one in answers], answers[0].dq.shape[1])


def check_scene(scene: Scene) -> None:
    """Raise :class:`InputError` naming the first obstacle whose pose or velocity is not finite."""
    if np.isfinite(scene.poses).all() and np.isfinite(scene.twists).all():
        return
    for name, pose, twist in zip(scene.names, scene.poses, scene.twists, strict=True):
        if not (np.isfinite(pose).all() and np.isfinite(twist).all()):
            raise InputError(f"obstacle '{name}' has a pose or velocity that is not finite")
