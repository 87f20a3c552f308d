"""One closed loop: controller, plant and moving scene, step by step, until something ends it.

At control step k, t_k = k dt (on a clock of the plant's own: when its last step ended), in this order: is the goal
reached; is the time up; what does the controller command (it may give up); the plant moves on, and may say that the run
must end there. The integrator never does: contact is the judge's to find.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Protocol

from cdfctl.errors import PlantError
from cdfctl.simulation.goals import Goal
from cdfctl.simulation.judge import Stop
from cdfctl.simulation.measurement import Sensor
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.plants import Plant
from cdfctl.simulation.recorder import Recorder
from cdfctl.types import Array, Decision, Scene, State, Trajectory


class Deciding(Protocol):
    """What a rollout asks for a command: a :class:`cdfctl.control.controller.Controller`, or one with a guard."""

    def step(self, state: State, scene: Scene, target: Scene | None = None) -> Decision:
        """What to command now."""
        ...

    def reset(self) -> None:
        """Forget the steps so far."""
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
        plant: what moves.
        stop: why it ended; ``error`` while it has not.
        reason: what went wrong where ``stop`` is ``error``: the plant's failure, or ``interrupted``; where it is
            ``contact``, what the plant said.
        max_steps: control steps within the time limit.
    """

    def __init__(
        self,
        controller: Deciding,
        plant: Plant,
        motion: SceneMotion,
        goal: Goal,
        q0: Array,
        *,
        dt: float,
        time_limit: float,
        sensor: Sensor,
        target: Sensor | None = None,
    ) -> None:
        """``q0`` (n,) is the start; ``dt`` and ``time_limit`` are in s; ``sensor`` is what the controller sees of the
        obstacles, ``target`` of the one body of a reach task."""
        self._controller, self.plant, self._motion, self._goal = controller, plant, motion, goal
        self._start, self._dt, self._sensor, self._target = State(0.0, q0), dt, sensor, target
        self.max_steps = math.floor(time_limit / dt + 1e-9)  # a limit of 20 s is 200 steps of 0.1 s, not 199
        self.stop: Stop = "error"
        self.reason: str | None = "interrupted"
        self._recorder = Recorder(len(q0), len(motion), self.max_steps)

    def steps(self) -> Generator[Step]:
        """Run the loop, yielding after every control step.

        The controller is stepped once before the clock starts and then reset, so that compiling its kernels does not
        count as a step's time. However the loop ends, the plant is closed.
        """
        state, scene = self._start, self._motion.at(self._start.t)
        self._recorder.start(state, scene)
        self._controller.reset()
        self._controller.step(state, *self._seen(state.t, scene))
        self._controller.reset()
        for sensor in (self._sensor, self._target):
            if sensor is not None:
                sensor.restart()
        try:
            yield from self._loop()
        except PlantError as error:
            self.stop, self.reason = "error", str(error)
        finally:
            self.plant.close()

    def _loop(self) -> Iterator[Step]:
        controller, plant, dt = self._controller, self.plant, self._dt
        state = plant.start(self._start.q)
        scene = self._motion.at(state.t)
        self._recorder.start(state, scene)
        for index in range(self.max_steps + 1):
            at_end = index == self.max_steps
            if self._goal.reached(state, scene, at_end=at_end):
                return self._end("reached")
            if at_end:
                return self._end("timeout")
            seen = self._seen(state.t, scene)
            began = time.perf_counter()
            decision = controller.step(state, *seen)
            elapsed = time.perf_counter() - began
            if decision.status == "infeasible":
                return self._end("infeasible")
            after = plant.step(state, decision.u, dt)
            now, state, scene = Step(index, state, scene, decision), after, self._motion.at(after.t)
            self._recorder.add(decision, elapsed, state, scene, plant.between())
            yield now
            if (said := plant.stopped()) is not None:
                self.stop, self.reason = "contact", said
                return None

    def _seen(self, t: float, scene: Scene) -> tuple[Scene, Scene | None]:
        """What the controller is told at its next step: the obstacles, and the target."""
        return self._sensor.see(t, scene), None if self._target is None else self._target.see(t)

    def _end(self, stop: Stop) -> None:
        self.stop, self.reason = stop, None

    def trajectory(self) -> Trajectory:
        """The arrays of all steps completed so far."""
        return self._recorder.trajectory()
