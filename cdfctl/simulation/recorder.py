"""The arrays of a rollout, allocated ahead and filled step by step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdfctl.simulation.plants import Track
from cdfctl.types import Array, Decision, Scene, State, Trajectory

FIRST_CAPACITY = 1024

# Arrays with one entry a step, and those with one more: the states between which the steps lie.
STEP_ARRAYS = ("u", "h", "V", "slack", "infeasible", "step_time", "h_sdf", "contact_q", "plan_q", "plan_t")
STATE_ARRAYS = ("t", "q", "obstacle_pose", "obstacle_twist")


class Recorder:
    """Fills the arrays of a :class:`cdfctl.types.Trajectory`; memory doubles where a run outgrows it."""

    def __init__(self, n: int, m: int, max_steps: int) -> None:
        """For ``n`` joints, ``m`` obstacles and at most ``max_steps`` steps."""
        self._n, self._m = n, m
        self._capacity = max(1, min(max_steps, FIRST_CAPACITY))
        self._count = 0
        shapes: dict[str, tuple[int, ...]] = {
            "t": (),
            "q": (n,),
            "obstacle_pose": (m, 7),
            "obstacle_twist": (m, 6),
            "u": (n,),
            "h": (m,),
            "V": (),
            "slack": (),
            "infeasible": (),
            "step_time": (),
        }
        self._arrays = {name: self._new(name, shape) for name, shape in shapes.items()}
        self._between: list[Track] = []

    def _new(self, name: str, shape: tuple[int, ...]) -> Array:
        extra = 1 if name in STATE_ARRAYS else 0
        return np.full((self._capacity + extra, *shape), np.nan)

    def start(self, state: State, scene: Scene) -> None:
        """The state before the first step."""
        self._count = 0
        self._between.clear()
        self._state(0, state, scene)

    def add(
        self, decision: Decision, step_time: float, state: State, scene: Scene, between: Track | None = None
    ) -> None:
        """A completed step: what was decided, how long that took (s), where it led, and by which way."""
        k = self._count
        if k == self._capacity:
            self._grow()
        given: dict[str, Array | float] = {
            "u": decision.u,
            "h": decision.h,
            "V": decision.V,
            "slack": decision.slack,
            "infeasible": decision.infeasible,
            "step_time": step_time,
        }
        optional = {"h_sdf": decision.h_sdf, "contact_q": decision.contact_q, "plan_q": decision.plan_q}
        if decision.plan_t is not None:
            optional["plan_t"] = self._arrays["t"][k] + decision.plan_t
        given |= {name: array for name, array in optional.items() if array is not None}
        for name, value in given.items():
            if name not in self._arrays:
                self._arrays[name] = self._new(name, np.shape(value))
            self._arrays[name][k] = value
        self._count = k + 1
        self._between.append(between if between is not None else Track(np.zeros(0), np.zeros((0, self._n))))
        self._state(k + 1, state, scene)

    def _state(self, k: int, state: State, scene: Scene) -> None:
        arrays = self._arrays
        arrays["t"][k], arrays["q"][k] = state.t, state.q
        arrays["obstacle_pose"][k], arrays["obstacle_twist"][k] = scene.poses, scene.twists

    def _grow(self) -> None:
        old = self._arrays
        self._capacity *= 2
        self._arrays = {name: self._new(name, array.shape[1:]) for name, array in old.items()}
        for name, array in old.items():
            self._arrays[name][: len(array)] = array

    def trajectory(self) -> Trajectory:
        """A copy of what was recorded."""
        N = self._count
        cut = {name: array[: N + (name in STATE_ARRAYS)].copy() for name, array in self._arrays.items()}
        trajectory = Trajectory(infeasible=cut.pop("infeasible").astype(np.bool_), **cut)
        if not any(len(track.t) for track in self._between):
            return trajectory
        t, q = [trajectory.t[:1]], [trajectory.q[:1]]
        for k, track in enumerate(self._between):
            t += [track.t, trajectory.t[k + 1 : k + 2]]
            q += [track.q.reshape(-1, self._n), trajectory.q[k + 1 : k + 2]]
        return replace(trajectory, plant_t=np.concatenate(t), plant_q=np.concatenate(q))
