"""The robot every other part reads: kinematics as plain arrays, geometry as convex pieces, and the same in Pinocchio.

Placement of joint i in the world, for configuration q (``Chain``):

    X_i(q) = X_parent(q) * (rotation_i, translation_i) * ( turn about axis_i by q_i  |  slide along axis_i by q_i )
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdfctl.errors import InputError, name_hint, unknown_name
from cdfctl.robots.braking import Braking
from cdfctl.robots.convex import ConvexPiece
from cdfctl.robots.robot_file import (
    DATA,
    ROBOT_FILE_SUFFIXES,
    RobotFile,
    ShippedRobot,
    find_urdf,
    name_from,
    read_robot_file,
    shipped_names,
    shipped_robots,
)
from cdfctl.types import Array, BoolArray, IntArray

__all__ = ["Chain", "Robot", "ShippedRobot", "load_robot", "shipped_robots"]

# Digits (m, rad) that count in the hash: rounding of sines differs between machines, geometry does not.
HASH_DECIMALS = 9


class Chain(NamedTuple):
    """The kinematic tree as plain arrays, for compiled kernels; joints in topological order (parent[i] < i).

    Attributes:
        parent: (n,) index of the parent joint, -1 for the world.
        rotation: (n, 3, 3) and
        translation: (n, 3) m, placement of the joint's frame in its parent's, at joint value 0.
        axis: (n, 3) unit vector in the joint's frame.
        prismatic: (n,) the joint slides.
        moves: (n, n) moves[j, i]: joint j moves the body of joint i (it is an ancestor, or i itself).
        lower, upper: (n,) position limits, rad or m, ±inf for a continuous joint.
        continuous: (n,) the joint wraps at 2 pi.
    """

    parent: IntArray
    rotation: Array
    translation: Array
    axis: Array
    prismatic: BoolArray
    moves: BoolArray
    lower: Array
    upper: Array
    continuous: BoolArray


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot of n joints, one coordinate each. Built by :func:`load_robot`.

    Attributes:
        name: of the robot file, or of the URDF's file.
        model: ``pinocchio.Model``, nq == nv == n; grippers and the like are locked.
        geometry: ``pinocchio.GeometryModel`` of the collision geometry, every object convex or primitive, the base's
            too.
        n: number of joints.
        joint_names: (n,).
        lower, upper: (n,) position limits, rad or m; ±inf for a continuous joint.
        velocity_limit: (n,) bound on the absolute value of u, rad/s or m/s.
        braking: how that bound falls towards the end stops, None where it does not; see :meth:`velocity_bounds`.
        acceleration_limit: (n,) bound on the change of u, rad/s² or m/s²; inf where there is none.
        continuous: (n,) the joint wraps at 2 pi.
        prismatic: (n,) the joint slides.
        home: (n,) an example configuration: the robot file's, else mid-range.
        tip: name of the frame whose path length is reported.
        links: names of the links with collision geometry that a joint moves.
        base_links: names of the links with collision geometry that no joint moves.
        geometry_links: the link's name of every object of ``geometry``.
        pieces: convex pieces of the moving links.
        chain: the kinematic tree as arrays.
        hash: sha256 of all that a contact depends on: kinematics, geometry, position limits (not the velocity limit).
        notes: facts to print with results.
        urdf: the URDF file it was read from.
        package_dirs: where ``package://`` mesh names of that file are looked for.
        allowed_contacts: pairs of link names, in alphabetical order, whose contact is no collision of the robot with
            itself, with the reason: ``neighbours``, or ``SRDF``.
    """

    name: str
    model: Any = field(repr=False)
    geometry: Any = field(repr=False)
    n: int
    joint_names: tuple[str, ...]
    lower: Array
    upper: Array
    velocity_limit: Array
    braking: Braking | None = field(repr=False)
    acceleration_limit: Array
    continuous: BoolArray
    prismatic: BoolArray
    home: Array
    tip: str
    links: tuple[str, ...]
    base_links: tuple[str, ...]
    geometry_links: tuple[str, ...] = field(repr=False)
    pieces: tuple[ConvexPiece, ...] = field(repr=False)
    chain: Chain = field(repr=False)
    hash: str
    notes: tuple[str, ...]
    urdf: Path = field(repr=False)
    package_dirs: tuple[Path, ...] = field(repr=False)
    allowed_contacts: Mapping[tuple[str, str], str] = field(repr=False)

    def velocity_bounds(self, q: Array, dt: float = 0.0) -> tuple[Array, Array]:
        """Least and greatest joint velocity (n,) at ``q`` (n,), rad/s or m/s, that may be held for ``dt`` (s).

        Those of an arm whose limits fall towards its end stops are at most 0 and at least 0 there: see
        :mod:`cdfctl.robots.braking`.
        """
        if self.braking is None:
            return -self.velocity_limit, self.velocity_limit
        low, high = self.braking.bounds(q, dt)
        return np.maximum(low, -self.velocity_limit), np.minimum(high, self.velocity_limit)

    def tip_position(self, q: Array) -> Array:
        """Position (3,) of the tip frame in the world at configuration ``q`` (n,), m."""
        position: Array = self.tip_path(np.asarray(q, dtype=np.float64)[None, :])[0]
        return position

    def tip_path(self, Q: Array) -> Array:
        """Positions (k, 3) of the tip frame in the world at the configurations ``Q`` (k, n), m."""
        import pinocchio as pin

        data, frame = self.model.createData(), frame_index(self.model, self.tip)
        positions = np.empty((len(Q), 3))
        for row, q in zip(positions, Q, strict=True):
            pin.framesForwardKinematics(self.model, data, q)
            row[:] = data.oMf[frame].translation
        return positions


def load_robot(
    name_or_path: str | Path,
    *,
    package_dirs: Sequence[str | Path] = (),
    lock: Mapping[str, float] | None = None,
    position_limits: Mapping[str, tuple[float, float]] | None = None,
    velocity_limits: Mapping[str, float] | float | None = None,
    acceleration_limits: Mapping[str, float] | float | None = None,
    srdf: str | Path | None = None,
    tip: str | None = None,
) -> Robot:
    """A shipped robot by name, or the robot of a robot file (.yaml) or of a URDF (.urdf).

    Args:
        name_or_path: a shipped name, or a path with a suffix.
        package_dirs: directories in which ``package://`` mesh names are looked for.
        lock: joints to lock, each at a position (rad or m); added to those of the robot file.
        position_limits: joint name to (lower, upper) in rad or m, in place of the URDF's.
        velocity_limits: joint name to the bound on its speed in rad/s or m/s, in place of the URDF's; or one bound for
            every joint.
        acceleration_limits: the same in rad/s² or m/s², in place of the robot file's; a URDF has none.
        srdf: which links may touch, in place of the robot file's.
        tip: frame whose path length is reported.

    Raises:
        InputError: an unknown name, or a file that is no usable robot, in one line.
        MissingError: the data package of a shipped robot is not installed.
    """
    from cdfctl.robots.assembly import assemble_robot

    if not isinstance(name_or_path, str | Path):
        raise InputError(f"a robot is a name or a path, found {type(name_or_path).__name__}")
    path = Path(name_or_path)
    text = str(name_or_path)
    if not text.isprintable():
        raise InputError(f"{text!r} is not the name of a robot", name_hint("", shipped_names()))
    suffix = path.suffix.lower()
    own_dirs = tuple(Path(entry) for entry in package_dirs)
    if suffix == ".urdf":
        file, urdf, file_srdf = None, path, None
    else:
        if suffix in ROBOT_FILE_SUFFIXES:
            file_path = path
        elif text in shipped_names():
            file_path = DATA / f"{text}.yaml"
        elif "/" in text or suffix:
            raise InputError(f"{text}: not a robot", hint="a robot is a shipped name, a robot file .yaml, or a .urdf")
        else:
            raise unknown_name("robot", text, shipped_names())
        file = read_robot_file(file_path)
        urdf, file_dirs, file_srdf = find_urdf(file, file_path)
        own_dirs += file_dirs
    if file is None:
        file = RobotFile(version=1, name=name_from(path), description="", source=str(path), licence="", urdf=path.name)
    speed, speeds = _one_or_named(velocity_limits)
    acceleration, accelerations = _one_or_named(acceleration_limits)
    changes = {
        "lock": {**file.lock, **(lock or {})},
        "position_limits": {**file.position_limits, **(position_limits or {})},
        "velocity_limits": {} if speed is not None else {**file.velocity_limits, **speeds},
        "acceleration_limits": {} if acceleration is not None else {**file.acceleration_limits, **accelerations},
        "tip": tip if tip is not None else file.tip,
        # The file's home is for the joints the file leaves free.
        "home": file.home if set(lock or ()) <= set(file.lock) else None,
    }
    own_srdf = file_srdf if srdf is None else Path(srdf)
    return assemble_robot(file.model_copy(update=changes), urdf, own_dirs, own_srdf, speed, acceleration)


def _one_or_named(limits: Mapping[str, float] | float | None) -> tuple[float | None, Mapping[str, float]]:
    """Limits as one for every joint, or by name."""
    if limits is None or isinstance(limits, Mapping):
        return None, limits or {}
    return float(limits), {}


def frame_index(model: Any, name: str) -> int:
    """Index of the frame called ``name``: the link's, where a joint has the same name."""
    import pinocchio as pin

    if model.existFrame(name, pin.FrameType.BODY):
        return int(model.getFrameId(name, pin.FrameType.BODY))
    return next(i for i, frame in enumerate(model.frames) if frame.name == name)


def robot_hash(chain: Chain, names: Sequence[str], arrays: Sequence[Array]) -> str:
    """sha256 over the names and the chain's and the given arrays, rounded to ``HASH_DECIMALS``, little-endian."""
    digest = hashlib.sha256()
    for name in names:
        digest.update(name.encode() + b"\0")
    for array in (*chain, *arrays):
        rounded = np.round(np.asarray(array, dtype=np.float64), HASH_DECIMALS) + 0.0  # -0.0 becomes 0.0
        digest.update(repr(rounded.shape).encode())
        digest.update(rounded.astype("<f8").tobytes())
    return digest.hexdigest()
