"""What was made of a robot's file: its joints with their limits, its tip, and what was changed of its geometry."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from rich.console import Group, RenderableType
from rich.text import Text

from cdfctl.report.tables import bullets, listing
from cdfctl.robots.robot import Robot

LARGEST = 20.0  # m: more than any arm
MOST_TURNS = 8.0 * math.pi  # rad between the limits of a joint


def robot_summary(robot: Robot) -> RenderableType:
    """Joints, tip, links and notes, legible at 80 columns."""
    rows = [_row(joint) for joint in joint_facts(robot)]
    with_acceleration = any(row[-1] for row in rows)
    columns = ["joint", "position", "speed", *(["acceleration"] if with_acceleration else [])]
    parts: list[RenderableType] = [listing(columns, [row[: len(columns)] for row in rows])]
    parts.append(Text(f"tip: {robot.tip}"))
    parts.append(Text(f"collision geometry: {', '.join(robot.links)}; fixed: {', '.join(robot.base_links) or 'none'}"))
    notes = [*robot.notes, *_remarks(robot)]
    if notes:
        parts += [Text("Robot model"), bullets(notes)]
    return Group(*parts)


def _remarks(robot: Robot) -> Iterator[str]:
    """What a file may have meant otherwise: hulls of meshes, and lengths or angles of another unit."""
    shapes = zip(robot.geometry_links, robot.geometry.geometryObjects, strict=True)
    hulls = list(dict.fromkeys(link for link, item in shapes if isinstance(item.geometry, coal.ConvexBase)))
    if hulls:
        yield f"meshes stand for their convex hulls: {', '.join(hulls)}"
    size = extent(robot)
    if size > LARGEST:
        yield f'it is {size:.0f} m large at home: a mesh in millimetres has scale="0.001 0.001 0.001" in the URDF'
    wide = [
        j["name"] for j in joint_facts(robot) if j["unit"] == "rad" and MOST_TURNS < j["upper"] - j["lower"] < math.inf
    ]
    if wide:
        yield f"more than four turns between the limits of {', '.join(wide)}: a URDF's angles are in radians"


def extent(robot: Robot) -> float:
    """How far (m) the farthest point of the moving links' bounding balls is from the world's origin at home."""
    data, placed = robot.model.createData(), robot.geometry.createData()
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, robot.home)
    found = [0.0]
    for item, placement in zip(robot.geometry.geometryObjects, placed.oMg, strict=True):
        item.geometry.computeLocalAABB()
        centre = placement.act(np.array(item.geometry.aabb_center))
        found.append(float(np.linalg.norm(centre)) + float(item.geometry.aabb_radius))
    return max(found)


def joint_facts(robot: Robot) -> list[dict[str, Any]]:
    """Each joint: name, ``unit`` (rad or m), ``lower``, ``upper``, ``velocity`` and ``acceleration`` limits, inf where
    there is none."""
    return [
        {
            "name": name,
            "unit": "m" if robot.prismatic[i] else "rad",
            "lower": float(robot.lower[i]),
            "upper": float(robot.upper[i]),
            "velocity": float(robot.velocity_limit[i]),
            "acceleration": float(robot.acceleration_limit[i]),
        }
        for i, name in enumerate(robot.joint_names)
    ]


def _row(joint: dict[str, Any]) -> list[str]:
    unit, lower, upper = joint["unit"], joint["lower"], joint["upper"]
    free = math.isinf(lower) and math.isinf(upper)
    return [
        joint["name"],
        "continuous" if free else f"{lower:.5g} to {upper:.5g} {unit}",
        f"{joint['velocity']:.4g} {unit}/s",
        "" if math.isinf(joint["acceleration"]) else f"{joint['acceleration']:.4g} {unit}/s²",
    ]
