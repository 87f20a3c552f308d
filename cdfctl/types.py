"""The nouns of cdfctl: small frozen dataclasses over float64 arrays.

Conventions, for the whole code:

- SI units: metres, seconds, radians (metres for prismatic joints). World frame unless a name says otherwise.
- ``n`` is the number of joints, ``m`` the number of obstacles, ``r`` the number of rows of a field's answer.
- A quaternion is ``x y z w``. A pose is ``(7,)``: position, quaternion. A twist is ``(6,)``: the linear velocity of the
  obstacle's origin, then the angular velocity, both in world axes.
- A capsule's and a cylinder's axis is their local z, centred; ``length`` is the straight part. A box has full side
  lengths.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from math import hypot, isfinite, isinf
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdfctl.errors import InputError

Array: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int64]
Unit = Literal["m", "rad"]


def as_vector(value: ArrayLike, size: int | None, name: str) -> Array:
    """``value`` as a finite float64 vector of the given size (any size if None), or an :class:`InputError`."""
    array = as_numbers(value, size, name)
    check_finite(array, name)
    return array


def as_numbers(value: ArrayLike, size: int | None, name: str) -> Array:
    """The same, finite or not."""
    array = _array(value, name)
    if array.ndim != 1 or (size is not None and array.shape[0] != size):
        expected = "numbers" if size is None else f"{size} numbers"
        raise InputError(f"{name} must have {expected}, found shape {array.shape}")
    return array


def _array(value: ArrayLike, name: str) -> Array:
    """``value`` copied into float64, or an :class:`InputError`."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} must be a list of numbers, found {reprlib.repr(value)}") from None
    if isinstance(value, np.ma.MaskedArray) and value.mask.any():
        raise InputError(f"{name} has numbers that are masked")
    return array


def check_finite(array: Array, name: str) -> None:
    """Raise :class:`InputError` where a number of ``array`` is NaN or infinite."""
    # One number tells in most cases, in a fifth of the time: a NaN or an infinity in a vector is one in its square.
    if not isfinite(np.vdot(array, array)) and not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, found {array.tolist()}")


def _positive(value: float, name: str, *, allow_zero: bool = False) -> float:
    """``value`` as a finite float greater than 0 (or 0), or an :class:`InputError`."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} must be a number, found {reprlib.repr(value)}") from None
    if not (isfinite(number) and (number > 0.0 or (allow_zero and number == 0.0))):
        raise InputError(f"{name} must be {'at least' if allow_zero else 'greater than'} 0, found {value}")
    return number


def _make_positive(shape: object, *names: str) -> None:
    for name in names:
        object.__setattr__(shape, name, _positive(getattr(shape, name), name))


@dataclass(frozen=True)
class Sphere:
    """A ball; ``radius`` in m."""

    radius: float

    def __post_init__(self) -> None:
        _make_positive(self, "radius")


@dataclass(frozen=True)
class Box:
    """A box centred at its origin; ``size`` (3,) full side lengths in m."""

    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        size = as_vector(self.size, 3, "box size")
        object.__setattr__(self, "size", tuple(_positive(x, "box size") for x in size.tolist()))


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` of a segment of ``length`` along local z, in m."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _make_positive(self, "radius", "length")


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along local z, ``radius`` and ``length`` in m."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _make_positive(self, "radius", "length")


@dataclass(frozen=True, eq=False)
class ConvexMesh:
    """The convex hull of ``vertices`` (k, 3) in m, or of the vertices of a mesh file (STL, OBJ, DAE, PLY)."""

    vertices: Array = field(repr=False)

    def __init__(self, vertices: ArrayLike | str | Path) -> None:
        points: ArrayLike
        if isinstance(vertices, (str, Path)):
            from cdfctl.robots.meshes import load_vertices

            points = load_vertices(Path(vertices))
        else:
            points = vertices
        object.__setattr__(self, "vertices", _points(points, "mesh vertices", least=4))


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Balls of one ``radius`` (m, may be 0) around ``points`` (k, 3); as an obstacle its distance is the nearest's."""

    points: Array = field(repr=False)
    radius: float = 0.0

    def __init__(self, points: ArrayLike, radius: float = 0.0) -> None:
        object.__setattr__(self, "points", _points(points, "cloud points", least=1))
        object.__setattr__(self, "radius", _positive(radius, "radius", allow_zero=True))


def _points(value: ArrayLike, name: str, least: int) -> Array:
    array = _array(value, name)
    if array.ndim != 2 or array.shape[1] != 3 or array.shape[0] < least:
        raise InputError(f"{name} must have shape (k, 3) with k >= {least}, found {array.shape}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite")
    array.flags.writeable = False
    return array


Shape: TypeAlias = Sphere | Box | Capsule | Cylinder | ConvexMesh | PointCloud


@dataclass(frozen=True, eq=False)
class Obstacle:
    """One obstacle at one instant.

    Attributes:
        shape: its geometry, in its own frame.
        position: (3,) its origin, m.
        orientation: (4,) quaternion x y z w, normalised here.
        velocity: (3,) velocity of its origin, m/s.
        angular_velocity: (3,) rad/s, world axes.
        name: its identity from step to step; without one, its place in the scene.
    """

    shape: Shape
    position: Array
    orientation: Array
    velocity: Array
    angular_velocity: Array
    name: str | None = None

    def __init__(
        self,
        shape: Shape,
        position: ArrayLike,
        orientation: ArrayLike = (0.0, 0.0, 0.0, 1.0),
        velocity: ArrayLike = (0.0, 0.0, 0.0),
        angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
        name: str | None = None,
    ) -> None:
        quaternion = as_vector(orientation, 4, "orientation")
        norm = hypot(*quaternion)
        if norm < 1e-6:
            raise InputError("orientation must be a quaternion x y z w of non-zero length")
        if isinf(norm):
            raise InputError("orientation must be a quaternion x y z w of finite length")
        if not isinstance(shape, Shape):
            raise InputError(f"shape must be one of cdfctl's, Sphere, Box and so on, found {reprlib.repr(shape)}")
        if not isinstance(name, str | None):
            raise InputError(f"name must be text, found {reprlib.repr(name)}")
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "position", as_vector(position, 3, "position"))
        object.__setattr__(self, "orientation", quaternion / norm)
        object.__setattr__(self, "velocity", as_vector(velocity, 3, "velocity"))
        object.__setattr__(self, "angular_velocity", as_vector(angular_velocity, 3, "angular_velocity"))
        object.__setattr__(self, "name", name)


class Scene:
    """The obstacles at one instant: shapes, poses, twists; nothing else.

    It stores arrays, since a control loop reads it at every step: ``shapes`` (m), ``names`` (m), ``poses`` (m, 7),
    ``twists`` (m, 6). Build it from :class:`Obstacle` objects, or by :meth:`from_arrays` where the arrays are at hand.
    The identity of the ``shapes`` tuple tells a field that nothing but poses and twists changed since the last step.
    """

    __slots__ = ("__dict__", "names", "poses", "shapes", "twists")

    shapes: tuple[Shape, ...]
    names: tuple[str, ...]
    poses: Array
    twists: Array

    def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None:
        items = list(obstacles)
        if not all(isinstance(item, Obstacle) for item in items):
            raise InputError("a scene is made of cdfctl.Obstacle objects")
        self.shapes = _same(tuple(o.shape for o in items))
        self.names = tuple(o.name if o.name is not None else str(i) for i, o in enumerate(items))
        if len(set(self.names)) != len(self.names):
            raise InputError(f"obstacle names must differ, found {list(self.names)}")
        self.poses = np.zeros((len(items), 7))
        self.twists = np.zeros((len(items), 6))
        for i, o in enumerate(items):
            self.poses[i, :3], self.poses[i, 3:] = o.position, o.orientation
            self.twists[i, :3], self.twists[i, 3:] = o.velocity, o.angular_velocity

    @classmethod
    def from_arrays(cls, shapes: tuple[Shape, ...], names: tuple[str, ...], poses: Array, twists: Array) -> Scene:
        """A scene over given arrays, not copied: ``poses`` (m, 7) with unit quaternions, ``twists`` (m, 6).

        Their numbers are not looked at here.

        Raises:
            InputError: they are not of these shapes, or not as many as ``shapes`` and ``names``.
        """
        m = len(shapes)
        if not (len(names) == m and np.shape(poses) == (m, 7) and np.shape(twists) == (m, 6)):
            found = f"{len(names)} names, poses {np.shape(poses)}, twists {np.shape(twists)}"
            raise InputError(f"{m} shapes need as many names, poses ({m}, 7) and twists ({m}, 6), found {found}")
        scene = cls.__new__(cls)
        scene.shapes, scene.names, scene.poses, scene.twists = shapes, names, poses, twists
        return scene

    def __len__(self) -> int:
        return len(self.shapes)

    @cached_property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The same content as :class:`Obstacle` objects."""
        return tuple(
            Obstacle(shape, pose[:3], pose[3:], twist[:3], twist[3:], name)
            for shape, pose, twist, name in zip(self.shapes, self.poses, self.twists, self.names, strict=True)
        )


def _same(shapes: tuple[Shape, ...]) -> tuple[Shape, ...]:
    """``shapes``, or equal ones of a scene before: a loop that makes its scene anew at every step has its shapes
    converted once. Meshes and clouds are equal to themselves only."""
    try:
        return _recent(shapes)
    except TypeError:  # a radius that has no hash
        return shapes


@lru_cache(maxsize=8)
def _recent(shapes: tuple[Shape, ...]) -> tuple[Shape, ...]:
    return shapes


@dataclass(frozen=True)
class State:
    """Time ``t`` (s) and configuration ``q`` (n,)."""

    t: float
    q: Array


@dataclass(frozen=True)
class FieldQuery:
    """A field's answer: r rows, each a distance and its two derivatives.

    Attributes:
        obstacle: (r,) index into the scene.
        link: (r,) index into ``robot.links``, -1 where none.
        d: (r,) distance, m (SDF) or rad (CDF), negative in penetration, +inf where there is no contact to reach.
        dq: (r, n) derivative of d with respect to q.
        dt: (r,) partial derivative of d with respect to time, q held.
        valid: (r,) False where a derivative is undefined or no joint can change d: such a row must not be used.
        contact_q: (r, n) the nearest contact configuration (CDF), NaN for the SDF.
        unit: of ``d``.
    """

    obstacle: IntArray
    link: IntArray
    d: Array
    dq: Array
    dt: Array
    valid: BoolArray
    contact_q: Array
    unit: Unit


@dataclass(frozen=True)
class SelfQuery:
    """The nearest pairs of a robot's own bodies, k rows, nearest first.

    Attributes:
        pair: (k,) index into the pairs of :class:`cdfctl.fields.self_distance.SelfDistance`.
        d: (k,) signed distance, m, negative in penetration.
        dq: (k, n) derivative of d with respect to q, m/rad (m/m for a prismatic joint).
        valid: (k,) False where the derivative is undefined or no joint can change d.
    """

    pair: IntArray
    d: Array
    dq: Array
    valid: BoolArray


@dataclass(frozen=True)
class Rows:
    """Linear constraints ``G u - delta * slack <= rhs``: the one sign convention of the whole code.

    Attributes:
        G: (k, n).
        rhs: (k,).
        soft: (k,) True where ``on_infeasible: least-violation`` may relax the row.
        delta: (k,) coefficient of the Lyapunov slack, 0 for every row but a control-Lyapunov row.
    """

    G: Array
    rhs: Array
    soft: BoolArray
    delta: Array


DecisionStatus = Literal["optimal", "least-violation", "brake", "infeasible"]


@dataclass(frozen=True)
class Decision:
    """What a controller commands at one step.

    Attributes:
        u: (n,) commanded joint velocity, rad/s.
        h: (m,) least barrier value over an obstacle's rows, +inf where it has none (m or rad; the CDF's for ``dual``).
        slack: the Lyapunov slack, NaN without a Lyapunov row.
        status: ``optimal`` where every row holds; otherwise what was done about it.
        infeasible: no u satisfies all rows (then ``status`` is not ``optimal``).
        residual: greatest violation of a row that was to hold, by the returned u.
        h_sdf: (m,) the SDF's barrier for ``dual``, None otherwise.
        contact_q: (m, n) nearest contact configuration, NaN where none; None for a field without one.
        V: Lyapunov function, NaN without one.
        plan_q: (K, n) configurations between which the plan moves straight, the first is q; None without a planner.
        plan_t: (K,) s from now, when it is there; a shorter plan ends in NaN, in both.
        h_self: (k,) barrier values of the nearest pairs of the robot's own links, nearest first, m; None where
            self-collision is not looked at.
        self_pair: the links of the nearest such pair, None without one.
        active: what holds the command, in words: ``ball near panda_link5``, ``panda_link2 near panda_hand``,
            ``bound of panda_joint4``.
        reason: why it brakes, where that is not for want of a velocity that satisfies the rows.
    """

    u: Array
    h: Array
    slack: float
    status: DecisionStatus
    infeasible: bool
    residual: float
    h_sdf: Array | None = None
    contact_q: Array | None = None
    V: float = float("nan")
    plan_q: Array | None = None
    plan_t: Array | None = None
    h_self: Array | None = None
    self_pair: tuple[str, str] | None = None
    active: tuple[str, ...] = ()
    reason: str | None = None


@dataclass(frozen=True)
class Trajectory:
    """The arrays of ``trajectory.npz``: N control steps of n joints among m obstacles; ``None`` arrays are not stored.

    Attributes:
        t: (N+1,) s.
        q: (N+1, n).
        u: (N, n).
        obstacle_pose: (N+1, m, 7).
        obstacle_twist: (N+1, m, 6).
        h: (N, m).
        h_sdf: (N, m) only for ``dual``.
        contact_q: (N, m, n) only for fields with contacts.
        plan_q: (N, K, n) only for controllers that plan: configurations between which each step's plan moves straight,
            NaN after its end.
        plan_t: (N, K) s, when it is there.
        V, slack: (N,).
        infeasible: (N,).
        step_time: (N,) s, wall clock of the controller's step.
        plant_t: (P+1,) s, and
        plant_q: (P+1, n): all states known of a plant that does not move in straight lines, those of ``t`` among them;
            None for the integrator.
    """

    t: Array
    q: Array
    u: Array
    obstacle_pose: Array
    obstacle_twist: Array
    h: Array
    V: Array
    slack: Array
    infeasible: BoolArray
    step_time: Array
    h_sdf: Array | None = None
    contact_q: Array | None = None
    plan_q: Array | None = None
    plan_t: Array | None = None
    plant_t: Array | None = None
    plant_q: Array | None = None

    @property
    def path(self) -> tuple[Array, Array]:
        """The finest record of the motion: times (P+1,) and configurations (P+1, n), straight lines between them."""
        if self.plant_t is None or self.plant_q is None:
            return self.t, self.q
        return self.plant_t, self.plant_q


Outcome = Literal["reached", "collision", "timeout", "infeasible", "error"]
OUTCOMES: tuple[Outcome, ...] = ("reached", "collision", "timeout", "infeasible", "error")


@dataclass(frozen=True)
class Contact:
    """First contact of a run: ``time`` (s), robot ``link`` and ``obstacle`` by name; of a robot with itself, the other
    link in place of an obstacle."""

    time: float
    link: str
    obstacle: str


@dataclass(frozen=True)
class Verdict:
    """The judge's word on one rollout.

    Attributes:
        outcome: in the order collision, infeasible, reached, timeout (``error``: the plant or a worker failed).
        outcome_sampled: the same, looking at control steps only (the paper's protocol).
        time_to_reach: s, None unless reached.
        path_length: of the tip frame, m.
        joint_path: integral of the norm of the joint velocity, rad.
        min_clearance: least signed distance robot-obstacle over the whole run, m; +inf without obstacles.
        min_clearance_time: when, s; None without obstacles.
        contact: the first contact that counts, None if there was none.
        min_self_clearance: least signed distance of two of the robot's own links that may not touch, m; +inf where all
            of those are proved to stay apart, or there are none.
        self_contact: the robot's first contact with itself, whether it counts or not.
    """

    outcome: Outcome
    outcome_sampled: Outcome
    time_to_reach: float | None
    path_length: float
    joint_path: float
    min_clearance: float
    min_clearance_time: float | None
    contact: Contact | None
    min_self_clearance: float = float("inf")
    self_contact: Contact | None = None

    @property
    def success(self) -> bool:
        """Reached, and no contact at any instant."""
        return self.outcome == "reached"


@dataclass(frozen=True, order=True)
class TrialKey:
    """One trial of a benchmark: the same ``(scenario, trial, seed)`` is the same set-up for every controller."""

    scenario: str
    controller: str
    on_infeasible: str
    seed: int
    trial: int


@dataclass(frozen=True)
class TrialResult:
    """A trial's key, its verdict, and the counts a table needs; ``reason`` says why where the outcome is ``error``."""

    key: TrialKey
    verdict: Verdict
    steps: int
    infeasible_steps: int
    step_times: Sequence[float] = field(repr=False, default=())
    reason: str | None = None
