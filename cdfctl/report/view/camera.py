"""Where to look from, so that the whole run is in the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdfctl.report.view.replay import Body, Replay
from cdfctl.types import Array

FIELD_OF_VIEW = math.radians(40.0)
ASPECT = 1.2
"""Width over height of the part of a window that nothing covers."""
NEAR = 0.75
"""Obstacles this near to the base, as a share of the robot's size, are to be in the picture too."""

FLAT = 1e-3
"""An arm whose joints and tip stay within this height (m) moves in a plane, and is looked at from above."""

# From where an arm in space is seen: in front of it, to its right, a little from above.
DIRECTION = np.array([1.0, -0.75, 0.55])


@dataclass(frozen=True)
class Camera:
    """``position``, ``look_at``, ``up`` (3,), ``fov`` in rad; the ``floor``'s height and the ``grid``'s width, m."""

    position: Array
    look_at: Array
    up: Array
    fov: float
    floor: float
    grid: float

    @classmethod
    def of(cls, replay: Replay) -> Camera:
        """A camera that has every joint and the tip in view over the whole run, the goal, and the obstacles near by."""
        body = replay.body
        every = max(1, len(replay.path_q) // 40)
        seen = [*replay.path_q[::every], *([] if body.goal is None else [body.goal])]
        points = np.concatenate([body.skeleton(q) for q in seen] + [np.zeros((1, 3))])
        size = size_of(body)
        low, high = points.min(axis=0), points.max(axis=0)
        flat, floor = high[2] - low[2] < FLAT, float(low[2])
        points = np.concatenate([points, _near(replay, NEAR * size, 0.2 * size)])
        low, high = points.min(axis=0), points.max(axis=0)
        direction = np.array([0.0, 0.0, 1.0]) if flat else DIRECTION / np.linalg.norm(DIRECTION)
        up = np.array([0.0, 1.0, 0.0]) if flat else np.array([0.0, 0.0, 1.0])
        centre = 0.5 * (low + high)
        distance = _distance(points - centre, direction, up, 0.12 * size)
        grid = 10.0 ** math.floor(math.log10(size))
        return cls(
            centre + distance * direction,
            centre,
            up,
            FIELD_OF_VIEW,
            floor - (0.02 * size if flat else 0.0),
            grid,
        )

    def apply(self, initial_camera: object, right: float = 0.0) -> None:
        """Make it the camera every client begins with, the run ``right`` of the middle, in heights of the picture."""
        view = self.position - self.look_at
        across = np.cross(self.up, view)
        height = 2.0 * math.tan(0.5 * self.fov) * np.linalg.norm(view)
        shift = -right * height * across / np.linalg.norm(across)
        values = {"position": self.position + shift, "look_at": self.look_at + shift, "up": self.up, "fov": self.fov}
        for name, value in values.items():
            setattr(initial_camera, name, value)


def _near(replay: Replay, reach: float, most: float) -> Array:
    """The corners (k, 3) of the obstacles while they are within ``reach`` (m) of the base, at ``most`` (m) large."""
    extent = np.minimum(replay.body.clearance.reach, most)
    poses = replay.trajectory.obstacle_pose[:: max(1, len(replay.trajectory.t) // 40), :, :3]
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    close = np.linalg.norm(poses, axis=2) < reach
    around = poses[:, :, None] + extent[None, :, None, None] * corners / math.sqrt(3.0)
    return np.asarray(around[close].reshape(-1, 3))


def _distance(points: Array, direction: Array, up: Array, padding: float) -> float:
    """How far away along ``direction`` all ``points`` (k, 3), and ``padding`` (m) around them, are in the picture."""
    right = np.cross(up, direction)
    right /= np.linalg.norm(right)
    above = np.cross(direction, right)
    half = math.tan(0.5 * FIELD_OF_VIEW)
    beside = np.maximum(np.abs(points @ above), np.abs(points @ right) / ASPECT) + padding
    return float((beside / half + points @ direction).max())


def size_of(body: Body) -> float:
    """How far the robot reaches, about: the length of its chain of joints from the world to the tip, m."""
    points = np.concatenate([np.zeros((1, 3)), body.skeleton(body.robot.home)])
    return max(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()), 0.1)
