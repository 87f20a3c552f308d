"""The nearest contacts of the whole robot with one obstacle: successive halving over many starts.

Every start gets two steps; the most promising go on with three more, and the best of those to convergence. A candidate
is promising by its cost, an estimate of the distance from q to the contact it is heading for, and must differ from the
ones kept before it. A converged candidate is a contact only if no other piece is in penetration there; where one is,
that piece touches earlier, and the search goes on with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.body import Body, forward, piece_pose
from cdfctl.fields.kernel.contact import (
    CURVATURE,
    Candidates,
    Scratch,
    advance,
    evaluate,
    frames_of,
    new_candidates,
    new_scratch,
    restore,
)
from cdfctl.fields.kernel.distance import NO_CONTACT, Work, block_bound, new_work, relative_pose
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.projection import copy
from cdfctl.fields.kernel.rows import nearest_in_block
from cdfctl.fields.kernel.starts import (
    Samples,
    Starts,
    Table,
    new_starts,
    sample_starts,
    spread_samples,
    swing_starts,
    table_starts,
)
from cdfctl.fields.kernel.vec import Vec
from cdfctl.types import Array, BoolArray, IntArray

SWINGS = 8  # one-joint turns kept as starts
SPREAD = 12  # samples kept as starts
ENTRIES = 8  # table entries kept as starts
COLD_KEPT = 16  # starts that are followed, beyond the contacts asked for, without a memory
WARM_KEPT = 2  # and with one
WIDE_KEPT = 5  # with one, in the obstacle's turn to be searched widely again
COLD_SECOND = 4  # of these, those that go on after two steps
WARM_SECOND = 1
SPARE = 1  # contacts looked for beyond those asked for
RETRIES = 2  # candidates that may turn out to be no contact, with a memory
COLD_STEPS = 30  # at most, to finish a contact, without a memory
WARM_STEPS = 8  # and with one
CLOSE = 5e-3  # rad: the residual at which a candidate's cost is good enough to compare
CONVERGED = 1e-4  # rad: and at which a contact is done; its distance is right to the square of it
ALIKE = 0.05  # rad: candidates of one piece nearer than this are one
DISTINCT = 0.1  # rad: contacts nearer than this to a nearer one are not told apart
UNKNOWN, NOTHING = 0, -1  # in a memory: nothing is known of an obstacle; no contact was found
TOUCH = 5e-5  # m: greatest |f| of a contact, and the penetration of other pieces that is overlooked


class Search(NamedTuple):
    """Workspace of the search, one a thread.

    Attributes:
        found: the candidates.
        chosen: (c,) those that go on, best first.
        dropped, tried: (c,) marks.
        swings, spread, entries: starts of each kind.
        samples: configurations over the limits.
        scratch, work: of the steps and of the distances.
    """

    found: Candidates
    chosen: IntArray
    dropped: BoolArray
    tried: BoolArray
    swings: Starts
    spread: Starts
    entries: Starts
    samples: Samples
    scratch: Scratch
    work: Work


class Memory(NamedTuple):
    """Contacts remembered from the last query, obstacle by obstacle: starts of the next one.

    Attributes:
        known: (m,) how many; 0 where nothing is known yet, -1 where the last query found no contact.
        piece: (m, w).
        x: (m, w, n).
        turn: (1,) counts the queries: obstacle ``turn % m`` is searched as widely as at first, so that a contact that
            has become the nearest since is found before long.
    """

    known: IntArray
    piece: IntArray
    x: Array
    turn: IntArray


def new_search(body: Body, remembered: int) -> Search:
    """A workspace for ``body`` and memories of ``remembered`` contacts an obstacle."""
    k, n = len(body.joint), len(body.chain.parent)
    c = k + remembered + SWINGS + SPREAD + ENTRIES
    return Search(
        found=new_candidates(c, n),
        chosen=np.zeros(c, dtype=np.int64),
        dropped=np.zeros(c, dtype=np.bool_),
        tried=np.zeros(c, dtype=np.bool_),
        swings=new_starts(SWINGS, n),
        spread=new_starts(SPREAD, n),
        entries=new_starts(ENTRIES, n),
        samples=spread_samples(body),
        scratch=new_scratch(n),
        work=new_work(),
    )


def new_memory(m: int, w: int, n: int) -> Memory:
    """An empty memory for m obstacles."""
    return Memory(
        np.zeros(m, dtype=np.int64), np.zeros((m, w), dtype=np.int64), np.zeros((m, w, n)), np.zeros(1, dtype=np.int64)
    )


@njit
def add_start(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, k: int, x: Array, work: Work
) -> None:
    """Candidate c begins with piece k at x, joints that do not move the piece as in q."""
    joint = body.joint[k]
    found.piece[c], found.curvature[c] = k, CURVATURE
    for j in range(q.shape[0]):
        inside = min(max(x[j], body.chain.lower[j]), body.chain.upper[j])
        found.x[c, j] = inside if body.chain.moves[j, joint] else q[j]
    evaluate(body, q, parts, o, found, c, work)


@njit
def nearest_contacts(
    body: Body,
    q: Array,
    parts: Parts,
    o: int,
    memory: Memory,
    table: Table,
    centre: Vec,
    size: float,
    sheets: int,
    search: Search,
) -> int:
    """The contacts with obstacle o nearest to q, which must be clear of it: nearest first in ``search.chosen``.

    At most ``sheets`` of them, told apart by :data:`DISTINCT`; the answer says how many. The first candidates of
    ``search.found`` must be the pieces, in their order, evaluated at q. ``memory`` is used and renewed; ``centre`` and
    ``size`` are of a ball around the obstacle, or around what of it is near.
    """
    found, chosen = search.found, search.chosen
    count = body.joint.shape[0]
    frames = frames_of(found, 0)
    warm, cold = max(0, memory.known[o]), memory.known[o] == UNKNOWN
    wide = cold or memory.turn[0] % memory.known.shape[0] == o
    for i in range(warm):
        add_start(body, q, parts, o, found, count, memory.piece[o, i], memory.x[o, i], search.work)
        count += 1
    if wide:
        forward(body, q, frames)
        for i in range(swing_starts(body, q, frames, centre, size, search.swings)):
            add_start(body, q, parts, o, found, count, search.swings.piece[i], search.swings.x[i], search.work)
            count += 1
        for i in range(sample_starts(body, q, parts, o, search.samples, search.spread)):
            add_start(body, q, parts, o, found, count, search.spread.piece[i], search.spread.x[i], search.work)
            count += 1
    for i in range(table_starts(body, q, table, centre, search.entries)):
        add_start(body, q, parts, o, found, count, search.entries.piece[i], search.entries.x[i], search.work)
        count += 1

    kept = choose(search, count, (COLD_KEPT if cold else WIDE_KEPT if wide else WARM_KEPT) + sheets, ALIKE, True)
    for i in range(kept):
        _improve(body, q, parts, o, search, chosen[i], 2, CLOSE)
    kept = choose(search, count, (COLD_SECOND if cold else WARM_SECOND) + sheets, ALIKE, True)
    for i in range(kept):
        _improve(body, q, parts, o, search, chosen[i], 3, CLOSE)
    # Where there was a contact a moment ago there is one now, as a rule: then the search gives up on none too soon.
    thorough = wide or warm > 0
    most = count if cold else sheets + SPARE + RETRIES
    _finish_best(body, q, parts, o, search, count, sheets + SPARE, most, thorough, COLD_STEPS if cold else WARM_STEPS)
    _remember(memory, o, search, choose(search, count, sheets + SPARE, ALIKE, True))
    return choose(search, count, sheets, DISTINCT, False)


@njit
def _finish_best(
    body: Body,
    q: Array,
    parts: Parts,
    o: int,
    search: Search,
    count: int,
    wanted: int,
    most: int,
    thorough: bool,
    steps: int,
) -> None:
    """Finish candidates, the most promising first, until ``wanted`` are contacts or ``most`` have been tried.

    If ``thorough``, more than ``most`` are tried as long as none was a contact.
    All others, and those that turn out to be none, get an infinite cost.
    """
    found, tried = search.found, search.tried
    tried[:] = False
    contacts = 0
    for tries in range(count):
        if contacts == wanted or (tries >= most and (contacts > 0 or not thorough)):
            break
        best = -1
        for c in range(count):
            if not tried[c] and found.cost[c] < np.inf and (best < 0 or found.cost[c] < found.cost[best]):
                best = c
        if best < 0:
            break
        tried[best] = True
        if _like_a_contact(search, count, best):
            found.cost[best] = np.inf
            continue
        _finish(body, q, parts, o, search, best, steps)
        if found.cost[best] < np.inf:
            contacts += 1
    for c in range(count):
        if not tried[c]:
            found.cost[c] = np.inf


@njit
def _like_a_contact(search: Search, count: int, candidate: int) -> bool:
    """Whether a candidate is near a finished one of the same piece, and so on its way to the same contact."""
    found = search.found
    for c in range(count):
        if c == candidate or not search.tried[c] or not found.cost[c] < np.inf:
            continue
        if found.piece[c] == found.piece[candidate] and _apart2(found, c, candidate) < ALIKE * ALIKE:
            return True
    return False


@njit
def _apart2(found: Candidates, c: int, other: int) -> float:
    """Squared distance of two candidates, rad²."""
    distance2 = 0.0
    for j in range(found.x.shape[1]):
        distance2 += (found.x[c, j] - found.x[other, j]) ** 2
    return distance2


@njit
def choose(search: Search, count: int, most: int, gap: float, by_piece: bool) -> int:
    """Up to ``most`` candidates of least cost into ``search.chosen``; how many.

    One nearer than ``gap`` to a better one (of the same piece, if ``by_piece``) is passed over.
    """
    found, chosen, dropped = search.found, search.chosen, search.dropped
    kept = 0
    while kept < most:
        best = -1
        for c in range(count):
            if not dropped[c] and found.cost[c] < np.inf and (best < 0 or found.cost[c] < found.cost[best]):
                best = c
        if best < 0:
            break
        dropped[best] = True
        alike = False
        for i in range(kept):
            other = chosen[i]
            if by_piece and found.piece[other] != found.piece[best]:
                continue
            alike = alike or _apart2(found, other, best) < gap * gap
        if not alike:
            chosen[kept] = best
            kept += 1
    for c in range(count):
        dropped[c] = False
    return kept


@njit
def _improve(body: Body, q: Array, parts: Parts, o: int, search: Search, c: int, steps: int, tolerance: float) -> None:
    """Up to ``steps`` steps of candidate c, until its residual is below ``tolerance``, rad."""
    found = search.found
    for _ in range(steps):
        if found.residual[c] < tolerance and abs(found.f[c]) < TOUCH:
            return
        advance(body, q, parts, o, found, c, search.scratch, search.work)


@njit
def _finish(body: Body, q: Array, parts: Parts, o: int, search: Search, c: int, steps: int) -> None:
    """Candidate c to convergence, or for ``steps`` steps.

    Its cost becomes its distance from q, infinite where it is no contact.
    """
    found = search.found
    for _ in range(2):
        _improve(body, q, parts, o, search, c, steps, CONVERGED)
        restore(body, q, parts, o, found, c, search.scratch, search.work)
        if not abs(found.f[c]) <= TOUCH:
            found.cost[c] = np.inf
            return
        other = penetrating_piece(body, parts, o, found, c, search.work)
        if other < 0:
            return
        found.piece[c] = other
        for j in range(q.shape[0]):
            if not body.chain.moves[j, body.joint[other]]:
                found.x[c, j] = q[j]
        evaluate(body, q, parts, o, found, c, search.work)
    found.cost[c] = np.inf


@njit
def penetrating_piece(body: Body, parts: Parts, o: int, found: Candidates, c: int, work: Work) -> int:
    """A piece other than that of candidate c that is in penetration at its x, -1 for none."""
    frames = frames_of(found, c)
    forward(body, found.x[c], frames)
    for k in range(body.joint.shape[0]):
        if k == found.piece[c]:
            continue
        r_a, t_a = piece_pose(body, frames, k)
        r, t = relative_pose(r_a, t_a, parts, parts.first[o])
        for block in range(parts.first_block[o], parts.first_block[o + 1]):
            if block_bound(body, k, parts, block, r, t) < -TOUCH:
                _, contact = nearest_in_block(body, frames, k, parts, block, -1, NO_CONTACT, work)
                if contact.d < -TOUCH:
                    return k
    return -1


@njit
def _remember(memory: Memory, o: int, search: Search, kept: int) -> None:
    count = min(kept, memory.piece.shape[1])
    memory.known[o] = count if count > 0 else NOTHING
    for i in range(count):
        memory.piece[o, i] = search.found.piece[search.chosen[i]]
        copy(search.found.x[search.chosen[i]], memory.x[o, i])
