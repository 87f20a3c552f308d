"""Whatever the scene and the state: a finite command within the limits, its residual checked, or one clear refusal."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, get_args

import numpy as np
import pytest

import cdfctl
from cdfctl.control.qp import OnInfeasible
from cdfctl.errors import InputError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.variants import VARIANTS

ROBOTS = ("planar", "franka", "ur5")
HULL = np.random.default_rng(1).normal(size=(12, 3))
CLOUD = np.random.default_rng(2).normal(size=(40, 3))
RESIDUAL = 1e-5  # rad/s or m/s by which a row may be missed where the step counts as feasible; rows scale to 1
COUNTS = (0, 1, 2, 6, 20)
RULES = get_args(OnInfeasible)


@cache
def robot_of(name: str) -> Robot:
    return cdfctl.load_robot(name)


def shape_of(rng: np.random.Generator) -> Any:
    size = float(10.0 ** rng.uniform(-3, 0.3))
    match rng.integers(6):
        case 0:
            return cdfctl.Sphere(size)
        case 1:
            return cdfctl.Box(tuple(size * rng.uniform(0.1, 2.0, 3)))
        case 2:
            return cdfctl.Capsule(size, 2.0 * size)
        case 3:
            return cdfctl.Cylinder(size, size)
        case 4:
            return cdfctl.ConvexMesh(size * HULL)
        case _:
            return cdfctl.PointCloud(size * CLOUD, 0.01)


def obstacle_of(rng: np.random.Generator, robot: Robot, q: np.ndarray) -> cdfctl.Obstacle:
    """Anywhere: about the robot, within it, at a joint of it, at the world's origin, or a kilometre away."""
    match rng.integers(6):
        case 0:
            position = rng.normal(size=3) * 1000.0
        case 1:
            position = np.zeros(3)
        case 2:
            position = robot.tip_position(q)
        case _:
            position = rng.uniform([-1.5, -1.5, -0.5], [1.5, 1.5, 1.5]) * (4.0 if robot.name == "planar" else 1.0)
    speed = rng.choice([0.0, 0.5, 5.0, 1e4])
    return cdfctl.Obstacle(
        shape_of(rng),
        position=position,
        orientation=rng.normal(size=4),
        velocity=speed * rng.normal(size=3),
        angular_velocity=speed * rng.normal(size=3),
    )


def configuration_of(rng: np.random.Generator, robot: Robot) -> np.ndarray:
    """Inside the limits, on them, a little outside, or far outside."""
    low, high = np.maximum(robot.lower, -10.0), np.minimum(robot.upper, 10.0)
    q = rng.uniform(low, high)
    match rng.integers(5):
        case 0:
            q = np.where(rng.random(robot.n) < 0.5, low, high)
        case 1:
            q += rng.normal(size=robot.n) * 0.2
        case 2 if rng.random() < 0.3:
            q += rng.normal(size=robot.n) * 100.0
    return q


def check(seed: int, steps: int) -> dict[str, int]:
    """``steps`` commands of one filter of one variant; what is counted."""
    rng = np.random.default_rng(seed)
    robot = robot_of(ROBOTS[rng.integers(len(ROBOTS))])
    names = [name for name in VARIANTS if not VARIANTS[name].plans]
    variant = names[rng.integers(len(names))]
    rule = RULES[rng.integers(len(RULES))]
    safe = cdfctl.SafetyFilter(robot, variant=variant, dt=float(rng.choice([0.001, 0.01, 0.1])), on_infeasible=rule)
    counts = {"steps": 0, "infeasible": 0, "refused": 0}
    count = 500 if rng.random() < 0.005 else int(rng.choice(COUNTS))
    q = configuration_of(rng, robot)
    scene = cdfctl.Scene([obstacle_of(rng, robot, q) for _ in range(count)])
    for _ in range(steps):
        speed = float(rng.choice([0.0, 1.0, 1e6]))
        nominal = speed * rng.normal(size=robot.n)
        if rng.random() < 0.05 and count:
            spoilt = cdfctl.Scene.from_arrays(scene.shapes, scene.names, scene.poses.copy(), scene.twists.copy())
            part = spoilt.poses if rng.random() < 0.5 else spoilt.twists
            part[rng.integers(count), rng.integers(6)] = rng.choice([math.nan, math.inf, -math.inf])
            with pytest.raises(InputError, match="finite"):
                safe.step(q, spoilt, nominal)
            with pytest.raises(InputError, match="finite"):
                safe.step(np.full(robot.n, math.nan), scene, nominal)
            counts["refused"] += 1
        decision = safe.step(q, scene, nominal)
        told = (seed, robot.name, variant, count, decision)
        assert np.all(np.isfinite(decision.u)), told
        assert np.all(np.abs(decision.u) <= robot.velocity_limit * (1 + 1e-9)), told
        assert not np.any(np.isnan(decision.h)), told
        assert decision.h.shape == (count,), told
        assert decision.infeasible or decision.residual <= RESIDUAL, told
        assert (decision.status == "optimal") <= (not decision.infeasible), told
        counts["steps"] += 1
        counts["infeasible"] += decision.infeasible
        q = q + 0.01 * decision.u
    return counts


@pytest.mark.timeout(7200)
@pytest.mark.parametrize(
    ("first", "draws"), [(0, 80), *[pytest.param(10_000 * k, 5_000, marks=pytest.mark.long) for k in range(1, 5)]]
)
def test_every_answer_is_a_command_or_a_refusal(first: int, draws: int) -> None:
    total: dict[str, int] = {}
    for seed in range(first, first + draws):
        for name, count in check(seed, 5).items():
            total[name] = total.get(name, 0) + count
    assert total["steps"] == 5 * draws
    assert 0 < total["infeasible"] < total["steps"]
    assert total["refused"] > 0
