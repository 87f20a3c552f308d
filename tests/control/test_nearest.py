"""Least barrier and nearest contact of each obstacle, against a look at its rows one by one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.control.nearest import least_barrier, nearest_contact
from cdfctl.types import Array, FieldQuery


def query_of(rng: np.random.Generator, m: int, r: int) -> FieldQuery:
    obstacle = rng.integers(0, m, r)
    d: Array = rng.normal(size=r).round(1)  # with ties
    d[rng.random(r) < 0.2] = np.inf
    d[rng.random(r) < 0.1] = -np.inf
    link, valid = np.zeros(r, dtype=np.int64), np.ones(r, dtype=np.bool_)
    return FieldQuery(obstacle, link, d, rng.normal(size=(r, 2)), np.zeros(r), valid, rng.normal(size=(r, 2)), "rad")


@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(0, 12))
def test_barrier_and_contact_obstacle_by_obstacle(seed: int, m: int, r: int) -> None:
    query = query_of(np.random.default_rng(seed), m, r)
    h, contact = least_barrier(query, m, 0.05), nearest_contact(query, m)
    for o in range(m):
        own = query.obstacle == o
        assert h[o] == min([*(query.d[own] - 0.05), np.inf])
        finite = own & np.isfinite(query.d)
        if not finite.any():
            assert np.isnan(contact[o]).all()
        else:
            nearest = finite & (query.d == query.d[finite].min())
            assert contact[o].tolist() in query.contact_q[nearest].tolist()
