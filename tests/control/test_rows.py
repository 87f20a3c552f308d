"""Constraint rows symbol by symbol, on an arm whose every quantity can be written down by hand.

The arm: one revolute joint at the origin, a thin link of length L along x at q = 0. The obstacle: a ball of radius r at
distance c along y, above the link's tip (c > L), moving at v along y. At angle q the tip is the nearest point, so

    d = sqrt(L^2 cos^2 q + (c - L sin q)^2) - r
    dd/dq = -L c cos q / (d + r),        dd/dt = v (c - L sin q) / (d + r)
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.control.rows import cbf_rows, hyperplane_rows, joint_limit_box, stack, tvcbf_rows, tvclf_row, usable
from cdfctl.types import FieldQuery

L, C, RADIUS, V = 1.0, 1.6, 0.3, -0.7


def one_joint_query(q: float) -> FieldQuery:
    far = np.hypot(L * np.cos(q), C - L * np.sin(q))
    return FieldQuery(
        obstacle=np.zeros(1, dtype=np.int64),
        link=np.zeros(1, dtype=np.int64),
        d=np.array([far - RADIUS]),
        dq=np.array([[-L * C * np.cos(q) / far]]),
        dt=np.array([V * (C - L * np.sin(q)) / far]),
        valid=np.ones(1, dtype=np.bool_),
        contact_q=np.full((1, 1), np.nan),
        unit="m",
    )


def rows_query(d: list[float], valid: list[bool]) -> FieldQuery:
    r = len(d)
    return FieldQuery(
        obstacle=np.arange(r),
        link=np.zeros(r, dtype=np.int64),
        d=np.array(d),
        dq=np.arange(2.0 * r).reshape(r, 2),
        dt=np.arange(r, dtype=np.float64),
        valid=np.array(valid),
        contact_q=np.full((r, 2), np.nan),
        unit="rad",
    )


def test_hand_derivatives_are_right() -> None:
    """The reference itself against finite differences."""
    q, e = 0.4, 1e-6
    query = one_joint_query(q)
    difference = (one_joint_query(q + e).d[0] - one_joint_query(q - e).d[0]) / (2 * e)
    assert query.dq[0, 0] == pytest.approx(difference, rel=1e-6)


def test_tvcbf_symbol_by_symbol() -> None:
    q, alpha, margin = 0.4, 2.0, 0.05
    rows = tvcbf_rows(one_joint_query(q), alpha, margin)
    far = np.hypot(L * np.cos(q), C - L * np.sin(q))
    h = far - RADIUS - margin
    assert rows.G[0] == pytest.approx([L * C * np.cos(q) / far])
    assert rows.rhs == pytest.approx([alpha * h + V * (C - L * np.sin(q)) / far])
    assert rows.soft.tolist() == [True]
    assert rows.delta.tolist() == [0.0]


def test_tvcbf_on_its_boundary_makes_the_barrier_decay_at_alpha() -> None:
    """At the greatest u the row allows, d/dt h along the motion of arm and ball is exactly -alpha h."""
    q, alpha, margin, e = 0.4, 2.0, 0.05, 1e-6
    rows = tvcbf_rows(one_joint_query(q), alpha, margin)
    u = rows.rhs[0] / rows.G[0, 0]

    def h(t: float) -> float:
        angle = q + u * t
        return float(np.hypot(L * np.cos(angle), C + V * t - L * np.sin(angle))) - RADIUS - margin

    assert (h(e) - h(-e)) / (2 * e) == pytest.approx(-alpha * h(0.0), rel=1e-6)


def test_cbf_is_tvcbf_of_a_frozen_scene() -> None:
    query = one_joint_query(0.4)
    frozen = FieldQuery(**{**query.__dict__, "dt": np.zeros(1)})
    with_time, without = tvcbf_rows(frozen, 1.5, 0.05), cbf_rows(query, 1.5, 0.05)
    assert without.G.tolist() == with_time.G.tolist()
    assert without.rhs.tolist() == with_time.rhs.tolist()


def test_hyperplane_symbol_by_symbol() -> None:
    q, offset, dt = 0.4, 0.3, 0.1
    rows = hyperplane_rows(one_joint_query(q), offset, dt)
    far = np.hypot(L * np.cos(q), C - L * np.sin(q))
    assert rows.G[0] == pytest.approx([L * C * np.cos(q) / far * dt])
    assert rows.rhs == pytest.approx([np.log(far - RADIUS + offset)])


def test_hyperplane_without_logarithm_allows_nothing() -> None:
    rows = hyperplane_rows(rows_query([-0.3, -0.5, 0.7], [True] * 3), 0.3, 0.1)
    assert rows.rhs[:2].tolist() == [-np.inf, -np.inf]
    assert rows.rhs[2] == pytest.approx(0.0)


def test_tvclf_symbol_by_symbol() -> None:
    """The ball of this file as a target: V where it is, V+ where it will be."""
    q, gamma, dt = 0.4, 1.5, 0.1
    now = float(np.hypot(L * np.cos(q), C - L * np.sin(q))) - RADIUS
    then = float(np.hypot(L * np.cos(q), C + V * dt - L * np.sin(q))) - RADIUS
    ahead = rows_query([then], [True])
    rows = tvclf_row(now, ahead, gamma, dt)
    assert rows.G.tolist() == ahead.dq.tolist()
    assert rows.rhs == pytest.approx([-gamma * now - (then - now) / dt])
    assert rows.delta.tolist() == [1.0]
    assert rows.soft.tolist() == [False]


def test_tvclf_out_of_reach_gives_no_row_or_none_of_time() -> None:
    assert tvclf_row(0.7, rows_query([np.inf], [False]), 1.0, 0.1).G.shape == (0, 2)
    assert tvclf_row(np.inf, rows_query([0.5], [True]), 2.0, 0.1).rhs == pytest.approx([-1.0])


def test_only_valid_and_finite_rows_take_part() -> None:
    query = rows_query([0.1, np.inf, 0.2, 0.3], [True, True, False, True])
    assert usable(query).tolist() == [True, False, False, True]
    for rows in (tvcbf_rows(query, 1.0, 0.0), cbf_rows(query, 1.0, 0.0), hyperplane_rows(query, 1.0, 0.1)):
        assert rows.G.shape == (2, 2)
        assert np.isfinite(rows.rhs).all()
    assert tvcbf_rows(query, 1.0, 0.0).G.tolist() == [[0.0, -1.0], [-6.0, -7.0]]


def test_stack() -> None:
    first, second = (tvcbf_rows(rows_query([0.1, 0.2], [True, True]), 1.0, 0.0) for _ in range(2))
    both = stack([first, second], 2)
    assert both.G.shape == (4, 2)
    assert stack([], 3).G.shape == (0, 3)
    assert stack([first], 2) is first


def test_joint_limit_box_by_hand() -> None:
    q = np.array([0.5, 2.9, -3.2, 1.0])
    lower, upper = np.array([-3.0, -3.0, -3.0, -np.inf]), np.array([3.0, 3.0, 3.0, np.inf])
    low, high = joint_limit_box(q, lower, upper, np.full(4, -2.0), np.full(4, 2.0), 3.0)
    assert low == pytest.approx([-2.0, -2.0, 0.6, -2.0])  # the third joint, 0.2 under its limit, returns at 0.6
    assert high == pytest.approx([2.0, 0.3, 2.0, 2.0])


@given(
    st.floats(-20, 20),
    st.floats(-10, 10),
    st.floats(0, 10),
    st.floats(0.01, 5),
    st.floats(0.01, 10),
    st.floats(0.001, 0.2),
)
def test_joint_limit_box_is_never_empty_and_keeps_the_joint_inside(
    q: float, lower: float, width: float, speed: float, alpha: float, dt: float
) -> None:
    upper = lower + width
    low, high = (
        float(x[0]) for x in joint_limit_box(*(np.array([x]) for x in (q, lower, upper, -speed, speed)), alpha)
    )
    assert -speed <= low <= high <= speed
    if lower <= q <= upper and alpha * dt <= 1.0:
        assert q + low * dt >= lower - 1e-12 * (1 + abs(lower))
        assert q + high * dt <= upper + 1e-12 * (1 + abs(upper))
    if q < lower - 1e-9:  # less is lost in rounding
        assert low > 0.0
    if q > upper + 1e-9:
        assert high < 0.0
