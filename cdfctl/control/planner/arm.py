"""The robot as the planner sees it: convex pieces, each within one ball, and covered by several smaller ones.

A ball around a piece gives a lower bound of its distance at the price of one subtraction. Where that bound is too loose
to tell anything, the cover gives a tighter one; only then is the exact distance asked for.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from cdfctl.fields.kernel.body import Body, body_of
from cdfctl.fields.kernel.structs import Struct
from cdfctl.robots.convex import ConvexPiece, convex_hull
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, BoolArray, IntArray

COVER = 16  # balls that cover a piece
TURNS = 400  # steps of the search for the smallest ball around some points; its error falls as 1 / TURNS


class Arm(Struct):
    """A robot of n joints and k convex pieces.

    Attributes:
        body: kinematics and the exact pieces.
        centre: (k, 3) centre of a ball around the piece, in the frame of its joint, m.
        radius: (k,) of that ball.
        reach: (n, k) greatest distance of a point of piece k from the axis of joint j, at any configuration; 1 for a
            sliding joint and 0 for one that does not move the piece.
        ball: (b, 4) centre in the joint's frame and radius of the balls of all covers.
        first_ball: (k+1,) the cover of piece k is ball[first_ball[k]:first_ball[k+1]].
        slender: (k,) the piece is a point or a segment with a radius, whose distance to a point is closed form.
        end: (k, 2, 3) ends of the segment of a slender piece, in the joint's frame.
        thin: (k,) radius added to the piece's core, m.
    """

    body: Body
    centre: Array
    radius: Array
    reach: Array
    ball: Array
    first_ball: IntArray
    slender: BoolArray
    end: Array
    thin: Array


@lru_cache(maxsize=8)
def arm_of(robot: Robot) -> Arm:
    """The arrays of ``robot``, which nothing may write to."""
    body = body_of(robot)
    pieces = sorted(robot.pieces, key=lambda piece: piece.link)  # the order of body_of
    points = [_corners(piece) for piece in pieces]
    around = np.array([_ball(p) for p in points]).reshape(-1, 4)
    around[:, 3] += [piece.radius for piece in pieces]
    covers = [_cover(p, piece.radius) for p, piece in zip(points, pieces, strict=True)]
    slender = np.array([len(p.vertices) <= 2 and p.disc == 0.0 for p in pieces], dtype=np.bool_)
    end = np.zeros((len(pieces), 2, 3))
    for k in np.flatnonzero(slender):
        end[k] = points[k][0], points[k][-1]
    return Arm(
        body=body,
        centre=around[:, :3].copy(),
        radius=around[:, 3].copy(),
        reach=_reach(robot, body, around),
        ball=np.concatenate([*covers, np.zeros((0, 4))]),
        first_ball=np.cumsum([0, *map(len, covers)]).astype(np.int64),
        slender=slender,
        end=end,
        thin=np.array([piece.radius for piece in pieces]),
    )


def _corners(piece: ConvexPiece) -> Array:
    """Points (c, 3) in the joint's frame whose hull holds the piece's core: a disc becomes an octagon around it."""
    points = piece.vertices
    if piece.disc > 0.0:
        angle = np.arange(8) * (np.pi / 4.0)
        ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(8)], axis=1) * (piece.disc / np.cos(np.pi / 8.0))
        points = (points[:, None, :] + ring).reshape(-1, 3)
    return points @ piece.rotation.T + piece.translation


def _ball(points: Array) -> Array:
    """Centre and radius (4,) of a ball around ``points``, near the smallest (Badoiu and Clarkson's iteration)."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for i in range(TURNS):
        far = points[np.argmax(np.linalg.norm(points - centre, axis=1))]
        centre = centre + (far - centre) / (i + 2)
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())


def _cover(points: Array, radius: float) -> Array:
    """Balls (b, 4) whose union holds the hull of ``points`` grown by ``radius``.

    The hull is cut across its longest side again and again; a ball around the corners of a convex part holds the part.
    """
    parts = [points]
    while len(parts) < COVER:
        sides = [np.ptp(p, axis=0).max() for p in parts]
        longest = parts.pop(int(np.argmax(sides)))
        if max(sides) < 1e-9:
            return np.array([np.append(longest[0], radius)])
        parts += _halves(longest)
    balls = np.array([_ball(p) for p in parts])
    balls[:, 3] += radius
    return balls


def _halves(points: Array) -> list[Array]:
    """The corners of both halves of a hull, cut in the middle of its longest side."""
    axis = int(np.argmax(np.ptp(points, axis=0)))
    middle = 0.5 * (points[:, axis].min() + points[:, axis].max())
    low, high = points[points[:, axis] <= middle], points[points[:, axis] > middle]
    # Every edge that crosses the cut joins a corner of one side to one of the other.
    share = (middle - low[:, None, axis]) / (high[None, :, axis] - low[:, None, axis])
    cut = (low[:, None, :] + share[..., None] * (high[None, :, :] - low[:, None, :])).reshape(-1, 3)
    return [convex_hull(np.concatenate([side, cut]))[0] for side in (low, high)]


def _reach(robot: Robot, body: Body, around: Array) -> Array:
    """Bounds (n, k): along the chain, the distance of two joints is that of their frames, more where joints slide."""
    chain = robot.chain
    reach = np.zeros((robot.n, len(around)))
    for k, joint in enumerate(body.joint):
        length = float(np.linalg.norm(around[k, :3]) + around[k, 3])
        i = int(joint)
        while i >= 0:
            if chain.prismatic[i]:
                slide = max(abs(float(chain.lower[i])), abs(float(chain.upper[i])))
                reach[i, k], length = 1.0, length + slide
            else:
                reach[i, k] = length
            length += float(np.linalg.norm(chain.translation[i]))
            i = int(chain.parent[i])
    return reach
