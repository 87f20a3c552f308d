"""Contacts of every piece of the robot with a ball at one point, from many starts.

A start x is brought onto f_k(x) = 0 by Newton's restoration: the nearest point of the linearised surface within the
limits, again and again. So contacts are spread over the whole of the contact set, not near any q, which is what a table
is for. Of what was found for a piece at most ``most`` are kept, each as far as can be from those kept before it.
"""

from __future__ import annotations

from math import floor, pi, sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body
from cdfctl.fields.kernel.candidates import Candidates, new_candidates
from cdfctl.fields.kernel.contact import STILL, evaluate, penetrating_piece
from cdfctl.fields.kernel.distance import Work, new_work
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import copy
from cdfctl.fields.kernel.parts import Parts, parts_of
from cdfctl.fields.kernel.projection import project
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array, IntArray, Sphere

LANDED = 1e-5  # m: greatest |f| of an entry as it is found; single precision, as it is stored, adds about 1e-7
STEPS = 8  # of restoration
LONGEST = 1.0  # rad, of one step
CROWD = 4  # contacts found, for each that is kept, after which no more starts are tried
ALIKE = 0.02  # rad: of contacts nearer than this to each other one is kept
HOPELESS = 3  # the share, one in so many, of all starts without a contact after which a piece is given up


class Tools(Struct):
    """Workspace, one a thread: one candidate, a step, what was found (s, n), how far each is from those kept (s,)."""

    parts: Parts
    found: Candidates
    y: Array
    pool: Array
    gap: Array
    work: Work


def new_tools(body: Body, radius: float, starts: int) -> Tools:
    """A workspace for a ball of ``radius`` m and ``starts`` starts a piece."""
    n = len(body.chain.parent)
    parts = parts_of((Sphere(radius),))
    return Tools(parts, new_candidates(body, 1), np.zeros(n), np.zeros((starts, n)), np.zeros(starts), new_work())


@njit
def point_contacts(
    body: Body, p: Array, starts: Array, clear: bool, tools: Tools, count: IntArray, contacts: Array
) -> None:
    """Contacts of all pieces with the ball at ``p`` (3,).

    Args:
        body: the robot.
        p: (3,) m.
        starts: (k, s, n) configurations to start from, piece by piece, within the limits.
        clear: leave out contacts at which another piece, no further from the base, is in penetration.
        tools: the workspace.
        count: (k,) gets the number of contacts kept for each piece.
        contacts: (k, most, n) gets them; joints that do not move the piece are 0.
    """
    pose = tools.parts.pose
    pose[0, 0], pose[0, 1], pose[0, 2] = p[0], p[1], p[2]
    most = contacts.shape[1]
    total = starts.shape[1]
    for k in range(body.joint.shape[0]):
        landed = 0
        for s in range(total):
            if landed >= CROWD * most or (landed == 0 and HOPELESS * s >= total):
                break
            if land(body, k, starts[k, s], tools) and not (clear and blocked(body, tools)):
                copy(tools.found.x[0], tools.pool[landed])
                landed += 1
        count[k] = spread(body, k, landed, tools, contacts[k])


@njit
def land(body: Body, k: int, start: Array, tools: Tools) -> bool:
    """Bring piece k from ``start`` onto the surface; whether it got there, with the place in ``tools.found``."""
    found, y, chain = tools.found, tools.y, body.chain
    x, g = found.x[0], found.g[0]
    found.piece[0] = k
    for j in range(x.shape[0]):
        x[j] = start[j] if chain.moves[j, body.joint[k]] else min(max(0.0, chain.lower[j]), chain.upper[j])
    evaluate(body, x, tools.parts, 0, found, 0, tools.work)
    for _ in range(STEPS):
        f = found.f[0]
        if abs(f) <= LANDED:
            return True
        if found.slope[0] <= STILL:
            return False
        project(x, x, f, g, chain.lower, chain.upper, y)
        length2 = 0.0
        for j in range(x.shape[0]):
            length2 += (y[j] - x[j]) ** 2
        if length2 == 0.0:
            return False  # in a corner of the limits
        share = min(1.0, LONGEST / sqrt(length2))
        for j in range(x.shape[0]):
            x[j] += share * (y[j] - x[j])
        evaluate(body, x, tools.parts, 0, found, 0, tools.work)
    return bool(abs(found.f[0]) <= LANDED)


@njit
def blocked(body: Body, tools: Tools) -> bool:
    """Whether another piece is in penetration at the place of ``tools.found``, as far as its joints decide it."""
    return penetrating_piece(body, tools.parts, 0, tools.found, 0, LANDED, True, tools.work) >= 0


@njit
def spread(body: Body, k: int, landed: int, tools: Tools, kept: Array) -> int:
    """Copy the best spread of the first ``landed`` contacts of the pool into ``kept`` (most, n); how many."""
    pool, gap, chain = tools.pool, tools.gap, body.chain
    for s in range(landed):
        gap[s] = np.inf
    count: int = min(landed, kept.shape[0])
    for i in range(count):
        farthest = 0
        for s in range(1, landed):
            if gap[s] > gap[farthest]:
                farthest = s
        if gap[farthest] < ALIKE * ALIKE:
            return i
        for j in range(pool.shape[1]):
            turned = pool[farthest, j] if chain.moves[j, body.joint[k]] else 0.0
            if chain.continuous[j]:
                turned -= 2.0 * pi * floor(turned / (2.0 * pi) + 0.5)
            kept[i, j] = turned
        for s in range(landed):
            gap2 = 0.0
            for j in range(pool.shape[1]):
                apart = abs(pool[s, j] - pool[farthest, j])
                if chain.continuous[j]:
                    apart -= 2.0 * pi * floor(apart / (2.0 * pi) + 0.5)
                gap2 += apart * apart
            gap[s] = min(gap[s], gap2)
    return count


@njit
def all_contacts(
    body: Body, points: Array, starts: Array, clear: bool, tools: Tools, count: IntArray, contacts: Array
) -> None:
    """:func:`point_contacts` for every one of ``points`` (p, 3); the other arrays have p in front of their shapes."""
    for i in range(points.shape[0]):
        point_contacts(body, points[i], starts[i], clear, tools, count[i], contacts[i])
