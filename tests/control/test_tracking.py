"""Estimates against least squares over all measurements, and against motions that are not straight."""

from __future__ import annotations

import numpy as np

from cdfctl.control.tracking import SLOW, Tracker
from cdfctl.types import Scene, Sphere

DT, NOISE, SHARE = 0.1, 0.01, 0.15
SHAPES, NAMES = (Sphere(0.1),), ("a",)


def seen(p, v):
    return Scene.from_arrays(
        SHAPES, NAMES, np.array([[*p, 0.0, 0.0, 0.0, 1.0]]), np.array([[*v, 0.0, 0.0, 0.0]], dtype=float)
    )


def believed(positions, velocities):
    tracker = Tracker(DT, NOISE, SHARE)
    scenes = [tracker.update(seen(p, v)) for p, v in zip(positions, velocities, strict=True)]
    return np.array([s.poses[0, :3] for s in scenes]), np.array([s.twists[0, :3] for s in scenes])


def test_it_is_least_squares_over_all_that_was_measured(monkeypatch):
    """Without drift: p_0 and b minimise the squares of all positions and of b, each over its variance."""
    monkeypatch.setattr("cdfctl.control.tracking.DRIFT", 0.0)
    random = np.random.default_rng(0)
    told, true = np.array([1.1, 0.2, 0.0]), np.array([1.0, 0.0, 0.0])
    k = np.arange(12)
    z = k[:, None] * DT * true + NOISE * random.standard_normal((12, 3))
    p, v = believed(z, np.tile(told, (12, 1)))
    # z_k = p_0 + (told - b) k DT + noise; the first position is the prior of p_0
    spread = np.hypot(SHARE * np.linalg.norm(told), SLOW)
    A = np.vstack([np.column_stack([np.ones(12), -k * DT]) / NOISE, [0.0, 1.0 / spread]])
    y = np.vstack([(z - k[:, None] * DT * told) / NOISE, np.zeros(3)])
    (p0, b), *_ = np.linalg.lstsq(A, y, rcond=None)
    np.testing.assert_allclose(v[-1], told - b, atol=1e-9)
    np.testing.assert_allclose(p[-1], p0 + 11 * DT * (told - b), atol=1e-9)


def test_a_wrong_velocity_is_found_out_within_a_second():
    """The errors of a scenario: 20 %, 10 degrees, 1 cm."""
    random, left = np.random.default_rng(1), []
    for _ in range(50):
        angle, turn = random.uniform(0.0, 6.28), np.radians(random.uniform(-10.0, 10.0))
        true = 1.5 * np.array([np.cos(angle), np.sin(angle), 0.0])
        told = 1.5 * random.uniform(0.8, 1.2) * np.array([np.cos(angle + turn), np.sin(angle + turn), 0.0])
        z = np.arange(11)[:, None] * DT * true + 0.01 * random.standard_normal((11, 3))
        v = believed(z, np.tile(told, (11, 1)))[1]
        left.append([np.linalg.norm(v[k] - true) for k in (0, 10)])
    first, last = np.sqrt(np.mean(np.square(left), axis=0))
    assert first > 0.15
    assert last < 0.2 * first


def sway(t):
    return np.column_stack([0.3 * np.sin(4.0 * t), np.cos(4.0 * t), 0.1 * t])


def sway_rate(t):
    return np.column_stack([1.2 * np.cos(4.0 * t), -4.0 * np.sin(4.0 * t), np.full_like(t, 0.1)])


def test_what_is_exact_stays_as_it_is_however_it_moves():
    t = DT * np.arange(30)
    p, v = believed(sway(t), sway_rate(t))
    np.testing.assert_allclose(p, sway(t), atol=0.01)
    np.testing.assert_allclose(v, sway_rate(t), atol=0.08)
    straight = np.outer(t, [1.0, -2.0, 0.0])
    p, v = believed(straight, np.tile([1.0, -2.0, 0.0], (30, 1)))
    np.testing.assert_allclose(p, straight, atol=1e-12)
    np.testing.assert_allclose(v, np.tile([1.0, -2.0, 0.0], (30, 1)), atol=1e-12)


def test_a_corner_between_two_measurements_is_followed():
    t = DT * np.arange(20)
    before, after = np.array([2.0, 0.0, 0.0]), np.array([0.0, -2.0, 0.0])
    corner = 0.93
    p = np.where(t[:, None] < corner, np.outer(t, before), corner * before + np.outer(t - corner, after))
    v = np.where(t[:, None] < corner, before, after)
    found = believed(p, v)
    np.testing.assert_allclose(found[0], p, atol=0.01)
    np.testing.assert_allclose(found[1], v, atol=0.1)


def test_a_velocity_that_is_not_measured_at_all_is_found():
    t = DT * np.arange(15)
    v = believed(np.outer(t, [0.5, 0.0, 0.0]), np.zeros((15, 3)))[1]
    np.testing.assert_allclose(v[-1], [0.5, 0.0, 0.0], atol=0.01)


def test_what_is_held_teaches_nothing_and_what_jumps_begins_anew():
    tracker = Tracker(DT)
    for k in range(5):
        last = tracker.update(seen([0.1 * k, 0.0, 0.0], [1.2, 0.0, 0.0]))
    held = [tracker.update(seen([0.4, 0.0, 0.0], [1.2, 0.0, 0.0])) for _ in range(3)][-1]
    np.testing.assert_array_equal(held.poses, last.poses)
    np.testing.assert_array_equal(held.twists, last.twists)
    again = tracker.update(seen([0.8, 0.0, 0.0], [1.2, 0.0, 0.0]))  # where it should be, after 0.4 s
    np.testing.assert_allclose(again.poses[0, 0], 0.8, atol=0.02)
    far = seen([5.0, 0.0, 0.0], [1.2, 0.0, 0.0])
    begun = tracker.update(far)
    np.testing.assert_array_equal(begun.poses, far.poses)
    np.testing.assert_array_equal(begun.twists, far.twists)


def test_other_obstacles_and_a_reset_begin_anew():
    tracker, wrong = Tracker(DT), [1.5, 0.0, 0.0]
    for k in range(5):
        tracker.update(seen([0.1 * k, 0.0, 0.0], wrong))
    other = Scene.from_arrays(SHAPES, ("b",), np.array([[0.5, 0, 0, 0, 0, 0, 1.0]]), np.array([[*wrong, 0, 0, 0.0]]))
    assert tracker.update(other) is other
    tracker.reset()
    assert tracker.update(other) is other
