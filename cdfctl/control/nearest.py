"""What is reported of a field's answer, obstacle by obstacle: the nearest of its rows."""

from __future__ import annotations

from math import inf, isfinite, isnan, nan

import numpy as np

from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array, FieldQuery, IntArray


def least_barrier(query: FieldQuery, m: int, margin: float) -> Array:
    """h (m,): the least ``d - margin`` over each obstacle's rows, +inf where it has none."""
    h = np.empty(m)
    _least(query.obstacle, query.d, margin, h)
    return h


def nearest_contact(query: FieldQuery, m: int) -> Array:
    """(m, n) the contact configuration of each obstacle's nearest row, NaN where it has none."""
    contact = np.empty((m, query.dq.shape[1]))
    _nearest(query.obstacle, query.d, query.contact_q, np.empty(m), contact)
    return contact


@njit
def _least(obstacle: IntArray, d: Array, margin: float, h: Array) -> None:
    h[:] = inf
    for row in range(d.shape[0]):
        o = obstacle[row]
        if d[row] - margin < h[o] or isnan(d[row]):
            h[o] = d[row] - margin


@njit
def _nearest(obstacle: IntArray, d: Array, contact_q: Array, least: Array, contact: Array) -> None:
    least[:] = inf
    contact[:] = nan
    for row in range(d.shape[0]):
        o = obstacle[row]
        if isfinite(d[row]) and d[row] <= least[o]:
            least[o] = d[row]
            for j in range(contact.shape[1]):
                contact[o, j] = contact_q[row, j]
