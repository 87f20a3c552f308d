"""Obstacles: their shapes, where they are, how they move.

A shape is centred at the obstacle's origin. A capsule's and a cylinder's axis is the local z axis and ``length`` is the
straight part; a box has full side lengths. Positions are in the world frame, and have three coordinates for the planar
arm too (z = 0).
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self, TypeAlias, TypeVar

from pydantic import BeforeValidator, Field, model_validator

from cdfctl.scenario.placing import MOST_COPIES, MOST_OBSTACLES, ApproachConfig, GridConfig, RedrawConfig
from cdfctl.scenario.values import (
    Complaint,
    Label,
    ListOf,
    NonNegative,
    Number,
    Place,
    Points,
    Positive,
    Positive3,
    Quaternion,
    Strict,
    Uniform,
    Vector3,
    Whole,
    about,
    high,
    low,
    refuse,
    refuse_all,
)

ZERO = (0.0, 0.0, 0.0)
FILES = "STL, OBJ, DAE or PLY"


class BallShape(Strict):
    """A ball."""

    type: Annotated[Literal["ball"], about("a ball")]
    radius: Annotated[Positive, about("radius", "m")]


class BoxShape(Strict):
    """A box."""

    type: Annotated[Literal["box"], about("a box")]
    size: Annotated[Positive3, about("full side lengths along local x, y, z", "m")]


class CapsuleShape(Strict):
    """All points within ``radius`` of a segment."""

    type: Annotated[Literal["capsule"], about("a capsule along local z")]
    radius: Annotated[Positive, about("radius", "m")]
    length: Annotated[Positive, about("length of the straight part, without the caps", "m")]


class CylinderShape(Strict):
    """A cylinder."""

    type: Annotated[Literal["cylinder"], about("a cylinder along local z")]
    radius: Annotated[Positive, about("radius", "m")]
    length: Annotated[Positive, about("length", "m")]


class MeshShape(Strict):
    """The convex hull of some vertices."""

    type: Annotated[Literal["mesh"], about("the convex hull of a mesh")]
    file: Annotated[Label | None, about(f"a mesh file ({FILES}), relative to the scenario file; or give vertices")] = (
        None
    )
    vertices: Annotated[Points | None, about("at least four vertices; or give file", "m")] = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        _either(self.file, self.vertices, "file", "vertices")
        if self.vertices is not None and len(self.vertices) < 4:
            raise refuse(f"a mesh needs at least 4 vertices, found {len(self.vertices)}", at=("vertices",))
        return self


class CloudShape(Strict):
    """Balls of one radius around points."""

    type: Annotated[Literal["point-cloud"], about("balls of one radius around points")]
    file: Annotated[
        Label | None,
        about("a file of points (.npy, .csv or .txt, three columns), relative to the scenario file; or points"),
    ] = None
    points: Annotated[Points | None, about("the points; or give file", "m")] = None
    radius: Annotated[NonNegative, about("radius of every ball", "m")] = 0.0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        _either(self.file, self.points, "file", "points")
        if self.points is not None and not self.points:
            raise refuse("a point cloud needs at least 1 point", at=("points",))
        return self


Shape: TypeAlias = Annotated[
    BallShape | BoxShape | CapsuleShape | CylinderShape | MeshShape | CloudShape, Field(discriminator="type")
]


class WaypointMotion(Strict):
    """Straight lines at constant speed from waypoint to waypoint; at rest before the first and after the last."""

    type: Annotated[
        Literal["waypoints"], about("from waypoint to waypoint at constant speed, at rest before and after")
    ]
    times: Annotated[
        tuple[NonNegative, ...],
        BeforeValidator(ListOf(least=2, noun="times")),
        about("when each waypoint is passed, increasing", "s"),
    ]
    positions: Annotated[Points, about("where, one [x, y, z] a time", "m")]
    orientations: Annotated[
        tuple[Quaternion, ...] | None,
        BeforeValidator(ListOf(noun="quaternions [x, y, z, w]")),
        about("how turned, one quaternion x y z w a time; without it the obstacle keeps its orientation"),
    ] = None

    @model_validator(mode="after")
    def _lengths(self) -> Self:
        complaints: list[Complaint] = []
        count = len(self.times)
        for name, values in (("positions", self.positions), ("orientations", self.orientations)):
            if values is not None and len(values) != count:
                complaints.append((f"expected {count} {name}, one a time, found {len(values)}", None, (name,)))
        for k in range(1, count):
            if not high(self.times[k - 1]) < low(self.times[k]):
                complaints.append(("times must increase", None, ("times", k)))
        for k, quaternion in enumerate(self.orientations or ()):
            complaints += _quaternion(quaternion, ("orientations", k))
        return _unless(complaints, self)


class SinusoidMotion(Strict):
    """position + amplitude sin(2 pi frequency t + phase)."""

    type: Annotated[Literal["sinusoid"], about("position + amplitude sin(2 pi frequency t + phase)")]
    amplitude: Annotated[Vector3, about("amplitude along world x, y, z", "m")]
    frequency: Annotated[NonNegative, about("frequency", "Hz")]
    phase: Annotated[Number, about("phase at t = 0", "rad")] = 0.0


Motion: TypeAlias = Annotated[WaypointMotion | SinusoidMotion, Field(discriminator="type")]


class Body(Strict):
    """A shape, its pose at t = 0 and its motion: what an obstacle and a target have in common.

    Without ``motion`` it keeps a constant twist: ``velocity`` of its origin, ``angular_velocity`` about it.
    """

    shape: Annotated[Shape, about("its geometry")]
    position: Annotated[
        Vector3 | None,
        BeforeValidator(ListOf(exact=3)),
        about("its origin at t = 0 (a sinusoid's centre); not given with waypoints, which have their own", "m"),
    ] = None
    orientation: Annotated[Quaternion, about("quaternion x y z w, normalised when read")] = (0.0, 0.0, 0.0, 1.0)
    velocity: Annotated[Vector3, about("constant velocity of its origin, world axes", "m/s")] = ZERO
    angular_velocity: Annotated[Vector3, about("constant angular velocity, world axes", "rad/s")] = ZERO
    motion: Annotated[Motion | None, about("another motion than a constant twist")] = None
    approach: Annotated[
        ApproachConfig | None, about("instead of position and velocity: when, where and how fast it passes a point")
    ] = None

    @model_validator(mode="after")
    def _coherent(self) -> Self:
        complaints = _quaternion(self.orientation, ("orientation",))
        waypoints = isinstance(self.motion, WaypointMotion)
        if self.approach is not None:
            given = {"position": self.position, "velocity": self.velocity, "motion": self.motion}
            for name, value in given.items():
                if value not in (None, ZERO):
                    hint = "the approach says where it is and how it moves"
                    complaints.append((f"{name} and approach exclude each other", hint, (name,)))
        elif self.position is None and not waypoints:
            complaints.append(("missing key 'position'", "its origin at t = 0, [x, y, z] in m", ("position",)))
        if self.position is not None and waypoints:
            hint = "leave position out: motion.positions says where it is"
            complaints.append(("position and waypoints exclude each other", hint, ("position",)))
        for name in ("velocity", "angular_velocity"):
            if self.motion is not None and getattr(self, name) != ZERO:
                complaints.append((f"{name} and motion exclude each other", "give one of them", (name,)))
        return _unless(complaints, self)


class ObstacleConfig(Body):
    """One obstacle, or a group of them: ``count`` draws, each with its copies on ``grid``."""

    name: Annotated[
        Label | None,
        about("its name in reports; without one, its place in the list, from 0; in a group name-1, name-2, ..."),
    ] = None
    count: Annotated[
        int | None, BeforeValidator(Whole(1, MOST_COPIES)), about("so many obstacles, each drawn for itself")
    ] = None
    grid: Annotated[GridConfig | None, about("copies of each draw, side by side")] = None
    redraw_within: Annotated[RedrawConfig | None, about("when this obstacle, with its copies, is drawn again")] = None

    @model_validator(mode="after")
    def _group(self) -> Self:
        complaints: list[Complaint] = []
        if self.grid is not None and isinstance(self.motion, WaypointMotion):
            complaints.append(("grid and waypoints exclude each other", "a grid needs a position", ("grid",)))
        if self.redraw_within is not None and self.redraw_within.segment is not None and self.motion is not None:
            hint = "its path must be a straight line: velocity or approach"
            complaints.append(("segment and motion exclude each other", hint, ("redraw_within", "segment")))
        if self.members > MOST_OBSTACLES:
            complaints.append((f"{self.members} obstacles are too many", f"at most {MOST_OBSTACLES}", ("grid",)))
        return _unless(complaints, self)

    @property
    def members(self) -> int:
        """How many obstacles it becomes when drawn."""
        return (self.count or 1) * (math.prod(self.grid.counts) if self.grid is not None else 1)


def _either(first: object, second: object, first_name: str, second_name: str) -> None:
    if first is None and second is None:
        raise refuse(f"missing key '{first_name}' or '{second_name}'", at=(first_name,))
    if first is not None and second is not None:
        raise refuse(f"{first_name} and {second_name} exclude each other", "give one of them", at=(second_name,))


def _quaternion(value: tuple[float | Uniform, ...], at: Place) -> list[Complaint]:
    if any(isinstance(x, Uniform) or abs(x) >= 1e-6 for x in value):
        return []
    return [("a quaternion x y z w must not be zero", None, at)]


T = TypeVar("T")


def _unless(complaints: list[Complaint], model: T) -> T:
    if complaints:
        raise refuse_all(complaints)
    return model
