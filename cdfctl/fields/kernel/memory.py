"""What is remembered of one query for the next: contacts, as starts, and where everything was."""

from __future__ import annotations

import numpy as np

from cdfctl.fields.kernel.candidates import Candidates, Choice
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import copy
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array, BoolArray, IntArray

UNKNOWN, NOTHING = 0, -1  # in a memory: nothing is known of an obstacle; no contact was found
STEADY = 0.5  # share of a contact's motion by which the motion before may differ, if it is to go on like that
NONE, ALL = -2, -1  # of the kinds of starts, which count from 0
LEAP = 0.05  # m, or rad of a joint, between two queries: an obstacle that moved so far is searched widely
DRIFT = 0.15  # m, or rad, since its last turn: one that moved so far is searched from all kinds of starts at its turn


class Memory(Struct):
    """Contacts remembered from the last query, obstacle by obstacle: starts of the next one.

    Attributes:
        known: (m,) how many; 0 where nothing is known yet, -1 where the last query found no contact.
        piece: (m, w).
        x: (m, w, n).
        motion: (m, w, n) how far the contact had moved when it was found, from the query before.
        steady: (m, w) whether it moved as far as in the query before that one, nearly.
        tried: (m, k) m, how far piece k was when it was last tried as a start of a new contact; infinite where it never
            was, or has one.
        turn: (1,) counts the queries: it is the turn of obstacle ``turn % m``.
        leapt: (m,) not 0 where obstacle or robot moved by more than :data:`LEAP` since the last query.
        drift: (m,) how far obstacle and robot have moved since its last turn, query by query, m or rad of a joint.
        q, pose: (n,), (m, 7) of the last query.
        before, moved: (w, n) workspace of :func:`keep`; ``start`` (n,) that of :func:`expect`.
    """

    known: IntArray
    piece: IntArray
    x: Array
    motion: Array
    steady: BoolArray
    tried: Array
    turn: IntArray
    leapt: IntArray
    drift: Array
    q: Array
    pose: Array
    before: Array
    moved: Array
    start: Array


def new_memory(m: int, w: int, n: int, k: int) -> Memory:
    """An empty memory of ``w`` contacts of each of m obstacles with a robot of n joints and k pieces."""
    return Memory(
        np.zeros(m, dtype=np.int64),
        np.zeros((m, w), dtype=np.int64),
        np.zeros((m, w, n)),
        np.zeros((m, w, n)),
        np.zeros((m, w), dtype=np.bool_),
        np.full((m, k), np.inf),
        np.zeros(1, dtype=np.int64),
        np.zeros(m, dtype=np.int64),
        np.zeros(m),
        np.zeros(n),
        np.zeros((m, 7)),
        np.zeros((w, n)),
        np.zeros((w, n)),
        np.zeros(n),
    )


@njit
def begin_query(memory: Memory, q: Array, parts: Parts) -> None:
    """Count the query and mark what has moved far since the last one."""
    first = memory.turn[0] == 0
    memory.turn[0] += 1
    robot = 0.0
    for j in range(q.shape[0]):
        robot = max(robot, abs(q[j] - memory.q[j]))
        memory.q[j] = q[j]
    for o in range(memory.leapt.shape[0]):
        moved = robot
        for j in range(7):
            moved = max(moved, abs(parts.pose[o, j] - memory.pose[o, j]))
            memory.pose[o, j] = parts.pose[o, j]
        memory.leapt[o] = 1 if moved > LEAP and not first else 0
        memory.drift[o] = 0.0 if first else memory.drift[o] + moved


@njit
def kind_now(memory: Memory, o: int, kinds: int) -> int:
    """Which kind of starts, of so many, obstacle o is to be searched from in this query: :data:`ALL` where nothing is
    known, after a leap, and at its turn if much has moved since the last one; else at its turn the next kind, and
    :data:`NONE` before."""
    m = memory.known.shape[0]
    turn = memory.turn[0] % m == o
    whole = memory.known[o] == UNKNOWN or memory.leapt[o] != 0 or (turn and memory.drift[o] > DRIFT)
    if turn or whole:
        memory.drift[o] = 0.0
    return ALL if whole else (memory.turn[0] // m) % kinds if turn else NONE


@njit
def expect(memory: Memory, o: int, i: int) -> None:
    """Where contact i of obstacle o is now, into ``memory.start``: on its way, if it is steady, or where it was."""
    share = 1.0 if memory.steady[o, i] and memory.leapt[o] == 0 else 0.0
    for j in range(memory.start.shape[0]):
        memory.start[j] = memory.x[o, i, j] + share * memory.motion[o, i, j]


@njit
def keep(memory: Memory, o: int, found: Candidates, choice: Choice, kept: int, pieces: int) -> None:
    """Remember the first ``kept`` of ``choice.chosen`` as the contacts of obstacle o, as many as there is room for.

    Candidate ``pieces`` + i began as the remembered contact i.
    """
    count, warm = min(kept, memory.piece.shape[1]), max(0, memory.known[o])
    memory.known[o] = count if count > 0 else NOTHING
    for i in range(warm):
        copy(memory.x[o, i], memory.before[i])
        copy(memory.motion[o, i], memory.moved[i])
    for i in range(count):
        c = choice.chosen[i]
        x, motion, origin = found.x[c], memory.motion[o, i], c - pieces
        change2, size2 = 0.0, 0.0
        for j in range(x.shape[0]):
            motion[j] = x[j] - memory.before[origin, j] if 0 <= origin < warm else 0.0
            change2 += (motion[j] - memory.moved[origin, j]) ** 2 if 0 <= origin < warm else 0.0
            size2 += motion[j] ** 2
        memory.steady[o, i] = change2 < STEADY * STEADY * size2
        memory.piece[o, i], memory.tried[o, found.piece[c]] = found.piece[c], np.inf
        copy(x, memory.x[o, i])
