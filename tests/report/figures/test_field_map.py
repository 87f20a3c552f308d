"""Fields over two joints against the closed form of the planar arm and discs, and against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.fields.cdf import CDF
from cdfctl.fields.sdf import SDF
from cdfctl.report.figures.field_map import both_maps, level_steps, sample
from cdfctl.robots.robot import load_robot
from cdfctl.types import Obstacle, Scene, Sphere

POINTS = 25
DISCS = (((1.5, 2.0), 0.3), ((-2.0, -1.8), 0.4))
Q = np.linspace(-np.pi, np.pi, POINTS)


@pytest.fixture(scope="module")
def planar():
    return load_robot("planar")


def scene(discs):
    return Scene([Obstacle(Sphere(radius), position=[*centre, 0.0]) for centre, radius in discs])


def signed_distance(q1, q2, centre, radius):
    """Of two segments of 2 m and a disc, in closed form."""
    elbow = 2.0 * np.stack([np.cos(q1), np.sin(q1)], axis=-1)
    tip = elbow + 2.0 * np.stack([np.cos(q1 + q2), np.sin(q1 + q2)], axis=-1)
    least = np.inf
    for start, end in ((np.zeros_like(elbow), elbow), (elbow, tip)):
        along = np.clip(((centre - start) * (end - start)).sum(-1) / 4.0, 0.0, 1.0)[..., None]
        least = np.minimum(least, np.linalg.norm(centre - start - along * (end - start), axis=-1))
    return least - radius


def configuration_distance(discs, points):
    """By brute force: the nearest change of sign of the closed form on a fine grid, whose spacing is 0.006 rad."""
    fine = np.linspace(-np.pi, np.pi, 1001)
    q1, q2 = np.meshgrid(fine, fine)
    edge = np.zeros(q1.shape, dtype=bool)
    for centre, radius in discs:
        inside = signed_distance(q1, q2, centre, radius) < 0.0
        edge[:, 1:] |= inside[:, 1:] != inside[:, :-1]
        edge[1:, :] |= inside[1:, :] != inside[:-1, :]
    contacts = np.stack([q1[edge], q2[edge]], axis=1)
    return np.array([np.linalg.norm(contacts - q, axis=1).min() for q in points])


def grid(values):
    x, y = np.meshgrid(values, values)
    return x, y, np.stack([x.ravel(), y.ravel()], axis=1)


def test_the_signed_distance_is_sampled_in_its_place(planar):
    found = sample(SDF(planar), scene(DISCS), Q, Q[::2])
    q1, q2 = np.meshgrid(Q, Q[::2])
    truth = np.minimum(*(signed_distance(q1, q2, *disc) for disc in DISCS))
    np.testing.assert_allclose(found.d, truth, atol=1e-6)
    assert (np.linalg.norm(sample(SDF(planar), scene(DISCS[:1]), Q, Q).dq, axis=2) < 1e-6).mean() > 0.1, "it is flat"


def test_the_configuration_space_distance_is_that_to_the_zero_set(planar):
    found = sample(CDF(planar), scene(DISCS[:1]), Q, Q)
    x, y, points = grid(Q)
    truth = configuration_distance(DISCS[:1], points).reshape(x.shape)
    truth *= np.where(signed_distance(x, y, *DISCS[0]) < 0.0, -1.0, 1.0)
    # The search may miss the nearest contact of a point here and there; the grid of the truth is 0.006 rad wide.
    assert np.mean(np.abs(found.d - truth) < 0.02) >= 0.99
    assert np.max(np.abs(found.d - truth)) < 0.1
    assert np.mean(np.abs(found.d - truth) < 0.01) > 0.97
    np.testing.assert_allclose(np.linalg.norm(found.dq, axis=2), 1.0, atol=1e-6)


def test_the_map_of_a_run_is_the_distance_to_the_nearest_contact_curve(planar):
    """On the coarsest grid of a run's figure; every point, since nothing is searched for."""
    values = np.linspace(-np.pi, np.pi, 81)
    maps = both_maps(SDF(planar), scene(DISCS), values, values)
    x, y, points = grid(values[::4])
    outside = np.minimum(*(signed_distance(x, y, *disc) for disc in DISCS)) > 0.0
    truth = configuration_distance(DISCS, points).reshape(x.shape)
    found, gradient = maps["cdf"].d[::4, ::4], maps["cdf"].dq[::4, ::4]
    np.testing.assert_allclose(found[outside], truth[outside], atol=0.02)
    assert (found[~outside] <= 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=2)[outside], 1.0, atol=1e-9)
    np.testing.assert_allclose(maps["sdf"].d[::4, ::4][outside], np.minimum(
        *(signed_distance(x, y, *disc) for disc in DISCS))[outside], atol=1e-6)  # fmt: skip


@pytest.mark.parametrize("discs", [(), (((9.0, 0.0), 0.3),)], ids=["none", "out of reach"])
def test_without_a_contact_the_distance_is_infinite(planar, discs):
    maps = both_maps(SDF(planar), scene(discs), Q, Q)
    assert np.isposinf(maps["cdf"].d).all()
    assert maps["cdf"].top == 0.0


@given(st.floats(1e-3, 1e3), st.integers(2, 12))
def test_level_steps_cover_the_range_in_round_steps(top, most):
    steps = level_steps(top, most)
    step = steps[1]
    assert steps[0] == 0.0
    assert steps[-1] >= top * (1 - 1e-9)
    assert len(steps) <= most + 2
    mantissa = step / 10.0 ** np.floor(np.log10(step * (1 + 1e-9)))
    assert np.isclose(mantissa, [1.0, 2.0, 2.5, 5.0]).any()
