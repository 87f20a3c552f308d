"""Whole-body reaching: the Lyapunov function V is the field's distance to the target, any part of the robot will do."""

from __future__ import annotations

import numpy as np

from cdfctl.control.rows import tvclf_row
from cdfctl.errors import InputError
from cdfctl.fields.field import Field
from cdfctl.types import Array, Rows, Scene


class Reaching:
    """The Lyapunov row of a target, by a field of its own: its warm starts must not mix with those of the obstacles."""

    def __init__(self, field: Field, gamma: float, dt: float) -> None:
        """``gamma`` (1/s) is the rate at which V is to fall, ``dt`` (s) the control period."""
        self._field, self._gamma, self._dt = field, gamma, dt

    def value(self, q: Array, target: Scene) -> float:
        """V at configuration ``q`` (n,): the distance to the one body of ``target``, m or rad, +inf out of reach."""
        if len(target) != 1:
            raise InputError(f"a target is one body, found {len(target)}")
        return float(self._field.query(q, target).d[0])

    def row(self, q: Array, target: Scene) -> tuple[Rows, float]:
        """The Lyapunov row at ``q`` (n,) and V. The row is empty where nothing can be gained: out of reach, or where
        the field has no gradient."""
        V = self.value(q, target)
        ahead = self._field.query(q, moved(target, self._dt))
        return tvclf_row(V, ahead, self._gamma, self._dt), V

    def reset(self) -> None:
        """Forget the steps so far."""
        self._field.reset()


def moved(scene: Scene, dt: float) -> Scene:
    """``scene`` after ``dt`` (s) at its present twists: p + v dt, and the rotation exp(omega dt) applied."""
    poses = scene.poses.copy()
    poses[:, :3] += scene.twists[:, :3] * dt
    for pose, omega in zip(poses, scene.twists[:, 3:], strict=True):
        angle = float(np.linalg.norm(omega)) * dt
        if angle > 0.0:
            axis = omega / np.linalg.norm(omega)
            pose[3:] = _turned(np.sin(0.5 * angle) * axis, float(np.cos(0.5 * angle)), pose[3:])
    return Scene.from_arrays(scene.shapes, scene.names, poses, scene.twists)


def _turned(v: Array, w: float, quaternion: Array) -> Array:
    """The quaternion product of (v, w) and ``quaternion``, both x y z w, normalised."""
    u, s = quaternion[:3], float(quaternion[3])
    product = np.append(w * u + s * v + np.cross(v, u), w * s - float(v @ u))
    unit: Array = product / np.linalg.norm(product)
    return unit
