"""A Franka Research 3 as a plant: it is commanded at the scenario's rate, and time is its own.

The joint velocity of each control step is sent as it is. The arm's side ramps from one command to the next within the
limits on acceleration and jerk, all joints arriving together: on the way the velocity is, to within 0.004 rad/s
(measured), on the straight line between the two. So a linear constraint that both commands satisfy holds on the whole
ramp; what the ramp costs is time, and it is reported (``response_s``). A command beyond the arm's velocity limit is
scaled down whole, never clipped joint by joint, and counted.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdfctl.errors import InputError, PlantError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.plant import FrankaConfig
from cdfctl.simulation.plants import Plant, Report, Track
from cdfctl.simulation.plants.franka.arm import Arm
from cdfctl.simulation.plants.franka.rehearsal import Rehearsal, Sink
from cdfctl.simulation.plants.franka.ticks import Ticks
from cdfctl.types import Array, State

HOLD_TICKS = 2.5
"""Control steps a command is kept without a new one, where the scenario does not say."""

Approach = Callable[[float, Array], Array]
"""The joint velocity (n,), rad/s, that takes the arm from q (n,) to the start, slowly and by the safety rows; the first
argument is the time since it set out, s."""

APPROACH_FACTOR = 4.0
"""An approach may take this many times what it takes in a straight line at its speed, and not less than 10 s."""


SETTLING = 0.3
"""How long the arm is told to stand still at the start before the run begins, s."""


class FrankaPlant(Plant):
    """The arm: start checks where it is, step sends and waits for the next tick, close stops it."""

    def __init__(
        self,
        config: FrankaConfig,
        robot: Robot,
        dt: float,
        connect: Callable[[FrankaConfig], Arm],
        approach: Approach,
    ) -> None:
        """``dt`` is the control period (s); ``connect`` is called by :meth:`start`, ``approach`` only if it must be."""
        self._config, self._robot, self._dt = config, robot, dt
        self._connect, self._approach = connect, approach
        self._hold = hold_of(config, dt)
        self._arm: Arm | None = None
        self._ticks: Ticks | None = None
        self._between = super().between()
        self._past: list[tuple[float, Array, Array]] = []  # t, q, u of every step
        self._end: tuple[float, Array] | None = None
        self._approached = 0.0
        self._scaled = 0
        self._stopped: float | None = None
        self._expired = 0

    def rehearse(self, q0: Array, sink: Sink) -> Report:
        """Tell ``sink`` every command instead of an arm, one that is at ``q0`` (n,); what would be set up on one."""
        config = self._config
        self._connect = lambda _: Rehearsal(q0, sink)
        return {
            "host": config.host,
            "rate_Hz": 1.0 / self._dt,
            "hold_s": self._hold,
            "acceleration_rad_s2": config.acceleration,
            "jerk_rad_s3": config.jerk,
            "start_tolerance_rad": config.start_tolerance,
            "move_to_start": config.move_to_start,
        }

    def start(self, q0: Array) -> State:
        """Connect, and check that the arm is at ``q0`` (n,), or go there; the clock is at 0 now.

        Raises:
            MissingError: no arm answers.
            InputError: it is elsewhere, or not an arm that can do what the scenario asks.
            PlantError: it cannot be commanded, or cannot get there.
        """
        self._arm = self._connect(self._config)
        misfits = [message for message, _, _ in self._arm.limits.complaints(self._robot, "the arm")]
        if misfits:
            raise InputError("\n".join(f"{self._config.host}: {message}" for message in misfits))
        q = self._arm.sample().q
        if self._far(q, q0, self._config.start_tolerance):
            if not self._config.move_to_start:
                raise InputError(
                    f"{self._config.host}: the arm is not at the scenario's start: {self._where(q, q0)}",
                    "--move-to-start goes there slowly, among the scenario's obstacles as they are at t = 0",
                )
            self._approach_to(q0)
        self._ticks = Ticks(self._arm, self._dt, self._hold)
        return State(0.0, self._ticks.first.q)

    def step(self, state: State, u: Array, dt: float) -> State:
        """Send ``u`` (n,), rad/s, and return the arm's state at the next tick; ``dt`` is the period of the plant.

        Raises:
            PlantError: the arm has stopped, or cannot be reached.
        """
        assert self._ticks is not None  # start() comes first
        sent = self._within(state.q, u)
        self._past.append((state.t, state.q, sent))
        after, self._between = self._ticks.step(sent)
        self._end = (after.t, after.q)
        return State(after.t, after.q)

    def between(self) -> Track:
        """The states seen within the last step."""
        return self._between

    def close(self) -> None:
        """Stop the arm and let it go."""
        arm, self._arm = self._arm, None
        if arm is not None:
            self._stopped = arm.close()
            self._expired = arm.expired

    def report(self) -> Report:
        """What there is to say of the run; times are the arm's."""
        ticks = self._ticks
        lags = np.array(ticks.lags) if ticks is not None and ticks.lags else np.zeros(1)
        response, error = self._response()
        return {
            "type": "franka",
            "host": self._config.host,
            "rate_Hz": 1.0 / self._dt,
            "hold_s": self._hold,
            "ticks": 0 if ticks is None else ticks.count,
            "missed_ticks": 0 if ticks is None else ticks.missed,
            "missed_by_arm": 0 if ticks is None else ticks.missed_by_arm,
            "expired_commands": self._expired if self._arm is None else self._arm.expired,
            "scaled_commands": self._scaled,
            "lag_p50_s": float(np.percentile(lags, 50)),
            "lag_max_s": float(lags.max()),
            "response_s": response,
            "position_error_max_rad": error,
            "approach_s": self._approached,
            "stop_s": self._stopped,
        }

    def _within(self, q: Array, u: Array) -> Array:
        assert self._arm is not None
        low, high = self._arm.limits(q)
        over = float(np.max(np.where(u > 0.0, u / np.maximum(high, 1e-9), u / np.minimum(low, -1e-9))))
        if over <= 1.0 + 1e-9:
            return u
        self._scaled += 1
        return u / over

    def _approach_to(self, q0: Array) -> None:
        assert self._arm is not None
        ticks = Ticks(self._arm, self._dt, self._hold)
        q, tolerance = ticks.first.q, 0.5 * self._config.start_tolerance
        distance = float(np.abs(q0 - q).max())
        limit = max(10.0, APPROACH_FACTOR * distance / self._config.approach_speed)
        t = 0.0
        while self._far(q, q0, tolerance):
            now, _ = ticks.step(self._within(q, self._approach(t, q)))
            t, q = now.t, now.q
            if t > limit:
                raise PlantError(
                    f"{self._config.host}: the arm does not get to the scenario's start in {limit:.0f} s: "
                    f"{self._where(q, q0)}"
                )
        self._approached = t
        while ticks.step(np.zeros_like(q))[0].t < t + SETTLING:
            pass

    def _far(self, q: Array, q0: Array, tolerance: float) -> bool:
        return bool(np.abs(q - q0).max() > tolerance)

    def _where(self, q: Array, q0: Array) -> str:
        far = np.flatnonzero(np.abs(q - q0) > 0.5 * self._config.start_tolerance)
        return ", ".join(f"{self._robot.joint_names[i]} is at {q[i]:.3f}, not {q0[i]:.3f} rad" for i in far)

    def _response(self) -> tuple[float | None, float | None]:
        """By how much the arm trails its commands: s, and rad at most.

        Where each command took effect tau later, q(t) = q(0) + integral of u over [0, t] - tau u(t): tau is the least
        squares fit of that, the error what it is without tau.
        """
        if self._end is None or len(self._past) < 2:
            return None, None
        t = np.array([p[0] for p in self._past] + [self._end[0]])
        q = np.array([p[1] for p in self._past] + [self._end[1]])
        u = np.array([p[2] for p in self._past])
        asked = q[0] + np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(u * np.diff(t)[:, None], axis=0)])
        error = (asked - q)[1:]
        power = float((u * u).sum())
        return float((error * u).sum()) / power if power > 0.0 else None, float(np.abs(error).max())


def hold_of(config: FrankaConfig, dt: float) -> float:
    """How long a command is kept without a new one, s."""
    return config.hold if config.hold is not None else HOLD_TICKS * dt
