"""A proof that two bodies of a robot never come near each other, by halving boxes of joint values.

Turning joint j by an angle a moves every point of a body beyond it by at most r_j |a|, with r_j the greatest distance
of such a point from the joint's axis (a sliding joint: r_j = 1); which of the two bodies is thought of as moving is
free. For a box of joint values with centre c and
half-widths w, over the joints between the two bodies,

    d(q) >= d(c) - sum_j r_j w_j        for every q of the box.

A box whose bound is too small is halved across its joint of greatest r_j w_j, until every box is proved, a centre is
found that is too near, or too many boxes were looked at.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdfctl.robots.coal_geometry import bounding_ball
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, IntArray


def stays_apart(robot: Robot, pair: tuple[int, int], distance: float, most_boxes: int) -> tuple[bool, int]:
    """Whether it is proved that two objects of ``robot.geometry`` stay ``distance`` (m) apart within the joint limits,
    and how many boxes that took; no more than ``most_boxes``.

    False is no proof of the contrary.
    """
    import pinocchio as pin

    joints, reach = reaches(robot, pair)
    low = np.where(np.isfinite(robot.lower), robot.lower, np.where(robot.prismatic, -math.inf, -math.pi))[joints]
    high = np.where(np.isfinite(robot.upper), robot.upper, np.where(robot.prismatic, math.inf, math.pi))[joints]
    if not np.isfinite(high - low).all():
        return False, 0
    geometry = pin.GeometryModel(robot.geometry)
    geometry.addCollisionPair(pin.CollisionPair(*pair))
    data, placed = robot.model.createData(), pin.GeometryData(geometry)
    q = np.zeros(robot.n)
    boxes = [(0.5 * (low + high), 0.5 * (high - low))]
    looked_at = 0
    while boxes:
        if looked_at >= most_boxes:
            return False, looked_at
        centre, half = boxes.pop()
        looked_at += 1
        q[joints] = centre
        pin.updateGeometryPlacements(robot.model, data, geometry, placed, q)
        d = float(pin.computeDistance(geometry, placed, 0).min_distance)
        if d < distance:
            return False, looked_at
        ways = reach * half
        if d - ways.sum() < distance:
            widest = int(np.argmax(ways))
            half = half.copy()
            half[widest] *= 0.5
            for side in (-half[widest], half[widest]):
                moved = centre.copy()
                moved[widest] += side
                boxes.append((moved, half))
    return True, looked_at


def reaches(robot: Robot, pair: tuple[int, int]) -> tuple[IntArray, Array]:
    """The joints between two objects of ``robot.geometry`` and r_j of each (m/rad; 1 for a sliding joint)."""
    first, second = (robot.geometry.geometryObjects[i] for i in pair)
    up = _joints_up(robot, first.parentJoint - 1, second.parentJoint - 1)
    down = _joints_up(robot, second.parentJoint - 1, first.parentJoint - 1)
    # turning one body about a joint is turning the other the opposite way: the nearer one counts
    ours = _reaches_from(robot, first, up, down[::-1])
    theirs = _reaches_from(robot, second, down, up[::-1])
    joints = sorted(ours)
    return np.array(joints, dtype=np.int64), np.array([min(ours[j], theirs[j]) for j in joints])


def _joints_up(robot: Robot, joint: int, other: int) -> list[int]:
    """``joint`` and its ancestors, up to the first that also moves joint ``other`` (-1: the base)."""
    found = []
    while joint >= 0 and (other < 0 or not robot.chain.moves[joint, other]):
        found.append(joint)
        joint = int(robot.chain.parent[joint])
    return found


def _reaches_from(robot: Robot, body: Any, up: list[int], down: list[int]) -> dict[int, float]:
    """Bounds on the distance of the body's points from the axis of every joint on the way, first ``up``, then ``down``.

    For the first joint the distance from the axis itself; beyond it, the length of the way to the joint's origin.
    """
    chain = robot.chain
    *centre, radius = bounding_ball(body.geometry)
    here = body.placement.act(np.array(centre))
    way = float(np.linalg.norm(here))
    found: dict[int, float] = {}
    for joint in (*up, *down):
        length = float(np.linalg.norm(chain.translation[joint]))
        slide = max(abs(chain.lower[joint]), abs(chain.upper[joint])) if chain.prismatic[joint] else 0.0
        if found:
            to_axis = way if joint in up else way + length
        elif joint in up:
            to_axis = float(np.linalg.norm(np.cross(here, chain.axis[joint])))
        else:
            axis = chain.rotation[joint] @ chain.axis[joint]
            to_axis = float(np.linalg.norm(np.cross(here - chain.translation[joint], axis)))
        found[joint] = 1.0 if chain.prismatic[joint] else to_axis + radius
        way += length + slide
    return found
