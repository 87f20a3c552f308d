"""Where the obstacles will be, from one scene: a constant twist, or a motion that is known; and how wrong that may be.

    p(t) = p + v (delay + t),        R(t) = exp(omega (delay + t)) R

``delay`` is the age of the scene: what is measured now was true then. The distance to keep from an obstacle widens with
the time looked ahead, by a bound on the error of its position and a share of its speed:

    margin(t) = margin + position_error + min( velocity_error |v| (delay + t), WIDEST )

It is bounded, since a plan is made anew at every step: far ahead it need only be likely to stay free.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cdfctl.control.planner.course import Course
from cdfctl.control.reaching import moved
from cdfctl.fields.kernel.parts import Parts, parts_of, turn_obstacles
from cdfctl.types import Array, Scene, Shape

WIDEST = 0.1  # m


class KnownMotion(Protocol):
    """Obstacles whose motion is known beforehand."""

    def pieces(self, name: str, start: float, end: float) -> tuple[Array, Array, Array] | None:
        """The motion of the obstacle ``name`` within [start, end] (s) as pieces of constant twist: the times at which
        they begin (K,), the first not after ``start``, the poses then (K, 7), the twists from then on (K, 6); None
        where it keeps the twist it has."""
        ...


@dataclass(frozen=True)
class Prediction:
    """How a scene is carried forward.

    Attributes:
        margin: distance to keep, m.
        delay: age of the scenes, s.
        position_error: bound on the error of a measured position, m.
        velocity_error: bound on the error of a measured velocity, as a share of the speed.
        span: how far ahead known motions are asked for, s.
    """

    margin: float
    delay: float = 0.0
    position_error: float = 0.0
    velocity_error: float = 0.0
    span: float = 20.0


class Predictor:
    """Turns scenes into courses. Shapes are converted again only when the scene has another ``shapes`` tuple."""

    def __init__(self, prediction: Prediction, known: KnownMotion | None = None) -> None:
        self._prediction, self._known = prediction, known
        self._shapes: tuple[Shape, ...] | None = None

    def course(self, scene: Scene, t: float = 0.0) -> Course:
        """The obstacles of ``scene``, measured at time ``t`` (s), from now on. The arrays are used again by the next
        call."""
        if scene.shapes is not self._shapes:
            self._shapes, self._course = scene.shapes, _empty(parts_of(scene.shapes))
            self._off = np.linalg.norm(self._course.block[:, :3], axis=1)
        p = self._prediction
        now = moved(scene, p.delay) if p.delay > 0.0 else scene
        m = len(scene)
        knot, pose, twist = np.zeros((m, 1)), now.poses[:, None, :], scene.twists[:, None, :]
        if self._known is not None:
            knot, pose, twist = self._pieces(scene, t + p.delay, knot, pose, twist)
        if knot.shape != self._course.knot.shape:
            self._course = _with_pieces(self._course, knot.shape[1])
        course = self._course
        o, block, rotation = course.obstacle, course.block, course.rotation
        course.knot[:], course.position[:], course.twist[:] = knot, pose[:, :, :3], twist
        turn_obstacles(np.ascontiguousarray(pose.reshape(-1, 7)), rotation.reshape(-1, 3, 3))
        speed = np.sqrt(np.einsum("mki,mki->mk", twist[:, :, :3], twist[:, :, :3])).max(axis=1)
        turning = np.sqrt(np.einsum("mki,mki->mk", twist[:, :, 3:], twist[:, :, 3:])).max(axis=1)
        margin, kept = course.margin, p.margin + p.position_error
        margin[:, 1] = p.velocity_error * np.linalg.norm(scene.twists[:, :3], axis=1)
        margin[:, 0] = kept + np.minimum(margin[:, 1] * p.delay, WIDEST)
        margin[:, 2] = kept + WIDEST
        off = turning[o] * self._off
        course.pace[:] = speed[o] + off + turning[o] * block[:, 3] + margin[o, 1]
        course.straight[:] = (off == 0.0) & (knot.shape[1] == 1)
        course.line[:, :3] = course.position[o, 0] + np.einsum("bij,bj->bi", rotation[o, 0], block[:, :3])
        course.line[:, 3:] = course.twist[o, 0, :3]
        return course

    def _pieces(self, scene: Scene, now: float, knot: Array, pose: Array, twist: Array) -> tuple[Array, Array, Array]:
        assert self._known is not None
        found = {}
        for i, name in enumerate(scene.names):
            pieces = self._known.pieces(name, now, now + self._prediction.span)
            if pieces is not None:
                found[i] = pieces
        K = max((len(times) for times, _, _ in found.values()), default=1)
        knots = np.full((len(scene), K), np.inf)
        knots[:, 0] = knot[:, 0]
        poses, twists = np.repeat(pose, K, axis=1), np.repeat(twist, K, axis=1)
        for i, (times, at, rates) in found.items():
            k = len(times)
            knots[i, :k], poses[i, :k], twists[i, :k] = times - now, at, rates
            poses[i, k:], twists[i, k:] = at[-1], rates[-1]
        return knots, poses, twists


def _empty(parts: Parts) -> Course:
    """A course whose geometry is that of ``parts``; its motion is filled in at every step."""
    b, m = len(parts.block), len(parts.first) - 1
    first, info = parts.block["first"], parts.sets.info
    single = parts.block["last"] - first == 1
    point = single & (info["last"][first] - info["first"][first] == 1) & (info["disc"][first] == 0.0)
    return Course(
        sets=parts.sets,
        obstacle=np.repeat(np.arange(m), np.diff(parts.first_block)),
        part=np.append(first, parts.block["last"][-1:]).astype(np.int64),
        block=np.column_stack([parts.block["centre"], parts.block["reach"] + parts.block["radius"]]),
        straight=np.ones(b, dtype=np.bool_),
        line=np.zeros((b, 6)),
        point=point,
        pace=np.zeros(b),
        knot=np.zeros((m, 1)),
        rotation=np.zeros((m, 1, 3, 3)),
        position=np.zeros((m, 1, 3)),
        twist=np.zeros((m, 1, 6)),
        margin=np.zeros((m, 3)),
    )


def _with_pieces(course: Course, K: int) -> Course:
    """The same obstacles, with room for ``K`` pieces of motion."""
    m = len(course.knot)
    room = {"knot": (m, K), "rotation": (m, K, 3, 3), "position": (m, K, 3), "twist": (m, K, 6)}
    return Course(**{**course.members(), **{name: np.zeros(shape) for name, shape in room.items()}})
