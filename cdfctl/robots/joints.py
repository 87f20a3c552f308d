"""The joints of a robot: the URDF's limits or the robot file's, and which joints are locked where."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.robot_file import RobotFile
from cdfctl.robots.urdf import Urdf, UrdfJoint


def limited_joints(
    file: RobotFile, urdf: Urdf, speed: float | None = None, acceleration: float | None = None
) -> dict[str, UrdfJoint]:
    """The URDF's moving joints with the limits of the robot file in place; ``speed`` and ``acceleration``, where given,
    are those of every joint."""
    joints = dict(urdf.joints)
    for name, (lower, upper) in file.position_limits.items():
        joint = _find(joints, name, f"robot '{file.name}': position limit")
        if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
            raise InputError(
                f"robot '{file.name}': position limits of joint '{name}' must be finite and ascend, "
                f"found [{lower}, {upper}]"
            )
        kind = "revolute" if joint.type == "continuous" else joint.type
        joints[name] = replace(joint, lower=lower, upper=upper, type=kind)
    for name, bound in file.velocity_limits.items():
        joint = _find(joints, name, f"robot '{file.name}': velocity limit")
        joints[name] = replace(joint, velocity=_positive(file, f"velocity limit of joint '{name}'", bound))
    if speed is not None:
        bound = _positive(file, "velocity limit", speed)
        joints = {name: replace(joint, velocity=bound) for name, joint in joints.items()}
    for name, bound in file.acceleration_limits.items():
        joint = _find(joints, name, f"robot '{file.name}': acceleration limit")
        joints[name] = replace(joint, acceleration=_positive(file, f"acceleration limit of joint '{name}'", bound))
    if acceleration is not None:
        bound = _positive(file, "acceleration limit", acceleration)
        joints = {name: replace(joint, acceleration=bound) for name, joint in joints.items()}
    return joints


def locked_joints(file: RobotFile, urdf: Urdf) -> dict[str, float]:
    """Joints to lock and where; a joint that mimics a locked one is locked with it."""
    locked: dict[str, float] = {}
    for name, value in file.lock.items():
        joint = _find(urdf.joints, name, f"robot '{file.name}': lock")
        if not joint.lower - 1e-9 <= value <= joint.upper + 1e-9:
            limits = f"[{joint.lower}, {joint.upper}]"
            raise InputError(
                f"robot '{file.name}': joint '{name}' cannot be locked at {value}: its limits are {limits}"
            )
        locked[name] = value
    for joint in urdf.joints.values():
        if joint.mimic is None or joint.name in locked:
            continue
        source, multiplier, offset = joint.mimic
        if source not in locked:
            raise InputError(
                f"{urdf.path}: joint '{joint.name}' mimics '{source}', which is not supported",
                hint=f"lock '{source}', or '{joint.name}', at a position",
            )
        locked[joint.name] = multiplier * locked[source] + offset
    if len(locked) == len(urdf.joints):
        raise InputError(f"robot '{file.name}': every joint is locked")
    return locked


def check_limits(urdf: Urdf, joints: Iterable[UrdfJoint]) -> None:
    """Refuse a joint that is left to move and cannot: an empty range, or no speed."""
    for joint in joints:
        if not joint.lower < joint.upper:
            raise InputError(
                f"{urdf.path}: joint '{joint.name}' cannot move: its limits are both {joint.lower}", hint="lock it"
            )
        if not joint.velocity > 0.0:
            found = "none" if math.isnan(joint.velocity) else f"{joint.velocity}"
            raise InputError(
                f"{urdf.path}: joint '{joint.name}' needs a velocity limit greater than 0, found {found}",
                hint="give one in velocity_limits",
            )


def _positive(file: RobotFile, what: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"robot '{file.name}': {what} must be greater than 0, found {value}")
    return value


def _find(joints: Mapping[str, UrdfJoint], name: str, where: str) -> UrdfJoint:
    if name not in joints:
        raise InputError(f"{where}: unknown joint '{name}'", hint=name_hint(name, joints))
    return joints[name]
