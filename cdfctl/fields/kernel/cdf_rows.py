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
from cdfctl.fields.kernel.candidates import Candidates
from cdfctl.fields.kernel.contact import AT_LIMIT
from cdfctl.fields.kernel.escape import Escape, escape_from, new_escape
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import copy
from cdfctl.fields.kernel.memory import Memory, begin_query
from cdfctl.fields.kernel.parts import Parts, obstacle_pose, time_derivative
from cdfctl.fields.kernel.pieces import distance_rows, pieces_at, place_at
from cdfctl.fields.kernel.rows import Answer
from cdfctl.fields.kernel.search import Search, nearest_contacts, new_search
from cdfctl.fields.kernel.starts import Table, table_starts
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Vec, add, rotate, vec, vec3
from cdfctl.types import Array, BoolArray, IntArray

AT_CONTACT = 1e-3  # rad
UNMOVED = 1e-6  # m/rad: a contact whose gradient over the free joints is shorter moves with no joint


class ContactRows(Struct):
    """Room for r rows, those of the first obstacle first, and for what is known of the m obstacles.

    Attributes:
        count: (1,) how many rows are filled.
        obstacle, link: (r,) which ones touch; ``link`` is -1 in a row that says there is no contact.
        d, dt, valid: (r,); ``dq``, ``contact_q`` (r, n).
        f: (m,) least signed distance of the pieces at q, m.
    """

    count: IntArray
    obstacle: IntArray
    link: IntArray
    d: Array
    dq: Array
    dt: Array
    valid: BoolArray
    contact_q: Array
    f: Array


def new_contact_rows(m: int, sheets: int, n: int) -> ContactRows:
    """Rows for m obstacles of up to ``sheets`` each, not filled yet."""
    r = m * sheets
    return ContactRows(
        np.zeros(1, dtype=np.int64),
        np.zeros(r, dtype=np.int64),
        np.zeros(r, dtype=np.int64),
        np.zeros(r),
        np.zeros((r, n)),
        np.zeros(r),
        np.zeros(r, dtype=np.bool_),
        np.zeros((r, n)),
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
    body: Body,
    q: Array,
    parts: Parts,
    memory: Memory,
    table: Table,
    sheets: int,
    every_obstacle: bool,
    rows: ContactRows,
    distances: Answer,
    work: Workspace,
) -> bool:
    """Fill ``rows`` for all obstacles at q (n,); and ``distances``, unless q is outside the limits, which the answer
    says: it has none, one or one a link for each obstacle (:func:`cdfctl.fields.kernel.pieces.distance_rows`).

    If ``every_obstacle``, one without a contact has a row too, which says so: d = +inf, or -inf in a penetration
    without a way out, and not valid.
    """
    begin_query(memory, q, parts)
    finisher, pieces = work.search.finisher, work.search.pieces
    found = finisher.found
    inside = place_at(body, q, finisher.scratch.y, found)
    count = 0
    for o in range(parts.first.shape[0] - 1):
        nearest, filled = pieces_at(body, q, parts, o, found, pieces, finisher.work), 0
        rows.f[o] = found.f[nearest] if nearest >= 0 else np.inf
        if inside:
            distance_rows(body, q, parts, o, found, pieces, distances, finisher.work)
        if nearest >= 0:
            centre, size = _ball_around(parts, o, vec(found.b, nearest))
            if rows.f[o] < 0.0:
                filled = _escape_row(body, q, parts, o, memory, table, centre, rows, count, work)
            else:
                filled = nearest_contacts(body, q, parts, o, memory, table, centre, size, sheets, work.search)
                for i in range(filled):
                    _fill(body, q, parts, o, found, finisher.choice.chosen[i], rows, count + i)
        if filled == 0 and every_obstacle:
            _say_none(rows, o, count, -np.inf if rows.f[o] < 0.0 else np.inf)
            filled = 1
        count += filled
    rows.count[0] = count
    return inside


@njit
def _say_none(rows: ContactRows, o: int, i: int, d: float) -> None:
    """Row i: obstacle o has no contact."""
    rows.obstacle[i], rows.link[i] = o, -1
    rows.d[i], rows.dt[i], rows.valid[i] = d, 0.0, False
    for j in range(rows.dq.shape[1]):
        rows.dq[i, j], rows.contact_q[i, j] = 0.0, np.nan


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
def _fill(body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, rows: ContactRows, i: int) -> None:
    """Row i of obstacle o from candidate c, a contact outside penetration."""
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
    rows.obstacle[i], rows.link[i], rows.d[i] = o, body.link[found.piece[c]], D
    at_contact = D < AT_CONTACT and g2 == whole2
    rows.valid[i] = sqrt(g2) > UNMOVED and (at_contact or D > 0.0)
    for j in range(q.shape[0]):
        rows.contact_q[i, j] = x[j]
        if not rows.valid[i]:
            rows.dq[i, j] = 0.0
        elif at_contact:
            rows.dq[i, j] = g[j] / sqrt(g2)
        else:
            rows.dq[i, j] = (q[j] - x[j]) / D
    if not rows.valid[i]:
        rows.dt[i] = 0.0
    elif at_contact:
        rows.dt[i] = rate / sqrt(g2)
    else:
        rows.dt[i] = rate * sqrt(free2) / (D * sqrt(g2))


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
    i: int,
    work: Workspace,
) -> int:
    """The one row of an obstacle in penetration, row i; how many rows, 0 where no way out was found."""
    escape, best, touching = work.escape, np.inf, 0
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
        D = escape_from(body, q, parts, o, escape, work.search.finisher.work)
        if best > D:
            best = D
            touching = _fill_escape(body, q, o, D, escape, rows, i)
    if best < np.inf:
        memory.known[o] = 1
        memory.piece[o, 0] = touching
        copy(rows.contact_q[i], memory.x[o, 0])
        return 1
    return 0


@njit
def _fill_escape(body: Body, q: Array, o: int, D: float, escape: Escape, rows: ContactRows, i: int) -> int:
    """Row i from the way out in ``escape``; the piece that touches there."""
    touching = 0
    for k in range(escape.f.shape[0]):
        if escape.mu[k] > escape.mu[touching] or (escape.mu[touching] <= 0.0 and escape.f[k] < escape.f[touching]):
            touching = k
    rows.obstacle[i], rows.link[i], rows.d[i] = o, body.link[touching], -D
    g = escape.g[touching]
    g2, rate = 0.0, 0.0
    for j in range(q.shape[0]):
        g2 += g[j] * g[j]
    for k in range(escape.mu.shape[0]):
        rate += escape.mu[k] * escape.dt[k]
    at_contact = D < AT_CONTACT
    rows.valid[i] = sqrt(g2) > UNMOVED
    for j in range(q.shape[0]):
        rows.contact_q[i, j] = escape.x[j]
        if not rows.valid[i]:
            rows.dq[i, j] = 0.0
        elif at_contact:
            rows.dq[i, j] = g[j] / sqrt(g2)
        else:
            rows.dq[i, j] = (escape.x[j] - q[j]) / D
    if not rows.valid[i]:
        rows.dt[i] = 0.0
    else:
        rows.dt[i] = escape.dt[touching] / sqrt(g2) if at_contact else rate / D
    return touching
