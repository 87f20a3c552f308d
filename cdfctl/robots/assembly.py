"""From a robot file and a URDF to a :class:`~cdfctl.robots.robot.Robot`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.coal_geometry import coal_convex, convex_form
from cdfctl.robots.convex import ConvexPiece, ConvexSet, convex_hull
from cdfctl.robots.robot import Chain, Robot, robot_hash
from cdfctl.robots.robot_file import RobotFile
from cdfctl.robots.urdf import Urdf, UrdfJoint, read_urdf
from cdfctl.types import Array, IntArray


class _Body(NamedTuple):
    """One convex collision body: its link, Pinocchio's joint (0 is the world) and frame, placement, geometry, set."""

    link: str
    joint: int
    frame: int
    placement: Any
    geometry: Any
    shape: ConvexSet
    faces: IntArray


def assemble_robot(file: RobotFile, urdf_path: Path, package_dirs: Sequence[Path], speed: float | None = None) -> Robot:
    """Build the robot of ``file`` from its URDF; errors as in :func:`~cdfctl.robots.robot.load_robot`.

    ``speed`` (rad/s or m/s), where given, is the velocity limit of every joint, whatever the URDF says.
    """
    urdf = read_urdf(urdf_path, package_dirs)
    joints = _limited_joints(file, urdf)
    if speed is not None:
        if not (math.isfinite(speed) and speed > 0.0):
            raise InputError(f"{urdf.path}: the velocity limit must be greater than 0, found {speed}")
        joints = {name: replace(joint, velocity=speed) for name, joint in joints.items()}
    locked = _locked_joints(file, urdf)
    model, geometry = _reduced(urdf, locked)
    names = tuple(str(name) for name in model.names)[1:]
    moving = [joints[name] for name in names]
    _check_limits(urdf, moving)
    lower = np.array([joint.lower for joint in moving])
    upper = np.array([joint.upper for joint in moving])
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    bodies = _merged(file, _bodies(urdf, model, geometry))
    links = _unique(body.link for body in bodies if body.joint > 0)
    if not links:
        raise InputError(f"{urdf.path}: no moving link has collision geometry")
    chain = _chain(model, lower, upper, np.array([joint.type == "continuous" for joint in moving]))
    velocity = np.array([joint.velocity for joint in moving])
    return Robot(
        name=file.name,
        model=model,
        geometry=_geometry_model(bodies),
        n=len(names),
        joint_names=names,
        lower=lower,
        upper=upper,
        velocity_limit=velocity,
        continuous=chain.continuous,
        prismatic=chain.prismatic,
        home=_home(file, lower, upper),
        tip=_tip(file, model),
        links=links,
        base_links=_unique(body.link for body in bodies if body.joint == 0),
        geometry_links=tuple(body.link for body in bodies),
        pieces=_pieces(bodies, links),
        chain=chain,
        hash=_hash(chain, velocity, names, bodies),
        notes=(*(_lock_note(urdf, name, value) for name, value in locked.items()), *_merge_notes(file), *file.notes),
    )


def _limited_joints(file: RobotFile, urdf: Urdf) -> dict[str, UrdfJoint]:
    """The URDF's moving joints with the limits of the robot file in place."""
    joints = dict(urdf.joints)
    for name, (lower, upper) in file.position_limits.items():
        joint = _find(joints, name, f"{_robot(file)}: position limit")
        if not lower < upper:
            raise InputError(f"{_robot(file)}: position limit of joint '{name}': {lower} is not below {upper}")
        kind = "revolute" if joint.type == "continuous" else joint.type
        joints[name] = replace(joint, lower=lower, upper=upper, type=kind)
    for name, speed in file.velocity_limits.items():
        joint = _find(joints, name, f"{_robot(file)}: velocity limit")
        if not (math.isfinite(speed) and speed > 0.0):
            raise InputError(f"{_robot(file)}: velocity limit of joint '{name}' must be greater than 0, found {speed}")
        joints[name] = replace(joint, velocity=speed)
    return joints


def _locked_joints(file: RobotFile, urdf: Urdf) -> dict[str, float]:
    """Joints to lock and where; a joint that mimics a locked one is locked with it."""
    locked: dict[str, float] = {}
    for name, value in file.lock.items():
        joint = _find(urdf.joints, name, f"{_robot(file)}: lock")
        if not joint.lower - 1e-9 <= value <= joint.upper + 1e-9:
            limits = f"[{joint.lower}, {joint.upper}]"
            raise InputError(f"{_robot(file)}: joint '{name}' cannot be locked at {value}: its limits are {limits}")
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
        raise InputError(f"{_robot(file)}: every joint is locked")
    return locked


def _find(joints: Mapping[str, UrdfJoint], name: str, where: str) -> UrdfJoint:
    if name not in joints:
        raise InputError(f"{where}: unknown joint '{name}'", hint=name_hint(name, joints))
    return joints[name]


def _check_limits(urdf: Urdf, joints: Iterable[UrdfJoint]) -> None:
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
        raise InputError(f"{urdf.path}: Pinocchio cannot read it: {' '.join(str(error).split())}") from None
    return model, geometry


def _bodies(urdf: Urdf, model: Any, geometry: Any) -> list[_Body]:
    bodies = []
    for item in geometry.geometryObjects:
        link = _link_of(urdf, model, item)
        try:
            solid, shape, faces = convex_form(item.geometry)
        except InputError as error:
            raise InputError(f"{urdf.path}: collision geometry of link '{link}': {error.message}") from None
        bodies.append(_Body(link, item.parentJoint, item.parentFrame, item.placement, solid, shape, faces))
    return bodies


def _link_of(urdf: Urdf, model: Any, item: Any) -> str:
    """Pinocchio names a collision object ``<link>_<number>``."""
    name = str(item.name).rpartition("_")[0]
    return name if name in urdf.links else str(model.frames[item.parentFrame].name)


def _merged(file: RobotFile, bodies: list[_Body]) -> list[_Body]:
    """Bodies of the links named in ``merge`` become one hull, where the first of them stood."""
    for name, links in file.merge.items():
        found = _unique(body.link for body in bodies)
        for link in links:
            if link not in found:
                raise InputError(f"{_robot(file)}: merge '{name}': unknown link '{link}'", hint=name_hint(link, found))
        members = [body for body in bodies if body.link in links]
        if len({body.joint for body in members}) > 1 or any(b.shape.disc or b.shape.radius for b in members):
            raise InputError(f"{_robot(file)}: merge '{name}': only boxes and meshes that move together can be merged")
        points = [b.shape.vertices @ b.placement.rotation.T + b.placement.translation for b in members]
        vertices, faces = convex_hull(np.concatenate(points))
        first = members[0]
        hull = _Body(
            name, first.joint, first.frame, _identity(), coal_convex(vertices, faces), ConvexSet(vertices), faces
        )
        bodies = [hull if body is first else body for body in bodies if body is first or body not in members]
    return bodies


def _identity() -> Any:
    import pinocchio as pin

    return pin.SE3.Identity()


def _geometry_model(bodies: Sequence[_Body]) -> Any:
    import pinocchio as pin

    geometry = pin.GeometryModel()
    for name, body in zip(_body_names(bodies), bodies, strict=True):
        geometry.addGeometryObject(pin.GeometryObject(name, body.joint, body.frame, body.placement, body.geometry))
    return geometry


def _body_names(bodies: Sequence[_Body]) -> list[str]:
    """The link's name, numbered from the second body of a link on."""
    seen: dict[str, int] = {}
    names = []
    for body in bodies:
        count = seen[body.link] = seen.get(body.link, 0) + 1
        names.append(body.link if count == 1 else f"{body.link}/{count}")
    return names


def _pieces(bodies: Sequence[_Body], links: Sequence[str]) -> tuple[ConvexPiece, ...]:
    return tuple(
        ConvexPiece(
            name=name,
            link=links.index(body.link),
            joint=body.joint - 1,
            rotation=np.array(body.placement.rotation),
            translation=np.array(body.placement.translation),
            vertices=body.shape.vertices,
            disc=body.shape.disc,
            radius=body.shape.radius,
            faces=body.faces,
        )
        for name, body in zip(_body_names(bodies), bodies, strict=True)
        if body.joint > 0
    )


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
        raise InputError(f"{_robot(file)}: home must have {len(lower)} numbers, found {len(home)}")
    return np.clip(home, lower, upper)  # limits may have been narrowed


def _tip(file: RobotFile, model: Any) -> str:
    names = _unique(str(frame.name) for frame in model.frames)
    if file.tip is None:
        return next(str(frame.name) for frame in reversed(list(model.frames)) if frame.parentJoint == model.njoints - 1)
    if file.tip not in names:
        raise InputError(f"{_robot(file)}: unknown tip frame '{file.tip}'", hint=name_hint(file.tip, names))
    return file.tip


def _hash(chain: Chain, velocity: Array, names: Sequence[str], bodies: Sequence[_Body]) -> str:
    arrays = [velocity]
    for b in bodies:
        numbers = np.array([b.joint, b.shape.disc, b.shape.radius])
        arrays += [numbers, b.placement.rotation, b.placement.translation, b.shape.vertices]
    return robot_hash(chain, (*names, *_body_names(bodies)), arrays)


def _lock_note(urdf: Urdf, name: str, value: float) -> str:
    return f"{name} locked at {value:g} {'m' if urdf.joints[name].type == 'prismatic' else 'rad'}"


def _merge_notes(file: RobotFile) -> list[str]:
    return [f"{', '.join(links)} merged into one hull, '{name}'" for name, links in file.merge.items()]


def _robot(file: RobotFile) -> str:
    return f"robot '{file.name}'"


def _unique(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
