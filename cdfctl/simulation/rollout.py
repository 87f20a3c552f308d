"""One closed loop: controller, plant and moving scene, step by step, until something ends it.

At control step k, t_k = k dt, in this order: is the goal reached; is the time up; what does the controller command (it
may give up); the plant moves on. Contact does not end a rollout: that is the judge's to find.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from cdfctl.control.controller import Controller
from cdfctl.errors import PlantError
from cdfctl.simulation.goals import Goal
from cdfctl.simulation.judge import Stop
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.recorder import Recorder
from cdfctl.types import Array, Decision, Scene, State, Trajectory


class Plant(Protocol):
    """Anything that moves as commanded, more or less."""

    def step(self, state: State, u: Array, dt: float) -> State:
        """The state after ``dt`` (s) at joint velocity ``u`` (n,). Raises :class:`PlantError` where it fails."""
        ...


@dataclass(frozen=True)
class Step:
    """What a rollout yields: step ``index`` began in ``state`` among ``scene``, and this was commanded."""

    index: int
    state: State
    scene: Scene
    decision: Decision


class Rollout:
    """A closed loop to be iterated once; whatever happened so far is in :meth:`trajectory`, also after an interrupt.

    Attributes:
        stop: why it ended; ``error`` while it has not.
        reason: what went wrong where ``stop`` is ``error``: the plant's failure, or ``interrupted``.
        max_steps: control steps within the time limit.
    """

    def __init__(
        self,
        controller: Controller,
        plant: Plant,
        motion: SceneMotion,
        goal: Goal,
        q0: Array,
        *,
        dt: float,
        time_limit: float,
        target: SceneMotion | None = None,
    ) -> None:
        """``q0`` (n,) is the start; ``dt`` and ``time_limit`` are in s; ``target`` is the one body of a reach task."""
        self._controller, self._plant, self._motion, self._goal = controller, plant, motion, goal
        self._start, self._dt, self._target = State(0.0, q0), dt, target
        self.max_steps = math.floor(time_limit / dt + 1e-9)  # a limit of 20 s is 200 steps of 0.1 s, not 199
        self.stop: Stop = "error"
        self.reason: str | None = "interrupted"
        self._recorder = Recorder(len(q0), len(motion), self.max_steps)

    def steps(self) -> Iterator[Step]:
        """Run the loop, yielding after every control step.

        The controller is stepped once before the clock starts and then reset, so that compiling its kernels does not
        count as a step's time.
        """
        controller, plant, dt = self._controller, self._plant, self._dt
        state, scene = self._start, self._motion.at(self._start.t)
        self._recorder.start(state, scene)
        controller.reset()
        controller.step(state, scene, self._target_at(state))
        controller.reset()
        for index in range(self.max_steps + 1):
            at_end = index == self.max_steps
            if self._goal.reached(state, scene, at_end=at_end):
                return self._end("reached")
            if at_end:
                return self._end("timeout")
            target = self._target_at(state)
            began = time.perf_counter()
            decision = controller.step(state, scene, target)
            elapsed = time.perf_counter() - began
            if decision.status == "infeasible":
                return self._end("infeasible")
            try:
                after = plant.step(state, decision.u, dt)
            except PlantError as error:
                self.reason = str(error)
                return
            now, state, scene = Step(index, state, scene, decision), after, self._motion.at(after.t)
            self._recorder.add(decision, elapsed, state, scene)
            yield now

    def _target_at(self, state: State) -> Scene | None:
        return None if self._target is None else self._target.at(state.t)

    def _end(self, stop: Stop) -> None:
        self.stop, self.reason = stop, None

    def trajectory(self) -> Trajectory:
        """The arrays of all steps completed so far."""
        return self._recorder.trajectory()
