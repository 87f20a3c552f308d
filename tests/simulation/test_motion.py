"""Obstacle motion against finite differences, another rotation library, and sampling."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from cdfctl.errors import InputError
from cdfctl.scenario.shapes import BallShape, CloudShape, MeshShape, ObstacleConfig, SinusoidMotion, WaypointMotion
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.shapes import load_points, shape_of
from cdfctl.types import Array, ConvexMesh, PointCloud

BALL = BallShape(type="ball", radius=0.1)


def vector(rng: np.random.Generator, size: int, scale: float = 1.0) -> tuple[float, ...]:
    return tuple((scale * rng.normal(size=size)).tolist())


def random_obstacle(kind: str, rng: np.random.Generator) -> ObstacleConfig:
    orientation = vector(rng, 4)
    if kind == "twist":
        return ObstacleConfig(
            shape=BALL,
            position=vector(rng, 3),
            orientation=orientation,
            velocity=vector(rng, 3),
            angular_velocity=vector(rng, 3, 2.0),
        )
    if kind == "waypoints":
        k = int(rng.integers(2, 6))
        turns = {"orientations": tuple(vector(rng, 4) for _ in range(k))} if rng.random() < 0.8 else {}
        motion = WaypointMotion(
            type="waypoints",
            times=tuple((0.3 + np.cumsum(rng.uniform(0.2, 1.0, k))).tolist()),
            positions=tuple(vector(rng, 3) for _ in range(k)),
            **turns,
        )
        return ObstacleConfig(shape=BALL, orientation=orientation, motion=motion)
    sinusoid = SinusoidMotion(
        type="sinusoid", amplitude=vector(rng, 3), frequency=float(rng.uniform(0, 2)), phase=float(rng.uniform(-7, 7))
    )
    return ObstacleConfig(shape=BALL, position=vector(rng, 3), orientation=orientation, motion=sinusoid)


def rotation(pose: Array) -> Rotation:
    return Rotation.from_quat(pose[3:])


kinds = st.sampled_from(["twist", "waypoints", "sinusoid"])
seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=150, deadline=None)
@given(kinds, seeds, st.floats(0.0, 6.0))
def test_twist_is_the_derivative_of_the_pose(kind: str, seed: int, t: float) -> None:
    obstacle = random_obstacle(kind, np.random.default_rng(seed))
    motion, e = SceneMotion([obstacle]), 1e-6
    if isinstance(obstacle.motion, WaypointMotion) and np.abs(np.array(obstacle.motion.times, float) - t).min() < 2 * e:
        t += 4 * e  # not across a waypoint
    before, after = motion.poses(t - e)[0], motion.poses(t + e)[0]
    twist = motion.twists(t)[0]
    assert twist[:3] == pytest.approx(
        (after[:3] - before[:3]) / (2 * e), abs=1e-6 * (1 + np.abs(twist).max() ** 2 * 100)
    )
    turn = (rotation(after) * rotation(before).inv()).as_rotvec() / (2 * e)
    assert twist[3:] == pytest.approx(turn, abs=1e-5)
    assert np.linalg.norm(after[3:]) == pytest.approx(1.0, abs=1e-12)


@settings(max_examples=100, deadline=None)
@given(kinds, seeds, st.floats(0.0, 5.0), st.floats(0.0, 1.0))
def test_speed_bounds_hold_and_are_attained(kind: str, seed: int, t0: float, length: float) -> None:
    motion = SceneMotion([random_obstacle(kind, np.random.default_rng(seed))])
    times = np.linspace(t0, t0 + length, 60)
    twists = np.array([motion.twists(float(t))[0] for t in times])
    for part, bound in (
        (slice(0, 3), motion.max_speed(0, t0, t0 + length)),
        (slice(3, 6), motion.max_angular_speed(0, t0, t0 + length)),
    ):
        speeds = np.linalg.norm(twists[:, part], axis=1)
        assert speeds.max() <= bound * (1 + 1e-12) + 1e-15
        fastest = np.linalg.norm(motion.twists(t0)[0][part])
        assert motion_bound_at(motion, part, t0) == pytest.approx(fastest, rel=1e-9, abs=1e-12)


def motion_bound_at(motion: SceneMotion, part: slice, t: float) -> float:
    """The bound over an interval of no length is the speed itself."""
    return motion.max_speed(0, t, t) if part.start == 0 else motion.max_angular_speed(0, t, t)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_waypoints_interpolate_as_slerp_does_and_rest_outside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.2, 1.0, 4))
    positions, quaternions = rng.normal(size=(4, 3)), rng.normal(size=(4, 4))
    waypoints = WaypointMotion(
        type="waypoints",
        times=tuple(times.tolist()),
        positions=tuple(map(tuple, positions.tolist())),
        orientations=tuple(map(tuple, quaternions.tolist())),
    )
    motion = SceneMotion([ObstacleConfig(shape=BALL, motion=waypoints)])
    reference = Slerp(times, Rotation.from_quat(quaternions))
    for t in rng.uniform(times[0], times[-1], 10):
        pose = motion.poses(float(t))[0]
        assert pose[:3] == pytest.approx([np.interp(t, times, positions[:, i]) for i in range(3)], abs=1e-12)
        assert (rotation(pose) * reference(t).inv()).magnitude() < 1e-7
    for t, k in ((-1.0, 0), (times[0] - 1e-9, 0), (times[-1], 3), (times[-1] + 5.0, 3)):
        pose = motion.poses(float(t))[0]
        assert pose[:3] == pytest.approx(positions[k], abs=1e-9)
        assert (rotation(pose) * Rotation.from_quat(quaternions[k]).inv()).magnitude() < 1e-7
        assert not motion.twists(float(t))[0].any()


def test_constant_twist_turns_about_its_own_origin() -> None:
    spin = ObstacleConfig(
        shape=BALL, position=(1.0, 2.0, 3.0), velocity=(0.5, 0.0, 0.0), angular_velocity=(0.0, 0.0, np.pi)
    )
    pose = SceneMotion([spin]).poses(0.5)[0]
    assert pose == pytest.approx([1.25, 2.0, 3.0, 0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)])


def test_sinusoid_by_hand() -> None:
    sinusoid = SinusoidMotion(type="sinusoid", amplitude=(0.2, 0.0, 0.0), frequency=0.5, phase=0.0)
    motion = SceneMotion([ObstacleConfig(shape=BALL, position=(1.0, 0.0, 0.0), motion=sinusoid)])
    assert motion.poses(0.5)[0][:3] == pytest.approx([1.2, 0.0, 0.0])
    assert motion.twists(0.0)[0][:3] == pytest.approx([0.2 * np.pi, 0.0, 0.0])
    assert motion.max_speed(0, 0.4, 0.6) == pytest.approx(0.2 * np.pi * np.sin(0.1 * np.pi))
    assert motion.max_speed(0, 0.4, 1.1) == pytest.approx(0.2 * np.pi)


def test_scene_keeps_its_shapes_and_names() -> None:
    named = ObstacleConfig(shape=BALL, position=(0.0, 0.0, 0.0), name="ball")
    motion = SceneMotion([named, ObstacleConfig(shape=BALL, position=(1.0, 0.0, 0.0))])
    first, second = motion.at(0.0), motion.at(1.0)
    assert first.shapes is second.shapes
    assert first.names == ("ball", "1")
    assert first.poses is not second.poses
    assert len(SceneMotion([]).at(0.0)) == 0
    assert SceneMotion([]).poses(1.0).shape == (0, 7)


@pytest.mark.parametrize("name", ["cloud.npy", "cloud.csv", "cloud.txt"])
def test_points_are_read(tmp_path: Path, name: str) -> None:
    points = np.array([[0.0, 0.1, 0.2], [1e-3, -2.0, 3.5]])
    if name.endswith("npy"):
        np.save(tmp_path / name, points)
    else:
        np.savetxt(tmp_path / name, points, delimiter="," if name.endswith("csv") else " ", header="x y z")
    cloud = shape_of(CloudShape(type="point-cloud", file=str(tmp_path / name), radius=0.01))
    assert isinstance(cloud, PointCloud)
    assert cloud.points.tolist() == points.tolist()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("bad.txt", "1 2 3\n4 5\n"),
        ("bad.csv", "a,b,c\n"),
        ("two.txt", "1 2\n"),
        ("nan.txt", "1 2 nan\n"),
        ("empty.txt", ""),
        ("bad.npy", "not numpy"),
        ("bad.xyz", "1 2 3\n"),
    ],
)
def test_bad_point_files_are_refused_in_one_line(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError) as caught:
        load_points(tmp_path / name)
    assert name in caught.value.message
    assert "\n" not in caught.value.message


def test_missing_point_file_and_directory(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.txt"):
        load_points(tmp_path / "none.txt")
    (tmp_path / "folder.txt").mkdir()
    with pytest.raises(InputError, match=r"folder\.txt"):
        load_points(tmp_path / "folder.txt")


def test_mesh_from_vertices() -> None:
    corners = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    mesh = shape_of(MeshShape(type="mesh", vertices=corners))
    assert isinstance(mesh, ConvexMesh)
    assert mesh.vertices.tolist() == [list(c) for c in corners]
