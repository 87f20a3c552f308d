"""Contacts proposed by torch and restored by the kernel are as good as the kernel's own."""

from __future__ import annotations

import builtins
from typing import Any

import numpy as np
import pytest

from cdfctl import load_robot
from cdfctl.errors import MissingError
from cdfctl.fields.cdf import CDF
from cdfctl.fields.kernel.body import body_of
from cdfctl.fields.kernel.starts import Table
from cdfctl.fields.table.build import assemble_table, chunk_contacts, random_starts
from cdfctl.fields.table.contacts import new_tools
from cdfctl.fields.table.grid import Grid
from cdfctl.fields.table.proposals import Proposer, torch_for
from cdfctl.robots.robot import Robot
from cdfctl.types import Obstacle, Scene, Sphere

from .table_helpers import link_distance, points_of

RADIUS = 0.05


def table_at(robot: Robot, grid: Grid, device: str, starts: int = 24) -> Table:
    """The table of one small grid; ``numpy`` starts as they are drawn, ``cpu`` ones through torch."""
    body, points = body_of(robot), grid.points()
    draws = np.stack([random_starts(body, 0, i, starts) for i in range(len(points))])
    if device != "numpy":
        pieces = tuple(sorted(robot.pieces, key=lambda piece: piece.link))
        draws = Proposer(body, pieces, RADIUS, device).near_contact(points, draws)
    return assemble_table(grid, [chunk_contacts(body, points, draws, new_tools(body, RADIUS, starts))])


@pytest.fixture(scope="module")
def grid() -> Grid:
    return Grid(np.array([0.3, -0.2, 0.4]), 0.15, np.array([2, 3, 2]))


@pytest.fixture(scope="module")
def tables(grid: Grid) -> dict[str, Table]:
    pytest.importorskip("torch")
    franka = load_robot("franka")
    return {device: table_at(franka, grid, device) for device in ("numpy", "cpu")}


def test_residuals_of_both_are_within_a_tenth_of_a_millimetre(tables: dict[str, Table]) -> None:
    franka = load_robot("franka")
    for table in tables.values():
        assert len(table.piece) > 300
        points = points_of(table)
        for e in np.random.default_rng(0).choice(len(table.piece), 100, replace=False):
            assert abs(link_distance(franka, int(table.piece[e]), table.q[e], points[e], RADIUS)[0]) <= 1e-4


def test_queries_from_either_table_agree(tables: dict[str, Table]) -> None:
    franka = load_robot("franka")
    random = np.random.default_rng(3)
    fields = [CDF(franka, table) for table in tables.values()]
    for _ in range(20):
        q = np.clip(franka.home + random.uniform(-0.5, 0.5, franka.n), franka.lower, franka.upper)
        scene = Scene([Obstacle(Sphere(RADIUS), random.uniform([0.25, -0.25, 0.35], [0.5, 0.2, 0.6]))])
        answers = []
        for field in fields:
            field.reset()
            answers.append(float(field.query(q, scene).d[0]))
        assert answers[0] == pytest.approx(answers[1], abs=0.01)


@pytest.mark.parametrize("name", ["planar", "franka", "kinova", "z1"])
def test_proposals_are_nearer_to_contact_and_within_the_limits(name: str) -> None:
    pytest.importorskip("torch")
    robot = load_robot(name)
    body, link = body_of(robot), len(robot.links) - 1
    pieces = tuple(sorted(robot.pieces, key=lambda piece: piece.link))
    point = robot.tip_position(robot.home)
    draws = random_starts(body, 0, 0, 40)[None]
    moved = Proposer(body, pieces, RADIUS, "cpu").near_contact(point[None], draws)
    assert np.all((moved >= robot.lower - 1e-6) & (moved <= robot.upper + 1e-6))

    def gaps(starts: np.ndarray) -> np.ndarray:
        return np.array([np.min(np.abs(link_distance(robot, link, q, point, RADIUS))) for q in starts[0, -1]])

    assert np.median(gaps(moved)) < 0.5 * np.median(gaps(draws))


def test_without_torch_the_error_names_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def no_torch(name: str, *arguments: Any, **named: Any) -> Any:
        if name == "torch":
            raise ImportError(name)
        return real(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", no_torch)
    with pytest.raises(MissingError, match="not installed") as caught:
        torch_for("cpu")
    assert "pip install 'cdfctl[torch]'" in str(caught.value)


def test_without_a_gpu_cuda_is_refused() -> None:
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("this machine has a GPU")
    with pytest.raises(MissingError, match="GPU"):
        torch_for("cuda")
