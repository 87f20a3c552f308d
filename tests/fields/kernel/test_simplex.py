"""The nearest point of a simplex against a search of all its faces."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cdfctl.fields.kernel.simplex import nearest_on_segment, nearest_on_tetrahedron, nearest_on_triangle

NEAREST = {2: nearest_on_segment, 3: nearest_on_triangle, 4: nearest_on_tetrahedron}


def nearest_norm(vertices: np.ndarray) -> float:
    """Brute force: the point nearest to the origin in the plane of every subset, where it lies in the subset's hull."""
    best = np.inf
    for size in range(1, len(vertices) + 1):
        for subset in itertools.combinations(vertices, size):
            base, edges = subset[0], np.array(subset[1:]).reshape(-1, 3) - subset[0]
            t = np.linalg.lstsq(edges.T, -base, rcond=None)[0] if size > 1 else np.zeros(0)
            if np.all(t >= 0) and t.sum() <= 1:
                best = min(best, float(np.linalg.norm(base + t @ edges)))
    return best


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("shift", [0.0, 0.5, 3.0])
def test_random_simplices(count, shift):
    rng = np.random.default_rng(count)
    for _ in range(300):
        vertices = rng.normal(size=(count, 3)) + shift * rng.normal(size=3)
        point, weights = NEAREST[count](*(tuple(v) for v in vertices))
        weights = np.array(weights[:count])
        assert np.all(weights >= 0)
        assert weights.sum() == pytest.approx(1.0)
        np.testing.assert_allclose(weights @ vertices, point, atol=1e-12)
        assert np.linalg.norm(point) == pytest.approx(nearest_norm(vertices), abs=1e-9)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_simplices_without_extent(count):
    """Repeated, collinear and coplanar vertices: the answer must still be the nearest point."""
    rng = np.random.default_rng(10 + count)
    for _ in range(300):
        directions = rng.normal(size=(1 + rng.integers(2), 3)) * (rng.random() > 0.2)
        vertices = rng.normal(size=3) + np.round(rng.normal(size=(count, len(directions))), 1) @ directions
        point, weights = NEAREST[count](*(tuple(v) for v in vertices))
        np.testing.assert_allclose(np.array(weights[:count]) @ vertices, point, atol=1e-9)
        assert np.linalg.norm(point) == pytest.approx(nearest_norm(vertices), abs=1e-9)


def test_the_origin_inside_a_tetrahedron():
    point, weights = nearest_on_tetrahedron((1.0, 0.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, -1.0), (0.0, 0.0, 2.0))
    assert point == (0.0, 0.0, 0.0)
    assert all(w > 0 for w in weights)
