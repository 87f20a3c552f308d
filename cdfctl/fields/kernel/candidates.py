"""Candidates for the nearest contact of one obstacle, and which of them to keep."""

from __future__ import annotations

import numpy as np

from cdfctl.fields.kernel.body import Body, Frames, new_frames
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import distance2
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array, BoolArray, IntArray

ALIKE = 0.05  # rad: candidates of one piece nearer than this are one
# rad: contacts of one piece nearer than the first figure are not told apart, nor those of two pieces nearer than the
# second, where they meet at a joint. More would do harm: a robot between two contacts, each at its margin of 0.05 rad,
# that has a row for only one of them is driven into the other.
DISTINCT, MEETING = 0.1, 0.01


class Candidates(Struct):
    """c candidate contacts between one obstacle and pieces of the robot, each with all that is known where it stands.

    Attributes:
        piece: (c,) the piece of the robot.
        x: (c, n) configuration.
        f: (c,) signed distance there, m; ``g`` (c, n) its gradient.
        a, b, normal: (c, 3) witness points and normal in the world.
        slope: (c,) norm of g over the joints not at a limit.
        multiplier: (c,) λ, and ``residual`` (c,) the norm of z (c, n) = x - q + λ g over the joints free to move.
        part: (c,) the part of the obstacle that is nearest.
        corners: (c,) how many corners of the cores carry the nearest points, 0 where D is flat; ``corner_a``,
            ``corner_b`` (c, 4, 3) which ones, in the frame of the piece.
        cost: (c,) rad: the distance from q, and the linearised distance still to go to the surface.
        frames: where the joints are, in the ``place`` (c,) of each candidate: its own, or the last, the joints at q.
    """

    piece: IntArray
    x: Array
    f: Array
    g: Array
    a: Array
    b: Array
    normal: Array
    slope: Array
    multiplier: Array
    residual: Array
    z: Array
    part: IntArray
    corners: IntArray
    corner_a: Array
    corner_b: Array
    cost: Array
    place: IntArray
    frames: Frames


class Choice(Struct):
    """Workspace: ``chosen`` (c,) are the candidates that go on, best first; ``marked`` (c,) those dealt with."""

    chosen: IntArray
    marked: BoolArray


def new_candidates(body: Body, c: int) -> Candidates:
    """Places for ``c`` candidates."""
    n = len(body.chain.parent)
    return Candidates(
        piece=np.zeros(c, dtype=np.int64),
        x=np.zeros((c, n)),
        f=np.zeros(c),
        g=np.zeros((c, n)),
        a=np.zeros((c, 3)),
        b=np.zeros((c, 3)),
        normal=np.zeros((c, 3)),
        slope=np.zeros(c),
        multiplier=np.zeros(c),
        residual=np.zeros(c),
        z=np.zeros((c, n)),
        part=np.zeros(c, dtype=np.int64),
        corners=np.zeros(c, dtype=np.int64),
        corner_a=np.zeros((c, 4, 3)),
        corner_b=np.zeros((c, 4, 3)),
        cost=np.zeros(c),
        place=np.zeros(c, dtype=np.int64),
        frames=new_frames(body, c + 1),
    )


def new_choice(c: int) -> Choice:
    """A choice among ``c`` candidates."""
    return Choice(np.zeros(c, dtype=np.int64), np.zeros(c, dtype=np.bool_))


@njit
def choose(found: Candidates, count: int, most: int, choice: Choice) -> int:
    """Up to ``most`` of the first ``count`` candidates of least cost into ``choice.chosen``; how many.

    One nearer than :data:`ALIKE` to a better one of the same piece is passed over.
    """
    return _select(found, count, most, ALIKE, 0.0, choice)


@njit
def choose_distinct(found: Candidates, count: int, most: int, choice: Choice) -> int:
    """As :func:`choose`, passing over those nearer to a better one than :data:`DISTINCT`: one sheet, one contact."""
    return _select(found, count, most, DISTINCT, MEETING, choice)


@njit
def _select(found: Candidates, count: int, most: int, gap: float, meeting: float, choice: Choice) -> int:
    """``gap`` between candidates of one piece, ``meeting`` between those of two, rad."""
    kept = 0
    unmark(choice, count)
    while kept < most:
        best = cheapest(found, count, choice)
        if best < 0:
            break
        choice.marked[best] = True
        alike = False
        for i in range(kept):
            other = choice.chosen[i]
            apart = gap if found.piece[other] == found.piece[best] else meeting
            alike = alike or distance2(found.x[other], found.x[best]) < apart * apart
        if not alike:
            choice.chosen[kept] = best
            kept += 1
    return kept


@njit
def unmark(choice: Choice, count: int) -> None:
    """No candidate is marked any more."""
    for c in range(count):
        choice.marked[c] = False


@njit
def cheapest(found: Candidates, count: int, choice: Choice) -> int:
    """The unmarked candidate of least cost, -1 where none has a finite one."""
    best = -1
    for c in range(count):
        if not choice.marked[c] and found.cost[c] < np.inf and (best < 0 or found.cost[c] < found.cost[best]):
            best = c
    return best


@njit
def marked_cost(found: Candidates, count: int, rank: int, choice: Choice) -> float:
    """The ``rank``-th least cost of the marked candidates, infinite where there are fewer."""
    least = -1.0
    for _ in range(rank):
        next_least = np.inf
        for c in range(count):
            if choice.marked[c] and least < found.cost[c] < next_least:
                next_least = found.cost[c]
        least = next_least
    return least


@njit
def marked_like(found: Candidates, count: int, candidate: int, choice: Choice) -> int:
    """A marked candidate of the same piece and finite cost that the candidate is near, -1 for none."""
    for c in range(count):
        if c == candidate or not choice.marked[c] or not found.cost[c] < np.inf:
            continue
        if found.piece[c] == found.piece[candidate] and distance2(found.x[c], found.x[candidate]) < ALIKE * ALIKE:
            return c
    return -1
