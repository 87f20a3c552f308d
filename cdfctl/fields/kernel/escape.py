"""The way out of penetration: the configuration nearest to q at which no piece is in penetration.

    min 1/2 ||x - q||²   s.t.   f_k(x) >= 0 for every piece k,   lower <= x <= upper

Sequential programming with all constraints linearised at x. Each linearised program is solved in its dual, one
multiplier after the other (Hildreth): given the others, the multiplier of piece k follows from the projection of
q + Σ_{i≠k} μ_i g_i on the half-space of piece k, limits included. At the end, with d_c = -||x - q||,

    x - q = Σ μ_k g_k on the free joints,     ∂d_c/∂t = Σ μ_k ν_kᵀ ḃ_k / ||x - q||

which is the formula of one contact where only one multiplier is positive.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body, Frames, forward, gradient, new_frames
from cdfctl.fields.kernel.distance import Work
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import distance2
from cdfctl.fields.kernel.parts import Parts, time_derivative
from cdfctl.fields.kernel.projection import project
from cdfctl.fields.kernel.rows import nearest_pair
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array

STEPS = 40
SWEEPS = 60
LONGEST_STEP = 0.5  # rad
TOUCH = 5e-5  # m
SETTLED = 1e-6  # rad


class Escape(Struct):
    """Workspace: ``x``, ``y``, ``target`` (n,), per piece ``f``, ``dt``, ``mu`` (k,), ``g`` (k, n), and the joints."""

    x: Array
    y: Array
    target: Array
    f: Array
    dt: Array
    mu: Array
    g: Array
    frames: Frames


def new_escape(body: Body) -> Escape:
    """A workspace for ``body``."""
    k, n = len(body.joint), len(body.chain.parent)
    return Escape(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(k), np.zeros(k), np.zeros(k), np.zeros((k, n)), new_frames(body)
    )


@njit
def escape_from(body: Body, q: Array, parts: Parts, o: int, escape: Escape, work: Work) -> float:
    """Move ``escape.x``, a start, to the nearest way out of obstacle o it leads to; ||x - q||, infinite for none.

    ``f``, ``g``, ``dt`` and ``mu`` of the workspace are those at the end.
    """
    lower, upper = body.chain.lower, body.chain.upper
    x, y, n = escape.x, escape.y, q.shape[0]
    for _ in range(STEPS):
        least = linearise(body, parts, o, escape, work)
        _project_all(q, lower, upper, escape)
        step2 = distance2(y, x)
        if step2 <= SETTLED * SETTLED and least >= -TOUCH:
            break
        share = min(1.0, LONGEST_STEP / sqrt(step2)) if step2 > 0.0 else 0.0
        for j in range(n):
            x[j] += share * (y[j] - x[j])
    least = linearise(body, parts, o, escape, work)
    if not abs(least) <= TOUCH:
        return np.inf
    return sqrt(distance2(x, q))


@njit
def linearise(body: Body, parts: Parts, o: int, escape: Escape, work: Work) -> float:
    """f, g and ∂f/∂t of every piece at ``escape.x``; the least f."""
    forward(body, escape.x, escape.frames, 0)
    least = np.inf
    for k in range(escape.f.shape[0]):
        _, contact = nearest_pair(body, escape.frames, 0, k, k + 1, parts, o, work)
        escape.f[k] = contact.d
        escape.dt[k] = time_derivative(parts, o, contact.b, contact.normal)
        gradient(body, escape.frames, 0, body.joint[k], contact.a, contact.normal, escape.g[k])
        least = min(least, contact.d)
    return least


@njit
def _project_all(q: Array, lower: Array, upper: Array, escape: Escape) -> None:
    """Nearest point to q of the linearised constraints, into ``escape.y``, with its multipliers ``mu``."""
    x, y, target, f, g, mu = escape.x, escape.y, escape.target, escape.f, escape.g, escape.mu
    n, pieces = q.shape[0], f.shape[0]
    mu[:] = 0.0
    for _ in range(SWEEPS):
        change = 0.0
        for k in range(pieces):
            value = f[k]
            for j in range(n):
                target[j] = q[j]
                for i in range(pieces):
                    if i != k and mu[i] > 0.0:
                        target[j] += mu[i] * g[i, j]
                value += g[k, j] * (min(max(target[j], lower[j]), upper[j]) - x[j])
            multiplier = 0.0
            if value < 0.0:
                multiplier = max(0.0, -project(target, x, f[k], g[k], lower, upper, y))
            change = max(change, abs(multiplier - mu[k]))
            mu[k] = multiplier
        if change <= 1e-10:
            break
    for j in range(n):
        y[j] = q[j]
        for k in range(pieces):
            y[j] += mu[k] * g[k, j]
        y[j] = min(max(y[j], lower[j]), upper[j])
