"""The nearest contacts of the whole robot with one obstacle: successive halving over many starts.

A first query of an obstacle, and later ones in its turn, search *widely*: every start gets two steps; the most
promising go on with three more, and the best of those to convergence. A candidate is promising by its cost, an estimate
of the distance from q to the contact it is heading for, and must differ from the ones kept before it. A converged
candidate is a contact only if no other piece is in penetration there; where one is, that piece touches earlier, and the
search goes on with it.

Between its turns, and while it and the robot move little from query to query, an obstacle is *followed*: the contacts
remembered from the last query are brought to convergence, and of the pieces as they stand at q the most promising one,
if it may come before them. One obstacle a query has its turn: with m obstacles, what a wide search would find is found
within m queries.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdfctl.fields.kernel.body import Body, forward
from cdfctl.fields.kernel.candidates import (
    Candidates,
    Choice,
    cheapest,
    choose,
    choose_distinct,
    marked_like,
    new_candidates,
    new_choice,
    unmark,
)
from cdfctl.fields.kernel.contact import (
    Scratch,
    advance,
    curvature_at,
    evaluate,
    evaluate_placed,
    is_near,
    new_scratch,
    penetrating_piece,
    restore,
)
from cdfctl.fields.kernel.distance import Work, new_work
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.memory import UNKNOWN, Memory, keep
from cdfctl.fields.kernel.parts import Parts, parts_of
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
from cdfctl.fields.kernel.structs import Struct, compiled
from cdfctl.fields.kernel.vec import Vec
from cdfctl.types import Array

SWINGS = 8  # one-joint turns kept as starts
SPREAD = 12  # samples kept as starts
ENTRIES = 8  # table entries kept as starts
COLD_KEPT = 16  # starts that get steps, beyond the contacts asked for, in a first query
WIDE_KEPT = 5  # and in a later one
COLD_SECOND = 4  # of these, those that go on after two steps
WIDE_SECOND = 1
SPARE = 1  # contacts looked for beyond those asked for
RETRIES = 2  # candidates that may turn out to be no contact, with a memory
COLD_STEPS = 30  # at most, to finish a contact, in a first query
WARM_STEPS = 8  # and in a later one
SLOW, PATIENCE = 0.8, 3  # share of the gap that so many steps in a row leave, where a candidate is given up
CLOSE = 5e-3  # rad: the residual at which a candidate's cost is good enough to compare
CONVERGED = 1e-4  # rad: and at which a contact is done; its distance is right to the square of it
TOUCH = 5e-5  # m: greatest |f| of a contact, and the penetration of other pieces that is overlooked


class Search(Struct):
    """Workspace of the search, one a thread.

    Attributes:
        found: the candidates.
        choice: those that go on.
        swings, spread, entries: starts of each kind.
        samples: configurations over the limits.
        scratch, work: of the steps and of the distances.
        advance: :func:`cdfctl.fields.kernel.contact.advance`, whose code is long and its callers many.
    """

    found: Candidates
    choice: Choice
    swings: Starts
    spread: Starts
    entries: Starts
    samples: Samples
    scratch: Scratch
    work: Work
    advance: Callable[[Body, Array, Parts, int, Candidates, int, Scratch, Work], None]


def new_search(body: Body, remembered: int) -> Search:
    """A workspace for ``body`` and memories of ``remembered`` contacts an obstacle."""
    k, n = len(body.joint), len(body.chain.parent)
    c = k + remembered + SWINGS + SPREAD + ENTRIES
    found, scratch, work = new_candidates(body, c), new_scratch(n), new_work()
    return Search(
        found=found,
        choice=new_choice(c),
        swings=new_starts(SWINGS, n),
        spread=new_starts(SPREAD, n),
        entries=new_starts(ENTRIES, n),
        samples=spread_samples(body),
        scratch=scratch,
        work=work,
        advance=compiled(advance, body, np.zeros(n), parts_of(()), 0, found, 0, scratch, work),
    )


@njit
def place_at(body: Body, q: Array, search: Search) -> None:
    """Place the joints at q, held within the limits, for :func:`pieces_at`."""
    held = search.scratch.y
    for j in range(q.shape[0]):
        held[j] = min(max(q[j], body.chain.lower[j]), body.chain.upper[j])
    forward(body, held, search.found.frames, search.found.place.shape[0])


@njit
def pieces_at(body: Body, q: Array, parts: Parts, o: int, search: Search) -> int:
    """The first candidates become the pieces as they stand at q, in their order; the one nearest to obstacle o."""
    found, nearest = search.found, 0
    for k in range(body.joint.shape[0]):
        _begin(body, q, parts, o, found, k, k, q)
        found.place[k] = found.place.shape[0]
        evaluate_placed(body, q, parts, o, found, k, search.work)
        if found.f[k] < found.f[nearest]:
            nearest = k
    return nearest


@njit
def _begin(body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, k: int, x: Array) -> None:
    """Candidate c begins with piece k at x, joints that do not move the piece as in q."""
    found.piece[c], found.curvature[c] = k, curvature_at(body, parts, o, k)
    for j in range(q.shape[0]):
        inside = min(max(x[j], body.chain.lower[j]), body.chain.upper[j])
        found.x[c, j] = inside if body.chain.moves[j, body.joint[k]] else q[j]


@njit
def add_start(body: Body, q: Array, parts: Parts, o: int, search: Search, c: int, k: int, x: Array) -> None:
    """Candidate c begins with piece k at x, joints that do not move the piece as in q, and is evaluated."""
    _begin(body, q, parts, o, search.found, c, k, x)
    evaluate(body, q, parts, o, search.found, c, search.work)


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
    """The contacts with obstacle o nearest to q, which must be clear of it: nearest first in ``search.choice.chosen``.

    At most ``sheets`` of them, told apart by ``DISTINCT``; the answer says how many. :func:`pieces_at` must have been
    called. ``memory`` is used and renewed; ``centre`` and ``size`` are of a ball around the obstacle, or around what of
    it is near.
    """
    found, choice = search.found, search.choice
    pieces = body.joint.shape[0]
    warm, cold = max(0, memory.known[o]), memory.known[o] == UNKNOWN
    count = pieces + warm
    for i in range(warm):
        add_start(body, q, parts, o, search, pieces + i, memory.piece[o, i], memory.x[o, i])
    wanted = sheets + SPARE
    if cold or memory.leapt[o] != 0 or memory.turn[0] % memory.known.shape[0] == o:
        count = _add_starts(body, q, parts, o, table, centre, size, search, count)
        kept = choose(found, count, (COLD_KEPT if cold else WIDE_KEPT) + sheets, choice)
        _improve_chosen(body, q, parts, o, search, kept, 2)
        kept = choose(found, count, (COLD_SECOND if cold else WIDE_SECOND) + sheets, choice)
        _improve_chosen(body, q, parts, o, search, kept, 3)
        most, thorough, steps = count if cold else wanted + RETRIES, True, COLD_STEPS if cold else WARM_STEPS
    else:
        _keep_promising(search, pieces, warm)
        # Where there was a contact a moment ago there is one now, as a rule: then the search gives up on none too soon.
        most, thorough, steps = wanted + RETRIES, warm > 0, WARM_STEPS
    _finish_best(body, q, parts, o, search, count, warm, wanted, most, thorough, steps)
    keep(memory, o, found, choice, choose(found, count, wanted, choice))
    return choose_distinct(found, count, sheets, choice)


@njit
def _add_starts(
    body: Body, q: Array, parts: Parts, o: int, table: Table, p: Vec, size: float, search: Search, count: int
) -> int:
    """Further candidates, beyond the ``count`` there are: swings, samples and entries of the table; how many then."""
    swings, spread, entries = search.swings, search.spread, search.entries
    place = search.found.place.shape[0]
    for i in range(swing_starts(body, q, search.found.frames, place, p, size, swings)):
        add_start(body, q, parts, o, search, count, swings.piece[i], swings.x[i])
        count += 1
    for i in range(sample_starts(body, q, p, size, search.samples, spread)):
        add_start(body, q, parts, o, search, count, spread.piece[i], spread.x[i])
        count += 1
    for i in range(table_starts(body, q, table, p, entries)):
        add_start(body, q, parts, o, search, count, entries.piece[i], entries.x[i])
        count += 1
    return count


@njit
def _keep_promising(search: Search, pieces: int, warm: int) -> None:
    """Of the pieces as they stand at q, keep the one of least cost that has no contact among the ``warm`` known ones.

    It must promise to be nearer than all of these.
    """
    found = search.found
    nearest, best = np.inf, -1
    for c in range(pieces, pieces + warm):
        nearest = min(nearest, found.cost[c])
    for k in range(pieces):
        known = False
        for c in range(pieces, pieces + warm):
            known = known or found.piece[c] == k
        if not known and found.cost[k] < nearest and (best < 0 or found.cost[k] < found.cost[best]):
            best = k
    for k in range(pieces):
        if k != best:
            found.cost[k] = np.inf


@njit
def _finish_best(
    body: Body,
    q: Array,
    parts: Parts,
    o: int,
    search: Search,
    count: int,
    warm: int,
    wanted: int,
    most: int,
    thorough: bool,
    steps: int,
) -> None:
    """Finish candidates, the most promising first, until ``wanted`` are contacts or ``most`` have been tried, and then
    what is left of the ``warm`` remembered ones, which are nearly always contacts.

    If ``thorough``, more than ``most`` are tried as long as none was a contact. All that are left, and those that turn
    out to be none, or one that was found before, get an infinite cost.
    """
    found, choice = search.found, search.choice
    pieces = body.joint.shape[0]
    unmark(choice, count)
    contacts = 0
    tries = 0
    while contacts < wanted and (tries < most or (thorough and contacts == 0)):
        best = cheapest(found, count, choice)
        if best < 0:
            break
        if marked_like(found, count, best, choice) >= 0:
            choice.marked[best] = True
            found.cost[best] = np.inf
            continue
        contacts += _finish_new(body, q, parts, o, search, count, best, steps)
        tries += 1
    for c in range(pieces, pieces + warm):
        if contacts < wanted and not choice.marked[c] and found.cost[c] < np.inf:
            contacts += _finish_new(body, q, parts, o, search, count, c, steps)
    for c in range(count):
        if not choice.marked[c]:
            found.cost[c] = np.inf


@njit
def _finish_new(body: Body, q: Array, parts: Parts, o: int, search: Search, count: int, c: int, steps: int) -> int:
    """Finish and mark candidate c; 1 where it is a contact that no marked one is, else 0.

    Where another piece penetrates, a candidate slides to that piece's contact: several may end in the same one. Then
    the nearer stays, the other gets an infinite cost.
    """
    found, choice = search.found, search.choice
    choice.marked[c] = True
    _finish(body, q, parts, o, search, c, steps)
    if not found.cost[c] < np.inf:
        return 0
    other = marked_like(found, count, c, choice)
    if other < 0:
        return 1
    found.cost[c if found.cost[c] >= found.cost[other] else other] = np.inf
    return 0


@njit
def _improve_chosen(body: Body, q: Array, parts: Parts, o: int, search: Search, kept: int, steps: int) -> None:
    for i in range(kept):
        _improve(body, q, parts, o, search, search.choice.chosen[i], steps, CLOSE)


@njit
def _improve(body: Body, q: Array, parts: Parts, o: int, search: Search, c: int, steps: int, tolerance: float) -> None:
    """Up to ``steps`` steps of candidate c, until its residual is below ``tolerance``, rad.

    One that comes no nearer to the surface gets an infinite cost, which another step would undo: it is out of reach.
    """
    found = search.found
    stalled = 0
    for _ in range(steps):
        gap = abs(found.f[c])
        if found.residual[c] < tolerance and gap < TOUCH:
            return
        search.advance(body, q, parts, o, found, c, search.scratch, search.work)
        if not is_near(found, c) and abs(found.f[c]) > SLOW * gap:
            stalled += 1
            if stalled == PATIENCE:
                found.cost[c] = np.inf
                return
        else:
            stalled = 0


@njit
def _finish(body: Body, q: Array, parts: Parts, o: int, search: Search, c: int, steps: int) -> None:
    """Candidate c to convergence, or for ``steps`` steps.

    Its cost becomes its distance from q, infinite where it is no contact.
    """
    found = search.found
    for _ in range(2):
        _improve(body, q, parts, o, search, c, steps, CONVERGED)
        if not found.cost[c] < np.inf:
            return
        restore(body, q, parts, o, found, c, search.scratch, search.work)
        if not abs(found.f[c]) <= TOUCH:
            found.cost[c] = np.inf
            return
        other = penetrating_piece(body, parts, o, found, c, TOUCH, False, search.work)
        if other < 0:
            return
        found.piece[c] = other
        for j in range(q.shape[0]):
            if not body.chain.moves[j, body.joint[other]]:
                found.x[c, j] = q[j]
        evaluate(body, q, parts, o, found, c, search.work)
    found.cost[c] = np.inf
