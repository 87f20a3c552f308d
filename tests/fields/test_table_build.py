"""Building a table: entries are contacts by another judge's measure, and an interrupt or threads change no byte."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdfctl.fields.table.build as build_module
from cdfctl import load_robot
from cdfctl.errors import InputError
from cdfctl.fields.kernel.body import body_of
from cdfctl.fields.kernel.starts import Table
from cdfctl.fields.table.build import BuildParameters, build_table, chunk_contacts, forget_chunks
from cdfctl.fields.table.file import read_file, write_file
from cdfctl.fields.table.grid import workspace_grid
from cdfctl.fields.table.partial import PartialBuild
from cdfctl.robots.robot import Robot

from .table_helpers import link_distance, points_of, small_table


@pytest.fixture(scope="module")
def planar() -> Robot:
    return load_robot("planar")


@pytest.fixture(scope="module")
def planar_table(planar: Robot, tmp_path_factory: pytest.TempPathFactory) -> Table:
    return small_table(planar, tmp_path_factory.mktemp("planar"))


@pytest.mark.parametrize("name", ["planar", "franka", "kinova", "z1"])
def test_entries_touch_the_ball_by_coal(name: str, tmp_path: Path) -> None:
    robot = load_robot(name)
    table = small_table(robot, tmp_path, resolution=3, starts=9)
    links = [piece.link for piece in sorted(robot.pieces, key=lambda piece: piece.link)]
    points = points_of(table)
    assert len(table.piece) > 20
    for e in np.random.default_rng(0).choice(len(table.piece), 20, replace=False):
        distances = link_distance(robot, links[table.piece[e]], table.q[e], points[e], 0.05)
        assert np.min(np.abs(distances)) <= 1e-4


@pytest.mark.parametrize("name", ["planar", "franka", "kinova"])
def test_entries_obey_the_limits_and_leave_idle_joints_at_zero(name: str, tmp_path: Path) -> None:
    robot = load_robot(name)
    table = small_table(robot, tmp_path, resolution=3, starts=9)
    joints = np.array([piece.joint for piece in sorted(robot.pieces, key=lambda piece: piece.link)])
    moves = robot.chain.moves[:, joints[table.piece]].T
    assert np.all(table.q[~moves] == 0.0)
    inside = (table.q >= robot.lower - 1e-6) & (table.q <= robot.upper + 1e-6)
    assert np.all(inside[moves])
    assert np.all(np.abs(table.q[:, robot.continuous]) <= np.pi + 1e-6)


def test_planar_contacts_of_link_2_are_those_of_the_law_of_cosines(planar: Robot, planar_table: Table) -> None:
    """A ball beyond both links touches the tip only: then |p| = |L1 + L2 e^(i q2)| up to the radius."""
    points = points_of(planar_table)
    far = np.hypot(points[:, 0], points[:, 1]) > 2.5
    tips = np.array([planar.tip_position(q.astype(np.float64)) for q in planar_table.q[far]])
    elbows = 2.0 * np.stack([np.cos(planar_table.q[far, 0]), np.sin(planar_table.q[far, 0])], axis=1)
    assert far.sum() > 20
    along = tips[:, :2] - elbows
    share = np.clip(np.einsum("ij,ij->i", points[far, :2] - elbows, along) / 4.0, 0.0, 1.0)
    gap = np.linalg.norm(points[far, :2] - elbows - share[:, None] * along, axis=1)
    np.testing.assert_allclose(gap, 0.05, atol=2e-5)


def test_at_most_twenty_entries_of_a_piece_at_a_point_and_no_two_alike(planar_table: Table) -> None:
    for i in range(len(planar_table.first) - 1):
        part = slice(planar_table.first[i], planar_table.first[i + 1])
        for piece in np.unique(planar_table.piece[part]):
            q = planar_table.q[part][planar_table.piece[part] == piece]
            assert len(q) <= 20
            apart = np.linalg.norm(q[:, None] - q[None], axis=2) + 10.0 * np.eye(len(q))
            assert apart.min() > 0.0199


def test_the_grid_fills_the_reach_and_is_flat_for_a_planar_arm(planar: Robot) -> None:
    flat = workspace_grid(body_of(planar), 10, 0.05)
    assert list(flat.shape) == [10, 10, 1]
    assert flat.points()[:, 2] == pytest.approx(0.0, abs=1e-6)
    franka = load_robot("franka")
    grid = workspace_grid(body_of(franka), 22, 0.05)
    assert grid.size >= 20**3
    low, high = grid.origin - 0.5 * grid.spacing, grid.origin + (grid.shape - 0.5) * grid.spacing
    tips = franka.tip_path(np.random.default_rng(1).uniform(franka.lower, franka.upper, (500, franka.n)))
    assert np.all((tips > low) & (tips < high))


def test_the_number_of_threads_changes_nothing(planar: Robot, planar_table: Table, tmp_path: Path) -> None:
    parameters = BuildParameters(resolution=6, starts=24)
    same(build_table(planar, parameters, tmp_path / "two.safetensors", jobs=2), planar_table)


def test_another_seed_gives_other_entries(planar: Robot, planar_table: Table, tmp_path: Path) -> None:
    other = small_table(planar, tmp_path, seed=1)
    assert not np.array_equal(other.q, planar_table.q)


def test_an_interrupted_build_goes_on_and_ends_the_same(
    planar: Robot, planar_table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build_module, "CHUNK", 4)
    target, parameters = tmp_path / "t.safetensors", BuildParameters(resolution=6, starts=24)

    calls = itertools.count()

    def interrupted(*arguments: Any) -> Any:
        if next(calls) >= 4:
            raise KeyboardInterrupt
        return chunk_contacts(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(build_module, "chunk_contacts", interrupted)
        with pytest.raises(KeyboardInterrupt):
            build_table(planar, parameters, target, jobs=2)
    kept = sorted((tmp_path / "t.safetensors.partial").glob("*.chunk"))
    assert len(kept) == 4
    kept[0].write_bytes(kept[0].read_bytes()[:-3])  # a chunk that was damaged is searched again
    seen: list[int] = []
    table = build_table(planar, parameters, target, jobs=2, progress=lambda done, total: seen.append(done))
    assert seen[0] == 4 * 3
    assert seen[-1] == 36
    same(table, planar_table)
    forget_chunks(target)
    assert list(tmp_path.iterdir()) == []


def test_chunks_of_other_parameters_are_not_used(planar: Robot, planar_table: Table, tmp_path: Path) -> None:
    target = tmp_path / "t.safetensors"
    build_table(planar, BuildParameters(resolution=6, starts=24, radius=0.2), target, jobs=1)
    same(build_table(planar, BuildParameters(resolution=6, starts=24), target, jobs=1), planar_table)


def test_chunks_that_are_none_are_searched_again(planar: Robot, planar_table: Table, tmp_path: Path) -> None:
    """Whole files, with a checksum that fits, which no build of this robot writes."""
    target, parameters = tmp_path / "t.safetensors", BuildParameters(resolution=6, starts=24)
    build_table(planar, parameters, target, jobs=1)
    chunk = tmp_path / "t.safetensors.partial" / "00000.chunk"
    good = read_file(chunk)[0]
    for name, array in (("count", good["count"] + np.int16(1)), ("q", good["q"] * np.float32("nan")), ("x", good["q"])):
        write_file(chunk, {**good, name: array}, {})
        same(build_table(planar, parameters, target, jobs=1), planar_table)


def test_a_folder_in_the_place_of_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "t.safetensors.partial" / "key").mkdir(parents=True)
    with pytest.raises(InputError, match="key: Is a directory") as caught, PartialBuild(tmp_path / "t.safetensors", {}):
        pass
    assert "remove" in str(caught.value)


def test_two_builds_of_one_table_do_not_mix(tmp_path: Path) -> None:
    target = tmp_path / "t.safetensors"
    with PartialBuild(target, {"a": 1}), pytest.raises(InputError, match="another build"), PartialBuild(target, {}):
        pass


@pytest.mark.parametrize(
    "wrong", [{"resolution": 1}, {"starts": 2}, {"seed": -1}, {"radius": 0.0}, {"radius": float("nan")}]
)
def test_parameters_out_of_range_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        BuildParameters(**wrong)


def same(a: Table, b: Table) -> None:
    for name in a.members():
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
