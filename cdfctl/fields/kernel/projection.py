"""Nearest point of a linearised surface within joint limits: the inner step of the contact search.

    min 1/2 ||y - target||²   s.t.   f + g·(y - x) = 0,   lower <= y <= upper

At the minimum y(λ) = clip(target - λ g, lower, upper) for one multiplier λ, and g·y(λ) never grows with λ: a root of a
piecewise linear function of one variable, found by Newton's method on the free joints, with bisection where Newton
leaves the bracket. So joint limits are an active set that costs nothing.
"""

from __future__ import annotations

from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array

ROUNDS = 40  # two or three do, as a rule; bisection alone would be at 1e-12 by then


@njit
def project(target: Array, x: Array, f: float, g: Array, lower: Array, upper: Array, y: Array) -> float:
    """Write the nearest point into ``y`` (n,); the multiplier λ.

    Where the limits leave no point on the plane, ``y`` is the corner that comes nearest to it.
    """
    n = target.shape[0]
    level = -f
    for j in range(n):
        level += g[j] * x[j]
    multiplier, least, greatest = 0.0, -1e300, 1e300
    for _ in range(ROUNDS):
        value, slope, size = 0.0, 0.0, 0.0
        for j in range(n):
            free = target[j] - multiplier * g[j]
            y[j] = min(max(free, lower[j]), upper[j])
            value += g[j] * y[j]
            size += abs(g[j] * y[j])
            if lower[j] < free < upper[j]:
                slope += g[j] * g[j]
        excess = value - level
        if abs(excess) <= 1e-14 * (1.0 + size):
            break
        if excess > 0.0:
            least = multiplier
        else:
            greatest = multiplier
        # All joints at limits: the next breakpoint in the direction of the level frees one, if there is any.
        step = multiplier + excess / slope if slope > 0.0 else _next_free(target, g, lower, upper, multiplier, excess)
        if not least < step < greatest:
            if greatest >= 1e300 or least <= -1e300:
                break  # no joint is left to move: the level is out of reach
            step = 0.5 * (least + greatest)
        multiplier = step
    return multiplier


@njit
def _next_free(target: Array, g: Array, lower: Array, upper: Array, multiplier: float, excess: float) -> float:
    """The multiplier, beyond the present one, at which a clipped joint comes off its limit and begins to help.

    Infinite where no joint does.
    """
    best = 1e300 if excess > 0.0 else -1e300
    for j in range(target.shape[0]):
        if g[j] == 0.0:
            continue
        first = (target[j] - upper[j]) / g[j]
        second = (target[j] - lower[j]) / g[j]
        enter, leave = min(first, second), max(first, second)
        if excess > 0.0 and leave > multiplier:
            best = min(best, max(enter, multiplier) + 1e-9 * (leave - max(enter, multiplier)))
        if excess < 0.0 and enter < multiplier:
            best = max(best, min(leave, multiplier) - 1e-9 * (min(leave, multiplier) - enter))
    return best
