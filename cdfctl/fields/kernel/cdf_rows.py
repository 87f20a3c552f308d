"""The rows of the configuration-space distance field: the nearest contacts of every obstacle and their derivatives.

With q* the contact, D = ||q - q*||, ν the normal there, ḃ the velocity of the obstacle's witness point and F the joints
not at a limit,

    d_c = D,    ∂d_c/∂q = (q - q*) / d_c,    ∂d_c/∂t = νᵀḃ ||(q - q*)_F|| / (D ||(∂_q f)_F||)

outside contact; in penetration d_c = -D, with q* and ∂d_c/∂t from :mod:`.escape`. For D < 1e-3 the quotients are 0/0,
and ∂_q f / ||∂_q f|| and νᵀḃ / ||∂_q f|| take their place. The derivation is in the documentation, "The method".
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body
from cdfctl.fields.kernel.contact import AT_LIMIT
from cdfctl.fields.kernel.escape import Escape, escape_from, new_escape
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts, obstacle_pose, time_derivative
from cdfctl.fields.kernel.projection import copy
from cdfctl.fields.kernel.search import Memory, Search, nearest_contacts, new_search, pieces_at, place_at
from cdfctl.fields.kernel.starts import Table, table_starts
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Vec, add, rotate, vec, vec3
from cdfctl.types import Array, BoolArray, IntArray

AT_CONTACT = 1e-3  # rad
UNMOVED = 1e-6  # m/rad: a contact whose gradient over the free joints is shorter moves with no joint


class ContactRows(Struct):
    """m obstacles of ``sheets`` rows each, and the signed distance of every link for those who want it too.

    Attributes:
        filled: (m,) how many rows of an obstacle are filled. Where none is, the first says so: d = +inf, invalid.
        piece: (m, sheets); ``d``, ``dt``, ``valid`` (m, sheets); ``dq``, ``contact_q`` (m, sheets, n).
        f: (m,) least signed distance of the pieces at q, m.
    """

    filled: IntArray
    piece: IntArray
    d: Array
    dq: Array
    dt: Array
    valid: BoolArray
    contact_q: Array
    f: Array


def new_contact_rows(m: int, sheets: int, n: int) -> ContactRows:
    """Rows not filled yet."""
    return ContactRows(
        np.zeros(m, dtype=np.int64),
        np.zeros((m, sheets), dtype=np.int64),
        np.full((m, sheets), np.inf),
        np.zeros((m, sheets, n)),
        np.zeros((m, sheets)),
        np.zeros((m, sheets), dtype=np.bool_),
        np.full((m, sheets, n), np.nan),
        np.zeros(m),
    )


class Workspace(Struct):
    """Everything a query writes to but its answer."""

    search: Search
    escape: Escape


def new_workspace(body: Body, remembered: int) -> Workspace:
    """A workspace for ``body`` and memories of ``remembered`` contacts an obstacle."""
    return Workspace(new_search(body, remembered), new_escape(body))


@njit
def contact_rows(
    body: Body, q: Array, parts: Parts, memory: Memory, table: Table, sheets: int, rows: ContactRows, work: Workspace
) -> None:
    """Fill ``rows`` for all obstacles at q (n,)."""
    memory.turn[0] += 1
    found = work.search.found
    place_at(body, q, work.search)
    for o in range(parts.first.shape[0] - 1):
        nearest = pieces_at(body, q, parts, o, work.search)
        rows.f[o] = found.f[nearest]
        centre, size = _ball_around(parts, o, vec(found.b, nearest))
        if found.f[nearest] < 0.0:
            rows.filled[o] = _escape_row(body, q, parts, o, memory, table, centre, rows, work)
        else:
            rows.filled[o] = nearest_contacts(body, q, parts, o, memory, table, centre, size, sheets, work.search)
            for i in range(rows.filled[o]):
                _fill(body, q, parts, o, work.search, work.search.choice.chosen[i], rows, i)
        if rows.filled[o] == 0:
            _leave_empty(rows, o)


@njit
def _leave_empty(rows: ContactRows, o: int) -> None:
    rows.d[o, 0], rows.dt[o, 0], rows.valid[o, 0] = np.inf, 0.0, False
    for j in range(rows.dq.shape[2]):
        rows.dq[o, 0, j], rows.contact_q[o, 0, j] = 0.0, np.nan


@njit
def _ball_around(parts: Parts, o: int, b: Vec) -> tuple[Vec, float]:
    """A ball around an obstacle of one part; of several, the point ``b`` of them that is nearest to the robot."""
    p = parts.first[o]
    if parts.first[o + 1] - p != 1:
        return b, 0.0
    r, t = obstacle_pose(parts, o)
    part = parts.sets.info[p]
    return add(rotate(r, vec3(part.centre)), t), part.reach + part.radius


@njit
def _fill(body: Body, q: Array, parts: Parts, o: int, search: Search, c: int, rows: ContactRows, i: int) -> None:
    """Row i of obstacle o from candidate c, a contact outside penetration."""
    found = search.found
    x, g = found.x[c], found.g[c]
    lower, upper = body.chain.lower, body.chain.upper
    D2, free2, g2, whole2 = 0.0, 0.0, 0.0, 0.0
    for j in range(q.shape[0]):
        D2 += (q[j] - x[j]) ** 2
        whole2 += g[j] * g[j]
        if lower[j] + AT_LIMIT < x[j] < upper[j] - AT_LIMIT:
            free2 += (q[j] - x[j]) ** 2
            g2 += g[j] * g[j]
    D = sqrt(D2)
    rate = time_derivative(parts, o, vec(found.b, c), vec(found.normal, c))
    rows.piece[o, i], rows.d[o, i] = found.piece[c], D
    at_contact = D < AT_CONTACT and g2 == whole2
    rows.valid[o, i] = sqrt(g2) > UNMOVED and (at_contact or D > 0.0)
    for j in range(q.shape[0]):
        rows.contact_q[o, i, j] = x[j]
        if not rows.valid[o, i]:
            rows.dq[o, i, j] = 0.0
        elif at_contact:
            rows.dq[o, i, j] = g[j] / sqrt(g2)
        else:
            rows.dq[o, i, j] = (q[j] - x[j]) / D
    if not rows.valid[o, i]:
        rows.dt[o, i] = 0.0
    elif at_contact:
        rows.dt[o, i] = rate / sqrt(g2)
    else:
        rows.dt[o, i] = rate * sqrt(free2) / (D * sqrt(g2))


@njit
def _escape_row(
    body: Body,
    q: Array,
    parts: Parts,
    o: int,
    memory: Memory,
    table: Table,
    centre: Vec,
    rows: ContactRows,
    work: Workspace,
) -> int:
    """The one row of an obstacle in penetration; how many rows, 0 where no way out was found."""
    escape, best = work.escape, np.inf
    starts = table_starts(body, q, table, centre, work.search.entries)
    warm = max(0, memory.known[o])
    for s in range(1 + warm + starts):
        if s == 0:
            copy(q, escape.x)
        elif s <= warm:
            copy(memory.x[o, s - 1], escape.x)
        else:
            copy(work.search.entries.x[s - 1 - warm], escape.x)
        for j in range(q.shape[0]):
            escape.x[j] = min(max(escape.x[j], body.chain.lower[j]), body.chain.upper[j])
        D = escape_from(body, q, parts, o, escape, work.search.work)
        if best > D:
            best = D
            _fill_escape(body, q, o, D, escape, rows)
    if best < np.inf:
        memory.known[o] = 1
        memory.piece[o, 0] = rows.piece[o, 0]
        copy(rows.contact_q[o, 0], memory.x[o, 0])
        return 1
    return 0


@njit
def _fill_escape(body: Body, q: Array, o: int, D: float, escape: Escape, rows: ContactRows) -> None:
    touching = 0
    for k in range(escape.f.shape[0]):
        if escape.mu[k] > escape.mu[touching] or (escape.mu[touching] <= 0.0 and escape.f[k] < escape.f[touching]):
            touching = k
    rows.piece[o, 0], rows.d[o, 0] = touching, -D
    g = escape.g[touching]
    g2, rate = 0.0, 0.0
    for j in range(q.shape[0]):
        g2 += g[j] * g[j]
    for k in range(escape.mu.shape[0]):
        rate += escape.mu[k] * escape.dt[k]
    at_contact = D < AT_CONTACT
    rows.valid[o, 0] = sqrt(g2) > UNMOVED
    for j in range(q.shape[0]):
        rows.contact_q[o, 0, j] = escape.x[j]
        if not rows.valid[o, 0]:
            rows.dq[o, 0, j] = 0.0
        elif at_contact:
            rows.dq[o, 0, j] = g[j] / sqrt(g2)
        else:
            rows.dq[o, 0, j] = (escape.x[j] - q[j]) / D
    if not rows.valid[o, 0]:
        rows.dt[o, 0] = 0.0
    else:
        rows.dt[o, 0] = escape.dt[touching] / sqrt(g2) if at_contact else rate / D
