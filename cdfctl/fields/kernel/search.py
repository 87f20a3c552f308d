"""The nearest contacts of the whole robot with one obstacle: successive halving over many starts.

A first query of an obstacle, and one after a leap of it or of the robot, searches *widely*, from starts of all kinds:
every start gets two steps; the most promising go on with three more, and the best of those to convergence. A candidate
is promising by its cost, an estimate of the distance from q to the contact it is heading for, and must differ from the
ones kept before it. A converged candidate is a contact only if no other piece is in penetration there; where one is,
that piece touches earlier, and the search goes on with it.

Else an obstacle is *followed*: the contacts remembered from the last query are brought to convergence, and of the
pieces as they stand at q the most promising one, if it may come before them. In each query it is the turn of one
obstacle, which is searched from starts of one kind as well, or of all kinds if it or the robot has moved far since its
last turn. So with m obstacles, what a wide search would find is found within m queries, or 3 m in which little moves.
One kind at a time finds as many contacts as all kinds every time would, at a third of the cost: starts of one kind do
not crowd out those of another.
"""

from __future__ import annotations

from cdfctl.fields.kernel.body import Body
from cdfctl.fields.kernel.candidates import (
    choose,
    choose_distinct,
)
from cdfctl.fields.kernel.contact import (
    evaluate,
)
from cdfctl.fields.kernel.finish import Finisher, finish_best, improve_chosen, new_finisher
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.memory import ALL, NONE, UNKNOWN, Memory, expect, keep, kind_now
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.pieces import Pieces, all_pieces, begin, new_pieces, promising_piece
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
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Vec
from cdfctl.types import Array

STANDING, SWUNG, SAMPLED = 0, 1, 2  # kinds of starts: pieces as they stand and table entries; one-joint turns; samples
KINDS = 3
SWINGS = 8  # one-joint turns kept as starts
SPREAD = 12  # samples kept as starts
ENTRIES = 8  # table entries kept as starts
COLD_KEPT = 8  # starts that get steps, beyond the contacts asked for, in a first query
WIDE_KEPT = 3  # and in a later one
COLD_SECOND = 6  # of these, those that go on after two steps
WIDE_SECOND = 1
SPARE, COLD_SPARE = 1, 2  # contacts looked for beyond those asked for, the latter in a first query
RETRIES, COLD_RETRIES = 3, 5  # candidates finished in search of new contacts, the latter in a first query
COLD_STEPS = 30  # at most, to finish a contact, in a first query
WARM_STEPS = 8  # and in a later one


class Search(Struct):
    """Workspace of the search, one a thread.

    Attributes:
        finisher: the candidates and what it takes to improve them.
        pieces: those as they stand at q, which are the first candidates.
        swings, spread, entries: starts of each kind.
        samples: configurations over the limits.
    """

    finisher: Finisher
    pieces: Pieces
    swings: Starts
    spread: Starts
    entries: Starts
    samples: Samples


def new_search(body: Body, remembered: int) -> Search:
    """A workspace for ``body`` and memories of ``remembered`` contacts an obstacle."""
    k, n = len(body.joint), len(body.chain.parent)
    c = k + remembered + SWINGS + SPREAD + ENTRIES
    return Search(
        finisher=new_finisher(body, c),
        pieces=new_pieces(k),
        swings=new_starts(SWINGS, n),
        spread=new_starts(SPREAD, n),
        entries=new_starts(ENTRIES, n),
        samples=spread_samples(body),
    )


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
    """The contacts with obstacle o nearest to q, which must be clear of it: nearest first in ``chosen`` of the choice.

    At most ``sheets`` of them, told apart by ``DISTINCT``; the answer says how many. :func:`pieces_at` must have been
    called. ``memory`` is used and renewed; ``centre`` and ``size`` are of a ball around the obstacle, or around what of
    it is near.
    """
    finisher, pieces = search.finisher, search.pieces
    found, choice, work = finisher.found, finisher.choice, finisher.work
    first, warm, cold = body.joint.shape[0], max(0, memory.known[o]), memory.known[o] == UNKNOWN
    count = first + warm
    for i in range(warm):
        expect(memory, o, i)
        add_start(body, q, parts, o, finisher, first + i, memory.piece[o, i], memory.start)
    wanted = sheets + (COLD_SPARE if cold else SPARE)
    kind = kind_now(memory, o, KINDS)
    if kind != NONE:
        if kind in (ALL, STANDING):
            all_pieces(body, q, parts, o, memory, found, pieces, work)
        else:
            promising_piece(body, q, parts, o, memory, found, pieces, work)
        count = _add_starts(body, q, parts, o, table, centre, size, search, count, kind)
        kept = choose(found, count, (COLD_KEPT if cold else WIDE_KEPT) + sheets, choice)
        improve_chosen(body, q, parts, o, finisher, kept, 2)
        kept = choose(found, count, (COLD_SECOND if cold else WIDE_SECOND) + sheets, choice)
        improve_chosen(body, q, parts, o, finisher, kept, 3)
        most, thorough, steps = COLD_RETRIES if cold else RETRIES, True, COLD_STEPS if cold else WARM_STEPS
    else:
        promising_piece(body, q, parts, o, memory, found, pieces, work)
        # Where there was a contact a moment ago there is one now, as a rule: then the search gives up on none too soon.
        most, thorough, steps = 1, warm > 0, WARM_STEPS
    finish_best(body, q, parts, o, finisher, count, warm, wanted, most, thorough, steps)
    keep(memory, o, found, choice, choose(found, count, wanted, choice), first)
    return choose_distinct(found, count, sheets, choice)


@njit
def _add_starts(
    body: Body, q: Array, parts: Parts, o: int, table: Table, p: Vec, size: float, search: Search, count: int, kind: int
) -> int:
    """Further candidates of a kind, beyond the ``count`` there are; how many then."""
    finisher = search.finisher
    found = finisher.found
    if kind in (ALL, SWUNG):
        swings = swing_starts(body, q, found.frames, found.place.shape[0], p, size, search.swings)
        count = _add_all(body, q, parts, o, search.swings, swings, finisher, count)
    if kind in (ALL, SAMPLED):
        sampled = sample_starts(body, q, p, size, search.samples, search.spread)
        count = _add_all(body, q, parts, o, search.spread, sampled, finisher, count)
    if kind in (ALL, STANDING):
        entries = table_starts(body, q, table, p, search.entries)
        count = _add_all(body, q, parts, o, search.entries, entries, finisher, count)
    return count


@njit
def _add_all(
    body: Body, q: Array, parts: Parts, o: int, starts: Starts, many: int, finisher: Finisher, count: int
) -> int:
    """The first ``many`` of ``starts`` become candidates, beyond the ``count`` there are; how many then."""
    for i in range(many):
        add_start(body, q, parts, o, finisher, count + i, starts.piece[i], starts.x[i])
    return count + many


@njit
def add_start(body: Body, q: Array, parts: Parts, o: int, finisher: Finisher, c: int, k: int, x: Array) -> None:
    """Candidate c begins with piece k at x, joints that do not move the piece as in q, and is evaluated."""
    begin(body, q, finisher.found, c, k, x)
    evaluate(body, q, parts, o, finisher.found, c, finisher.work)
