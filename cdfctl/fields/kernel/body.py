"""The robot: its convex pieces, where its joints are at q, and how its points move with q.

The placement of joint i in the world is that of its parent, times the fixed placement of the joint, times a turn by
q_i about the joint's axis or a slide by q_i along it. With z the axis in the world, o the joint's origin and p a point
of a body the joint moves, the joint's column of the Jacobian at p is

    J_i = z × (p - o)    for a turn,        J_i = z    for a slide.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from cdfctl.fields.kernel.angles import padded, sines_and_cosines
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.sets import ConvexSets, pack
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Rot, Vec, add, compose, cross, dot, rot, rotate, scale, store, store_rot, sub, vec
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, BoolArray, IntArray


class Chain(Struct):
    """The kinematic tree: what :class:`cdfctl.robots.robot.Chain` says, under the same names."""

    parent: IntArray
    rotation: Array
    translation: Array
    axis: Array
    prismatic: BoolArray
    moves: BoolArray
    lower: Array
    upper: Array
    continuous: BoolArray


class Body(Struct):
    """A robot as arrays: n joints, k pieces in the order of their links.

    Attributes:
        chain: the kinematic tree, n joints.
        sets: the k pieces, each in its own frame.
        joint: (k,) joint that carries the piece.
        link: (k,) index into ``robot.links``.
        first: (L+1,) the pieces of link l are first[l] … first[l+1] - 1.
        rotation, translation: (k, 3, 3), (k, 3) the piece's frame in its joint's.
    """

    chain: Chain
    sets: ConvexSets
    joint: IntArray
    link: IntArray
    first: IntArray
    rotation: Array
    translation: Array


class Frames(Struct):
    """Workspace: where the joints are, in the world, at each of c configurations.

    Attributes:
        rotation, translation: (c, n, 3, 3), (c, n, 3) placement of joint i, its own motion included.
        axis: (c, n, 3) axis of joint i.
        angle, sine, cosine: what :mod:`.angles` needs to turn the joints.
    """

    rotation: Array
    translation: Array
    axis: Array
    angle: Array
    sine: Array
    cosine: Array


@lru_cache(maxsize=8)
def body_of(robot: Robot) -> Body:
    """The arrays of ``robot``, which nothing may write to: packing its hulls takes as long as some runs."""
    pieces = sorted(robot.pieces, key=lambda piece: piece.link)
    k = len(pieces)
    link = np.array([p.link for p in pieces], dtype=np.int64)
    return Body(
        chain=Chain(**{name: np.array(part) for name, part in robot.chain._asdict().items()}),
        sets=pack(pieces),
        joint=np.array([p.joint for p in pieces], dtype=np.int64),
        link=link,
        first=np.searchsorted(link, np.arange(len(robot.links) + 1)).astype(np.int64),
        rotation=np.array([p.rotation for p in pieces], dtype=np.float64).reshape(k, 3, 3),
        translation=np.array([p.translation for p in pieces], dtype=np.float64).reshape(k, 3),
    )


def new_frames(body: Body, c: int = 1) -> Frames:
    """An empty workspace for ``c`` configurations."""
    n = len(body.chain.parent)
    wide = padded(n)
    return Frames(
        np.zeros((c, n, 3, 3)),
        np.zeros((c, n, 3)),
        np.zeros((c, n, 3)),
        np.zeros(wide),
        np.zeros(wide),
        np.zeros(wide),
    )


@njit
def forward(body: Body, q: Array, frames: Frames, c: int) -> None:
    """All joints at q (n,), which is configuration c of ``frames``."""
    sines_and_cosines(q, frames.angle, frames.sine, frames.cosine)
    for i in range(q.shape[0]):
        _place_joint(body, q, frames, c, i)


@njit
def forward_to(body: Body, q: Array, joint: int, frames: Frames, c: int) -> None:
    """``joint`` at q (n,), and the joints between it and the base; the others keep what they had."""
    sines_and_cosines(q, frames.angle, frames.sine, frames.cosine)
    for i in range(joint + 1):
        if body.chain.moves[i, joint]:
            _place_joint(body, q, frames, c, i)


@njit
def _place_joint(body: Body, q: Array, frames: Frames, c: int, i: int) -> None:
    chain = body.chain
    r, t = rot(chain.rotation, i), vec(chain.translation, i)
    parent = chain.parent[i]
    if parent >= 0:
        parent_r = rot(frames.rotation[c], parent)
        t = add(vec(frames.translation[c], parent), rotate(parent_r, t))
        r = compose(parent_r, r)
    axis = vec(chain.axis, i)
    z = rotate(r, axis)
    if chain.prismatic[i]:
        t = add(t, scale(q[i], z))
    elif axis[2] == 1.0:
        r = turn_about_z(r, frames.sine[i], frames.cosine[i])
    else:
        r = compose(r, turn(axis, frames.sine[i], frames.cosine[i]))
    store_rot(frames.rotation[c], i, r)
    store(frames.translation[c], i, t)
    store(frames.axis[c], i, z)


@njit
def turn_about_z(r: Rot, s: float, c: float) -> Rot:
    """R times the rotation about z, the axis of most joints, by the angle of sine ``s`` and cosine ``c``."""
    x, y, z = r
    return (
        (c * x[0] + s * x[1], c * x[1] - s * x[0], x[2]),
        (c * y[0] + s * y[1], c * y[1] - s * y[0], y[2]),
        (c * z[0] + s * z[1], c * z[1] - s * z[0], z[2]),
    )


@njit
def turn(k: Vec, s: float, cosine: float) -> Rot:
    """Rotation about the unit vector k by the angle of sine ``s`` (Rodrigues): 1 + sin [k] + (1 - cos) [k]²."""
    c = 1.0 - cosine
    x, y, z = k
    return (
        (1.0 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y),
        (c * x * y + s * z, 1.0 - c * (x * x + z * z), c * y * z - s * x),
        (c * x * z - s * y, c * y * z + s * x, 1.0 - c * (x * x + y * y)),
    )


@njit
def piece_pose(body: Body, frames: Frames, c: int, k: int) -> tuple[Rot, Vec]:
    """Rotation and translation of piece k in the world at configuration c; its joint must have been placed."""
    joint = body.joint[k]
    r = rot(frames.rotation[c], joint)
    t = add(vec(frames.translation[c], joint), rotate(r, vec(body.translation, k)))
    return compose(r, rot(body.rotation, k)), t


@njit
def gradient(body: Body, frames: Frames, c: int, joint: int, a: Vec, normal: Vec, out: Array) -> None:
    """∂d/∂q = -νᵀ J_a for a point ``a`` (world) of the body of ``joint``, into ``out`` (n,); ν is ``normal``."""
    chain = body.chain
    for i in range(out.shape[0]):
        if not chain.moves[i, joint]:
            out[i] = 0.0
        elif chain.prismatic[i]:
            out[i] = -dot(normal, vec(frames.axis[c], i))
        else:
            out[i] = -dot(normal, cross(vec(frames.axis[c], i), sub(a, vec(frames.translation[c], i))))
