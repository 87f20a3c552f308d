"""The search: a tree of motions that keep their margins is grown at random; from its nodes the straight way is tried.

An edge is one straight joint motion, marched once, so that plans with the same beginning share its price. The tree
begins with the best plan of the last step. Once a plan is free, nothing is marched that cannot become better: the time
of a node and the straight way from there bound the cost of every plan through it.
"""

from __future__ import annotations

from math import inf

from cdfctl.control.planner.arm import Arm
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.jit import njit
from cdfctl.control.planner.march import FULL, NARROW, Space, march
from cdfctl.control.planner.plan import CLEAR, Aim, Plan, bound_motion, free_cost, hit_cost, straight
from cdfctl.control.planner.random import Stream, uniform
from cdfctl.control.planner.tree import (
    Tree,
    add_node,
    keep,
    propose_change,
    propose_random,
    propose_toward,
)
from cdfctl.types import Array

CHANGE = 0.25  # share of candidates that vary the best plan, once it is free
TOWARD = 0.7  # share of the others that go toward a random configuration and time
SEEK = 0.5  # the same under a threat, while no plan is free
BOOST = 4  # times as many candidates while no plan is free
GOOD = 1e-3  # s: nothing is sought that is better by less
REST = 1.0  # s: how long the goal should stay free after arrival, where the task does not say
TIGHT = 2.0  # s: what a plan costs more that keeps only a part of its margins
BACK = 0.02  # s: a motion that breaks a margin is kept until this long before


@njit
def search(
    arm: Arm,
    course: Course,
    aim: Aim,
    best: Plan,
    tree: Tree,
    q: Array,
    first: int,
    given: int,
    grade: int,
    threat: bool,
    candidates: int,
    enough: int,
    effort: float,
    search_effort: float,
    stream: Stream,
    space: Space,
) -> int:
    """Try candidates from number ``first`` on.

    Up to ``candidates`` are tried while a plan is free and ``enough`` while none is, or until ``effort``, or
    ``search_effort`` while none is, distances have been evaluated.

    Candidate 0 is the straight way, the others are drawn; but first the ``given`` motions in ``tree.move`` are tried,
    where that is not negative, and ``grade`` says how much of their margins they must keep. Under a
    ``threat`` what makes the best plan fail is to be got over first. Returns the number to go on with; ``enough`` means
    that all is done.
    """
    space.looks[0] = 0.0
    if given >= 0:
        _follow(arm, course, aim, best, tree, 0, given, grade, space)
    least_cost = straight(aim, q, tree.work) + GOOD
    for c in range(first, enough):
        free = c > 0 and best.value[1] == inf
        if free and (c >= candidates or best.value[0] <= least_cost):
            return enough
        if c > 0 and space.looks[0] >= (effort if free else search_effort):
            return c
        node, count = 0, 0
        if c > 0:
            near = threat and not free
            if free and uniform(stream) < CHANGE:
                count = propose_change(aim, best, tree, stream)
            else:
                count = 1
                if uniform(stream) < (SEEK if near else TOWARD):
                    node = propose_toward(aim, best, tree, near, stream)
                else:
                    node = propose_random(aim, tree, near, stream)
            if count == 0 or node < 0:
                continue
        _follow(arm, course, aim, best, tree, node, count, FULL, space)
    return enough


@njit
def _follow(
    arm: Arm, course: Course, aim: Aim, best: Plan, tree: Tree, node: int, count: int, grade: int, space: Space
) -> None:
    """Try ``count`` motions from ``node``, then the straight way, then rest: new nodes, and perhaps a better plan.

    All is one loop about one call of the march: each call more would cost the compiler as long again.
    """
    n, way = tree.work.shape[0], tree.move.shape[0] - 2
    arrival, must, cost, passed = 0.0, 0.0, 0.0, CLEAR
    grade = max(grade, int(tree.at[node, 4]))
    tight = TIGHT if grade >= NARROW else 0.0
    for i in range(count + 2):
        free = best.value[1] == inf
        start, least = tree.at[node, 0], tree.at[node, 2]
        if i < count:
            u, tau = tree.move[i], tree.tau[i]
            if tau <= 0.0:
                return
            bound_motion(aim, tree.q[node], u, tau)
            for j in range(n):
                tree.work[j] = tree.q[node, j] + tau * u[j]
            ahead = straight(aim, tree.work, tree.move[way])
            if free and free_cost(start + tau + ahead, least) + tight >= best.value[0] - GOOD:
                return
            for j in range(n):
                tree.work[j] = tree.q[node, j]
        elif i == count:
            u = tree.move[way]
            tau = straight(aim, tree.q[node], u)
            if free and free_cost(start + tau, least) + tight >= best.value[0]:
                return
            for j in range(n):
                tree.work[j] = tree.q[node, j]
            arrival = start + tau
        else:
            u = tree.move[way + 1]
            must = min(aim.stay, max(arrival, aim.horizon)) - arrival
            for j in range(n):
                tree.work[j] = tree.q[node, j] + tree.move[way, j] * (arrival - start)
                u[j] = 0.0
            start, tau = arrival, max(must, REST)
        hit, d = march(arm, course, tree.work, u, start, start + tau, CLEAR, grade, space)
        least = min(least, d)
        if i < count:
            if hit < inf:
                if not free and hit_cost(hit, least) < best.value[0]:
                    keep(best, tree, node, u, hit - start, hit_cost(hit, least), hit, least, grade)
                if hit - start > 2.0 * BACK:
                    add_node(tree, node, u, hit - start - BACK, tree.at[node, 2], grade)
                return
            node = add_node(tree, node, u, tau, least, grade)
            if node < 0:
                return
        elif i == count:
            cost, passed = free_cost(arrival, least) + tight, least
            if hit < inf:
                if not free and hit_cost(hit, least) < best.value[0]:
                    keep(best, tree, node, u, tau, hit_cost(hit, least), hit, least, grade)
                return
            if cost >= best.value[0]:
                return
        else:
            stop = inf
            if hit < arrival + must:
                cost, stop = hit_cost(hit, passed), hit
            elif hit < inf:
                cost += 0.5 * (1.0 - (hit - arrival) / REST)
            if cost < best.value[0] and (stop == inf or not free):
                keep(best, tree, node, tree.move[way], arrival - tree.at[node, 0], cost, stop, passed, grade)
