"""A robot and a scene as a MuJoCo model, built from what the judge sees: the same joints, the same convex geometry.

The kinematic tree and the inertias are Pinocchio's (links that do not move against each other are one body there), the
collision geometry is the robot's convex pieces. An obstacle is a mocap body: it is put where the scene has it, and
nothing moves it. Only a robot and an obstacle collide: not the arm with itself, not obstacles with each other.

Every joint has a velocity servo, torque = kv_j (u_j - dq_j/dt). With M the greatest and m_j the least diagonal entry of
the inertia matrix over sampled configurations (M over all turning, or all sliding, joints), and rotors of ROTOR M:

    kv_j = min( M / servo_time,  (m_j + ROTOR M) / timestep )

So the slowest joint follows with the time constant ``servo_time``, and the light ones, which the motion of the others
shakes most, are held as firmly as can be without chatter: a torque at its limit must not, in one step of the physics,
throw a joint past the velocity it was to have. Torques are bounded by the URDF's effort limits (unbounded where it says
0), what compensates gravity included. Damping and friction of joints are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import coal
import mujoco
import numpy as np
import pinocchio as pin

from cdfctl.errors import InputError
from cdfctl.robots.coal_geometry import coal_shape
from cdfctl.robots.robot import Robot
from cdfctl.scenario.plant import MujocoConfig
from cdfctl.types import Array, PointCloud, Shape

ROBOT, OBSTACLE = 1, 2
"""Bits of contype and conaffinity."""

DENSITY = 1000.0
"""kg/m³ of a link without inertia in the URDF, over its collision geometry."""

LEAST_MASS, LEAST_INERTIA = 1e-3, 1e-6
"""kg and kg m²: what a moving body has at least."""

ROTOR = 0.05
"""Inertia of a joint's rotor, seen through its gear, over M. URDFs do not give it; for the Franka it makes 0.18 kg m²,
where its makers' and others' models have 0.07 to 0.2."""

SAMPLES = 256
"""Configurations at which the inertia matrix is looked at."""

TINY = 1e-7
"""m: half the thickness of what has none (a flat mesh, the points of a cloud), since MuJoCo takes only solids."""


@dataclass(frozen=True)
class Built:
    """A compiled model and what its numbers mean.

    Attributes:
        model: ``mujoco.MjModel``; joint and actuator i are the robot's joint i, mocap body i is obstacle i.
        gains: (n,) kv of the servos, N m s/rad (N s/m for a sliding joint).
        geoms: of every geom, the number of the robot's geometry object, or -1 - i where it is of obstacle i.
        assumed: the joints whose body has no inertia in the URDF.
    """

    model: Any
    gains: Array
    geoms: tuple[int, ...]
    assumed: tuple[str, ...]


def build_model(robot: Robot, shapes: Sequence[Shape], config: MujocoConfig) -> Built:
    """The model of ``robot`` among obstacles of ``shapes``.

    Raises:
        InputError: an inertia of the URDF is none, or MuJoCo refuses the model.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.compiler.balanceinertia = True
    spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS, LEAST_INERTIA
    spec.option.timestep = config.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # a plant that is lost must not begin anew
    bodies, assumed = _bodies(spec, robot, config.gravity_compensation)
    owners: dict[str, int] = {}
    for i, shape in enumerate(shapes):
        body = spec.worldbody.add_body(name=f"obstacle/{i}", mocap=True)
        for k, (geometry, place) in enumerate(_parts(shape)):
            name = f"obstacle/{i}/{k}"
            owners[name] = -1 - i
            _add_geom(spec, body, name, geometry, pin.SE3(np.eye(3), place), (OBSTACLE, ROBOT))
    for k, item in enumerate(robot.geometry.geometryObjects):
        name = f"robot/{k}"
        fixed = item.parentJoint == 0
        _add_geom(spec, bodies[item.parentJoint], name, item.geometry, item.placement, (ROBOT, OBSTACLE))
        if fixed:
            # MuJoCo leaves out what cannot move against each other, and takes a mocap body for such.
            for other in owners:
                if other.startswith("obstacle/"):
                    spec.add_pair(geomname1=name, geomname2=other)
        owners[name] = k
    for joint in robot.joint_names:
        servo = spec.add_actuator(name=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint)
        servo.set_to_velocity(kv=1.0)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot take robot '{robot.name}': {' '.join(str(error).split())}") from None
    gains = _add_servos(model, robot, config)
    return Built(model, gains, tuple(owners[model.geom(g).name] for g in range(model.ngeom)), assumed)


def _add_servos(model: Any, robot: Robot, config: MujocoConfig) -> Array:
    """Give the compiled ``model`` its rotors and gains; the gains kv (n,)."""
    rng, data = np.random.default_rng(0), mujoco.MjData(model)
    low = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    high = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    diagonals, column = np.empty((SAMPLES, robot.n)), np.zeros(robot.n)
    for row, q in zip(diagonals, rng.uniform(low, high, (SAMPLES, robot.n)), strict=True):
        data.qpos[:] = q
        mujoco.mj_fwdPosition(model, data)
        for j, unit in enumerate(np.eye(robot.n)):
            mujoco.mj_mulM(model, data, column, unit)
            row[j] = column[j]
    least, most = diagonals.min(axis=0), diagonals.max(axis=0)
    M = np.array([most[robot.prismatic == kind].max() for kind in robot.prismatic])
    rotors = ROTOR * M
    gains: Array = np.minimum(M / config.servo_time, (least + rotors) / config.timestep)
    model.dof_armature[:] = rotors
    model.actuator_gainprm[:, 0], model.actuator_biasprm[:, 2] = gains, -gains
    mujoco.mj_setConst(model, data)
    return gains


def _bodies(spec: Any, robot: Robot, compensation: float) -> tuple[list[Any], tuple[str, ...]]:
    """The bodies by Pinocchio's joint number (0 is the world), each with its joint and inertia."""
    chain, model = robot.chain, robot.model
    bodies, assumed = [spec.worldbody], []
    for i, name in enumerate(robot.joint_names):
        quaternion = pin.Quaternion(chain.rotation[i])
        body = bodies[chain.parent[i] + 1].add_body(
            name=name,
            pos=chain.translation[i],
            quat=[quaternion.w, quaternion.x, quaternion.y, quaternion.z],
            gravcomp=compensation,
        )
        kind = mujoco.mjtJoint.mjJNT_SLIDE if chain.prismatic[i] else mujoco.mjtJoint.mjJNT_HINGE
        joint = body.add_joint(name=name, type=kind, axis=chain.axis[i], actgravcomp=True)
        if np.isfinite(chain.lower[i]) and np.isfinite(chain.upper[i]):
            joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_TRUE, [chain.lower[i], chain.upper[i]]
        effort = float(model.effortLimit[i])
        if np.isfinite(effort) and effort > 0.0:
            joint.actfrclimited, joint.actfrcrange = mujoco.mjtLimited.mjLIMITED_TRUE, [-effort, effort]
        if not _set_inertia(body, model.inertias[i + 1], f"robot '{robot.name}': the body of joint '{name}'"):
            assumed.append(name)
        bodies.append(body)
    return bodies, tuple(assumed)


def _set_inertia(body: Any, inertia: Any, where: str) -> bool:
    """Give ``body`` the inertia of the URDF; False where there is none, and that of its geometry is to be taken."""
    mass, lever, tensor = inertia.mass, inertia.lever, inertia.inertia
    if mass == 0.0:
        return False
    if not (np.isfinite(mass) and mass > 0.0 and np.isfinite(lever).all() and np.isfinite(tensor).all()):
        raise InputError(f"{where} has an inertia that is none: mass {mass} kg")
    if np.linalg.eigvalsh(tensor).min() < -1e-9:
        raise InputError(f"{where} has an inertia that is none: a negative principal moment")
    body.mass, body.ipos, body.explicitinertial = mass, lever, True
    # A point mass or a thin rod is not positive definite, as MuJoCo wants it.
    moments, axes = np.linalg.eigh(tensor)
    tensor = (axes * np.maximum(moments, LEAST_INERTIA)) @ axes.T
    body.fullinertia = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return True


def _parts(shape: Shape) -> Iterator[tuple[Any, Array]]:
    """The coal geometries that make up an obstacle and where each is in its frame."""
    if isinstance(shape, PointCloud):
        for point in shape.points:
            yield coal.Sphere(max(shape.radius, TINY)), point
    else:
        yield coal_shape(shape), np.zeros(3)


def _add_geom(spec: Any, body: Any, name: str, geometry: Any, frame: Any, bits: tuple[int, int]) -> None:
    kinds = mujoco.mjtGeom
    quaternion = pin.Quaternion(frame.rotation)
    given: dict[str, Any] = {
        "name": name,
        "pos": frame.translation,
        "quat": [quaternion.w, quaternion.x, quaternion.y, quaternion.z],
        "contype": bits[0],
        "conaffinity": bits[1],
        "density": DENSITY,
    }
    if isinstance(geometry, coal.Sphere):
        body.add_geom(type=kinds.mjGEOM_SPHERE, size=[geometry.radius, 0.0, 0.0], **given)
    elif isinstance(geometry, coal.Capsule):
        body.add_geom(type=kinds.mjGEOM_CAPSULE, size=[geometry.radius, geometry.halfLength, 0.0], **given)
    elif isinstance(geometry, coal.Cylinder):
        body.add_geom(type=kinds.mjGEOM_CYLINDER, size=[geometry.radius, geometry.halfLength, 0.0], **given)
    elif isinstance(geometry, coal.Box):
        body.add_geom(type=kinds.mjGEOM_BOX, size=geometry.halfSide, **given)
    else:
        spec.add_mesh(name=name, uservert=_solid(np.array(geometry.points())).ravel(), inertia=_CONVEX)
        body.add_geom(type=kinds.mjGEOM_MESH, meshname=name, **given)


_CONVEX = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX


def _solid(vertices: Array) -> Array:
    """``vertices`` (k, 3), a flat set made ``TINY`` thick on either side of its plane."""
    _, extents, axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=False)
    if len(vertices) > 3 and extents[2] > TINY:
        return vertices
    return np.concatenate([vertices - TINY * axes[2], vertices + TINY * axes[2]])
