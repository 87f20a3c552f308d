"""The search: plans are made at random around the best so far, scored, and the best is kept."""

from __future__ import annotations

from math import exp, inf
from typing import NamedTuple

import numpy as np

from cdfctl.control.planner.arm import Arm
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.jit import njit
from cdfctl.control.planner.march import Space, march
from cdfctl.control.planner.random import Stream, normal, uniform
from cdfctl.types import Array

HIT = 1000.0
CLEAR = 0.15
WEIGHT = 3.0
HOLD = 1.0
SHARE = 0.4


class Aim(NamedTuple):
    goal: Array
    turn: Array  # (n,) 2 pi for continuous
    speed: Array
    low: Array
    high: Array
    limit: Array
    stay: float
    horizon: float


class Plan(NamedTuple):
    u: Array  # (S+1, n) the last is the tail
    tau: Array  # (S+1,)
    value: Array  # (4,) J, hit time, t_end, min d


def new_plan(segments: int, n: int) -> Plan:
    return Plan(np.zeros((segments + 1, n)), np.zeros(segments + 1), np.array([np.inf, 0.0, 0.0, 0.0]))


@njit
def copy_plan(a: Plan, b: Plan) -> None:
    for s in range(a.tau.shape[0]):
        b.tau[s] = a.tau[s]
        for j in range(a.u.shape[1]):
            b.u[s, j] = a.u[s, j]
    for i in range(4):
        b.value[i] = a.value[i]


@njit
def shape_plan(aim: Aim, plan: Plan, q: Array, w: Array) -> float:
    """Clip to limits, fill the tail; returns t_end."""
    S, n = plan.u.shape
    S -= 1
    t = 0.0
    for j in range(n):
        w[j] = q[j]
    for s in range(S):
        tau = plan.tau[s]
        if tau <= 0.0:
            plan.tau[s] = 0.0
            continue
        for j in range(n):
            u = min(aim.limit[j], max(-aim.limit[j], plan.u[s, j]))
            x = w[j] + u * tau
            if x > aim.high[j]:
                u = max(0.0, aim.high[j] - w[j]) / tau
            elif x < aim.low[j]:
                u = min(0.0, aim.low[j] - w[j]) / tau
            plan.u[s, j] = u
            w[j] += u * tau
        t += tau
    tail = 0.0
    for j in range(n):
        d = aim.goal[j] - w[j]
        if aim.turn[j] > 0.0:
            d -= aim.turn[j] * np.floor(d / aim.turn[j] + 0.5)
        plan.u[S, j] = d
        tail = max(tail, abs(d) / aim.speed[j])
    plan.tau[S] = tail
    for j in range(n):
        plan.u[S, j] = plan.u[S, j] / tail if tail > 0.0 else 0.0
    return t + tail


@njit
def score(
    arm: Arm, course: Course, aim: Aim, plan: Plan, q: Array, bound: float, w: Array, rest: Array, space: Space
) -> float:
    t_end = shape_plan(aim, plan, q, w)
    plan.value[2] = t_end
    plan.value[0] = inf
    if t_end >= bound:
        return inf
    S, n = plan.u.shape
    for j in range(n):
        w[j] = q[j]
    t, least = 0.0, CLEAR
    for s in range(S):
        tau = plan.tau[s]
        if tau <= 0.0:
            continue
        hit, d = march(arm, course, w, plan.u[s], t, t + tau, CLEAR, space)
        least = min(least, d)
        if hit < inf:
            plan.value[0], plan.value[1], plan.value[3] = HIT - 100.0 * hit - 10.0 * least, hit, least
            return plan.value[0]
        for j in range(n):
            w[j] += plan.u[s, j] * tau
        t += tau
        if t_end + WEIGHT * (CLEAR - least) >= bound:
            return inf
    J = t_end + WEIGHT * (CLEAR - least)
    hit_time = inf
    stay = min(aim.stay, max(t_end, aim.horizon)) - t
    if stay > 0.0:
        hit, d = march(arm, course, w, rest, t, t + stay, CLEAR, space)
        if hit < inf:
            J, hit_time = HIT - 100.0 * hit - 10.0 * d, hit
    elif True:
        hit, d = march(arm, course, w, rest, t, t + HOLD, CLEAR, space)
        if hit < inf:
            J += 0.5 * (1.0 - (hit - t) / HOLD)
    plan.value[0], plan.value[1], plan.value[3] = J, hit_time, least
    return J


@njit
def vary(aim: Aim, best: Plan, plan: Plan, stream: Stream) -> None:
    S = plan.tau.shape[0] - 1
    n = plan.u.shape[1]
    for s in range(S):
        plan.tau[s] = best.tau[s]
        for j in range(n):
            plan.u[s, j] = best.u[s, j]
    size = 0.02 + 0.6 * uniform(stream) ** 2
    one = int(uniform(stream) * S) if uniform(stream) < 0.5 else -1
    for s in range(S):
        if one >= 0 and s != one:
            continue
        if plan.tau[s] <= 0.0:
            if uniform(stream) < 0.5:
                plan.tau[s] = 0.5 * uniform(stream)
                for j in range(n):
                    plan.u[s, j] = aim.limit[j] * (2.0 * uniform(stream) - 1.0)
            continue
        plan.tau[s] *= exp(size * normal(stream))
        for j in range(n):
            plan.u[s, j] += size * aim.limit[j] * normal(stream)


@njit
def fresh(aim: Aim, plan: Plan, stream: Stream) -> None:
    S = plan.tau.shape[0] - 1
    n = plan.u.shape[1]
    count = 1 + int(uniform(stream) * S)
    left = aim.horizon * uniform(stream)
    total = 0.0
    for s in range(S):
        plan.tau[s] = uniform(stream) if s < count else 0.0
        total += plan.tau[s]
        kind = uniform(stream)
        for j in range(n):
            x = uniform(stream)
            if kind < 0.4:
                v = 1.0 if x < 0.5 else -1.0
            elif kind < 0.6:
                v = 1.0 if x < 1.0 / 3.0 else (-1.0 if x > 2.0 / 3.0 else 0.0)
            elif kind < 0.7:
                v = 0.0
            else:
                v = 2.0 * x - 1.0
            plan.u[s, j] = v * aim.limit[j]
    for s in range(S):
        plan.tau[s] *= left / total


@njit
def shift(plan: Plan, dt: float) -> None:
    """Drop the first dt."""
    for s in range(plan.tau.shape[0]):
        used = min(dt, plan.tau[s])
        plan.tau[s] -= used
        dt -= used


@njit
def search(
    arm: Arm,
    course: Course,
    aim: Aim,
    best: Plan,
    trial: Plan,
    q: Array,
    first: int,
    last: int,
    effort: float,
    stream: Stream,
    w: Array,
    rest: Array,
    space: Space,
) -> int:
    space.looks[0] = 0.0
    S = trial.tau.shape[0] - 1
    for c in range(first, last):
        if c == 0:
            score(arm, course, aim, best, q, inf, w, rest, space)
        else:
            if c == 1:
                for s in range(S):
                    trial.tau[s] = 0.0
            elif best.value[0] < inf and uniform(stream) < SHARE:
                vary(aim, best, trial, stream)
            else:
                fresh(aim, trial, stream)
            if score(arm, course, aim, trial, q, best.value[0], w, rest, space) < best.value[0]:
                copy_plan(trial, best)
        if space.looks[0] >= effort:
            return c + 1
    return last
