"""The support function against brute force, for sets that scan and hulls that climb."""

from __future__ import annotations

import numpy as np
import pytest

from cdfctl.fields.kernel.sets import SCAN_LIMIT, pack, support
from cdfctl.robots.convex import ConvexSet, convex_hull


def directions(count: int) -> np.ndarray:
    axes = np.concatenate([np.eye(3), -np.eye(3), [[1, 1, 0], [1, -1, 1], [0, 0, 1e-9]]])
    return np.concatenate([axes, np.random.default_rng(1).normal(size=(count, 3))])


@pytest.mark.parametrize("count", [30, 150, 700, 3000])
def test_climbing_finds_the_farthest_vertex(geometry, count):
    s = geometry.hull(count)
    sets = pack([geometry.ball(0.1), s])
    assert sets.info["table"][1] >= 0
    for n in directions(2000):
        assert np.dot(support(sets, 1, tuple(n)), n) == pytest.approx((s.vertices @ n).max(), rel=1e-12, abs=1e-15)


def test_climbing_copes_with_faces_full_of_vertices(geometry):
    s = geometry.lattice(6)
    assert len(s.vertices) > SCAN_LIMIT
    sets = pack([s])
    for n in directions(500):
        assert np.dot(support(sets, 0, tuple(n)), n) == pytest.approx((s.vertices @ n).max(), abs=1e-12)


def test_a_flat_set_of_many_vertices_climbs_too():
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    s = ConvexSet(np.stack([np.cos(angle), np.sin(angle), np.zeros(60)], axis=1))
    sets = pack([s])
    for n in directions(200):
        assert np.dot(support(sets, 0, tuple(n)), n) == pytest.approx((s.vertices @ n).max(), abs=1e-12)


@pytest.mark.parametrize("direction", [(0.3, -0.4, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
def test_a_disc_adds_its_rim(geometry, direction):
    s = geometry.segment(0.3, disc=0.2)
    point = support(pack([s]), 0, direction)
    assert np.dot(point, direction) == pytest.approx(geometry.height(s, np.array(direction)), abs=1e-15)


def test_bounds_hold_the_core(geometry):
    sets = [geometry.ball(0.1), geometry.segment(0.3, disc=0.2), geometry.box(0.1, 0.2, 0.3), geometry.hull(100)]
    packed = pack(sets)
    for i in range(len(sets)):
        info = packed.info[i]
        for n in directions(300):
            point = np.array(support(packed, i, tuple(n)))
            assert np.all(point >= info["lower"] - 1e-15)
            assert np.all(point <= info["upper"] + 1e-15)
            assert np.linalg.norm(point - info["centre"]) <= info["reach"] + 1e-15


def test_no_sets_at_all():
    assert len(pack([]).info) == 0


@pytest.mark.parametrize("decimals", [1, 9])
def test_faces_that_are_known_serve_as_those_found(decimals):
    points = np.random.default_rng(2).normal(size=(300, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    vertices, faces = convex_hull(points.round(decimals))  # rounded: sides with many corners
    assert len(vertices) > SCAN_LIMIT
    sets = pack([ConvexSet(vertices, faces=faces)])
    for n in directions(500):
        assert np.dot(support(sets, 0, tuple(n)), n) == pytest.approx((vertices @ n).max(), abs=1e-12)
