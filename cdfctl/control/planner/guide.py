"""The search of :mod:`cdfctl.control.planner.lattice` from step to step: when it goes on, and when it begins anew.

There are lattices of wide and of narrow cells. Wide ones are searched first: there are an eighth as many of them as of
the others, and most ways that are there are on both. Where neither has a way that keeps its margins, one that keeps a
third of them is better than none.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from cdfctl.control.planner.arm import Arm
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.lattice import EXTRA, Lattice, find, forget, leave, new_lattice
from cdfctl.control.planner.march import KEPT, NARROW, Space
from cdfctl.control.planner.plan import Aim
from cdfctl.control.planner.tree import Tree
from cdfctl.robots.robot import Robot
from cdfctl.types import Array

LEVELS = (0.4, KEPT), (0.2, KEPT), (0.4, NARROW), (0.2, NARROW)  # width of a cell (about), rad or m; margins asked for
STALE = 0.05  # m: an obstacle that is, or in a second will be, so far from where it was predicted makes dead cells void


class Guide:
    """Lattices, kept while their goal stays, their layers last and the obstacles move as predicted."""

    def __init__(self, robot: Robot, horizon: float, dt: float) -> None:
        self._robot, self._horizon, self._dt = robot, horizon, dt
        self._goal = np.zeros(robot.n)
        self._lattices: Sequence[Lattice] = ()
        self.reset()

    def reset(self) -> None:
        """Forget the steps so far."""
        self._now = inf

    def pass_on(self) -> None:
        """A control period passes."""
        self._now += self._dt

    def begin(self, course: Course, aim: Aim) -> None:
        """A step at which no plan is at hand."""
        new = not self._lattices or not np.array_equal(self._goal, aim.goal)
        if new:
            self._lattices = [new_lattice(self._robot, aim.goal, w, self._horizon, self._dt) for w, _ in LEVELS]
            self._goal = aim.goal.copy()
        if new or self._now > EXTRA or self._void(course):
            self._sets, self._line, self._now = course.sets, course.line.copy(), 0.0
            for lattice in self._lattices:
                forget(lattice)
        for lattice in self._lattices:
            leave(lattice)
        self._level, self.found = 0, -1

    @property
    def grade(self) -> int:
        """How much of its margins the way found keeps."""
        return LEVELS[self._level][1]

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
        done = find(arm, course, aim, lattice, q, self._now, self.grade, effort, space)
        count = int(lattice.state[3])
        self.found = count if 0 < count <= len(tree.tau) else -1
        if self.found > 0:
            tree.move[:count], tree.tau[:count] = lattice.move[:count], lattice.tau[:count]
        if lattice.state[2] == 1 and self._level + 1 < len(self._lattices):
            self._level, done = self._level + 1, False
        return done
