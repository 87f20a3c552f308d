"""The rows of the signed distance field: which pair of piece and part is nearest, and its two derivatives."""

from __future__ import annotations

from math import sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body, Frames, forward, gradient, piece_pose
from cdfctl.fields.kernel.distance import (
    NO_CONTACT,
    Contact,
    Work,
    block_bound,
    keep_carrier,
    lower_bound,
    relative_pose,
    signed_distance,
    to_world,
)
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts, time_derivative
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import ZERO, Vec, store
from cdfctl.types import Array, BoolArray, IntArray

STILL = 1e-9  # a gradient shorter than this, m/rad or m/m, means that no joint can change the distance


class Answer(Struct):
    """r rows to fill: ``link`` (r,), ``d`` (r,), ``dq`` (r, n), ``dt`` (r,), ``valid`` (r,), and the witness points
    ``a`` on the robot, ``b`` on the obstacle and the unit ``normal`` between them, (r, 3), all in the world."""

    link: IntArray
    d: Array
    dq: Array
    dt: Array
    valid: BoolArray
    a: Array
    b: Array
    normal: Array


def new_answer(r: int, n: int) -> Answer:
    """Rows not filled yet."""
    return Answer(
        np.empty(r, dtype=np.int64),
        np.empty(r),
        np.empty((r, n)),
        np.empty(r),
        np.empty(r, dtype=np.bool_),
        np.empty((r, 3)),
        np.empty((r, 3)),
        np.empty((r, 3)),
    )


@njit
def nearest_rows(body: Body, q: Array, parts: Parts, frames: Frames, work: Work, answer: Answer) -> None:
    """One row an obstacle: the nearest of all links."""
    forward(body, q, frames, 0)
    for o in range(parts.first.shape[0] - 1):
        k, contact = nearest_pair(body, frames, 0, 0, body.joint.shape[0], parts, o, work)
        _fill(body, frames, parts, o, k, contact, answer, o)


@njit
def link_rows(body: Body, q: Array, parts: Parts, frames: Frames, work: Work, answer: Answer) -> None:
    """One row for each obstacle and link, the links of the first obstacle first."""
    forward(body, q, frames, 0)
    row = 0
    for o in range(parts.first.shape[0] - 1):
        for link in range(body.first.shape[0] - 1):
            k, contact = nearest_pair(body, frames, 0, body.first[link], body.first[link + 1], parts, o, work)
            _fill(body, frames, parts, o, k, contact, answer, row)
            row += 1


@njit
def nearest_pair(
    body: Body, frames: Frames, c: int, first: int, last: int, parts: Parts, o: int, work: Work
) -> tuple[int, Contact]:
    """The piece among ``first`` … ``last`` - 1 nearest to obstacle o, and the contact; (-1, no contact) for none.

    The robot is at configuration c of ``frames``.

    The block of parts with the least lower bound is measured first, then every one whose bound is below the best.
    """
    start_k, start_block, least = -1, -1, np.inf
    first_block, last_block = parts.first_block[o], parts.first_block[o + 1]
    if (last - first) * (last_block - first_block) == 1:
        return nearest_in_block(body, frames, c, first, parts, first_block, -1, NO_CONTACT, work)
    for k in range(first, last):
        r_a, t_a = piece_pose(body, frames, c, k)
        r, t = relative_pose(r_a, t_a, parts, parts.first[o])
        for block in range(first_block, last_block):
            bound = block_bound(body, k, parts, block, r, t)
            if start_k < 0 or bound < least:
                start_k, start_block, least = k, block, bound
    if start_k < 0:
        return -1, NO_CONTACT
    best_k, best = nearest_in_block(body, frames, c, start_k, parts, start_block, -1, NO_CONTACT, work)
    for k in range(first, last):
        r_a, t_a = piece_pose(body, frames, c, k)
        r, t = relative_pose(r_a, t_a, parts, parts.first[o])
        for block in range(first_block, last_block):
            if block_bound(body, k, parts, block, r, t) < best.d and not (k == start_k and block == start_block):
                best_k, best = nearest_in_block(body, frames, c, k, parts, block, best_k, best, work)
    return best_k, best


@njit
def nearest_in_block(
    body: Body, frames: Frames, c: int, k: int, parts: Parts, block: int, best_k: int, best: Contact, work: Work
) -> tuple[int, Contact]:
    """Piece k and the part of a block nearest to it, if that is nearer than ``best``; else ``best`` of ``best_k``."""
    r_a, t_a = piece_pose(body, frames, c, k)
    bounds = parts.block[block]
    r, t = relative_pose(r_a, t_a, parts, bounds.first)
    alone = bounds.last - bounds.first == 1
    for p in range(bounds.first, bounds.last):
        if alone or lower_bound(body, k, parts, p, r, t) < best.d:
            contact = signed_distance(body.sets, k, parts.sets, p, r, t, ZERO, best.d, work)
            if contact.d < best.d or best_k < 0:
                best_k, best = k, to_world(r_a, t_a, contact)
                keep_carrier(work, p)
    return best_k, best


@njit
def _fill(body: Body, frames: Frames, parts: Parts, o: int, k: int, contact: Contact, answer: Answer, row: int) -> None:
    if k >= 0:
        gradient(body, frames, 0, body.joint[k], contact.a, contact.normal, answer.dq[row])
    fill_row(body, parts, o, k, contact.d, contact.a, contact.b, contact.normal, answer, row)


@njit
def fill_row(
    body: Body, parts: Parts, o: int, k: int, d: float, a: Vec, b: Vec, normal: Vec, answer: Answer, row: int
) -> None:
    """Row ``row`` from the contact of piece k, -1 for none, with obstacle o; its ``dq`` has been filled."""
    answer.d[row] = d
    store(answer.a, row, a)
    store(answer.b, row, b)
    store(answer.normal, row, normal)
    dq = answer.dq[row]
    if k < 0:
        answer.link[row], answer.dt[row], answer.valid[row] = -1, 0.0, False
        dq[:] = 0.0
        return
    answer.link[row] = body.link[k]
    answer.dt[row] = time_derivative(parts, o, b, normal)
    length2 = 0.0
    for i in range(dq.shape[0]):
        length2 += dq[i] * dq[i]
    answer.valid[row] = sqrt(length2) >= STILL
