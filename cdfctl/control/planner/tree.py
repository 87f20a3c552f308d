"""A tree of motions that keep their margins: its nodes, and where the next motion starts."""

from __future__ import annotations

from math import exp, inf, pi

import numpy as np

from cdfctl.control.planner.jit import njit
from cdfctl.control.planner.plan import CLEAR, Aim, Plan, bound_motion, free_cost, straight
from cdfctl.control.planner.random import Stream, normal, uniform
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array, IntArray

LOCAL = 0.35  # share of the random motions that start on the best plan
STUCK = 0.6  # the same where what makes the best plan fail is to be got over
BETWEEN = 0.6  # share of them that start in the middle of an edge
BEYOND = 1.0  # s: then no motion goes farther past the time at which the best plan fails
LONGEST = 1.5  # s: longest motion toward a random configuration


class Tree(Struct):
    """Up to N nodes (configuration, time); node 0 is where the robot is now. S is the most edges of a way.

    Attributes:
        q: (N, n) configurations.
        u: (N, n) velocity of the edge that leads to a node.
        at: (N, 5) time, duration of that edge, least distance since the root, how often it was started from, the worst
            grade since the root.
        parent: (N,) the node before, -1 for the root.
        depth: (N,) edges since the root.
        used: (2,) nodes in use; the node where the best plan leaves the tree for the goal, 0 for none.
        move: (S+2, n) motions to be tried, one after the other, and room for two more.
        tau: (S,) their durations, s.
        work: (n,) room for a configuration.
    """

    q: Array
    u: Array
    at: Array
    parent: IntArray
    depth: IntArray
    used: IntArray
    move: Array
    tau: Array
    work: Array


def new_tree(nodes: int, segments: int, n: int) -> Tree:
    """A tree without nodes, with room for ``nodes``."""
    return Tree(
        np.zeros((nodes, n)),
        np.zeros((nodes, n)),
        np.zeros((nodes, 5)),
        np.zeros(nodes, dtype=np.int64),
        np.zeros(nodes, dtype=np.int64),
        np.zeros(2, dtype=np.int64),
        np.zeros((segments + 2, n)),
        np.zeros(segments),
        np.zeros(n),
    )


@njit
def plant(tree: Tree, q: Array) -> None:
    """Only the root is left, at q (n,)."""
    for j in range(q.shape[0]):
        tree.q[0, j], tree.u[0, j] = q[j], 0.0
    tree.at[0, 0], tree.at[0, 1], tree.at[0, 2], tree.at[0, 3] = 0.0, 0.0, CLEAR, 0.0
    tree.at[0, 4] = 0.0
    tree.parent[0], tree.depth[0], tree.used[0], tree.used[1] = -1, 0, 1, 0


@njit
def recall(best: Plan, tree: Tree) -> int:
    """The motions of the best plan, which is one no more, into ``move``: how many there are."""
    count = 0
    while count < tree.tau.shape[0] and best.tau[count] > 0.0:
        tree.tau[count] = best.tau[count]
        for j in range(tree.work.shape[0]):
            tree.move[count, j] = best.u[count, j]
        count += 1
    best.value[0], best.value[1] = inf, 0.0
    return count


@njit
def add_node(tree: Tree, parent: int, u: Array, tau: float, least: float, grade: int) -> int:
    """The node after ``tau`` at ``u`` from ``parent``; -1 where the tree is full."""
    new = int(tree.used[0])
    if new >= tree.q.shape[0]:
        return -1
    for j in range(u.shape[0]):
        tree.u[new, j] = u[j]
        tree.q[new, j] = tree.q[parent, j] + tau * u[j]
    tree.at[new, 0], tree.at[new, 1], tree.at[new, 2] = tree.at[parent, 0] + tau, tau, least
    tree.at[new, 3], tree.at[new, 4] = 0.0, grade
    tree.parent[new], tree.depth[new] = parent, tree.depth[parent] + 1
    tree.used[0] = new + 1
    return new


@njit
def keep(
    best: Plan, tree: Tree, node: int, u: Array, tau: float, cost: float, hit: float, least: float, grade: int
) -> None:
    """The way to ``node``, then ``tau`` at ``u``, becomes the best plan."""
    last = best.tau.shape[0] - 1
    best.value[0], best.value[1], best.value[2], best.value[3] = cost, hit, least, grade
    for s in range(last):
        best.tau[s] = 0.0
    best.tau[last] = tau
    for j in range(u.shape[0]):
        best.u[last, j] = u[j]
    tree.used[1] = node
    while node > 0:
        s = tree.depth[node] - 1
        best.tau[s] = tree.at[node, 1]
        for j in range(u.shape[0]):
            best.u[s, j] = tree.u[node, j]
        node = tree.parent[node]


@njit
def propose_random(aim: Aim, tree: Tree, near: bool, stream: Stream) -> int:
    """A random motion into ``move[0]``; the node it starts from, -1 for none.

    It starts on the best plan, or where few have started: all joints at full speed, or some of them and the others at
    rest or on the straight way to the goal; or rest; or any speed. ``near`` is for more on the best plan.
    """
    node = int(tree.used[1])
    if node > 0 and uniform(stream) < (STUCK if near else LOCAL):
        for _ in range(int(uniform(stream) * tree.depth[node])):
            node = int(tree.parent[node])
    else:
        node = int(uniform(stream) * tree.used[0])
        other = int(uniform(stream) * tree.used[0])
        if tree.at[other, 3] < tree.at[node, 3]:
            node = other
    tree.at[node, 3] += 1.0
    if node > 0 and uniform(stream) < BETWEEN:
        share, least = uniform(stream), tree.at[node, 2]
        node = add_node(tree, tree.parent[node], tree.u[node], share * tree.at[node, 1], least, int(tree.at[node, 4]))
    if node < 0 or tree.depth[node] >= tree.tau.shape[0] or tree.at[node, 0] >= aim.horizon:
        return -1
    kind, n = uniform(stream), tree.work.shape[0]
    some = max(2.0 / n, 1.0 / 3.0)
    straight(aim, tree.q[node], tree.move[0])
    for j in range(n):
        x, y = uniform(stream), uniform(stream)
        if kind < 0.3 or (kind < 0.7 and y < some):
            tree.move[0, j] = aim.limit[j] if x < 0.5 else -aim.limit[j]
        elif kind < 0.5 or 0.7 <= kind < 0.8:
            tree.move[0, j] = 0.0
        elif kind >= 0.8:
            tree.move[0, j] = (2.0 * x - 1.0) * aim.limit[j]
    x = uniform(stream)
    tree.tau[0] = min(0.02 + 1.2 * x * x, aim.horizon - tree.at[node, 0])
    return node


@njit
def propose_toward(aim: Aim, best: Plan, tree: Tree, near: bool, stream: Stream) -> int:
    """A motion toward a random configuration and time into ``move[0]``; the node it starts from, -1 for none.

    That is the last node from which the configuration can be reached in time, so that the tree spreads to where it has
    not been. ``near`` is for times not far beyond that at which the best plan fails.
    """
    q, n = tree.work, tree.work.shape[0]
    # Few joints can be sampled in all their range; of many, most samples are taken near the straight way.
    x = uniform(stream)
    spread = 2.0 * pi if uniform(stream) * n < 2.0 else pi * x * x
    for j in range(n):
        here = tree.q[0, j]
        low = max(aim.low[j], min(here, aim.goal[j]) - spread)
        high = min(aim.high[j], max(here, aim.goal[j]) + spread)
        q[j] = low + (high - low) * uniform(stream)
    t = (min(aim.horizon, best.value[1] + BEYOND) if near else aim.horizon) * uniform(stream)
    if best.value[1] == inf and t + straight(aim, q, tree.move[0]) >= best.value[0]:
        return -1
    node, latest = -1, -1.0
    for i in range(tree.used[0]):
        left = t - tree.at[i, 0]
        if left <= 0.0 or tree.at[i, 0] <= latest or tree.depth[i] >= tree.tau.shape[0]:
            continue
        j = 0
        while j < n and abs(q[j] - tree.q[i, j]) <= aim.limit[j] * left:
            j += 1
        if j == n:
            node, latest = i, tree.at[i, 0]
    if node >= 0:
        for j in range(n):
            tree.move[0, j] = (q[j] - tree.q[node, j]) / (t - latest)
        tree.tau[0] = min(t - latest, LONGEST)
    return node


@njit
def propose_change(aim: Aim, best: Plan, tree: Tree, stream: Stream) -> int:
    """The best plan with its motions changed a little, all or one of them, into ``move``: how many there are."""
    n, count = tree.work.shape[0], 0
    while count < tree.tau.shape[0] and best.tau[count] > 0.0:
        count += 1
    if count == 0:
        return 0
    size = 0.02 + 0.5 * uniform(stream) ** 2
    one = int(uniform(stream) * count) if uniform(stream) < 0.5 else -1
    q, total = tree.work, 0.0
    for j in range(n):
        q[j] = tree.q[0, j]
    for s in range(count):
        tree.tau[s] = best.tau[s]
        for j in range(n):
            tree.move[s, j] = best.u[s, j]
        if one < 0 or s == one:
            tree.tau[s] *= exp(size * normal(stream))
            for j in range(n):
                tree.move[s, j] += size * aim.limit[j] * normal(stream)
        bound_motion(aim, q, tree.move[s], tree.tau[s])
        for j in range(n):
            q[j] += tree.move[s, j] * tree.tau[s]
        total += tree.tau[s]
    return count if free_cost(total + straight(aim, q, tree.move[count]), CLEAR) < best.value[0] else 0
