"""The pieces of the robot as they stand at q, measured as far as the search needs them.

A bound of a piece's signed distance costs a tenth of the distance itself. Of an obstacle that is followed (see
:mod:`.search`) only those pieces are measured that may be the nearest one, which tells whether the obstacle is in
penetration, and those that may have come near enough to be tried for a new contact.
"""

from __future__ import annotations

import numpy as np

from cdfctl.fields.kernel.body import Body, forward, piece_pose
from cdfctl.fields.kernel.candidates import Candidates
from cdfctl.fields.kernel.contact import evaluate_placed
from cdfctl.fields.kernel.distance import Work, block_bound, relative_pose
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import copy
from cdfctl.fields.kernel.memory import Memory
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.rows import Answer, fill_row
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import ZERO, vec
from cdfctl.types import Array, BoolArray

NEARER = 0.8  # of the distance at which a piece was tried in vain, where it is tried again


class Pieces(Struct):
    """Workspace: ``bound`` (k,), no more than the signed distance of a piece, m, and equal to it where it is
    ``measured`` (k,)."""

    bound: Array
    measured: BoolArray


def new_pieces(k: int) -> Pieces:
    """A workspace for k pieces."""
    return Pieces(np.zeros(k), np.zeros(k, dtype=np.bool_))


@njit
def place_at(body: Body, q: Array, held: Array, found: Candidates) -> bool:
    """Place the joints at q, held within the limits, for :func:`pieces_at`; ``held`` (n,) is for that. Whether q was
    within them."""
    inside = True
    for j in range(q.shape[0]):
        held[j] = min(max(q[j], body.chain.lower[j]), body.chain.upper[j])
        inside = inside and held[j] == q[j]
    forward(body, held, found.frames, found.place.shape[0])
    return inside


@njit
def pieces_at(body: Body, q: Array, parts: Parts, o: int, found: Candidates, pieces: Pieces, work: Work) -> int:
    """The first candidates become the pieces as they stand at q, in their order; the one nearest to obstacle o, or -1.

    That one is measured, and those that were in question; the others have an infinite cost.
    """
    for k in range(body.joint.shape[0]):
        found.piece[k], found.place[k], found.cost[k] = k, found.place.shape[0], np.inf
        pieces.bound[k], pieces.measured[k] = _bound(body, found, k, parts, o), False
    return nearest_of(body, q, parts, o, found, pieces, 0, body.joint.shape[0], work)


@njit
def nearest_of(
    body: Body,
    q: Array,
    parts: Parts,
    o: int,
    found: Candidates,
    pieces: Pieces,
    first: int,
    last: int,
    work: Work,
) -> int:
    """The nearest of the pieces ``first`` … ``last`` - 1, measured, or -1: that of the least bound, or another whose
    bound is below its distance."""
    if first == last:
        return -1
    nearest = first
    for k in range(first, last):
        if pieces.bound[k] < pieces.bound[nearest]:
            nearest = k
    measure_piece(body, q, parts, o, found, pieces, nearest, work)
    for k in range(first, last):
        if pieces.bound[k] < pieces.bound[nearest]:
            measure_piece(body, q, parts, o, found, pieces, k, work)
            if pieces.bound[k] < pieces.bound[nearest]:
                nearest = k
    return nearest


@njit
def _bound(body: Body, found: Candidates, k: int, parts: Parts, o: int) -> float:
    """No more than the signed distance of piece k, at q, and obstacle o."""
    r_a, t_a = piece_pose(body, found.frames, found.place[k], k)
    r, t = relative_pose(r_a, t_a, parts, parts.first[o])
    least = np.inf
    for block in range(parts.first_block[o], parts.first_block[o + 1]):
        least = min(least, block_bound(body, k, parts, block, r, t))
    return least


@njit
def measure_piece(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, pieces: Pieces, k: int, work: Work
) -> None:
    """Candidate k, piece k at q, is evaluated, if it has not been."""
    if not pieces.measured[k]:
        begin(body, q, found, k, k, q)
        evaluate_placed(body, q, parts, o, found, k, work)
        pieces.bound[k], pieces.measured[k] = found.f[k], True


@njit
def distance_rows(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, pieces: Pieces, answer: Answer, work: Work
) -> None:
    """The rows of obstacle o in ``answer``, which has as many an obstacle: none, that of the nearest piece, or one a
    link. :func:`pieces_at` must have been called, at a q within the limits."""
    rows = answer.d.shape[0] // (parts.first.shape[0] - 1)
    for i in range(rows):
        first, last = (body.first[i], body.first[i + 1]) if rows > 1 else (0, body.joint.shape[0])
        k, row = nearest_of(body, q, parts, o, found, pieces, first, last, work), o * rows + i
        if k < 0:
            fill_row(body, parts, o, k, np.inf, ZERO, ZERO, ZERO, answer, row)
        else:
            copy(found.g[k], answer.dq[row])
            a, b, normal = vec(found.a, k), vec(found.b, k), vec(found.normal, k)
            fill_row(body, parts, o, k, found.f[k], a, b, normal, answer, row)


@njit
def begin(body: Body, q: Array, found: Candidates, c: int, k: int, x: Array) -> None:
    """Candidate c begins with piece k at x, joints that do not move the piece as in q."""
    found.piece[c] = k
    for j in range(q.shape[0]):
        inside = min(max(x[j], body.chain.lower[j]), body.chain.upper[j])
        found.x[c, j] = inside if body.chain.moves[j, body.joint[k]] else q[j]


@njit
def all_pieces(
    body: Body, q: Array, parts: Parts, o: int, memory: Memory, found: Candidates, pieces: Pieces, work: Work
) -> None:
    """Evaluate all of them; they count as tried."""
    for k in range(body.joint.shape[0]):
        measure_piece(body, q, parts, o, found, pieces, k, work)
        memory.tried[o, k] = pieces.bound[k]


@njit
def promising_piece(
    body: Body, q: Array, parts: Parts, o: int, memory: Memory, found: Candidates, pieces: Pieces, work: Work
) -> None:
    """Keep one piece to be tried for a new contact; the others get an infinite cost.

    It is the one of least cost, if that is below the costs of the known contacts, of those without such a contact. One
    that was tried in vain must have come nearer since, to :data:`NEARER` of the distance.
    """
    first, best, nearest = body.joint.shape[0], -1, np.inf
    last = first + max(0, memory.known[o])
    for c in range(first, last):
        nearest = min(nearest, found.cost[c])
    for k in range(first):
        wanted = pieces.bound[k] < NEARER * memory.tried[o, k]
        for c in range(first, last):
            wanted = wanted and found.piece[c] != k
        if wanted:
            measure_piece(body, q, parts, o, found, pieces, k, work)
            wanted = pieces.bound[k] < NEARER * memory.tried[o, k]
        if wanted and found.cost[k] < nearest and (best < 0 or found.cost[k] < found.cost[best]):
            best = k
    for k in range(first):
        if k != best:
            found.cost[k] = np.inf
    if best >= 0:
        memory.tried[o, best] = pieces.bound[best]
