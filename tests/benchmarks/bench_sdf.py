"""How long the signed distance field takes: ``python tests/benchmarks/bench_sdf.py [--cpu] [robot …]``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial

import numpy as np
from scenes import WORKSPACE
from timing import Measurement, repeated, show

from cdfctl.fields.sdf import SDF
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.types import Box, Cylinder, Obstacle, PointCloud, Scene, Shape, Sphere

CALLS = 500


def scene(rng: np.random.Generator, shape: Shape, count: int) -> Scene:
    """``count`` obstacles anywhere around the robot; the nearest are in it."""
    return Scene([Obstacle(shape, rng.uniform(*WORKSPACE), rng.normal(size=4)) for _ in range(count)])


def measure(robot: Robot) -> Iterator[Measurement]:
    """Every link and the nearest one, of several kinds of obstacles."""
    rng, field, q = np.random.default_rng(0), SDF(robot), robot.home
    scenes = {
        "6 balls": scene(rng, Sphere(0.05), 6),
        "50 balls": scene(rng, Sphere(0.05), 50),
        "6 boxes": scene(rng, Box((0.1, 0.2, 0.1)), 6),
        "6 cylinders": scene(rng, Cylinder(0.05, 0.2), 6),
        "cloud of 5000": Scene([Obstacle(PointCloud(rng.uniform(*WORKSPACE, size=(5000, 3)), 0.01), [0.0, 0.0, 0.0])]),
    }
    for name, obstacles in scenes.items():
        yield Measurement(f"sdf, {name}, nearest link", repeated(partial(field.query, q, obstacles), CALLS))
        yield Measurement(f"sdf, {name}, every link", repeated(partial(field.per_link, q, obstacles), CALLS))


if __name__ == "__main__":
    for name in [a for a in sys.argv[1:] if a != "--cpu"] or ["franka"]:
        show(measure(load_robot(name)))
