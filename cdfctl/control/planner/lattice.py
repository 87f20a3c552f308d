"""For robots of two joints: a way to the goal on a grid of configurations and times, searched depth first.

Cells lie around the goal, as wide as a joint moves at full speed in one layer of time. Edges are one layer long, each
joint at full speed or at rest, and marched like any other motion; depth first, toward the goal. A cell all of whose
edges have been followed in vain is dead: no way on the grid leads from there to the goal, whatever way leads there. So
the dead cells hold for all steps to come, while the obstacles move as predicted, and a search that takes more than one
step goes on where it was. Random motions, which spread from where the robot is now, are lost with every step.
"""

from __future__ import annotations

from math import ceil, floor, inf, pi

import numpy as np
from numpy.typing import NDArray

from cdfctl.control.planner.arm import Arm
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.jit import njit
from cdfctl.control.planner.march import Space, march
from cdfctl.control.planner.plan import Aim, straight
from cdfctl.fields.kernel.structs import Struct
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, BoolArray, IntArray

JOINTS = 2  # robots with more have too many cells
EXTRA = 4.0  # s: the layers go that far beyond the horizon, and are used so long
NEAR = 3  # layers to whose cells the robot may go straight from where it is
TRIES = 12  # nodes of a way from which the straight one is tried
UNKNOWN, FREE, DEAD = 0, 1, 2  # of a cell: free itself, or no way leads on from there
CELLS = (2 * NEAR + 1) ** 2  # of a layer, about the robot, that it may reach by then


class Lattice(Struct):
    """K layers of C1 x C2 cells.

    Attributes:
        layer: its length, s.
        width: (2,) of a cell, rad or m.
        wraps: (2,) the joint turns without end.
        origin: (2,) the goal's cell.
        seen: (K, C1, C2) what is known of a cell; ``DEAD`` also while it is on the way that is being followed.
        way: (K, 4) that way: layer, cell and the next edge to be tried.
        state: (4,) cells on the way; the next first cell to be tried; 1 where there are no more; motions of the way.
        at: (2, 2) configurations of two cells.
        move: (K+1, 2) velocities and
        tau: (K+1,) durations of the way found.
    """

    layer: float
    width: Array
    wraps: BoolArray
    origin: IntArray
    seen: NDArray[np.uint8]
    way: IntArray
    state: IntArray
    at: Array
    move: Array
    tau: Array


def new_lattice(robot: Robot, goal: Array, width: float, horizon: float, dt: float) -> Lattice:
    """Cells of about ``width`` (rad or m) around ``goal`` (2,), none of them dead."""
    limit = robot.velocity_limit
    layer = dt * max(1, round(width / (float(limit.max()) * dt)))
    wide, origin, count = limit * layer, np.zeros(JOINTS, dtype=np.int64), [0] * JOINTS
    for j in range(JOINTS):
        if robot.continuous[j]:
            count[j] = ceil(2.0 * pi / wide[j])
            wide[j] = 2.0 * pi / count[j]
        else:
            origin[j] = floor((goal[j] - robot.lower[j]) / wide[j])
            count[j] = int(origin[j]) + 1 + floor((robot.upper[j] - goal[j]) / wide[j])
    K = ceil((horizon + EXTRA) / layer)
    return Lattice(
        layer=layer,
        width=wide,
        wraps=np.asarray(robot.continuous, dtype=np.bool_),
        origin=origin,
        seen=np.zeros((K, *count), dtype=np.uint8),
        way=np.zeros((K, 4), dtype=np.int64),
        state=np.zeros(4, dtype=np.int64),
        at=np.zeros((2, JOINTS)),
        move=np.zeros((K + 1, JOINTS)),
        tau=np.zeros(K + 1),
    )


@njit
def forget(lattice: Lattice) -> None:
    """No cell is dead any more."""
    for k in range(lattice.seen.shape[0]):
        for i in range(lattice.seen.shape[1]):
            for j in range(lattice.seen.shape[2]):
                lattice.seen[k, i, j] = UNKNOWN
    lattice.state[0] = lattice.state[1] = lattice.state[2] = 0


@njit
def leave(lattice: Lattice) -> None:
    """Begin again from where the robot is now; dead cells stay dead."""
    for s in range(lattice.state[0]):
        k, i, j, _ = lattice.way[s]
        lattice.seen[k, i, j] = FREE
    lattice.state[0] = lattice.state[1] = lattice.state[2] = 0


@njit
def find(
    arm: Arm, course: Course, aim: Aim, lattice: Lattice, q: Array, now: float, grade: int, effort: float, space: Space
) -> bool:
    """Go on with the search from q (2,) at ``now`` (s since the first layer), until the goal is reached, there is no
    way to it, or ``effort`` distances have been evaluated: whether one of the first two is so.

    The way, or as far as it was followed, is unfolded; ``state[3]`` is how many motions it has.
    """
    space.looks[0] = 0.0
    done = _follow(arm, course, aim, lattice, q, now, grade, effort, space)
    lattice.state[3] = _unfold(arm, course, aim, lattice, q, now, grade, space)
    return done or lattice.state[2] == 1


@njit
def _follow(
    arm: Arm, course: Course, aim: Aim, lattice: Lattice, q: Array, now: float, grade: int, effort: float, space: Space
) -> bool:
    """Follow edges until the goal is reached, or no more are to be followed: whether it is."""
    state, way, seen, layer, at = lattice.state, lattice.way, lattice.seen, lattice.layer, lattice.at
    K, u = seen.shape[0], lattice.move[seen.shape[0]]
    first = floor(now / layer + 1e-6) + 1
    while space.looks[0] < effort and state[2] == 0:
        s = int(state[0])
        if s == 0:
            # A first cell, those of the nearest layer before the others.
            k = first + state[1] // CELLS
            if k >= min(first + NEAR, K):
                state[2] = 1
                break
            x, y = state[1] % CELLS // (2 * NEAR + 1), state[1] % (2 * NEAR + 1)
            state[1] += 1
            i, j = _near(lattice, aim, q, 0, x), _near(lattice, aim, q, 1, y)
            start, end = 0.0, k * layer - now
            at[0, 0], at[0, 1] = q[0], q[1]
        else:
            k, i, j = way[s - 1, 0], way[s - 1, 1], way[s - 1, 2]
            _place(lattice, aim, aim.goal, i, j, 0)
            edge = way[s - 1, 3]
            if edge == 9 or k + 1 == K:
                state[0] -= 1
                continue
            way[s - 1, 3] += 1
            start, end = k * layer - now, (k + 1) * layer - now
            k += 1
            i += _turn(edge // 3, lattice.origin[0] - i, at[0, 0] - aim.goal[0])
            j += _turn(edge % 3, lattice.origin[1] - j, at[0, 1] - aim.goal[1])
        if lattice.wraps[0]:
            i %= seen.shape[1]
        if lattice.wraps[1]:
            j %= seen.shape[2]
        if i < 0 or i >= seen.shape[1] or j < 0 or j >= seen.shape[2] or seen[k, i, j] == DEAD:
            continue
        _place(lattice, aim, at[0], i, j, 1)
        fits = True
        for n in range(2):
            u[n] = (at[1, n] - at[0, n]) / (end - start)
            fits = fits and abs(u[n]) <= aim.limit[n] * (1.0 + 1e-9)
        if not fits:
            continue
        # Most of the edges that are not free end in a cell that is not: it is looked at once for all of them.
        if seen[k, i, j] == UNKNOWN:
            hit, _ = march(arm, course, at[1], u, end, end, 0.0, grade, space)
            seen[k, i, j] = FREE if hit == inf else DEAD
            if hit < inf:
                continue
        hit, _ = march(arm, course, at[0], u, start, end, 0.0, grade, space)
        if hit < inf:
            continue
        seen[k, i, j] = DEAD
        way[s, 0], way[s, 1], way[s, 2], way[s, 3] = k, i, j, 0
        state[0] += 1
        if i == lattice.origin[0] and j == lattice.origin[1]:
            if aim.stay <= end:
                return True
            u[0] = u[1] = 0.0
            hit, _ = march(arm, course, aim.goal, u, end, aim.stay, 0.0, grade, space)
            if hit == inf:
                return True
    return False


@njit
def _near(lattice: Lattice, aim: Aim, q: Array, n: int, order: int) -> int:
    """Of the cells about q along joint n, the one numbered ``order``: toward the goal first."""
    u = aim.goal[n] - q[n]
    if lattice.wraps[n]:
        u -= 2.0 * pi * floor(u / (2.0 * pi) + 0.5)
    cell = lattice.origin[n] - floor(u / lattice.width[n] + 0.5)
    return int(cell + (NEAR - order) * (1 if u >= 0.0 else -1))


@njit
def _turn(order: int, cells: int, ahead: float) -> int:
    """The move of a joint, -1, 0 or 1, numbered ``order``: toward the goal, which is ``cells`` away, first."""
    if cells == 0:
        return 0 if order == 0 else 3 - 2 * order
    way = -1 if ahead > 0.0 else 1
    return way * (1 - order)


@njit
def _place(lattice: Lattice, aim: Aim, q: Array, i: int, j: int, which: int) -> None:
    """The configuration of cell (i, j), the shorter way round from q (2,), into ``at[which]``."""
    for n in range(2):
        at = aim.goal[n] + ((i if n == 0 else j) - lattice.origin[n]) * lattice.width[n]
        if lattice.wraps[n]:
            at += 2.0 * pi * floor((q[n] - at) / (2.0 * pi) + 0.5)
        lattice.at[which, n] = at


@njit
def _unfold(
    arm: Arm, course: Course, aim: Aim, lattice: Lattice, q: Array, now: float, grade: int, space: Space
) -> int:
    """The way followed at present, from q (2,), into ``move`` and ``tau``: how many motions.

    It leaves for the goal as soon as the straight way is free, and neighbouring motions are made one where that is.
    """
    way, move, tau, at, layer = lattice.way, lattice.move, lattice.tau, lattice.at, lattice.layer
    count, t = int(lattice.state[0]), 0.0
    u, every = move[lattice.seen.shape[0]], 1 + count // TRIES
    for n in range(2):
        at[0, n] = q[n]
    for s in range(count):
        _place(lattice, aim, at[0], way[s, 1], way[s, 2], 1)
        end = way[s, 0] * layer - now
        tau[s] = end - t
        for n in range(2):
            move[s, n] = (at[1, n] - at[0, n]) / tau[s]
            at[0, n] = at[1, n]
        t = end
        ahead = straight(aim, at[0], u)
        if s % every == 0 and ahead > layer and t + ahead >= aim.stay:
            hit, _ = march(arm, course, at[0], u, t, t + ahead, 0.0, grade, space)
            if hit == inf:
                count = s + 1
                break
    return _joined(arm, course, lattice, q, count, grade, space)


@njit
def _joined(arm: Arm, course: Course, lattice: Lattice, q: Array, count: int, grade: int, space: Space) -> int:
    """The first ``count`` motions from q (2,), as many of them made one as are free as one: how many there are then.

    From each configuration on, twice as many are tried until that is not free, then half as many more, and so on.
    """
    move, tau, at, last = lattice.move, lattice.tau, lattice.at, lattice.seen.shape[0]
    kept, t, first = 0, 0.0, 0
    for n in range(2):
        at[0, n] = q[n]
    while first < count:
        most, step = 1, 1  # motions that are free as one; how many more are tried
        growing = True
        while step > 0:
            if most + step <= count - first:
                _mean(lattice, first, most + step)
                end = t + float(tau[last])
                hit, _ = march(arm, course, at[0], move[last], t, end, 0.0, grade, space)
                if hit == inf:
                    most += step
                    step = 2 * step if growing else step // 2
                    continue
            growing = False
            step //= 2
        _mean(lattice, first, most)
        first += most
        tau[kept] = tau[last]
        for n in range(2):
            move[kept, n] = move[last, n]
            at[0, n] += move[kept, n] * tau[kept]
        t += tau[kept]
        kept += 1
    return kept


@njit
def _mean(lattice: Lattice, first: int, count: int) -> None:
    """The one motion that leads where ``count`` motions from ``first`` on lead, behind all others."""
    move, tau, last = lattice.move, lattice.tau, lattice.seen.shape[0]
    tau[last] = 0.0
    for s in range(first, first + count):
        tau[last] += tau[s]
    for n in range(2):
        total = 0.0
        for s in range(first, first + count):
            total += move[s, n] * tau[s]
        move[last, n] = total / tau[last]
