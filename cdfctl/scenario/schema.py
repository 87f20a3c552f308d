"""The scenario file, version 1: what to do, with which robot, among which obstacles, by which controller.

Pure data. Every field says its unit and where its default comes from; the reference page and the JSON Schema are made
from these models. Defaults live here, and those of the controller's parameters in :mod:`cdfctl.scenario.variants`.

Any number of ``robot.q0``, ``task`` and ``obstacles`` may be ``{uniform: [a, b]}``: drawn once a trial. Where drawn
obstacles come from, and which draws are refused, is in :mod:`cdfctl.scenario.placing`.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BeforeValidator, Field, model_validator

from cdfctl.errors import name_hint
from cdfctl.scenario.consistency import inconsistencies
from cdfctl.scenario.feed import FeedConfig
from cdfctl.scenario.measurement import MeasurementConfig
from cdfctl.scenario.placing import RedrawConfig
from cdfctl.scenario.plant import KinematicConfig, PlantField
from cdfctl.scenario.shapes import Body, ObstacleConfig
from cdfctl.scenario.values import (
    Label,
    ListOf,
    Number,
    PerJoint,
    Plain,
    PlainNonNegative,
    PlainPositive,
    PositiveByName,
    PositivePerJoint,
    Strict,
    Text,
    Vector,
    Whole,
    about,
    found,
    refuse,
    refuse_all,
)
from cdfctl.scenario.variants import DEFAULT_VARIANT, VARIANTS

VERSION = 1
"""The format this code writes, and the newest it reads."""


def _version(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise refuse(f"expected a whole number, found {found(value)}", f"this is version {VERSION} of the format")
    if value > VERSION:
        raise refuse(
            f"version {value} is newer than this cdfctl reads (up to {VERSION})",
            "its fields may mean something else here: update cdfctl, or use a file of an older version",
        )
    if value != VERSION:
        raise refuse(f"unknown version {value}", f"allowed: {VERSION}")
    return value


def _name(value: object) -> object:
    if not isinstance(value, str):
        raise refuse(f"expected text, found {found(value)}", "put it in quotes")
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", value):
        raise refuse(
            f"a name is up to 64 letters, digits, '.', '_' and '-', found {found(value)}",
            "it becomes part of the run folder's name",
        )
    return value


def _variant(value: object) -> object:
    if not isinstance(value, str) or value not in VARIANTS:
        shown = f"unknown controller '{value}'" if isinstance(value, str) else f"expected text, found {found(value)}"
        raise refuse(shown, name_hint(str(value), VARIANTS))
    return value


def _range(value: object) -> tuple[object, ...]:
    pair = ListOf(exact=2)(value)
    low, high = pair
    if isinstance(low, int | float) and isinstance(high, int | float) and not low < high:
        raise refuse(f"expected [low, high] with low < high, found [{low}, {high}]")
    return pair


class LimitsConfig(Strict):
    """Limits that replace the robot's own."""

    position: Annotated[
        dict[str, Annotated[tuple[Plain, Plain], BeforeValidator(_range)]],
        about("joint name: [low, high]; joints not named keep the URDF's", "rad, m for a prismatic joint"),
    ] = Field(default_factory=dict)
    velocity: Annotated[
        PositiveByName | None,
        about("greatest |u|: one number for all joints, or joint name: number; otherwise the URDF's", "rad/s"),
    ] = None
    acceleration: Annotated[
        PositiveByName | None,
        about("greatest change of u: one number for all joints, or joint name: number; otherwise none", "rad/s^2"),
    ] = None


class RobotConfig(Strict):
    """The robot and where it starts. Exactly one of ``name`` and ``urdf``."""

    name: Annotated[Label | None, about("a shipped robot (see cdfctl robots), or a robot file's path (.yaml)")] = None
    urdf: Annotated[Label | None, about("path of a URDF, relative to the scenario file")] = None
    package_dirs: Annotated[
        tuple[Label, ...],
        BeforeValidator(ListOf(noun="folders")),
        about("where package:// of the URDF points, relative to the scenario file"),
    ] = ()
    srdf: Annotated[
        Label | None,
        about("path of an SRDF, relative to the scenario file: which links may touch; otherwise the robot file's"),
    ] = None
    lock: Annotated[dict[str, Plain], about("joint name: value it is locked at", "rad, m for a prismatic joint")] = (
        Field(default_factory=dict)
    )
    tip: Annotated[Label | None, about("frame whose path length is reported; without it the robot file's")] = None
    limits: Annotated[LimitsConfig, about("limits that replace the robot's own")] = LimitsConfig()
    q0: Annotated[Vector, about("start configuration, one number a joint", "rad, m for a prismatic joint")]

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.name is None and self.urdf is None:
            raise refuse("missing key 'name' or 'urdf'", "a shipped robot's name, or a URDF's path", at=("name",))
        if self.name is not None and self.urdf is not None:
            raise refuse("name and urdf exclude each other", "give one of them", at=("urdf",))
        if self.package_dirs and self.urdf is None:
            raise refuse("package_dirs goes with urdf", at=("package_dirs",))
        return self


class JointGoalTask(Strict):
    """Go to a configuration. Reached at the first control step within ``simulation.tolerance`` of it."""

    type: Annotated[Literal["joint-goal"], about("go to a configuration")]
    goal: Annotated[Vector, about("goal configuration, one number a joint", "rad, m for a prismatic joint")]
    not_before: Annotated[
        PlainNonNegative | None, about("being there counts from this time on; without it, at any time", "s")
    ] = None


class BeyondConfig(Strict):
    """All obstacles' origins have passed a plane."""

    axis: Annotated[Literal["x", "y", "z"], about("world axis")]
    side: Annotated[Literal["below", "above"], about("which side of the plane they must be on")]
    value: Annotated[Number, about("the plane's coordinate on that axis", "m")]


class UntilConfig(Strict):
    """When a hold is over."""

    obstacles_beyond: Annotated[BeyondConfig, about("all obstacles' origins have passed a plane")]


class HoldTask(Strict):
    """Keep a configuration, and come back to it. Reached when ``until`` holds and the pose is within tolerance."""

    type: Annotated[Literal["hold"], about("keep a configuration, and come back to it")]
    pose: Annotated[Vector, about("the configuration to hold", "rad, m for a prismatic joint")]
    until: Annotated[
        UntilConfig | None,
        about("when the hold is over; without it, at the time limit, and reached if the pose is within tolerance then"),
    ] = None


class TargetConfig(Body):
    """What a reach task touches: a body like an obstacle, but wanted."""


class ReachTask(Strict):
    """Touch a moving target with any part of the robot. Reached when V <= ``controller.reach_tolerance``."""

    type: Annotated[Literal["reach"], about("touch a target with any part of the robot")]
    target: Annotated[TargetConfig, about("the target: shape, position and motion like an obstacle's")]


Task: TypeAlias = Annotated[JointGoalTask | HoldTask | ReachTask, Field(discriminator="type")]


def _enum(schema: dict[str, Any]) -> None:
    schema.update({"enum": list(VARIANTS), "x-unit": "", "x-source": "ours"})


class ControllerConfig(Strict):
    """The controller: a variant, and parameters that replace its defaults. None means the variant's default."""

    variant: Annotated[
        Text, BeforeValidator(_variant), Field(description="which controller, by name", json_schema_extra=_enum)
    ] = DEFAULT_VARIANT
    alpha: Annotated[PlainPositive | None, about("class-K gain of the safety rows", "1/s")] = None
    gamma: Annotated[PlainPositive | None, about("rate of the Lyapunov row", "1/s")] = None
    margin: Annotated[PlainNonNegative | None, about("epsilon_cbf: h = d - margin", "m (SDF), rad (CDF)")] = None
    reach_tolerance: Annotated[PlainPositive | None, about("epsilon_clf: a target is reached at V <= this", "rad")] = (
        None
    )
    gain: Annotated[PlainPositive | None, about("K of u_ref = K (goal - q)", "1/s")] = None
    effort_weight: Annotated[PositivePerJoint | None, about("R: cost of u - u_ref, a number or one a joint")] = None
    smoothness_weight: Annotated[PerJoint | None, about("S: cost of u - u_last, a number or one a joint")] = None
    slack_weight: Annotated[
        PlainPositive | None, about("p: cost of the Lyapunov slack; at least 100 times the effort weight")
    ] = None
    violation_weight: Annotated[
        PlainPositive | None, about("rho: cost of violating a safety row under least-violation, rows normalised")
    ] = None
    hyperplane_offset: Annotated[
        PlainPositive | None, about("b of the separating hyperplane row", "m (SDF), rad (CDF)")
    ] = None
    limit_alpha: Annotated[PlainPositive | None, about("alpha_lim: gain of the joint limits as barriers", "1/s")] = None
    links: Annotated[
        Literal["nearest", "all"] | None, about("SDF rows: of the nearest link of each obstacle, or of every link")
    ] = None
    sheets: Annotated[
        int | None, BeforeValidator(Whole(1, 16)), about("CDF rows: how many distinct nearest contacts an obstacle")
    ] = None
    self_collision: Annotated[
        int | None,
        BeforeValidator(Whole(0, 64)),
        about("rows for the nearest pairs of the robot's own links, this many; 0 for none"),
    ] = None
    self_collision_margin: Annotated[
        PlainNonNegative | None, about("least distance of those pairs: h = d - margin", "m")
    ] = None
    on_infeasible: Annotated[
        Literal["fail", "least-violation", "brake"] | None,
        about("when no u satisfies the rows: end the trial, violate the safety rows least, or u = 0"),
    ] = None
    solver: Annotated[Label | None, about("QP solver, any installed one of qpsolvers")] = None
    segments: Annotated[
        int | None, BeforeValidator(Whole(1, 64)), about("plans: straight motions before the one to the goal")
    ] = None
    horizon: Annotated[PlainPositive | None, about("plans: the longest those motions take together", "s")] = None
    candidates: Annotated[
        int | None, BeforeValidator(Whole(1, 1_000_000)), about("plans: how many are tried at a step")
    ] = None
    budget_ms: Annotated[
        PlainPositive | None,
        about("plans: time the search of a step may take, the best so far is used; without it candidates decide", "ms"),
    ] = None
    planner_seed: Annotated[int | None, BeforeValidator(Whole(0, 2**53 - 1)), about("plans: seed of the search")] = None
    prediction: Annotated[
        Literal["constant-twist", "known"] | None,
        about("plans: obstacles keep the twist they have, or the scenario's motions are known to the controller"),
    ] = None
    delay: Annotated[PlainNonNegative | None, about("plans: age of the scenes, made up for by p + v delay", "s")] = None
    position_error: Annotated[
        PlainNonNegative | None, about("plans: bound on the error of a measured position; widens the margin", "m")
    ] = None
    velocity_error: Annotated[
        PlainNonNegative | None,
        about("plans: bound on the error of a measured velocity, a share of the speed; widens the margin with time"),
    ] = None


class SimulationConfig(Strict):
    """The rollout."""

    dt: Annotated[PlainPositive, about("control step", "s", "paper, 0.1 s")] = 0.1
    time_limit: Annotated[PlainPositive, about("the trial ends here", "s", "paper, 20 s")] = 20.0
    tolerance: Annotated[
        PlainPositive, about("a configuration is reached within this, 2-norm", "rad", "ours: 0.05 Franka, 0.1 planar")
    ] = 0.05


class Scenario(Strict):
    """A scenario file."""

    version: Annotated[Literal[1], BeforeValidator(_version), about("version of the format; this one is 1")]
    name: Annotated[str, BeforeValidator(_name), about("name of the scenario: letters, digits, '.', '_', '-'")]
    description: Annotated[Text, about("one line for lists")] = ""
    source: Annotated[Text, about("where the set-up is from")] = ""
    robot: Annotated[RobotConfig, about("the robot and where it starts")]
    task: Annotated[Task, about("what to do: joint-goal, hold or reach")]
    obstacles: Annotated[
        tuple[ObstacleConfig, ...], BeforeValidator(ListOf(noun="obstacles")), about("what to keep away from")
    ] = ()
    redraw_within: Annotated[
        RedrawConfig | None, about("when the whole set-up is drawn again: any obstacle breaks one of these")
    ] = None
    feed: Annotated[FeedConfig | None, about("where measurements of the obstacles come from")] = None
    measurement: Annotated[MeasurementConfig, about("how wrong the controller's picture of the obstacles is")] = (
        MeasurementConfig()
    )
    controller: Annotated[ControllerConfig, about("by which controller")] = ControllerConfig()
    plant: PlantField = KinematicConfig()
    simulation: Annotated[SimulationConfig, about("the rollout")] = SimulationConfig()
    seed: Annotated[int, BeforeValidator(Whole(0, 2**53 - 1)), about("seed of the draws")] = 0
    assumptions: Annotated[
        tuple[Text, ...],
        BeforeValidator(ListOf(noun="sentences")),
        about("what the source leaves open and how it is settled"),
    ] = ()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        complaints = inconsistencies(self.model_dump())
        if complaints:
            raise refuse_all(complaints)
        return self
