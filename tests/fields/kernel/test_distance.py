"""Signed distance of convex sets against coal, qhull, closed forms and the laws it must obey."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

EXACT = 1e-9  # m: what is asked of the kernel


@pytest.fixture(scope="module")
def solids(geometry):
    return {
        "ball": geometry.ball(0.05),
        "capsule": geometry.segment(0.2, radius=0.04),
        "box": geometry.box(0.1, 0.2, 0.06),
        "hull": geometry.hull(60),
        "large hull": geometry.hull(500, seed=1),
        "cylinder": geometry.segment(0.15, disc=0.06),
    }


def placements(geometry, count: int, scale: float, seed: int):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield geometry.random_rotation(rng), scale * rng.normal(size=3)


def pairs(*names: str) -> list[tuple[str, str]]:
    return list(itertools.combinations_with_replacement(names, 2))


def check(geometry, a, b, rotation, translation):
    """The contact, after checks that need no referee: unit normal, witnesses d apart along it, a certified bound.

    Any unit normal bounds the distance from below; where it equals d, and the witnesses are d apart, d is the distance.
    """
    c = geometry.measure(a, b, rotation, translation)
    n = np.array(c.normal)
    assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(np.array(c.b) - c.a, c.d * n, atol=1e-9)
    assert geometry.separation(a, b, rotation, translation, n) == pytest.approx(c.d, abs=EXACT)
    return c


@pytest.mark.parametrize(("one", "two"), pairs("ball", "capsule", "box", "hull", "large hull", "cylinder"))
def test_equals_coal_where_sets_are_apart(geometry, solids, one, two):
    a, b = solids[one], solids[two]
    for rotation, translation in placements(geometry, 60, 0.3, seed=0):
        c = check(geometry, a, b, rotation, translation)
        if c.d > 0:
            # coal's own tolerance on curved shapes is the looser one
            tolerance = 1e-6 if "cylinder" in (one, two) else EXACT
            assert c.d == pytest.approx(geometry.coal_distance(a, b, rotation, translation), abs=tolerance)


@pytest.mark.parametrize("one", ["ball", "capsule", "box", "hull"])
@pytest.mark.parametrize("two", ["box", "hull"])  # the cores of balls and capsules alone have no inside
def test_equals_the_hull_of_differences_in_penetration(geometry, solids, one, two):
    a, b = solids[one], solids[two]
    overlapping = 0
    for rotation, translation in placements(geometry, 150, 0.03, seed=1):
        c = check(geometry, a, b, rotation, translation)
        if c.d < -a.radius - b.radius:
            overlapping += 1
            assert c.d == pytest.approx(geometry.hull_distance(a, b, rotation, translation), abs=EXACT)
            assert c.d == pytest.approx(geometry.coal_distance(a, b, rotation, translation), abs=1e-6)
    assert overlapping > 20


def test_large_hulls_in_penetration(geometry, solids):
    a, b = solids["large hull"], solids["hull"]
    for rotation, translation in placements(geometry, 8, 0.03, seed=2):
        c = check(geometry, a, b, rotation, translation)
        assert c.d == pytest.approx(geometry.hull_distance(a, b, rotation, translation), abs=EXACT)


def test_ball_in_a_cylinder_has_a_closed_form(geometry):
    a, b = geometry.segment(0.15, disc=0.06), geometry.ball(0.02)
    rng = np.random.default_rng(3)
    for _ in range(2000):
        t = rng.uniform([-0.04, -0.04, -0.074], [0.04, 0.04, 0.074])
        depth = min(0.06 - np.hypot(t[0], t[1]), 0.075 - abs(t[2]))
        assert geometry.measure(a, b, np.eye(3), t).d == pytest.approx(-depth - 0.02, abs=EXACT)


@pytest.mark.parametrize("t", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.01), (1e-6, 0.0, 0.0), (0.0, 0.0, 0.015)])
def test_ball_on_the_axis_of_a_cylinder(geometry, t):
    """No direction is the nearest one there; every one that is found must be as good."""
    a, b = geometry.segment(0.15, disc=0.06), geometry.ball(0.02)
    depth = min(0.06 - np.hypot(t[0], t[1]), 0.075 - abs(t[2]))
    assert geometry.measure(a, b, np.eye(3), np.array(t)).d == pytest.approx(-depth - 0.02, abs=1e-8)


def test_cylinders_in_penetration_are_at_their_best_direction(geometry, solids):
    """No direction found by a local search from many starts separates the two better than the kernel's."""
    rng = np.random.default_rng(4)
    for other in ("cylinder", "box", "capsule"):
        a, b = solids["cylinder"], solids[other]
        for rotation, translation in placements(geometry, 4, 0.04, seed=5):
            c = check(geometry, a, b, rotation, translation)
            starts = rng.normal(size=(400, 3))
            values = [geometry.separation(a, b, rotation, translation, n / np.linalg.norm(n)) for n in starts]
            best = max(values)
            for k in np.argsort(values)[-3:]:
                found = minimize(
                    lambda n: -geometry.separation(a, b, rotation, translation, n / np.linalg.norm(n)),  # noqa: B023
                    starts[k],
                    method="Nelder-Mead",
                    options={"xatol": 1e-10, "fatol": 1e-12},
                )
                best = max(best, -found.fun)
            assert c.d == pytest.approx(best, abs=1e-6)
            assert c.d >= best - EXACT


@pytest.mark.parametrize(
    ("translation", "d"),
    [((0.3, 0.0, 0.0), 0.1), ((0.05, 0.0, 0.0), -0.15), ((0.0, 0.0, 0.0), -0.2)],
    ids=["apart", "overlapping", "concentric"],
)
def test_two_balls(geometry, translation, d):
    c = check(geometry, geometry.ball(0.15), geometry.ball(0.05), np.eye(3), np.array(translation))
    assert c.d == pytest.approx(d, abs=1e-15)


@pytest.mark.parametrize("turn", [0.0, 1e-12, 1e-8, 1e-4, np.pi / 2])
@pytest.mark.parametrize("offset", [0.0, 1e-13, 1e-9, 0.03, 0.2])
def test_capsules_parallel_crossing_and_on_one_axis(geometry, turn, offset):
    a, b = geometry.segment(0.4, radius=0.03), geometry.segment(0.3, radius=0.05)
    rotation = Rotation.from_rotvec([turn, 0, 0]).as_matrix()
    c = check(geometry, a, b, rotation, np.array([offset, 0.0, 0.0]))
    assert c.d == pytest.approx(offset - 0.08, abs=EXACT)


@pytest.mark.parametrize(
    "where", [(0.05, 0.0, 0.0), (0.05, 0.1, 0.0), (0.05, 0.1, 0.03)], ids=["face", "edge", "corner"]
)
@pytest.mark.parametrize("nudge", [-1e-6, -1e-10, -1e-14, 0.0, 1e-14, 1e-10, 1e-6])
def test_a_ball_about_a_point_of_a_boxs_surface(geometry, where, nudge):
    """The centre of the ball touches the box: core distance zero, yet the distance is smooth through it."""
    t = np.array(where) + np.array([nudge, 0.0, 0.0])
    c = check(geometry, geometry.box(0.1, 0.2, 0.06), geometry.ball(0.02), np.eye(3), t)
    on_another_face = where[1] == 0.1
    assert c.d == pytest.approx((max(nudge, 0.0) if on_another_face else nudge) - 0.02, abs=EXACT)


@pytest.mark.parametrize("shift", [(0.1, 0, 0), (0.1, 0.2, 0), (0.05, 0.02, 0.01), (0, 0, 0), (0.1 - 1e-13, 0, 0)])
def test_aligned_boxes(geometry, shift):
    size, t = np.array([0.1, 0.2, 0.06]), np.array(shift, dtype=float)
    c = check(geometry, geometry.box(*size), geometry.box(*size), np.eye(3), t)
    gap = np.abs(t) - size
    assert c.d == pytest.approx(gap.max() if gap.max() <= 0 else np.linalg.norm(np.maximum(gap, 0)), abs=EXACT)


def test_a_thin_plate(geometry):
    plate = geometry.box(0.5, 0.3, 1e-6)
    assert check(geometry, plate, geometry.ball(0.1), np.eye(3), np.zeros(3)).d == pytest.approx(-0.1 - 5e-7, abs=EXACT)


def test_any_pair_in_any_place(geometry, solids):
    """Aligned, almost aligned, touching and deep: no NaN, no answer without its certificate, no endless search."""
    shapes = [*solids.values(), geometry.lattice(4), geometry.box(0.4, 0.3, 1e-4), geometry.segment(0.2)]
    quarter_turns = Rotation.create_group("O").as_matrix()
    rng = np.random.default_rng(6)
    for k in range(10_000):
        a, b = shapes[rng.integers(len(shapes))], shapes[rng.integers(len(shapes))]
        rotation = quarter_turns[rng.integers(24)] if k % 2 else geometry.random_rotation(rng)
        if k % 6 == 1:
            rotation = Rotation.from_rotvec(rng.normal(size=3) * 10.0 ** -rng.integers(2, 12)).as_matrix()
        translation = rng.normal(size=3) * rng.choice([0.01, 0.05, 0.1, 0.3])
        if k % 4 == 0:
            translation = np.round(translation, rng.integers(1, 3))
        check(geometry, a, b, rotation, translation)


@pytest.mark.parametrize("scale", [0.02, 0.3])
def test_the_guess_changes_nothing(geometry, solids, scale):
    rng = np.random.default_rng(7)
    for rotation, translation in placements(geometry, 100, scale, seed=8):
        a, b = solids["hull"], solids["box"]
        plain = geometry.measure(a, b, rotation, translation)
        guided = geometry.measure(a, b, rotation, translation, guess=tuple(rng.normal(size=3)))
        again = geometry.measure(a, b, rotation, translation, guess=plain.normal)
        assert guided.d == pytest.approx(plain.d, abs=EXACT)
        assert again.d == pytest.approx(plain.d, abs=EXACT)


def test_beyond_the_cutoff_the_answer_is_a_bound(geometry, solids):
    for rotation, translation in placements(geometry, 200, 0.2, seed=9):
        a, b = solids["large hull"], solids["capsule"]
        d = geometry.measure(a, b, rotation, translation).d
        for cutoff in (-0.05, 0.0, 0.1, 0.3):
            answer = geometry.measure(a, b, rotation, translation, cutoff=cutoff).d
            if d > cutoff:
                assert cutoff < answer <= d + EXACT
            else:
                assert answer == pytest.approx(d, abs=EXACT)


names = st.sampled_from(["ball", "capsule", "box", "hull", "cylinder"])
vectors = st.tuples(*[st.floats(-0.25, 0.25)] * 3).map(np.array)
turns = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(lambda v: Rotation.from_rotvec(v).as_matrix())


@settings(max_examples=150)
@given(names, names, turns, vectors)
def test_swapping_the_sets_turns_the_normal_round(geometry, solids, one, two, rotation, translation):
    a, b = solids[one], solids[two]
    c = geometry.measure(a, b, rotation, translation)
    back = geometry.measure(b, a, rotation.T, -rotation.T @ translation)
    assert back.d == pytest.approx(c.d, abs=EXACT)


@settings(max_examples=150)
@given(names, names, turns, vectors, vectors)
def test_the_distance_is_one_lipschitz_in_a_translation(geometry, solids, one, two, rotation, translation, step):
    a, b = solids[one], solids[two]
    before = geometry.measure(a, b, rotation, translation)
    after = geometry.measure(a, b, rotation, translation + step)
    assert abs(after.d - before.d) <= np.linalg.norm(step) + EXACT
    # and no faster than the normal says is lost when moving against it, since any direction bounds from below
    assert after.d >= before.d + np.dot(before.normal, step) - EXACT


@settings(max_examples=100)
@given(names, turns, vectors, turns, vectors)
def test_a_rigid_motion_of_both_changes_nothing(geometry, solids, name, rotation, translation, turn, shift):
    """A hull moved into other coordinates, vertex by vertex, is as far from the other set moved likewise."""
    a, b = solids["hull"], solids[name]
    moved = type(a)(a.vertices @ turn.T + shift)
    d = geometry.measure(a, b, rotation, translation).d
    assert geometry.measure(moved, b, turn @ rotation, turn @ translation + shift).d == pytest.approx(d, abs=EXACT)


def test_the_normal_predicts_a_small_translation(geometry, solids):
    """d grows by the part of a step along the normal: apart and in penetration, away from kinks."""
    step, kinks, total = 1e-6, 0, 0
    for one, two in itertools.product(["hull", "cylinder", "box"], ["ball", "capsule", "hull"]):
        for rotation, translation in placements(geometry, 20, 0.08, seed=10):
            a, b = solids[one], solids[two]
            c = geometry.measure(a, b, rotation, translation)
            for axis in np.eye(3):
                up = geometry.measure(a, b, rotation, translation + step * axis).d
                down = geometry.measure(a, b, rotation, translation - step * axis).d
                total += 1
                kinks += abs((up - down) / (2 * step) - np.dot(c.normal, axis)) > 1e-4
    assert kinks <= 0.01 * total
