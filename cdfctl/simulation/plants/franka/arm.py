"""An arm behind libfranka's network interface, through franky: connect, read, command, stop.

franky runs the 1 kHz loop in a thread of its own. A command is a joint velocity that it ramps to within limits on
acceleration and jerk, all joints arriving together, and then keeps for a hold time; the next command takes over
wherever the ramp is. Times are the arm's clock.

Raises throughout:
    PlantError: the arm has stopped by a reflex, the network is lost, or no new state comes.
"""

from __future__ import annotations

import queue
import threading
import time
from contextlib import suppress
from typing import Any, NamedTuple, Protocol

import numpy as np

from cdfctl.errors import MissingError, PlantError
from cdfctl.scenario.plant import FrankaConfig
from cdfctl.simulation.plants.franka.limits import ArmLimits, limits_of, published
from cdfctl.types import Array

POLL = 0.001
"""Wall-clock seconds between two looks at the state: it changes every millisecond."""

AT_REST, REST_TIME = 0.03, 0.03
"""An arm whose joints all keep below this mean speed (rad/s) for so long (s) stands still."""

STOP_TIMEOUT = 2.0
"""Wall-clock seconds a stop may take; from full speed it takes 0.3."""

NETWORK_TIMEOUT = 1.5
"""Wall-clock seconds after which libfranka has noticed that the network is lost (it waits for 1.0)."""


class Sample(NamedTuple):
    """A state of the arm: ``t`` (s), its clock; ``q`` (n,), rad; ``dq`` (n,), rad/s."""

    t: float
    q: Array
    dq: Array


class Arm(Protocol):
    """What the plant asks of an arm."""

    expired: int
    """Commands that came after the last one's hold was over: the arm had begun to stop."""

    limits: ArmLimits
    """What the arm itself says it can do."""

    def sample(self) -> Sample:
        """The latest state."""
        ...

    def send(self, u: Array, hold: float) -> None:
        """Go to the joint velocity ``u`` (n,), rad/s, and keep it for ``hold`` (s)."""
        ...

    def wait(self, until: float) -> list[Sample]:
        """All states seen until the arm's clock reads ``until`` (s) or later; the last one is the latest."""
        ...

    def close(self) -> float | None:
        """Stop the arm and let it go; how long it took to stand still (s), None where that cannot be known."""
        ...


class FrankyArm:
    """A Franka Research 3 through franky. Build it by :func:`connect`."""

    def __init__(self, franky: Any, robot: Any, config: FrankaConfig) -> None:
        self.expired = 0
        self._franky, self._robot, self._host = franky, robot, config.host
        self._state_timeout = config.state_timeout
        self.limits: ArmLimits = published()
        self._moving = False
        self._lost = False
        self._newest = -1.0
        self._seen = time.monotonic()  # when the arm's clock last moved on

    def prepare(self, config: FrankaConfig) -> None:
        """Bring the arm out of a reflex, set the limits of its ramps, and wait for a fresh state."""
        robot, mode = self._robot, self._franky.RobotMode
        state = self._ask(lambda: robot.state)
        if state.robot_mode == mode.Reflex and not self._ask(robot.recover_from_errors):
            raise PlantError(f"{self._host}: the arm is in a reflex stop and does not recover")
        if state.robot_mode in (mode.UserStopped, mode.Guiding):
            hint = "release the user stop and the guiding buttons, and enable FCI"
            raise PlantError(f"{self._host}: the arm is in mode {state.robot_mode.name}", hint)
        for limit, wanted in (
            (robot.joint_acceleration_limit, config.acceleration),
            (robot.joint_jerk_limit, config.jerk),
        ):
            self._ask(lambda limit=limit, wanted=wanted: limit.set(np.minimum(wanted, limit.max)))
        self.limits = limits_of(str(self._ask(lambda: robot.model_urdf)))
        # What queued up on the way is read before what comes now.
        first = self.sample()
        self.wait(first.t + 0.01)

    def sample(self) -> Sample:
        """The latest state."""
        self._check()
        state = self._ask(lambda: self._robot.state)
        t = float(state.time.to_sec())
        now = time.monotonic()
        if t > self._newest:
            self._newest, self._seen = t, now
        elif now - self._seen > self._state_timeout:
            self._lost = True
            raise PlantError(
                f"{self._host}: no new state of the arm for {now - self._seen:.2g} s: it, or its network, is held up"
            )
        return Sample(t, np.array(state.q, dtype=np.float64), np.array(state.dq, dtype=np.float64))

    def send(self, u: Array, hold: float) -> None:
        """Go to the joint velocity ``u`` (n,), rad/s, and keep it for ``hold`` (s)."""
        self._check()
        if self._moving and not self._robot.is_in_control:
            self.expired += 1
        franky = self._franky
        motion = franky.JointVelocityMotion(u, duration=franky.Duration(max(1, round(1e3 * hold))))
        self._ask(lambda: self._robot.move(motion, asynchronous=True))
        self._moving = True

    def wait(self, until: float) -> list[Sample]:
        """All states seen until the arm's clock reads ``until`` (s) or later; the last one is the latest."""
        seen = [self.sample()]
        while seen[-1].t < until:
            time.sleep(min(POLL, max(0.2 * POLL, until - seen[-1].t)))
            sample = self.sample()
            if sample.t > seen[-1].t:
                seen.append(sample)
        return seen

    def close(self) -> float | None:
        """Stop the arm and let it go; how long it took to stand still (s), None where that cannot be known."""
        robot, self._robot = self._robot, None
        if robot is None:
            return None
        stopped = None
        with suppress(*self._faults()):
            if not self._lost and robot.is_in_control:
                stopped = self._stop(robot)
        # The handle must not go while franky's thread still waits for the network.
        end = time.monotonic() + NETWORK_TIMEOUT
        while robot.is_in_control and time.monotonic() < end:
            time.sleep(POLL)
        return stopped

    def _stop(self, robot: Any) -> float | None:
        began = float(robot.state.time.to_sec())
        robot.move(self._franky.JointVelocityStopMotion(), asynchronous=True)
        robot.join_motion(timeout=STOP_TIMEOUT)
        end = time.monotonic() + STOP_TIMEOUT
        since, q = began, np.array(robot.state.q)
        while time.monotonic() < end:
            state = robot.state
            t = float(state.time.to_sec())
            if float(np.abs(np.array(state.q) - q).max()) > AT_REST * REST_TIME:
                since, q = t, np.array(state.q)
            elif t - since >= REST_TIME:
                return since - began
            time.sleep(POLL)
        return None

    def _check(self) -> None:
        """Raise what has happened to the motion since the last look."""
        if self._moving:
            self._ask(self._robot.poll_motion)

    def _ask(self, call: Any) -> Any:
        try:
            return call()
        except self._faults() as error:
            self._lost = isinstance(error, self._franky.NetworkException | RuntimeError)
            raise PlantError(f"{self._host}: {_cause(self._franky, error)}: {told(error)}") from None

    def _faults(self) -> tuple[type[Exception], ...]:
        return (self._franky.Exception, RuntimeError)  # franky passes some of libfranka's on as RuntimeError


def connect(config: FrankaConfig) -> FrankyArm:
    """The arm at ``config.host``, ready for commands.

    franky's constructor blocks for as long as the arm does not answer (it serves one client): it runs in a thread that
    is left behind after ``config.connect_timeout``.

    Raises:
        MissingError: franky is not installed, or no arm answers.
    """
    franky = load_franky()
    realtime = franky.RealtimeConfig.Enforce if config.realtime else franky.RealtimeConfig.Ignore
    answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def attempt() -> None:
        try:
            answers.put(franky.Robot(config.host, realtime_config=realtime))
        except (franky.Exception, RuntimeError) as error:
            answers.put(error)

    threading.Thread(target=attempt, name="franky", daemon=True).start()
    try:
        answer = answers.get(timeout=config.connect_timeout)
    except queue.Empty:
        raise MissingError(
            f"no answer from an arm at {config.host} within {config.connect_timeout:g} s",
            "is it on, is FCI enabled, and is no other client connected? It serves one at a time",
        ) from None
    if isinstance(answer, Exception):
        hint = "plant.host names the arm; FCI must be enabled in Desk; a simulator: franky-sim"
        raise MissingError(f"no arm at {config.host}: {told(answer)}", hint)
    arm = FrankyArm(franky, answer, config)
    try:
        arm.prepare(config)
    except BaseException:
        arm.close()
        raise
    return arm


def load_franky() -> Any:
    """franky, or a :class:`MissingError` that names the extra."""
    try:
        import franky
    except ImportError as error:
        raise MissingError(
            f"the plant franka needs franky, which cannot be imported: {told(error)}",
            "python -m pip install 'cdfctl[franka]'",
        ) from None
    return franky


def told(error: BaseException) -> str:
    """An error's text in one line."""
    return " ".join(str(error).split()) or type(error).__name__


def _cause(franky: Any, error: Exception) -> str:
    if isinstance(error, franky.ControlException):
        return "the arm has stopped by itself"
    if isinstance(error, franky.NetworkException | RuntimeError):
        return "the connection to the arm is lost"
    return "the arm refuses"
