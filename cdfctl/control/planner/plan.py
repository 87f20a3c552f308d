"""What a plan is, what it aims at, and what it costs.

A plan is a few straight joint motions, then the straight way to the goal, then rest there. One that keeps its margins
costs the time it takes and a little for passing near; any other costs more, and the less the later it fails.
"""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np

from cdfctl.control.planner.jit import njit
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array

CLEAR = 0.15  # m: passing nearer than this costs
WEIGHT = 3.0  # s/m: that much
HIT = 1000.0  # s: the cost of a plan that fails at once


class Aim(NamedTuple):
    """Where to go and within what bounds.

    Attributes:
        goal: (n,) configuration.
        turn: (n,) 2 pi for a joint that wraps, 0 for one that does not.
        speed: (n,) greatest speed on the straight way to the goal, rad/s.
        low, high: (n,) bounds of the configuration.
        limit: (n,) greatest speed, rad/s.
        stay: until when being at the goal must be free, s from now.
        horizon: the longest the motions before the straight one take together, s.
    """

    goal: Array
    turn: Array
    speed: Array
    low: Array
    high: Array
    limit: Array
    stay: float
    horizon: float


class Plan(Struct):
    """A plan of up to S motions and the straight one, all in arrays of S + 1.

    Attributes:
        u: (S+1, n) velocities, rad/s.
        tau: (S+1,) durations, s; 0 for a motion that is not there. The last is the straight way to the goal.
        value: (4,) cost, s; when a margin is broken, inf for never; least distance, m, at most ``CLEAR``; the grade
            of its margins (see :mod:`cdfctl.control.planner.march`).
    """

    u: Array
    tau: Array
    value: Array


def new_plan(segments: int, n: int) -> Plan:
    """No plan: it costs more than any."""
    return Plan(np.zeros((segments + 1, n)), np.zeros(segments + 1), np.array([inf, 0.0, 0.0, 0.0]))


@njit
def free_cost(arrival: float, least: float) -> float:
    """The cost of a plan that keeps its margins: when it arrives, and how near it passes."""
    return arrival + WEIGHT * (CLEAR - least)


@njit
def hit_cost(time: float, least: float) -> float:
    """The cost of a plan that breaks a margin at ``time``."""
    return HIT - 100.0 * time - 10.0 * least


@njit
def straight(aim: Aim, q: Array, u: Array) -> float:
    """The straight way from q (n,) to the goal, all joints arriving together: its velocity into ``u``, its duration."""
    longest = 0.0
    for j in range(q.shape[0]):
        u[j] = aim.goal[j] - q[j]
        if aim.turn[j] > 0.0:
            u[j] -= aim.turn[j] * np.floor(u[j] / aim.turn[j] + 0.5)
        longest = max(longest, abs(u[j]) / aim.speed[j])
    for j in range(q.shape[0]):
        u[j] = u[j] / longest if longest > 0.0 else 0.0
    return longest


@njit
def bound_motion(aim: Aim, q: Array, u: Array, tau: float) -> None:
    """Change ``u`` so that q + u t stays within the bounds until ``tau``."""
    for j in range(q.shape[0]):
        u[j] = min(aim.limit[j], max(-aim.limit[j], u[j]))
        after = q[j] + u[j] * tau
        if after > aim.high[j]:
            u[j] = max(0.0, aim.high[j] - q[j]) / tau
        elif after < aim.low[j]:
            u[j] = min(0.0, aim.low[j] - q[j]) / tau


@njit
def shift(plan: Plan, dt: float) -> None:
    """The rest of a plan after ``dt``, its motions moved to the front."""
    last = plan.tau.shape[0] - 1
    kept = 0
    for s in range(last):
        used = min(dt, plan.tau[s])
        dt -= used
        left = plan.tau[s] - used
        if left > 1e-9:
            plan.tau[kept] = left
            for j in range(plan.u.shape[1]):
                plan.u[kept, j] = plan.u[s, j]
            kept += 1
    for s in range(kept, last):
        plan.tau[s] = 0.0


@njit
def unfold(plan: Plan, q: Array, dt: float, t: Array, path: Array) -> None:
    """When a plan from q (n,) turns, into ``t`` (S+2,), and where, into ``path`` (S+2, n): NaN after its end. Its mean
    velocity over the first ``dt`` goes into the last row."""
    k, n, last = 0, q.shape[0], path.shape[0] - 1
    t[0] = 0.0
    for j in range(n):
        path[0, j], path[last, j] = q[j], 0.0
    for s in range(plan.tau.shape[0]):
        tau = plan.tau[s]
        if tau <= 0.0:
            continue
        used = min(tau, max(0.0, dt - t[k]))
        k += 1
        t[k] = t[k - 1] + tau
        for j in range(n):
            path[k, j] = path[k - 1, j] + plan.u[s, j] * tau
            path[last, j] += plan.u[s, j] * (used / dt)
    for i in range(k + 1, last):
        t[i] = nan
        for j in range(n):
            path[i, j] = nan
