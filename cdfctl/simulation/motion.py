"""How obstacles move, in closed form: poses, exact twists, and bounds on speed.

Three motions of an obstacle, with ``p0``, ``Q0`` its pose at t = 0 and ``exp(w)`` the rotation by the vector ``w``:

    constant twist   p(t) = p0 + v t,                          Q(t) = exp(omega t) Q0
    waypoints        p(t) = p_k + (t - t_k) (p_{k+1} - p_k)/(t_{k+1} - t_k),
                     Q(t) = exp(omega_k (t - t_k)) Q_k         (slerp), at rest before the first and after the last
    sinusoid         p(t) = p0 + A sin(2 pi f t + phi),        Q(t) = Q0

A twist is the right-hand derivative: at a waypoint it is that of the segment that begins there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from cdfctl.scenario.shapes import Body, ObstacleConfig, SinusoidMotion, WaypointMotion
from cdfctl.simulation.shapes import shape_of, vector_of
from cdfctl.types import Array, Scene, Shape


class _Path(Protocol):
    """A motion other than a constant twist."""

    def pose(self, t: float) -> Array: ...
    def twist(self, t: float) -> Array: ...
    def max_speed(self, t0: float, t1: float) -> float: ...
    def max_angular_speed(self, t0: float, t1: float) -> float: ...
    def times(self, t0: float, t1: float) -> list[float]: ...


CHORD = 0.05
"""s: a sinusoid is known to a controller as straight lines of this duration."""


class SceneMotion:
    """The obstacles of a scenario over time.

    Attributes:
        shapes: (m) their geometry; the same tuple in every scene this motion gives.
        names: (m) unique names; an obstacle's place in the list where it has none.
    """

    shapes: tuple[Shape, ...]
    names: tuple[str, ...]

    def __init__(self, obstacles: Sequence[Body]) -> None:
        """``obstacles`` without draws left in them. Raises :class:`cdfctl.errors.InputError` for a shape's file that
        cannot be read."""
        self.shapes = tuple(shape_of(o.shape) for o in obstacles)
        self.names = tuple(_name(o, i) for i, o in enumerate(obstacles))
        m = len(obstacles)
        self._pose0, self._twist0 = np.zeros((m, 7)), np.zeros((m, 6))
        self._paths: dict[int, _Path] = {}
        for i, o in enumerate(obstacles):
            orientation = _unit(vector_of(o.orientation))
            position = np.zeros(3) if o.position is None else vector_of(o.position)
            self._pose0[i, :3], self._pose0[i, 3:] = position, orientation
            self._twist0[i, :3], self._twist0[i, 3:] = vector_of(o.velocity), vector_of(o.angular_velocity)
            if isinstance(o.motion, WaypointMotion):
                self._paths[i] = _Waypoints(o.motion, orientation)
            elif isinstance(o.motion, SinusoidMotion):
                self._paths[i] = _Sinusoid(o.motion, self._pose0[i])
        self._turning = [i for i in range(m) if np.any(self._twist0[i, 3:])]
        self._speed = np.linalg.norm(self._twist0[:, :3], axis=1)
        self._angular_speed = np.linalg.norm(self._twist0[:, 3:], axis=1)

    def __len__(self) -> int:
        return len(self.shapes)

    def poses(self, t: float) -> Array:
        """(m, 7) at time ``t`` (s)."""
        poses = self._pose0.copy()
        poses[:, :3] += t * self._twist0[:, :3]
        for i in self._turning:
            poses[i, 3:] = turn(self._twist0[i, 3:] * t, self._pose0[i, 3:])
        for i, path in self._paths.items():
            poses[i] = path.pose(t)
        return poses

    def twists(self, t: float) -> Array:
        """(m, 6) at time ``t`` (s): velocity of the origin, angular velocity, world axes."""
        twists = self._twist0.copy()
        for i, path in self._paths.items():
            twists[i] = path.twist(t)
        return twists

    def at(self, t: float) -> Scene:
        """The scene at time ``t`` (s)."""
        return Scene.from_arrays(self.shapes, self.names, self.poses(t), self.twists(t))

    def settled(self) -> SceneMotion:
        """The motion as it is known once a run is over."""
        return self

    def close(self) -> None:
        """Nothing more will be asked of it but what is settled."""

    def pieces(self, name: str, start: float, end: float) -> tuple[Array, Array, Array] | None:
        """The motion of the obstacle ``name`` within [start, end] (s) as pieces of constant twist: when they begin
        (K,), the poses then (K, 7), the twists from then on (K, 6); None for one constant twist."""
        path = self._paths.get(self.names.index(name))
        if path is None:
            return None
        times = np.array([start, *path.times(start, end)])
        poses = np.array([path.pose(t) for t in times])
        twists = np.array([path.twist(t) for t in times])
        if isinstance(path, _Sinusoid):
            after = np.append(times[1:], times[-1] + CHORD)
            there = np.array([path.pose(t) for t in after])
            twists[:, :3] = (there - poses)[:, :3] / (after - times)[:, None]
        return times, poses, twists

    def max_speed(self, i: int, t0: float, t1: float) -> float:
        """Bound on the speed (m/s) of obstacle ``i``'s origin within [t0, t1]."""
        path = self._paths.get(i)
        return float(self._speed[i]) if path is None else path.max_speed(t0, t1)

    def max_angular_speed(self, i: int, t0: float, t1: float) -> float:
        """Bound on the angular speed (rad/s) of obstacle ``i`` within [t0, t1]."""
        path = self._paths.get(i)
        return float(self._angular_speed[i]) if path is None else path.max_angular_speed(t0, t1)


class _Waypoints:
    def __init__(self, motion: WaypointMotion, orientation: Array) -> None:
        self._times = vector_of(motion.times)
        self._positions = np.array([vector_of(p) for p in motion.positions])
        k = len(self._times)
        self._quaternions = np.tile(orientation, (k, 1))
        if motion.orientations is not None:
            self._quaternions = np.array([_unit(vector_of(q)) for q in motion.orientations])
        dt = np.diff(self._times)
        # One twist a span: at rest before the first waypoint, between each two, at rest after the last.
        self._spans = np.zeros((k + 1, 6))
        self._spans[1:k, :3] = np.diff(self._positions, axis=0) / dt[:, None]
        for s in range(k - 1):
            self._spans[s + 1, 3:] = rotation_between(self._quaternions[s], self._quaternions[s + 1]) / dt[s]

    def _span(self, t: float) -> int:
        return int(np.searchsorted(self._times, t, side="right"))

    def pose(self, t: float) -> Array:
        span = self._span(t)
        k = max(span - 1, 0)
        since = t - self._times[k]
        twist = self._spans[span]
        return np.concatenate([self._positions[k] + since * twist[:3], turn(twist[3:] * since, self._quaternions[k])])

    def twist(self, t: float) -> Array:
        twist: Array = self._spans[self._span(t)].copy()
        return twist

    def _fastest(self, t0: float, t1: float, part: slice) -> float:
        spans = self._spans[self._span(t0) : self._span(t1) + 1, part]
        return float(np.linalg.norm(spans, axis=1).max())

    def max_speed(self, t0: float, t1: float) -> float:
        return self._fastest(t0, t1, slice(0, 3))

    def max_angular_speed(self, t0: float, t1: float) -> float:
        return self._fastest(t0, t1, slice(3, 6))

    def times(self, t0: float, t1: float) -> list[float]:
        return [float(t) for t in self._times if t0 < t < t1]


class _Sinusoid:
    def __init__(self, motion: SinusoidMotion, pose0: Array) -> None:
        self._amplitude = vector_of(motion.amplitude)
        self._rate = 2.0 * math.pi * float(vector_of([motion.frequency])[0])
        self._phase = float(vector_of([motion.phase])[0])
        self._pose0 = pose0.copy()

    def pose(self, t: float) -> Array:
        pose = self._pose0.copy()
        pose[:3] += self._amplitude * math.sin(self._rate * t + self._phase)
        return pose

    def twist(self, t: float) -> Array:
        twist = np.zeros(6)
        twist[:3] = self._amplitude * self._rate * math.cos(self._rate * t + self._phase)
        return twist

    def max_speed(self, t0: float, t1: float) -> float:
        a, b = self._rate * t0 + self._phase, self._rate * t1 + self._phase
        passes_the_middle = math.floor(b / math.pi) > math.floor(a / math.pi)  # where |cos| = 1
        share = 1.0 if passes_the_middle else max(abs(math.cos(a)), abs(math.cos(b)))
        return float(np.linalg.norm(self._amplitude)) * self._rate * share

    def max_angular_speed(self, t0: float, t1: float) -> float:
        return 0.0

    def times(self, t0: float, t1: float) -> list[float]:
        return np.arange(t0 + CHORD, t1, CHORD).tolist()


def _name(body: Body, index: int) -> str:
    name = body.name if isinstance(body, ObstacleConfig) else None
    return str(index) if name is None else name


def _unit(quaternion: Array) -> Array:
    unit: Array = quaternion / np.linalg.norm(quaternion)
    return unit


def turn(w: Array, quaternion: Array) -> Array:
    """exp(w) applied, in world axes, to a unit quaternion x y z w."""
    half = 0.5 * math.sqrt(float(w @ w))
    vector = 0.5 * float(np.sinc(half / math.pi)) * w  # sin(half)/half, 1 at 0
    return _unit(_product(np.array([*vector, math.cos(half)]), quaternion))


def rotation_between(first: Array, second: Array) -> Array:
    """The shortest w with exp(w) first = second, as rotations; |w| <= pi."""
    step = _product(second, first * np.array([-1.0, -1.0, -1.0, 1.0]))
    if step[3] < 0.0:
        step = -step  # q and -q are one rotation; this is the shorter way
    sine = float(np.linalg.norm(step[:3]))
    if sine == 0.0:
        return np.zeros(3)
    rotation: Array = 2.0 * math.atan2(sine, step[3]) / sine * step[:3]
    return rotation


def _product(a: Array, b: Array) -> Array:
    """The quaternion product a b, both x y z w: first b, then a."""
    ax, ay, az, aw = a.tolist()
    bx, by, bz, bw = b.tolist()
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )
