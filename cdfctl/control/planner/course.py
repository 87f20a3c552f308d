"""The obstacles over the time to come, as arrays, and where a point of one is at a time."""

from __future__ import annotations

from math import cos, sin, sqrt

from cdfctl.control.planner.jit import njit_inline
from cdfctl.fields.kernel.body import turn
from cdfctl.fields.kernel.sets import ConvexSets
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Rot, Vec, along, compose, rot, vec
from cdfctl.types import Array, BoolArray, IntArray


class Course(Struct):
    """m obstacles of p convex parts in b blocks, each moving by K pieces of constant twist; times from now on, s.

    Attributes:
        sets: the p parts, in the frame of their obstacle.
        obstacle: (b,) the obstacle a block belongs to.
        part: (b+1,) the parts of block i are part[i] … part[i+1] - 1.
        block: (b, 4) a ball around the block: centre in the obstacle's frame, radius, m.
        straight: (b,) the centre of that ball moves by one constant velocity.
        line: (b, 6) then: that centre now, in the world, and its velocity.
        point: (b,) the block is one point with a radius.
        pace: (b,) bound on the speed of the block's points, and on how fast its margin grows, m/s.
        knot: (m, K) times at which a piece of motion begins, rising; the first is not after now, unused ones are inf.
        rotation: (m, K, 3, 3) and
        position: (m, K, 3) the obstacle's pose then.
        twist: (m, K, 6) from then on.
        margin: (m, 3) distance to keep now (m), how fast it widens (m/s), and the widest it gets (m).
    """

    sets: ConvexSets
    obstacle: IntArray
    part: IntArray
    block: Array
    straight: BoolArray
    line: Array
    point: BoolArray
    pace: Array
    knot: Array
    rotation: Array
    position: Array
    twist: Array
    margin: Array


@njit_inline
def pose_at(knot: Array, rotation: Array, position: Array, twist: Array, o: int, t: float) -> tuple[Rot, Vec]:
    """Rotation and origin of obstacle o at time t; the arrays are those of :class:`Course`."""
    k, after = 0, knot.shape[1]
    while after - k > 1:  # the last piece that has begun
        middle = (k + after) // 2
        if knot[o, middle] <= t:
            k = middle
        else:
            after = middle
    s = t - knot[o, k]
    r, p = rot(rotation[o], k), along(vec(position[o], k), s, vec(twist[o], k))
    wx, wy, wz = twist[o, k, 3], twist[o, k, 4], twist[o, k, 5]
    speed = sqrt(wx * wx + wy * wy + wz * wz)
    if speed > 0.0:
        r = compose(turn((wx / speed, wy / speed, wz / speed), sin(speed * s), cos(speed * s)), r)
    return r, p
