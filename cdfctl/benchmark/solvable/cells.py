"""Which cells are free at an instant, each measured as seldom as the obstacles' speed allows.

The distance d_o of a cell's centre to obstacle o changes at most as fast as the obstacle moves, v_o. So a cell with
d_o > b for all o stays so for min_o (d_o - b)/v_o, and one with d_o <= b for some o stays so for (b - d_o)/v_o.

The threshold b decides what "free" proves. For an inner grid b = margin >= 0. For an outer one b = -r, with r the
greatest way from a point of the robot at the cell's centre to the same point anywhere in the cell: where a cell is not
free, no configuration in it is. With l_j the point's greatest distance from the axis of joint j and w_j the cells'
widths, r = sum over j of l_j w_j / 2 (a sliding joint: l_j = 1).
"""

from __future__ import annotations

import numpy as np

from cdfctl.benchmark.solvable.grid import Cells
from cdfctl.fields.kernel.body import Body, Frames, forward, piece_pose
from cdfctl.fields.kernel.distance import Work, lower_bound, relative_pose, signed_distance
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.vec import ZERO, add, cross, norm, rotate, sub, vec, vec3
from cdfctl.types import Array

LONGEST = 1.0  # s: no cell goes unmeasured for longer, so that far obstacles need not be measured exactly
EXACT = 1e-6  # m: the distances are better than this


@njit
def free_cells(
    body: Body,
    parts: Parts,
    speed: Array,
    first: Array,
    second: Array,
    widths: Array,
    margin: float,
    t: float,
    wanted: Cells,
    free: Cells,
    until: Array,
    q: Array,
    frames: Frames,
    work: Work,
) -> None:
    """Of the cells ``wanted`` (N1, N2), keep those that are free at ``t``, with the obstacles placed there.

    Args:
        speed: (m,) bounds on the speed of any point of the obstacles, m/s.
        first, second: the cells' centres.
        widths: (2,) of the cells for an outer grid; zero for an inner one.
        margin: m; the threshold of an inner grid, zero for an outer one.
        free: (N1, N2) what was found of each cell, and
        until: (N1, N2) how long that holds; both are brought up to date. s.
        q: (2,) workspace, as ``frames`` and ``work`` are.
    """
    for i in range(first.shape[0]):
        for j in range(second.shape[0]):
            if not wanted[i, j]:
                continue
            if t >= until[i, j]:
                q[0], q[1] = first[i], second[j]
                forward(body, q, frames, 0)
                hold = _measure(body, frames, parts, speed, widths, margin, work)
                free[i, j] = hold > 0.0
                until[i, j] = t + abs(hold)
            wanted[i, j] = free[i, j]


@njit
def _measure(body: Body, frames: Frames, parts: Parts, speed: Array, widths: Array, margin: float, work: Work) -> float:
    """How long (s) the configuration in ``frames`` stays free, or minus how long it stays not."""
    hold = LONGEST
    for k in range(body.joint.shape[0]):
        least = margin if widths[0] + widths[1] == 0.0 else -_within_cell(body, frames, k, widths) - EXACT
        r_a, t_a = piece_pose(body, frames, 0, k)
        for p in range(parts.obstacle.shape[0]):
            v = speed[parts.obstacle[p]]
            r, t = relative_pose(r_a, t_a, parts, p)
            cutoff = least + max(v * hold, EXACT)
            if lower_bound(body, k, parts, p, r, t) > cutoff:
                continue
            d = signed_distance(body.sets, k, parts.sets, p, r, t, ZERO, cutoff, work).d
            if d <= least:
                return -min((least - d) / v, LONGEST) if v > 0.0 else -LONGEST
            if v > 0.0:
                hold = min(hold, (d - least) / v)
    return hold


@njit
def _within_cell(body: Body, frames: Frames, k: int, widths: Array) -> float:
    """The greatest way of a point of piece k from a cell's centre to anywhere in the cell, m."""
    chain, carrier = body.chain, body.joint[k]
    r, t = piece_pose(body, frames, 0, k)
    info = body.sets.info[k]
    centre, radius = add(rotate(r, vec3(info.centre)), t), info.reach + info.radius
    way = 0.0
    for j in range(1, -1, -1):  # the joint nearest the body first: what it does lengthens the other's lever
        if not chain.moves[j, carrier]:
            continue
        lever = 1.0
        if not chain.prismatic[j]:
            arm = cross(sub(centre, vec(frames.translation[0], j)), vec(frames.axis[0], j))
            lever = norm(arm) + radius + way
        way += 0.5 * widths[j] * lever
    return way


def unmeasured(shape: tuple[int, int]) -> tuple[Cells, Array]:
    """``free`` and ``until`` of cells that were never measured."""
    return np.zeros(shape, dtype=np.uint8), np.full(shape, -np.inf)
