"""MuJoCo physics as a plant: velocity servos with gravity compensation, and contacts it finds itself.

The joint velocity that is commanded is what the servos are told for the whole control step. Between control steps the
physics takes steps of ``timestep``; obstacles are moved at each, and every state is handed on, so that the judge sees
the motion as it was. The run ends with the first contact: what follows would be the obstacle pushing the arm.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from cdfctl.errors import MissingError, PlantError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.plant import MujocoConfig
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.plants import Plant, Report, Track
from cdfctl.types import Array, State

INSTALL = "python -m pip install 'cdfctl[mujoco]'"

UNSTABLE = 1e4
"""rad/s or m/s: no arm moves so."""


class MujocoPlant(Plant):
    """An arm of MuJoCo among moving mocap bodies."""

    def __init__(self, robot: Robot, motion: SceneMotion, config: MujocoConfig, dt: float) -> None:
        """``dt`` is the control step, s, a whole multiple of ``config.timestep`` (the scenario has seen to it).

        Raises:
            MissingError: MuJoCo is not installed.
            InputError: the robot cannot be simulated.
        """
        try:
            import mujoco
        except ModuleNotFoundError:
            raise MissingError("the plant 'mujoco' needs MuJoCo, which is not installed", hint=INSTALL) from None
        from cdfctl.simulation.plants.mujoco_model import build_model

        self._count, self._obstacles = round(dt / config.timestep), len(motion)
        self._mujoco: Any = mujoco
        self._robot, self._motion, self._config = robot, motion, config
        self._built = build_model(robot, motion.shapes, config)
        self._model = self._built.model
        self._data = mujoco.MjData(self._model)
        self._positions, self._quaternions = self._data.mocap_pos, self._data.mocap_quat  # views, for speed
        self._clear()

    def _clear(self) -> None:
        self._track = Track(np.zeros(0), np.zeros((0, self._robot.n)))
        self._velocity_errors: list[Array] = []
        self._position_errors: list[Array] = []
        self._contact: tuple[float, str, str] | None = None
        self._began = self._ended = 0.0
        self._time = 0.0

    def start(self, q0: Array) -> State:
        """The arm at rest at ``q0`` (n,), time 0."""
        mujoco, data = self._mujoco, self._data
        self._clear()
        mujoco.mj_resetData(self._model, data)
        data.qpos[:] = q0
        self._place(0.0)
        mujoco.mj_step1(self._model, data)
        self._began = self._ended = time.perf_counter()
        return State(0.0, q0.copy())

    def step(self, state: State, u: Array, dt: float) -> State:
        """The state after ``dt`` (s), or at the first contact, with the servos told ``u`` (n,), rad/s.

        Raises:
            PlantError: the physics has become unstable.
        """
        mujoco, model, data = self._mujoco, self._model, self._data
        count, n = self._count, self._robot.n
        t, q = np.empty(count), np.empty((count, n))
        data.ctrl[:] = u
        position, done = data.qpos, 0
        while done < count and self._contact is None:
            mujoco.mj_step2(model, data)  # moves on from what mj_step1 found out about the state before
            done += 1
            # Times are sums of dt, rounded as the integrator rounds them.
            now = round(state.t + dt * done / count, 12)
            self._place(now)
            mujoco.mj_step1(model, data)  # and this finds the contacts of the state reached
            t[done - 1], q[done - 1] = now, position
            if data.ncon:
                self._note_contact(now)
        if not np.abs(data.qvel).max() < UNSTABLE:  # also where it is not a number
            raise PlantError(f"the physics became unstable at {state.t:g} s: take a smaller plant.timestep")
        self._track = Track(t[: done - 1], q[: done - 1])
        self._velocity_errors.append(data.qvel - u)
        self._position_errors.append(q[done - 1] - state.q - u * (t[done - 1] - state.t))
        self._ended = time.perf_counter()
        return State(float(t[done - 1]), q[done - 1])

    def between(self) -> Track:
        """The states at the physics' steps of the last control step."""
        return self._track

    def stopped(self) -> str | None:
        """The first contact, in words."""
        if self._contact is None:
            return None
        at, link, obstacle = self._contact
        return f"MuJoCo finds {link} in contact with {obstacle} at {at:.3f} s"

    def report(self) -> Report:
        """Tracking errors against the integrator over all control steps, and the contact.

        The velocity error is dq/dt - u at the end of a step, the position error q(t + dt) - (q(t) + u dt); the greatest
        over all joints, and the root mean square. Those of sliding joints are in m/s and m.
        """
        contact = self._contact
        return {
            "type": "mujoco",
            "version": str(self._mujoco.__version__),
            "timestep_s": self._config.timestep,
            "servo_gain": float(self._built.gains.max()),
            **_errors("velocity_error", "rad_s", self._velocity_errors),
            **_errors("position_error", "rad", self._position_errors),
            "contact": "none" if contact is None else f"{contact[1]} and {contact[2]}",
            "contact_time_s": None if contact is None else contact[0],
            "links_without_inertia": len(self._built.assumed),
            "real_time_factor": self._factor(),
        }

    def _factor(self) -> float | None:
        """Seconds simulated in a second of wall clock, controller included."""
        wall = self._ended - self._began
        return None if wall <= 0.0 else float(self._data.time / wall)

    def _place(self, t: float) -> None:
        if self._obstacles:
            poses = self._motion.poses(t)
            self._positions[:] = poses[:, :3]
            self._quaternions[:, 0], self._quaternions[:, 1:] = poses[:, 6], poses[:, 3:6]  # MuJoCo's is w x y z

    def _note_contact(self, now: float) -> None:
        for k in range(self._data.ncon):
            contact = self._data.contact[k]
            if contact.dist > 0.0:
                continue
            robot, obstacle = sorted((self._built.geoms[g] for g in contact.geom), reverse=True)
            self._contact = (now, self._robot.geometry_links[robot], self._motion.names[-1 - obstacle])
            return


def _errors(name: str, unit: str, errors: list[Array]) -> dict[str, float | None]:
    """Greatest absolute value and root mean square over all steps and joints."""
    if not errors:
        return {f"{name}_max_{unit}": None, f"{name}_rms_{unit}": None}
    found = np.array(errors)
    return {
        f"{name}_max_{unit}": float(np.abs(found).max()),
        f"{name}_rms_{unit}": float(np.sqrt(np.mean(found**2))),
    }
