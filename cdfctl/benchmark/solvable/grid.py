"""A grid over the two joints that fits the time step: in one step no joint moves by more than one cell.

With time step T and speed limits U, joint j has cells of width U_j T, one of them centred at the start. A continuous
joint's cells must close after a turn, so theirs are a little narrower (``inner``) or wider (``outer``).

inner: moving from a centre to the next takes at most T: a chain of centres is a motion that keeps the limits.
outer: a joint in the half-open cell [c - w/2, c + w/2) is, T later, in it or in a neighbour: a chain of cells holds
       every motion that keeps the limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cdfctl.robots.robot import Robot
from cdfctl.types import Array

Side = Literal["inner", "outer"]
Cells: TypeAlias = NDArray[np.uint8]
"""(N1, N2) of 0 and 1."""

TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Axis:
    """One joint's cells.

    Attributes:
        centres: (N,) rad, ascending (m for a prismatic joint).
        width: of a cell.
        start: the cell centred at the start.
        wraps: the first cell follows the last.
    """

    centres: Array
    width: float
    start: int
    wraps: bool


def axes_of(robot: Robot, q0: Array, step: float, side: Side) -> tuple[Axis, Axis]:
    """The cells of a robot's two joints for a time step of ``step`` (s), around the start ``q0`` (2,)."""
    first, second = (_axis(robot, j, float(q0[j]), float(robot.velocity_limit[j]) * step, side) for j in range(2))
    return first, second


def _axis(robot: Robot, j: int, start: float, width: float, side: Side) -> Axis:
    if robot.continuous[j]:
        count = max(3, math.ceil(TURN / width) if side == "inner" else math.floor(TURN / width))
        return Axis(_spread(start, TURN / count, 0, count), TURN / count, 0, wraps=True)
    low, high = float(robot.lower[j]), float(robot.upper[j])
    if side == "inner":  # centres within the limits
        below, above = math.floor((start - low) / width), math.floor((high - start) / width)
    else:  # cells that overlap them
        below, above = math.ceil((start - low) / width - 0.5), math.floor((high - start) / width + 0.5)
    return Axis(_spread(start, width, -below, above + 1), width, below, wraps=False)


def _spread(start: float, width: float, first: int, last: int) -> Array:
    return start + width * np.arange(first, last, dtype=np.float64)


def neighbours(alive: Cells, axes: tuple[Axis, Axis], out: Cells) -> None:
    """Into ``out``: every cell of ``alive`` (N1, N2) and those next to it, also across a corner; 0 or 1 each."""
    wide = alive.copy()
    wide[1:] |= alive[:-1]
    wide[:-1] |= alive[1:]
    if axes[0].wraps:
        wide[0] |= alive[-1]
        wide[-1] |= alive[0]
    out[:] = wide
    out[:, 1:] |= wide[:, :-1]
    out[:, :-1] |= wide[:, 1:]
    if axes[1].wraps:
        out[:, 0] |= wide[:, -1]
        out[:, -1] |= wide[:, 0]
