"""The planner of one robot: the best plan found so far, carried from step to step and improved within a budget."""

from __future__ import annotations

import time
from dataclasses import dataclass
from math import inf

import numpy as np

from cdfctl.control.planner.arm import arm_of
from cdfctl.control.planner.course import Course
from cdfctl.control.planner.march import Space, new_space
from cdfctl.control.planner.plan import Aim, new_plan, shift
from cdfctl.control.planner.random import new_stream
from cdfctl.control.planner.search import BOOST, search
from cdfctl.control.planner.tree import new_tree
from cdfctl.robots.robot import Robot
from cdfctl.types import Array

SLICE = 5_000.0  # work between two looks at the clock, about 0.1 ms
WORK = 60.0  # a step's work, for each candidate and joint: where trying is dear, fewer are tried


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


class Planner:
    """Plans for one robot. It carries a plan from step to step: one instance a loop."""

    def __init__(self, robot: Robot, settings: Settings, dt: float) -> None:
        self.robot, self._settings, self._dt = robot, settings, dt
        self._arm = arm_of(robot)
        self._turn = np.where(robot.continuous, 2.0 * np.pi, 0.0)
        self._best = new_plan(settings.segments, robot.n)
        self._tree = new_tree(2 * BOOST * settings.candidates + settings.segments, settings.segments, robot.n)
        self._space: Space = new_space(self._arm, 0)
        self.reset()

    def reset(self) -> None:
        """Forget the steps so far."""
        self._best.value[0], self._best.tau[:] = inf, 0.0
        self._stream = new_stream(self._settings.seed)

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
        began, first, work = time.perf_counter(), 0, 0.0
        slice_began = began
        # As for the candidates, there is more work to be done while no plan is free.
        while first < BOOST * settings.candidates and work < settings.candidates * robot.n * WORK * (
            1 if self._best.value[1] == inf and first > 0 else BOOST
        ):
            first = search(
                self._arm,
                course,
                aim,
                self._best,
                self._tree,
                q,
                first,
                settings.candidates,
                SLICE,
                self._stream,
                self._space,
            )
            work += float(self._space.looks[0])
            now = time.perf_counter()
            if now - began + (now - slice_began) > settings.budget:
                break  # another slice may not fit
            slice_began = now
        return self._found(q)

    def _found(self, q: Array) -> Found:
        best, dt = self._best, self._dt
        moves = best.u * best.tau[:, None]
        used = np.minimum(best.tau, np.maximum(0.0, dt - np.cumsum(best.tau) + best.tau))
        real = best.tau > 0.0
        t = np.full(len(best.tau) + 1, np.nan)
        path = np.full((len(t), len(q)), np.nan)
        k = int(real.sum()) + 1
        t[0], path[0] = 0.0, q
        t[1:k], path[1:k] = np.cumsum(best.tau[real]), q + np.cumsum(moves[real], axis=0)
        return Found(u=used @ best.u / dt, hit=float(best.value[1]), t=t, q=path)
