"""From a robot file and a URDF to a :class:`~cdfctl.robots.robot.Robot`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.bodies import Body, body_names, convex_pieces, geometry_model, merge_bodies, read_bodies
from cdfctl.robots.braking import braking_of
from cdfctl.robots.joints import check_limits, limited_joints, locked_joints
from cdfctl.robots.meshes import reason_of
from cdfctl.robots.robot import Chain, Robot, robot_hash
from cdfctl.robots.robot_file import RobotFile
from cdfctl.robots.srdf import allowed_contacts, read_srdf
from cdfctl.robots.urdf import Urdf, read_urdf
from cdfctl.types import Array


def assemble_robot(
    file: RobotFile,
    urdf_path: Path,
    package_dirs: Sequence[Path],
    srdf: Path | None = None,
    speed: float | None = None,
    acceleration: float | None = None,
) -> Robot:
    """Build the robot of ``file`` from its URDF; errors as in :func:`~cdfctl.robots.robot.load_robot`.

    ``speed`` (rad/s or m/s) and ``acceleration`` (rad/s² or m/s²), where given, are the limits of every joint, whatever
    the files say.
    """
    urdf = read_urdf(urdf_path, package_dirs)
    joints = limited_joints(file, urdf, speed, acceleration)
    locked = locked_joints(file, urdf)
    model, geometry = _reduced(urdf, locked)
    names = tuple(str(name) for name in model.names)[1:]
    moving = [joints[name] for name in names]
    check_limits(urdf, moving)
    lower = np.array([joint.lower for joint in moving])
    upper = np.array([joint.upper for joint in moving])
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    bodies = merge_bodies(file, read_bodies(urdf, model, geometry))
    links = _unique(body.link for body in bodies if body.joint > 0)
    if not links:
        raise InputError(f"{urdf.path}: no moving link has collision geometry")
    geometry_links = tuple(body.link for body in bodies)
    disabled = read_srdf(srdf, urdf.links) if srdf is not None else ()
    chain = _chain(model, lower, upper, np.array([joint.type == "continuous" for joint in moving]))
    return Robot(
        name=file.name,
        model=model,
        geometry=geometry_model(bodies),
        n=len(names),
        joint_names=names,
        lower=lower,
        upper=upper,
        velocity_limit=np.array([joint.velocity for joint in moving]),
        braking=braking_of(file, names, urdf.joints),
        acceleration_limit=np.array([joint.acceleration for joint in moving]),
        continuous=chain.continuous,
        prismatic=chain.prismatic,
        home=_home(file, lower, upper),
        tip=_tip(file, model),
        links=links,
        base_links=_unique(body.link for body in bodies if body.joint == 0),
        geometry_links=geometry_links,
        pieces=convex_pieces(bodies, links),
        chain=chain,
        hash=_hash(chain, names, bodies),
        notes=(*(_lock_note(urdf, name, value) for name, value in locked.items()), *_merge_notes(file), *file.notes),
        urdf=urdf.path,
        package_dirs=tuple(package_dirs),
        allowed_contacts=allowed_contacts(disabled, urdf.parents, geometry_links, file.merge),
    )


def _reduced(urdf: Urdf, locked: Mapping[str, float]) -> tuple[Any, Any]:
    """Pinocchio's model and collision geometry with the locked joints taken out."""
    import pinocchio as pin

    try:
        model = pin.buildModelFromXML(urdf.text)
        geometry = pin.buildGeomFromUrdfString(model, urdf.text, pin.GeometryType.COLLISION)
        if locked:
            reference = pin.neutral(model)
            for name, value in locked.items():
                reference[model.joints[model.getJointId(name)].idx_q] = value
            ids = [model.getJointId(name) for name in locked]
            model, (geometry,) = pin.buildReducedModel(model, [geometry], ids, reference)
    except (ValueError, RuntimeError, IndexError) as error:
        raise InputError(f"{urdf.path}: cannot be built: {reason_of(error)}") from None
    return model, geometry


def _chain(model: Any, lower: Array, upper: Array, continuous: Any) -> Chain:
    """Plain arrays of Pinocchio's tree; the axis is the joint's motion subspace in its own frame."""
    import pinocchio as pin

    n = model.nv
    data = model.createData()
    pin.forwardKinematics(model, data, np.zeros(n))
    parent = np.array([model.parents[i + 1] - 1 for i in range(n)], dtype=np.int64)
    columns = np.array([np.ravel(data.joints[i + 1].S) for i in range(n)])  # linear part, angular part
    prismatic = np.linalg.norm(columns[:, 3:], axis=1) < 0.5
    moves = np.eye(n, dtype=np.bool_)
    for i in range(n):
        if parent[i] >= 0:
            moves[:, i] |= moves[:, parent[i]]
    return Chain(
        parent=parent,
        rotation=np.array([model.jointPlacements[i + 1].rotation for i in range(n)]),
        translation=np.array([model.jointPlacements[i + 1].translation for i in range(n)]),
        axis=np.where(prismatic[:, None], columns[:, :3], columns[:, 3:]),
        prismatic=prismatic,
        moves=moves,
        lower=lower,
        upper=upper,
        continuous=np.asarray(continuous, dtype=np.bool_),
    )


def _home(file: RobotFile, lower: Array, upper: Array) -> Array:
    if file.home is None:
        bounded = np.isfinite(lower) & np.isfinite(upper)
        return np.where(bounded, 0.5 * (np.where(bounded, lower, 0.0) + np.where(bounded, upper, 0.0)), 0.0)
    home = np.array(file.home, dtype=np.float64)
    if home.shape != lower.shape:
        raise InputError(f"robot '{file.name}': home must have {len(lower)} numbers, found {len(home)}")
    return np.clip(home, lower, upper)  # limits may have been narrowed


def _tip(file: RobotFile, model: Any) -> str:
    names = _unique(str(frame.name) for frame in model.frames)
    if file.tip is None:
        return next(str(frame.name) for frame in reversed(list(model.frames)) if frame.parentJoint == model.njoints - 1)
    if file.tip not in names:
        raise InputError(f"robot '{file.name}': unknown tip frame '{file.tip}'", hint=name_hint(file.tip, names))
    return file.tip


def _hash(chain: Chain, names: Sequence[str], bodies: Sequence[Body]) -> str:
    arrays: list[Array] = []
    for b in bodies:
        numbers = np.array([b.joint, b.shape.disc, b.shape.radius])
        arrays += [numbers, b.placement.rotation, b.placement.translation, b.shape.vertices]
    return robot_hash(chain, (*names, *body_names(bodies)), arrays)


def _lock_note(urdf: Urdf, name: str, value: float) -> str:
    return f"{name} locked at {value:g} {'m' if urdf.joints[name].type == 'prismatic' else 'rad'}"


def _merge_notes(file: RobotFile) -> list[str]:
    return [f"{', '.join(links)} merged into one hull, '{name}'" for name, links in file.merge.items()]


def _unique(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
