"""The report of a table: the same for any number of threads, and it notices a bad table."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from cdfctl import load_robot
from cdfctl.fields.kernel.body import body_of
from cdfctl.fields.kernel.starts import Table
from cdfctl.fields.table.accuracy import Accuracy, HeldOut, measure_accuracy
from cdfctl.robots.robot import Robot

from .table_helpers import link_distance, points_of, small_table

POINTS = 40


@pytest.fixture(scope="module")
def planar() -> Robot:
    return load_robot("planar")


@pytest.fixture(scope="module")
def table(planar: Robot, tmp_path_factory: pytest.TempPathFactory) -> Table:
    return small_table(planar, tmp_path_factory.mktemp("planar"), resolution=8)


@pytest.fixture(scope="module")
def report(planar: Robot, table: Table) -> Accuracy:
    return measure_accuracy(planar, table, 0.05, 0, points=POINTS, jobs=1)


def test_threads_change_nothing_and_the_document_reads_back(planar: Robot, table: Table, report: Accuracy) -> None:
    assert measure_accuracy(planar, table, 0.05, 0, points=POINTS, jobs=3) == report
    assert Accuracy.of_document(json.loads(json.dumps(report.document()))) == report


def test_the_residual_is_that_of_the_entries(planar: Robot, table: Table, report: Accuracy) -> None:
    every = [
        abs(link_distance(planar, int(piece), q, point, 0.05)[0])
        for piece, q, point in zip(table.piece, table.q, points_of(table), strict=True)
    ]
    assert report.residual.max <= max(every) + 1e-12
    assert report.residual.max <= 1e-4
    wrong = replace(table, q=table.q + np.float32(0.01))
    assert measure_accuracy(planar, wrong, 0.05, 0, points=1, jobs=1).residual.max > 1e-3


def test_coverage_is_of_points_the_arm_can_reach(report: Accuracy) -> None:
    """The disc of radius 4.05 fills at most pi/4 of the square, and a cell at its rim may have no entries."""
    coverage = report.coverage
    assert coverage.points == POINTS
    assert 0 < coverage.reachable <= POINTS
    assert coverage.covered >= 0.8 * coverage.reachable


def test_a_table_without_entries_covers_nothing_and_adds_nothing(planar: Robot, table: Table) -> None:
    count = len(table.first)
    empty = replace(table, first=np.zeros(count, dtype=np.int64), piece=table.piece[:0].copy(), q=table.q[:0].copy())
    bare = measure_accuracy(planar, empty, 0.05, 0, points=POINTS, jobs=1)
    ways = {way.way: way for way in bare.comparison}
    assert bare.coverage.covered == 0
    assert bare.residual.entries == 0
    assert ways["table alone"].missed == ways["table alone"].pairs
    assert ways["cold, table"].mean == ways["cold, no table"].mean


def test_refined_queries_beat_the_table_alone(report: Accuracy) -> None:
    ways = {way.way: way for way in report.comparison}
    assert ways["cold, table"].within >= 0.8
    assert ways["cold, table"].within > ways["table alone"].within


def test_the_truth_is_the_least_distance_on_a_fine_grid(planar: Robot, table: Table) -> None:
    """From a q that is clear the way to any configuration in penetration crosses a contact, so the least distance to
    those on a grid is the truth up to the grid's step."""
    judge = HeldOut(body_of(planar), table, 0.3, 0)
    grid = np.linspace(-np.pi, np.pi, 1001)
    q1, q2 = np.meshgrid(grid, grid, indexing="ij")
    elbow = np.stack([2 * np.cos(q1), 2 * np.sin(q1)], axis=-1)
    tip = elbow + np.stack([2 * np.cos(q1 + q2), 2 * np.sin(q1 + q2)], axis=-1)
    compared = 0
    for index in range(25):
        answers = judge.answers(index)
        if answers is None:
            continue
        radius = np.sqrt(0.3**2 - answers.point[2] ** 2)
        gap1, gap2 = (gap(a, b, answers.point[:2]) - radius for a, b in ((np.zeros_like(elbow), elbow), (elbow, tip)))
        by_link1 = np.abs(q1 - answers.q[0])[gap1 <= 0.0]
        by_link2 = np.hypot(q1 - answers.q[0], q2 - answers.q[1])[gap2 <= 0.0]
        assert answers.truth == pytest.approx(min(by_link1.min(initial=np.inf), by_link2.min()), abs=0.02)
        compared += 1
    assert compared >= 5


def gap(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
    along = b - a
    share = np.clip(np.sum((p - a) * along, axis=-1) / np.sum(along * along, axis=-1), 0.0, 1.0)
    return np.linalg.norm(p - a - share[..., None] * along, axis=-1)
