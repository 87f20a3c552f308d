"""What was made of a robot's file: its joints with their limits, its tip, and what was changed of its geometry."""

from __future__ import annotations

import math
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from cdfctl.report.tables import bullets, listing
from cdfctl.robots.robot import Robot


def robot_summary(robot: Robot) -> RenderableType:
    """Joints, tip, links and notes, legible at 80 columns."""
    rows = [_row(joint) for joint in joint_facts(robot)]
    with_acceleration = any(row[-1] for row in rows)
    columns = ["joint", "position", "speed", *(["acceleration"] if with_acceleration else [])]
    parts: list[RenderableType] = [listing(columns, [row[: len(columns)] for row in rows])]
    parts.append(Text(f"tip: {robot.tip}"))
    parts.append(Text(f"collision geometry: {', '.join(robot.links)}; fixed: {', '.join(robot.base_links) or 'none'}"))
    if robot.notes:
        parts += [Text("Robot model"), bullets(robot.notes)]
    return Group(*parts)


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
