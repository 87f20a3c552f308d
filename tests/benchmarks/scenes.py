"""Scenes for the benchmarks: balls that keep moving, so that no query repeats the one before."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdfctl.fields.sdf import SDF
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, Scene, Shape, Sphere

RADIUS = 0.05  # m
WORKSPACE = ([-0.7, -0.7, 0.1], [0.7, 0.7, 1.0])  # m, of a Franka

Motion = Callable[[float], Scene]


def moving(positions: Callable[[float], tuple[Array, Array]]) -> Motion:
    """Balls at ``positions`` (m, 3), of the velocities given with them, as a function of time."""
    count = len(positions(0.0)[0])
    shapes: tuple[Shape, ...] = tuple(Sphere(RADIUS) for _ in range(count))
    names = tuple(f"ball-{i}" for i in range(count))

    def scene(t: float) -> Scene:
        poses, twists = np.zeros((count, 7)), np.zeros((count, 6))
        poses[:, :3], twists[:, :3] = positions(t)
        poses[:, 6] = 1.0
        return Scene.from_arrays(shapes, names, poses, twists)

    return scene


def circling() -> Motion:
    """Six balls on a circle around a Franka, one above the other."""
    phases, heights = np.arange(6) * np.pi / 3, 0.5 + 0.05 * np.arange(6)

    def positions(t: float) -> tuple[Array, Array]:
        c, s = np.cos(phases + 0.4 * t), np.sin(phases + 0.4 * t)
        return np.column_stack([0.55 * c, 0.55 * s, heights]), np.column_stack([-0.22 * s, 0.22 * c, 0.0 * s])

    return moving(positions)


def crowd(robot: Robot, count: int, box: tuple[list[float], list[float]] = WORKSPACE) -> Motion:
    """``count`` balls anywhere in ``box``, at first 5 to 60 cm clear of the robot at home, that swing by 2 cm."""
    rng, field = np.random.default_rng(count), SDF(robot)
    home = np.empty((0, 3))
    while len(home) < count:
        tried = rng.uniform(*box, (4 * count, 3))
        d = field.query(robot.home, moving(lambda t, tried=tried: (tried, np.zeros_like(tried)))(0.0)).d
        home = np.vstack([home, tried[(d > 0.05) & (d < 0.6)]])[:count]
    swing = rng.normal(size=(count, 3))
    swing *= 0.02 / np.linalg.norm(swing, axis=1)[:, None]
    swing[:, 2] *= box[0][2] < box[1][2]  # in the plane, those of a planar arm
    return moving(lambda t: (home + swing * np.sin(5.0 * t), 5.0 * swing * np.cos(5.0 * t)))
