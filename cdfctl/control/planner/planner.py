"""The planner of one robot: the best plan found so far, carried from step to step and improved within a budget."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np

from cdfctl.control.planner.arm import arm_of
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.guide import Guide
from cdfctl.control.planner.lattice import JOINTS
from cdfctl.control.planner.march import FULL, KEPT, NARROW, NARROW_KEPT, Space, march, new_space
from cdfctl.control.planner.plan import Aim, new_plan, shift, unfold
from cdfctl.control.planner.random import new_stream
from cdfctl.control.planner.search import BOOST, search
from cdfctl.control.planner.tree import new_tree, plant, recall
from cdfctl.robots.robot import Robot
from cdfctl.types import Array

SLICE = 20_000.0  # work between two looks at the clock, about 0.3 ms; none are taken without a budget
WORK = 60.0  # a step's work, for each candidate and joint: where trying is dear, fewer are tried
GUIDED = 4.0  # times as much for a guide, where no plan is at hand
THREAT = 2.0  # s: the robot is under a threat where it could not rest so long
SAVED = 0.25  # of it a step adds to what may be taken where no plan is free,
BURST = 64.0  # up to so many times a step's;
CALM = 16.0  # only so many of them where there is no threat and no guide, which ends when there is proved to be no way


@dataclass(frozen=True)
class Settings:
    """How plans are made.

    Attributes:
        segments: straight motions before the straight one to the goal.
        horizon: the longest they take together, s.
        candidates: plans tried at a step.
        budget: time a step's search may take, s; inf for none.
        seed: of the random plans.
    """

    segments: int
    horizon: float
    candidates: int
    budget: float
    seed: int


@dataclass(frozen=True)
class Found:
    """The best plan of a step.

    Attributes:
        u: (n,) its mean velocity over the first control period.
        hit: when it loses its margin, s from now; inf where it never does.
        t: (K,) times from now and
        q: (K, n) the configurations between which it moves straight; NaN after its end. K is ``segments + 2``.
    """

    u: Array
    hit: float
    t: Array
    q: Array


class _Clock:
    """Says when a step's budget (s) will not do for another slice as long as the last."""

    def __init__(self, budget: float) -> None:
        self._began = self._last = time.perf_counter()
        self._budget, self._over = budget, False

    def over(self) -> bool:
        """To be asked before every slice; once it is over, it stays so."""
        if self._over:
            return True
        now = time.perf_counter()
        slice_, self._last = now - self._last, now
        self._over = now - self._began + slice_ > self._budget
        return self._over


class Planner:
    """Plans for one robot. It carries a plan from step to step: one instance a loop."""

    def __init__(self, robot: Robot, settings: Settings, dt: float) -> None:
        self.robot, self._settings, self._dt = robot, settings, dt
        self._arm = arm_of(robot)
        self._rest = np.zeros(robot.n)
        self._turn = np.where(robot.continuous, 2.0 * np.pi, 0.0)
        self._best = new_plan(settings.segments, robot.n)
        self._tree = new_tree(2 * BOOST * settings.candidates + settings.segments, settings.segments, robot.n)
        self._space: Space = new_space(self._arm, 0)
        self._guide = Guide(robot, settings.horizon, dt) if robot.n == JOINTS else None
        self.reset()

    def reset(self) -> None:
        """Forget the steps so far."""
        self._best.value[0], self._best.tau[:] = inf, 0.0
        self._stream, self._saved = new_stream(self._settings.seed), inf
        if self._guide is not None:
            self._guide.reset()

    def plan(self, q: Array, course: Course, goal: Array, speed: Array, stay: float) -> Found:
        """The best plan from ``q`` (n,).

        Args:
            q: configuration now.
            course: the obstacles to come.
            goal: (n,) where to go.
            speed: (n,) greatest speed of each joint on the straight way there.
            stay: until when being at the goal must be free, s from now.
        """
        settings, robot = self._settings, self.robot
        if len(course.block) != len(self._space.until):
            self._space = new_space(self._arm, len(course.block))
        aim = Aim(
            goal=goal,
            turn=self._turn,
            speed=speed,
            low=np.minimum(robot.lower, q),
            high=np.maximum(robot.upper, q),
            limit=robot.velocity_limit,
            stay=stay,
            horizon=settings.horizon,
        )
        shift(self._best, self._dt)
        plant(self._tree, q)
        if self._guide is not None:
            self._guide.pass_on()
        threat, _ = march(self._arm, course, q, self._rest, 0.0, THREAT, 0.0, FULL, self._space)
        search, clock = self._searching(course, aim, q, threat < inf), _Clock(settings.budget)
        most = settings.candidates * robot.n * WORK
        self._saved = min(self._saved + SAVED * most, BURST * most)
        kept = (BURST - CALM) * most if self._guide is None and threat == inf else 0.0
        grade = KEPT if self._best.value[3] < NARROW else NARROW_KEPT
        given, enough, work = recall(self._best, self._tree), BOOST * settings.candidates, 0.0
        first = 0
        if self._guide is not None:
            first = search(0, given, grade, enough, 0.0, 0.0)  # the plan of the last step, and the straight way
            if self._best.value[1] < inf and given > 0 and grade == KEPT:
                plant(self._tree, q)
                first = search(first, given, NARROW_KEPT, first, 0.0, 0.0)
            given = -1
            if self._best.value[1] < inf:
                given, work = self._guided(self._guide, course, aim, q, clock, GUIDED * most + self._saved)
                self._saved -= max(0.0, work - GUIDED * most)
                first = search(first, given, self._guide.grade, settings.candidates, 0.0, 0.0)
                given, work, enough = -1, 0.0, settings.candidates
        # While no plan is free a step may take what those before it have saved.
        more = most + min((BOOST - 1) * most, max(0.0, self._saved - kept))
        while first < enough and work < (most if self._best.value[1] == inf else more):
            if clock.over():
                break
            part = SLICE if settings.budget < inf else inf
            first = search(first, given, grade, enough, min(part, most - work), min(part, more - work))
            work, given = work + float(self._space.looks[0]), -1
        self._saved -= max(0.0, work - most)
        return self._found(q)

    def _searching(
        self, course: Course, aim: Aim, q: Array, threat: bool
    ) -> Callable[[int, int, int, int, float, float], int]:
        """The search of a step, but for the numbers that say how far it goes."""

        def part(first: int, given: int, grade: int, enough: int, free: float, effort: float) -> int:
            return search(
                self._arm, course, aim, self._best, self._tree, q, first, given, grade, threat,
                self._settings.candidates, enough, free, effort, self._stream, self._space,
            )  # fmt: skip

        return part

    def _guided(
        self, guide: Guide, course: Course, aim: Aim, q: Array, clock: _Clock, effort: float
    ) -> tuple[int, float]:
        """The best that the guide finds with ``effort``, into the tree's motions: how many, -1 for none; the work."""
        work, part = 0.0, SLICE if self._settings.budget < inf else inf
        guide.begin(course, aim)
        while work < effort and not clock.over():
            done = guide.find(self._arm, course, aim, q, min(part, effort - work), self._tree, self._space)
            work += float(self._space.looks[0])
            if done:
                break
        return guide.found, work

    def _found(self, q: Array) -> Found:
        rows = len(self._best.tau) + 1
        t, path = np.empty(rows), np.empty((rows + 1, len(q)))
        unfold(self._best, q, self._dt, t, path)
        return Found(u=path[rows].copy(), hit=float(self._best.value[1]), t=t, q=path[:rows])
