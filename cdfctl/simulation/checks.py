"""What can be wrong with a valid scenario once the robot is known, all of it at once.

Each check gives complaints ``(message, hint, place)``, the place being a path of the scenario's fields; the scenario
file turns them into problems with line and excerpt.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.scenario.schema import HoldTask, JointGoalTask, ReachTask, RobotConfig, Scenario
from cdfctl.scenario.shapes import Body
from cdfctl.scenario.values import Complaint
from cdfctl.simulation.advancement import CONTACT
from cdfctl.simulation.clearance import nearest_each
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.self_contact import OwnDistances
from cdfctl.simulation.shapes import shape_of, vector_of

Place = tuple[str | int, ...]

DEGREES = "angles are in radians: 90 degrees is 1.5708"
METRES = "; lengths are in metres"
FAR = 1.0  # m: so deep is nothing that was meant


def robot_of(config: RobotConfig) -> Robot:
    """The robot of a scenario's robot section, with its limits, locks and tip.

    Raises:
        InputError: there is none such, or something in the section does not fit it.
    """
    source = config.name if config.name is not None else config.urdf
    assert source is not None  # the schema asks for one of the two
    return load_robot(
        source,
        package_dirs=config.package_dirs,
        lock=config.lock,
        position_limits=config.limits.position,
        velocity_limits=config.limits.velocity,
        acceleration_limits=config.limits.acceleration,
        srdf=config.srdf,
        tip=config.tip,
    )


def robot_complaints(config: RobotConfig, error: InputError) -> list[Complaint]:
    """Why :func:`robot_of` failed, placed at the joint names at fault where it is they."""
    limits = config.limits
    named: list[Place] = [("robot", "lock", name) for name in config.lock]
    named += [("robot", "limits", "position", name) for name in limits.position]
    for key, given in (("velocity", limits.velocity), ("acceleration", limits.acceleration)):
        named += [("robot", "limits", key, name) for name in (given if isinstance(given, dict) else ())]
    at = "name" if config.name else "urdf"
    if config.tip is not None and f"'{config.tip}'" in error.message:
        at = "tip"
    elif config.srdf is not None and error.message.startswith(f"{config.srdf}:"):
        at = "srdf"
    fallback: list[Complaint] = [(error.message, error.hint, ("robot", at))]
    if not named:
        return fallback
    try:
        # Whole, without this section's changes, to learn its joints' names; the robot file's own locks hide some.
        whole = robot_of(
            RobotConfig(name=config.name, urdf=config.urdf, package_dirs=config.package_dirs, q0=config.q0)
        )
    except InputError:
        return fallback
    names = whole.joint_names
    wrong = [place for place in named if place[-1] not in names and f"'{place[-1]}'" in error.message]
    return [
        (f"unknown joint '{place[-1]}' of {whole.name}", name_hint(str(place[-1]), names), place) for place in wrong
    ] or fallback


def scenario_complaints(scenario: Scenario, robot: Robot) -> list[Complaint]:
    """Everything wrong with a drawn and resolved ``scenario`` for ``robot``; empty where it can run."""
    found = [*_configurations(scenario, robot), *_weights(scenario, robot), *_solver(scenario), *_shapes(scenario)]
    return found or [*_start_in_contact(scenario, robot), *_start_in_self_contact(scenario, robot)]


def _configurations(scenario: Scenario, robot: Robot) -> Iterator[Complaint]:
    fields: list[tuple[Place, Sequence[object]]] = [(("robot", "q0"), scenario.robot.q0)]
    if isinstance(scenario.task, JointGoalTask):
        fields.append((("task", "goal"), scenario.task.goal))
    if isinstance(scenario.task, HoldTask):
        fields.append((("task", "pose"), scenario.task.pose))
    for place, values in fields:
        if len(values) != robot.n:
            joints = ", ".join(robot.joint_names)
            yield (
                f"expected {robot.n} numbers, one a joint of {robot.name}, found {len(values)}",
                f"joints: {joints}",
                place,
            )
            continue
        for i, value in enumerate(vector_of(values)):  # type: ignore[arg-type]  # drawn numbers
            yield from _joint_value(robot, i, float(value), (*place, i))


def _joint_value(robot: Robot, i: int, value: float, place: Place) -> Iterator[Complaint]:
    low, high = float(robot.lower[i]), float(robot.upper[i])
    unit = "m" if robot.prismatic[i] else "rad"
    degrees = not robot.prismatic[i] and abs(value) > 2.0 * math.pi
    if not low <= value <= high:
        message = (
            f"{value:g} {unit} is outside the limits of joint '{robot.joint_names[i]}', [{low:g}, {high:g}] {unit}"
        )
        yield message, DEGREES if degrees else None, place
    elif degrees and robot.continuous[i]:
        yield f"{value:g} rad is more than a turn of joint '{robot.joint_names[i]}'", DEGREES, place


def _weights(scenario: Scenario, robot: Robot) -> Iterator[Complaint]:
    for name in ("effort_weight", "smoothness_weight"):
        weight = getattr(scenario.controller, name)
        if isinstance(weight, tuple) and len(weight) != robot.n:
            message = f"expected one number or {robot.n}, one a joint of {robot.name}, found {len(weight)}"
            yield message, None, ("controller", name)


def _solver(scenario: Scenario) -> Iterator[Complaint]:
    if scenario.controller.solver is None:
        return
    from cdfctl.control.solvers import check_solver  # loads every solver: not for who only wants a robot

    try:
        check_solver(scenario.controller.solver)
    except InputError as error:
        yield error.message, error.hint, ("controller", "solver")


def _shapes(scenario: Scenario) -> Iterator[Complaint]:
    bodies: list[tuple[Place, Body]] = [(("obstacles", i), body) for i, body in enumerate(scenario.obstacles)]
    if isinstance(scenario.task, ReachTask):
        bodies.append((("task", "target"), scenario.task.target))
    for place, body in bodies:
        try:
            shape_of(body.shape)
        except InputError as error:
            yield error.message, error.hint, (*place, "shape")


def _start_in_contact(scenario: Scenario, robot: Robot) -> Iterator[Complaint]:
    """The judge's own distance at t = 0, each obstacle by itself, so that all of them are named."""
    scene = SceneMotion(scenario.obstacles).at(0.0)
    for i, found in enumerate(nearest_each(robot, vector_of(scenario.robot.q0), scene)):
        if found.distance <= CONTACT:
            message = f"at the start '{found.obstacle}' is in contact with {found.link} ({_depth(found.distance)})"
            place: Place = (
                ("obstacles", i, "position") if scenario.obstacles[i].position is not None else ("obstacles", i)
            )
            hint = "move the obstacle or robot.q0, or draw another trial"
            yield message, hint + (METRES if found.distance < -FAR else ""), place


def _start_in_self_contact(scenario: Scenario, robot: Robot) -> Iterator[Complaint]:
    """Only where the scenario asks for it: hulls may touch where the links do not."""
    if not scenario.controller.self_collision:
        return
    own = OwnDistances(robot)
    own.place(vector_of(scenario.robot.q0))
    for (a, b), distance in zip(own.links, own.distances().tolist(), strict=True):
        if distance <= CONTACT:
            message = f"at the start {a} is in contact with {b} ({_depth(distance)})"
            yield message, "move robot.q0, or name the pair in an SRDF, robot.srdf", ("robot", "q0")


def _depth(distance: float) -> str:
    return f"{-1e3 * distance:.1f} mm deep" if distance < 0.0 else "touching"
