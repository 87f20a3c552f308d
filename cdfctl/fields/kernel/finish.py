"""Bringing candidates to convergence: which of them are contacts, and of these no two the same."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body
from cdfctl.fields.kernel.candidates import (
    Candidates,
    Choice,
    cheapest,
    marked_cost,
    marked_like,
    new_candidates,
    new_choice,
    unmark,
)
from cdfctl.fields.kernel.contact import Scratch, advance, evaluate, is_near, new_scratch, penetrating_piece, restore
from cdfctl.fields.kernel.distance import Work, new_work
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import distance2
from cdfctl.fields.kernel.parts import Parts, parts_of
from cdfctl.fields.kernel.structs import Struct, compiled
from cdfctl.types import Array

SLOW, PATIENCE = 0.8, 3  # share of the gap that so many steps in a row leave, where a candidate is given up
CLOSE = 5e-3  # rad: the residual at which a candidate's cost is good enough to compare
CONVERGED = 1e-4  # rad: and at which a contact is done; its distance is right to the square of it
TOUCH = 5e-5  # m: greatest |f| of a contact, and the penetration of other pieces that is overlooked


class Finisher(Struct):
    """The candidates and what it takes to improve them.

    Attributes:
        found: the candidates.
        choice: those that go on.
        scratch, work: of the steps and of the distances.
        advance: :func:`cdfctl.fields.kernel.contact.advance`, whose code is long and its callers many.
    """

    found: Candidates
    choice: Choice
    scratch: Scratch
    work: Work
    advance: Callable[[Body, Array, Parts, int, Candidates, int, Scratch, Work], None]


def new_finisher(body: Body, c: int) -> Finisher:
    """A workspace for ``c`` candidates."""
    n = len(body.chain.parent)
    found, scratch, work = new_candidates(body, c), new_scratch(n), new_work()
    step = compiled(advance, body, np.zeros(n), parts_of(()), 0, found, 0, scratch, work)
    return Finisher(found, new_choice(c), scratch, work, step)


@njit
def finish_best(
    body: Body,
    q: Array,
    parts: Parts,
    o: int,
    finisher: Finisher,
    count: int,
    warm: int,
    wanted: int,
    most: int,
    thorough: bool,
    steps: int,
) -> None:
    """Finish the ``warm`` remembered contacts, which are nearly always contacts, and then up to ``most`` others, the
    most promising first, until ``wanted`` of these are contacts or none can come before the ``wanted`` nearest so far.

    If ``thorough``, more than ``most`` are tried as long as there is no contact at all. All that are left, and those
    that turn out to be none, or one that was found before, get an infinite cost.
    """
    found, choice = finisher.found, finisher.choice
    pieces = body.joint.shape[0]
    unmark(choice, count)
    contacts, fresh, tries = 0, 0, 0
    for c in range(pieces, pieces + warm):
        contacts += _finish_new(body, q, parts, o, finisher, count, c, steps, False)
    while fresh < wanted and (tries < most or (thorough and contacts + fresh == 0)):
        best = cheapest(found, count, choice)
        if best < 0 or not found.cost[best] < marked_cost(found, count, wanted, choice):
            break
        if marked_like(found, count, best, choice) >= 0:
            choice.marked[best] = True
            found.cost[best] = np.inf
            continue
        fresh += _finish_new(body, q, parts, o, finisher, count, best, steps, True)
        tries += 1
    for c in range(count):
        if not choice.marked[c]:
            found.cost[c] = np.inf


@njit
def _finish_new(
    body: Body, q: Array, parts: Parts, o: int, finisher: Finisher, count: int, c: int, steps: int, fresh: bool
) -> int:
    """Finish and mark candidate c; 1 where it is a contact that no marked one is, else 0.

    Where another piece penetrates, a candidate slides to that piece's contact: several may end in the same one. Then
    the nearer stays, the other gets an infinite cost. A ``fresh`` one is given up as soon as it comes near another.
    """
    found, choice = finisher.found, finisher.choice
    choice.marked[c] = True
    _finish(body, q, parts, o, finisher, c, steps, count if fresh else 0)
    if not found.cost[c] < np.inf:
        return 0
    other = marked_like(found, count, c, choice)
    if other < 0:
        return 1
    found.cost[c if found.cost[c] >= found.cost[other] else other] = np.inf
    return 0


@njit
def _finish(body: Body, q: Array, parts: Parts, o: int, finisher: Finisher, c: int, steps: int, count: int) -> None:
    """Candidate c to convergence, or for ``steps`` steps, or until it comes near a marked one of the first ``count``.

    Its cost becomes its distance from q, infinite where it is no contact.
    """
    found = finisher.found
    for _ in range(2):
        _improve(body, q, parts, o, finisher, c, steps, CONVERGED, count)
        if not found.cost[c] < np.inf:
            return
        restore(body, q, parts, o, found, c, finisher.scratch, finisher.work)
        if not abs(found.f[c]) <= TOUCH:
            found.cost[c] = np.inf
            return
        other = penetrating_piece(body, parts, o, found, c, TOUCH, False, finisher.work)
        if other < 0:
            found.cost[c] = sqrt(distance2(found.x[c], q))
            return
        found.piece[c] = other
        for j in range(q.shape[0]):
            if not body.chain.moves[j, body.joint[other]]:
                found.x[c, j] = q[j]
        evaluate(body, q, parts, o, found, c, finisher.work)
    found.cost[c] = np.inf


@njit
def improve_chosen(body: Body, q: Array, parts: Parts, o: int, finisher: Finisher, kept: int, steps: int) -> None:
    for i in range(kept):
        _improve(body, q, parts, o, finisher, finisher.choice.chosen[i], steps, CLOSE, 0)


@njit
def _improve(
    body: Body, q: Array, parts: Parts, o: int, finisher: Finisher, c: int, steps: int, tolerance: float, count: int
) -> None:
    """Up to ``steps`` steps of candidate c, until its residual is below ``tolerance``, rad.

    One that comes no nearer to the surface gets an infinite cost, which another step would undo: it is out of reach. So
    does one that comes near a marked one of the first ``count`` candidates.
    """
    found = finisher.found
    stalled = 0
    for _ in range(steps):
        gap = abs(found.f[c])
        if found.residual[c] < tolerance and gap < TOUCH:
            return
        finisher.advance(body, q, parts, o, found, c, finisher.scratch, finisher.work)
        if not is_near(found, c) and abs(found.f[c]) > SLOW * gap:
            stalled += 1
            if stalled == PATIENCE:
                found.cost[c] = np.inf
                return
        else:
            stalled = 0
        if marked_like(found, count, c, finisher.choice) >= 0:
            found.cost[c] = np.inf
            return
