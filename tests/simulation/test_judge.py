"""The judge against closed forms and dense sampling."""

from __future__ import annotations

import math
from dataclasses import replace

import coal
import numpy as np
import pinocchio as pin
import pytest

from cdfctl.robots.coal_geometry import coal_shape
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.simulation.judge import CLEARANCE_TOLERANCE, Sweep, clearance_curve, judge, tip_path_length
from cdfctl.types import Array, Box, Capsule, Cylinder, PointCloud, Shape, Sphere, Trajectory


class Drift:
    """Obstacles of constant velocity that turn about world axes at a constant rate."""

    def __init__(self, *bodies: tuple[Shape, list[float], list[float]], spin: list[float] | None = None) -> None:
        self.shapes = tuple(shape for shape, _, _ in bodies)
        self.names = tuple(f"o{i}" for i in range(len(bodies)))
        self.p = np.array([p for _, p, _ in bodies], dtype=float).reshape(-1, 3)
        self.v = np.array([v for _, _, v in bodies], dtype=float).reshape(-1, 3)
        self.spin = np.zeros(3) if spin is None else np.array(spin, dtype=float)

    def poses(self, t: float) -> Array:
        poses = np.zeros((len(self.shapes), 7))
        poses[:, :3] = self.p + self.v * t
        poses[:, 3:] = pin.Quaternion(pin.exp3(self.spin * t)).coeffs()
        return poses

    def max_speed(self, i: int, t0: float, t1: float) -> float:
        return float(np.linalg.norm(self.v[i]))

    def max_angular_speed(self, i: int, t0: float, t1: float) -> float:
        return float(np.linalg.norm(self.spin))


def run(q, dt: float = 0.1) -> Trajectory:
    q = np.array(q, dtype=float)
    steps = len(q) - 1
    nothing, m = np.full(steps, np.nan), 0
    return Trajectory(
        t=np.arange(steps + 1) * dt,
        q=q,
        u=np.diff(q, axis=0) / dt,
        obstacle_pose=np.zeros((steps + 1, m, 7)),
        obstacle_twist=np.zeros((steps + 1, m, 6)),
        h=np.zeros((steps, m)),
        V=nothing,
        slack=nothing,
        infeasible=np.zeros(steps, dtype=bool),
        step_time=np.zeros(steps),
    )


@pytest.fixture(scope="module")
def planar() -> Robot:
    return load_robot("planar")


@pytest.fixture(scope="module")
def franka() -> Robot:
    return load_robot("franka")


def test_a_contact_between_two_clear_instants_is_found(planar):
    # the arm lies along x up to 4; a ball passes its tip at 0.29 < 0.3, at 4.5 m/s, half-way between the instants
    motion = Drift((Sphere(0.3), [4.29, -0.225, 0.0], [0.0, 4.5, 0.0]))
    trajectory = run([[0, 0], [0, 0]])
    at_instants = math.hypot(0.29, 0.225) - 0.3
    np.testing.assert_allclose(clearance_curve(planar, motion, trajectory), at_instants, atol=1e-8)
    verdict = judge(planar, motion, trajectory, "reached")
    assert (verdict.outcome, verdict.outcome_sampled) == ("collision", "reached")
    assert not verdict.success
    assert verdict.time_to_reach is None
    assert verdict.min_clearance == pytest.approx(-0.01, abs=CLEARANCE_TOLERANCE)
    assert verdict.min_clearance_time == pytest.approx(0.05, abs=2e-3)
    assert verdict.contact is not None
    assert (verdict.contact.link, verdict.contact.obstacle) == ("link2", "o0")
    first = (0.225 - math.sqrt(0.3**2 - 0.29**2)) / 4.5
    assert verdict.contact.time == pytest.approx(first, abs=1e-6)


def test_a_near_miss_between_two_instants(planar):
    motion = Drift((Sphere(0.3), [4.31, -0.225, 0.0], [0.0, 4.5, 0.0]))
    verdict = judge(planar, motion, run([[0, 0], [0, 0]]), "reached")
    assert verdict.outcome == "reached"
    assert verdict.time_to_reach == pytest.approx(0.1)
    assert -1e-8 <= verdict.min_clearance - 0.01 <= CLEARANCE_TOLERANCE
    assert verdict.contact is None


def test_a_moving_arm_past_a_still_ball(planar):
    # the straight arm turns from 0 to 0.2 rad; a ball stands 0.02 m beyond the circle of the tip, at 0.1 rad
    position = [4.32 * math.cos(0.1), 4.32 * math.sin(0.1), 0.0]
    verdict = judge(planar, Drift((Sphere(0.3), position, [0, 0, 0])), run([[0, 0], [0.2, 0]]), "timeout")
    assert verdict.outcome == "timeout"
    assert -1e-8 <= verdict.min_clearance - 0.02 <= CLEARANCE_TOLERANCE
    assert verdict.min_clearance_time == pytest.approx(0.05, abs=1e-2)


@pytest.mark.parametrize(("gap", "outcome"), [(-1e-5, "collision"), (5e-7, "collision"), (3e-6, "timeout")])
def test_grazing(planar, gap, outcome):
    # not at a dyadic instant, and with a contact of a few micrometres only
    motion = Drift((Sphere(0.3), [4.3 + 1e-9 + gap, -0.1937, 0.0], [0.0, 4.5, 0.0]))
    verdict = judge(planar, motion, run([[0, 0], [0, 0]]), "timeout")
    if gap != 5e-7:  # between 0 and the threshold either word is right
        assert verdict.outcome == outcome
    assert (verdict.min_clearance <= 1e-6) == (verdict.outcome == "collision")
    assert verdict.min_clearance == pytest.approx(gap, abs=CLEARANCE_TOLERANCE)


def test_the_least_clearance_goes_on_after_the_first_contact(planar):
    motion = Drift((Sphere(0.3), [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]), (Sphere(0.2), [3.0, 5.05, 0.0], [0.0, -3.0, 0.0]))
    verdict = judge(planar, motion, run(np.zeros((31, 2))), "timeout")
    assert verdict.contact is not None
    assert verdict.contact.obstacle == "o0"
    assert verdict.contact.time == pytest.approx(0.7, abs=1e-5)
    assert verdict.min_clearance == pytest.approx(-0.3, abs=CLEARANCE_TOLERANCE)
    assert verdict.min_clearance_time == pytest.approx(1.0, abs=1e-3)


def test_contact_at_the_first_and_only_at_the_last_instant(planar):
    inside = judge(planar, Drift((Sphere(0.3), [1.0, 0.1, 0.0], [0, 0, 0])), run([[0, 0], [0.1, 0]]), "reached")
    assert inside.contact is not None
    assert inside.contact.time == 0.0
    assert inside.outcome_sampled == "collision"
    motion = Drift((Sphere(0.3), [1.0, -0.4, 0.0], [0.0, 1.0, 0.0]))
    last = judge(planar, motion, run([[0, 0], [0, 0]]), "reached")
    assert last.contact is not None
    assert last.contact.time == pytest.approx(0.1, abs=2e-6)


def test_a_turning_obstacle(planar):
    # a rod of 2 m about its centre, 1.2 m beside the arm: it points at the arm only between the instants
    motion = Drift((Box((2.4, 0.01, 0.01)), [3.0, 1.1, 0.0], [0, 0, 0]), spin=[0.0, 0.0, 10.0 * math.pi])
    verdict = judge(planar, motion, run([[0, 0], [0, 0]]), "reached")
    assert (verdict.outcome, verdict.outcome_sampled) == ("collision", "reached")
    reach = math.hypot(1.2, 0.005)  # its corner touches when it is 1.1 m below the centre
    turned = math.asin(1.1 / reach) - math.atan2(0.005, 1.2)
    assert verdict.contact is not None
    assert verdict.contact.time == pytest.approx(turned / (10.0 * math.pi), abs=1e-5)


def random_run(robot: Robot, rng: np.random.Generator, steps: int) -> Trajectory:
    u = rng.uniform(-2.0, 2.0, (steps, robot.n))
    return run(np.clip(np.vstack([robot.home, robot.home + np.cumsum(0.1 * u, axis=0)]), robot.lower, robot.upper))


def dense_least(robot: Robot, motion: Drift, trajectory: Trajectory, dt: float) -> tuple[float, float]:
    """Least distance and time of the first d <= 1e-6 on a fine grid, by Pinocchio's placements and coal."""
    data, placed = robot.model.createData(), robot.geometry.createData()
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-9
    solids = [coal_shape(shape) for shape in motion.shapes]
    bodies = [body.geometry for body in robot.geometry.geometryObjects]
    least, first = math.inf, math.inf
    for t in np.arange(0.0, trajectory.t[-1] + 0.5 * dt, dt):
        q = np.array([np.interp(t, trajectory.t, column) for column in trajectory.q.T])
        pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, q)
        frames = [coal.Transform3s(frame.rotation, frame.translation) for frame in placed.oMg]
        for solid, pose in zip(solids, motion.poses(float(t)), strict=True):
            there = coal.Transform3s(pin.Quaternion(pose[3:]).toRotationMatrix(), pose[:3])
            for body, here in zip(bodies, frames, strict=True):
                result.clear()
                d = coal.distance(body, here, solid, there, request, result)
                least = min(least, d)
                if d <= 1e-6:
                    first = min(first, float(t))
    return least, first


@pytest.mark.parametrize("seed", range(4))
def test_against_dense_sampling(franka, seed):
    rng = np.random.default_rng(seed)
    trajectory = random_run(franka, rng, 3)
    shapes = [Sphere(0.05), Box((0.1, 0.2, 0.3)), Capsule(0.05, 0.2), Cylinder(0.05, 0.2)]
    shape = shapes[seed]
    start = rng.uniform([0.3, -0.3, 0.3], [0.7, 0.3, 0.8])
    bodies = [(shape, list(start), list(rng.uniform(-1, 1, 3))), (Sphere(0.05), [0.6, 0.6, 0.4], [0.0, -2.0, 0.0])]
    motion = Drift(*bodies, spin=list(rng.uniform(-3, 3, 3)))
    grid = 2e-4
    least, first = dense_least(franka, motion, trajectory, grid)
    verdict = judge(franka, motion, trajectory, "timeout")
    fastest = float(Sweep(franka, motion, trajectory).speed.max())
    assert verdict.min_clearance <= least + CLEARANCE_TOLERANCE
    assert verdict.min_clearance >= least - 0.5 * fastest * grid - 1e-6
    assert (verdict.contact is not None) == (first < math.inf)
    if verdict.contact is not None:
        assert verdict.contact.time == pytest.approx(first, abs=grid + 1e-6)


@pytest.mark.parametrize("name", ["franka", "planar", "kinova"])
def test_speed_bounds_hold_for_every_vertex(name):
    robot, rng = load_robot(name), np.random.default_rng(5)
    trajectory = random_run(robot, rng, 4)
    speed = Sweep(robot, Drift((Sphere(0.1), [9, 9, 9], [0, 0, 0])), trajectory).speed
    data, placed = robot.model.createData(), robot.geometry.createData()
    moving = [k for k, body in enumerate(robot.geometry.geometryObjects) if body.parentJoint > 0]
    for k, (q0, q1) in enumerate(zip(trajectory.q[:-1], trajectory.q[1:], strict=True)):
        seen = np.zeros(len(moving))
        before: list[Array] = []
        for s in np.linspace(0.0, 1.0, 41):
            pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, q0 + s * (q1 - q0))
            after = [
                piece.vertices @ placed.oMg[g].rotation.T + placed.oMg[g].translation
                for g, piece in zip(moving, robot.pieces, strict=True)
            ]
            if before:
                steps = [np.linalg.norm(b - a, axis=1).max() for a, b in zip(before, after, strict=True)]
                seen = np.maximum(seen, np.array(steps) * 400.0)
            before = after
        assert np.all(seen <= speed[k, moving] + 1e-9)


def test_the_speed_bound_of_one_turning_joint_is_exact(planar):
    speed = Sweep(planar, Drift((Sphere(0.1), [9, 9, 9], [0, 0, 0])), run([[0, 0], [0.1, 0], [0.1, 0.2]])).speed
    np.testing.assert_allclose(speed, [[2.0, 4.0], [0.0, 4.0]], rtol=1e-6)


def test_the_base_is_judged(franka):
    motion = Drift((Sphere(0.05), [-0.5, 0.0, 0.05], [2.0, 0.0, 0.0]))
    verdict = judge(franka, motion, run(np.tile(franka.home, (6, 1))), "reached")
    assert verdict.contact is not None
    assert verdict.contact.link == "panda_link0"


def test_a_ball_wholly_inside_a_link_is_in_penetration(franka):
    data, placed = franka.model.createData(), franka.geometry.createData()
    pin.updateGeometryPlacements(franka.model, data, franka.geometry, placed, franka.home)
    k = franka.geometry_links.index("panda_link2")
    centre = np.array(franka.geometry.geometryObjects[k].geometry.points()).mean(axis=0)
    motion = Drift((Sphere(0.01), list(placed.oMg[k].act(centre)), [0, 0, 0]))
    verdict = judge(franka, motion, run(np.tile(franka.home, (3, 1))), "reached")
    assert verdict.outcome == "collision"
    assert verdict.min_clearance < -0.03
    assert verdict.contact is not None
    assert verdict.contact.time == 0.0


@pytest.mark.parametrize("offset", [0.6, 0.25, 0.0])
def test_a_point_cloud_is_the_least_of_its_balls(franka, offset):
    rng = np.random.default_rng(7)
    points = rng.uniform(-0.2, 0.2, (40, 3))
    start, velocity, radius = [0.3, offset, 0.4], [0.1, -0.3, 0.1], 0.02
    cloud = Drift((PointCloud(points, radius), start, velocity))
    balls = Drift(*((Sphere(radius), list(np.array(start) + point), velocity) for point in points))
    trajectory = random_run(franka, rng, 4)
    one, many = (judge(franka, motion, trajectory, "timeout") for motion in (cloud, balls))
    np.testing.assert_allclose(
        clearance_curve(franka, cloud, trajectory), clearance_curve(franka, balls, trajectory), atol=1e-6
    )
    assert one.min_clearance == pytest.approx(many.min_clearance, abs=2 * CLEARANCE_TOLERANCE)
    assert (one.contact is None) == (many.contact is None)
    if one.contact is not None and many.contact is not None:
        assert one.contact.time == pytest.approx(many.contact.time, abs=1e-5)
        assert one.contact.link == many.contact.link


def test_no_obstacles_and_no_steps(planar):
    verdict = judge(planar, Drift(), run([[0, 0], [0.1, 0]]), "reached")
    assert verdict.min_clearance == math.inf
    assert verdict.min_clearance_time is None
    assert verdict.success
    assert np.all(np.isinf(clearance_curve(planar, Drift(), run([[0, 0], [0.1, 0]]))))
    still = judge(planar, Drift((Sphere(0.3), [1.0, 0.7, 0.0], [0, 1, 0])), run([[0, 0]]), "reached")
    assert still.min_clearance == pytest.approx(0.4)
    assert (still.path_length, still.joint_path, still.time_to_reach) == (0.0, 0.0, 0.0)
    touching = judge(planar, Drift((Sphere(0.3), [1.0, 0.1, 0.0], [0, 1, 0])), run([[0, 0]]), "reached")
    assert touching.outcome == "collision"


@pytest.mark.parametrize("stop", ["reached", "timeout", "infeasible", "error"])
def test_order_of_outcomes(planar, stop):
    trajectory = run([[0, 0], [0, 0]])
    clear = judge(planar, Drift((Sphere(0.3), [1.0, 1.0, 0.0], [0, 0, 0])), trajectory, stop)
    assert clear.outcome == clear.outcome_sampled == stop
    assert (clear.time_to_reach is not None) == (stop == "reached")
    hit = judge(planar, Drift((Sphere(0.3), [1.0, 0.2, 0.0], [0, 0, 0])), trajectory, stop)
    assert hit.outcome == hit.outcome_sampled == ("error" if stop == "error" else "collision")


def test_path_lengths(planar):
    q = np.array([[0.0, 0.0], [0.3, 0.0], [0.3, 0.4]])
    verdict = judge(planar, Drift(), run(q), "reached")
    assert verdict.path_length == pytest.approx(4.0 * 0.3 + 2.0 * 0.4, rel=2e-5)
    assert verdict.joint_path == pytest.approx(0.7)
    assert tip_path_length(planar, q[:1]) == 0.0


def test_what_the_plant_did_between_control_steps_is_judged(planar):
    # At both control steps the arm lies along x; in between it swings out and back, over a ball beside it.
    motion = Drift((Sphere(0.3), [3.9, 0.6, 0.0], [0.0, 0.0, 0.0]))
    straight = run([[0, 0], [0, 0]])
    assert judge(planar, motion, straight, "reached").outcome == "reached"
    swung = replace(straight, plant_t=np.array([0.0, 0.05, 0.1]), plant_q=np.array([[0, 0], [0.3, 0.0], [0, 0]]))
    verdict = judge(planar, motion, swung, "reached")
    assert (verdict.outcome, verdict.outcome_sampled) == ("collision", "reached")
    assert verdict.path_length == pytest.approx(4.0 * 0.6, rel=1e-4)
    # 0.3 m from the ball's centre: 3.9 sin a - 0.6 cos a = -0.3, at 6 rad/s
    angle = math.atan2(0.6, 3.9) - math.asin(0.3 / math.hypot(3.9, 0.6))
    assert verdict.contact.time == pytest.approx(angle / 6.0, abs=1e-6)
    np.testing.assert_allclose(clearance_curve(planar, motion, swung), clearance_curve(planar, motion, straight))


@pytest.mark.parametrize(("stop", "outcome"), [("contact", "collision"), ("error", "error"), ("timeout", "timeout")])
def test_what_the_plant_felt_counts(planar, stop, outcome):
    motion = Drift((Sphere(0.3), [9.0, 9.0, 0.0], [0.0, 0.0, 0.0]))
    verdict = judge(planar, motion, run([[0, 0], [0.1, 0]]), stop)
    assert verdict.outcome == verdict.outcome_sampled == outcome
