"""What is remembered of one query for the next: contacts, as starts, and where everything was."""

from __future__ import annotations

import numpy as np

from cdfctl.fields.kernel.candidates import Candidates, Choice
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.projection import copy
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array, IntArray

UNKNOWN, NOTHING = 0, -1  # in a memory: nothing is known of an obstacle; no contact was found
LEAP = 0.05  # m, or rad of a joint, between two queries: an obstacle that moved so far is searched widely


class Memory(Struct):
    """Contacts remembered from the last query, obstacle by obstacle: starts of the next one.

    Attributes:
        known: (m,) how many; 0 where nothing is known yet, -1 where the last query found no contact.
        piece: (m, w).
        x: (m, w, n).
        turn: (1,) counts the queries: it is the turn of obstacle ``turn % m``.
        leapt: (m,) not 0 where obstacle or robot moved by more than :data:`LEAP` since the last query.
        q, pose: (n,), (m, 7) of the last query.
    """

    known: IntArray
    piece: IntArray
    x: Array
    turn: IntArray
    leapt: IntArray
    q: Array
    pose: Array


def new_memory(m: int, w: int, n: int) -> Memory:
    """An empty memory for m obstacles."""
    return Memory(
        np.zeros(m, dtype=np.int64),
        np.zeros((m, w), dtype=np.int64),
        np.zeros((m, w, n)),
        np.zeros(1, dtype=np.int64),
        np.zeros(m, dtype=np.int64),
        np.zeros(n),
        np.zeros((m, 7)),
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


@njit
def keep(memory: Memory, o: int, found: Candidates, choice: Choice, kept: int) -> None:
    """Remember the first ``kept`` of ``choice.chosen`` as the contacts of obstacle o, as many as there is room for."""
    count = min(kept, memory.piece.shape[1])
    memory.known[o] = count if count > 0 else NOTHING
    for i in range(count):
        c = choice.chosen[i]
        memory.piece[o, i] = found.piece[c]
        copy(found.x[c], memory.x[o, i])
