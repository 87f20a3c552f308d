"""The search of :mod:`cdfctl.control.planner.lattice` from step to step: when it goes on, and when it begins anew.

There are two lattices. The one with wide cells is searched first: it has an eighth as many of them as the other, and
most ways that are there are on both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdfctl.control.planner.arm import Arm
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.lattice import EXTRA, Lattice, find, leave, new_lattice
from cdfctl.control.planner.march import Space
from cdfctl.control.planner.plan import Aim
from cdfctl.control.planner.tree import Tree
from cdfctl.robots.robot import Robot
from cdfctl.types import Array

WIDTHS = 0.4, 0.2  # rad or m: about the width of a cell
STALE = 0.05  # m: an obstacle that is, or in a second will be, so far from where it was predicted makes dead cells void


class Guide:
    """Lattices, kept while their goal stays, their layers last and the obstacles move as predicted."""

    def __init__(self, robot: Robot, horizon: float, dt: float) -> None:
        self._robot, self._horizon, self._dt = robot, horizon, dt
        self._goal = np.zeros(robot.n)
        self.reset()

    def reset(self) -> None:
        """Forget the steps so far."""
        self._lattices: Sequence[Lattice] = ()
        self._now = 0.0

    def pass_on(self) -> None:
        """A control period passes."""
        self._now += self._dt

    def begin(self, course: Course, aim: Aim) -> None:
        """A step at which no plan is at hand."""
        if not self._lattices or not np.array_equal(self._goal, aim.goal) or self._now > EXTRA or self._void(course):
            self._lattices = [new_lattice(self._robot, aim.goal, w, self._horizon, self._dt) for w in WIDTHS]
            self._goal, self._sets, self._line, self._now = aim.goal.copy(), course.sets, course.line.copy(), 0.0
        for lattice in self._lattices:
            leave(lattice)
        self._level, self.found = 0, -1

    def _void(self, course: Course) -> bool:
        if course.sets is not self._sets:
            return True
        v = self._line[:, 3:]
        gap = course.line[:, :3] - self._line[:, :3] - self._now * v
        change = np.linalg.norm(gap, axis=1) + np.linalg.norm(course.line[:, 3:] - v, axis=1)
        return bool((change > STALE).any())

    def find(self, arm: Arm, course: Course, aim: Aim, q: Array, effort: float, tree: Tree, space: Space) -> bool:
        """Go on with ``effort`` more distances: whether a way is found, or there is none.

        The way, or as far as it has been followed, is then in ``tree.move``, and ``found`` says how many motions it
        has: -1 for none.
        """
        lattice = self._lattices[self._level]
        done = find(arm, course, aim, lattice, q, self._now, effort, space)
        count = int(lattice.state[3])
        self.found = count if 0 < count <= len(tree.tau) else -1
        if self.found > 0:
            tree.move[:count], tree.tau[:count] = lattice.move[:count], lattice.tau[:count]
        if lattice.state[2] == 1 and self._level + 1 < len(self._lattices):
            self._level, done = self._level + 1, False
        return done
