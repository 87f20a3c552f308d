"""Reachability: the cells that can be reached at each instant, from the free ones of the instant before.

    R_0 = { the start's cell },      R_k+1 = neighbours(R_k)  of which free at t_k+1

The task is done at the first control step with a cell of R_k that satisfies the goal. On an inner grid a chain of cells
back to the start is then a motion; on an outer grid, no such cell up to the time limit means that there is none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdfctl.benchmark.solvable.cells import free_cells, unmeasured
from cdfctl.benchmark.solvable.grid import Axis, Cells, Side, axes_of, neighbours
from cdfctl.fields.kernel.body import body_of, new_frames
from cdfctl.fields.kernel.distance import new_work
from cdfctl.fields.kernel.parts import SceneParts
from cdfctl.robots.robot import Robot
from cdfctl.simulation.clearance import Clearance
from cdfctl.simulation.motion import SceneMotion
from cdfctl.types import Array, BoolArray

GoalAt = Callable[[float, Array, Array, float], BoolArray | None]
"""Time (s), the cells' centres (N1,) and (N2,), a slack (rad) -> (N1, N2) where the goal is reached, or None."""


@dataclass(frozen=True)
class Problem:
    """One drawn set-up for a robot with two joints.

    Attributes:
        robot, motion: the robot, and the obstacles over time.
        q0: (2,) the start.
        goal: where the goal is reached, for a time and a grid.
        dt, steps: the control step (s), and how many the time limit has.
    """

    robot: Robot
    motion: SceneMotion
    q0: Array
    goal: GoalAt
    dt: float
    steps: int


@dataclass(frozen=True)
class Reached:
    """The goal is reached, at time ``t`` (s), by the chain ``q`` (K+1, 2) of cell centres, ``step`` (s) apart."""

    t: float
    q: Array
    step: float


def search(problem: Problem, parts: int, side: Side, margin: float = 0.0) -> Reached | None:
    """Search a grid whose time step is the control step in ``parts``; None where the goal is not reached.

    Args:
        problem: the set-up.
        parts: how many steps of the grid make a control step.
        side: inner or outer, see :mod:`cdfctl.benchmark.solvable.grid`.
        margin: how far (m) the centres of an inner grid keep from the obstacles.
    """
    step = problem.dt / parts
    axes = axes_of(problem.robot, problem.q0, step, side)
    slack = 0.5 * float(np.hypot(axes[0].width, axes[1].width)) if side == "outer" else 0.0
    centres = axes[0].centres, axes[1].centres
    measure = _Measure(problem, axes, side, margin)
    alive: Cells = np.zeros((len(centres[0]), len(centres[1])), dtype=np.uint8)
    alive[axes[0].start, axes[1].start] = 1
    measure.keep_free(0.0, alive)
    history: list[Cells] = []
    following = np.empty_like(alive)
    for k in range(problem.steps * parts + 1):
        if not alive.any():
            return None
        t = k * step
        if k:
            neighbours(alive, axes, following)
            measure.keep_free(t, following)
            alive, following = following, alive
        history.append(np.packbits(alive))
        goal = problem.goal(t, *centres, slack) if k % parts == 0 else None
        if goal is not None and (arrived := np.argwhere(goal & (alive == 1))).size:
            chain = _back(history, alive.shape, axes, arrived)
            return Reached(t, np.stack([centres[0][chain[:, 0]], centres[1][chain[:, 1]]], axis=1), step)
    return None


class _Measure:
    """The free cells of one grid over time."""

    def __init__(self, problem: Problem, axes: tuple[Axis, Axis], side: Side, margin: float) -> None:
        robot, motion = problem.robot, problem.motion
        self._motion, self._axes, self._margin = motion, axes, margin
        self._widths = np.array([axis.width for axis in axes]) if side == "outer" else np.zeros(2)
        self._body = body_of(robot)
        self._frames, self._work, self._q = new_frames(self._body), new_work(), np.zeros(2)
        self._scene_parts = SceneParts()
        self._free, self._until = unmeasured((len(axes[0].centres), len(axes[1].centres)))
        end = problem.dt * problem.steps
        reach = Clearance(robot, motion.shapes).reach
        bounds = [
            motion.max_speed(i, 0.0, end) + motion.max_angular_speed(i, 0.0, end) * r for i, r in enumerate(reach)
        ]
        self._speed = np.array(bounds, dtype=np.float64)

    def keep_free(self, t: float, wanted: Cells) -> None:
        """Leave of the cells ``wanted`` those that are free at ``t``."""
        placed = self._scene_parts.of(self._motion.at(t))
        first, second = self._axes
        free_cells(
            self._body, placed, self._speed, first.centres, second.centres, self._widths, self._margin, t,
            wanted, self._free, self._until, self._q, self._frames, self._work,
        )  # fmt: skip


def _back(
    history: list[Cells], shape: tuple[int, ...], axes: tuple[Axis, Axis], arrived: NDArray[np.integer[Any]]
) -> NDArray[np.int64]:
    """The cells (K+1, 2) of a way from the start to one of ``arrived``, straight on where it can be."""
    at = int(arrived[0, 0]), int(arrived[0, 1])
    way, last = [at], (0, 0)
    moves = [(a, b) for a in (0, -1, 1) for b in (0, -1, 1)]
    for packed in reversed(history[:-1]):
        alive = np.unpackbits(packed, count=shape[0] * shape[1]).reshape(shape)
        for move in (last, *moves):
            before = _beside(at, move, shape, axes)
            if before is not None and alive[before]:
                way.append(before)
                at, last = before, move
                break
    return np.array(way[::-1])


def _beside(
    at: tuple[int, int], move: tuple[int, int], shape: tuple[int, ...], axes: tuple[Axis, Axis]
) -> tuple[int, int] | None:
    place = []
    for index, by, count, axis in zip(at, move, shape, axes, strict=True):
        moved = index - by
        if not 0 <= moved < count:
            if not axis.wraps:
                return None
            moved %= count
        place.append(moved)
    return place[0], place[1]
