"""What the controller is told of the obstacles: late, noisy, now and then not at all.

At control time t the scene of t - delay is measured. With e_s, e_h, e_e the errors of an obstacle's speed, heading and
elevation (drawn once), R_z(e_h) a turn about world z and k the upward unit vector across v in the vertical plane of v:

    p^ = p + noise                                            new at every step
    v^ = R_z(e_h) (1 + e_s) ( cos(e_e) v + sin(e_e) |v| k )
    told = p^ + v^ delay                                      where the delay is compensated

A measurement that drops out is the last one, moved on by its twist (``predict``) or not (``hold``).

The errors of trial i come from ``SeedSequence(seed, spawn_key=(i, 1))``, those of a target from ``(i, 2)``; the draws
of the set-up from ``(i,)``. As many numbers are taken at every step whatever the sizes of the errors: a sweep over one
of them changes nothing else.
"""

from __future__ import annotations

import math

import numpy as np

from cdfctl.control.reaching import moved
from cdfctl.scenario.measurement import MeasurementConfig
from cdfctl.simulation.motion import SceneMotion
from cdfctl.types import Array, Scene

OBSTACLES, TARGET = 1, 2
"""Which stream of errors."""


class Sensor:
    """Measures one moving scene, step by step from the start of a run."""

    def __init__(self, motion: SceneMotion, config: MeasurementConfig, seed: int, trial: int, stream: int) -> None:
        """``stream`` is :data:`OBSTACLES` or :data:`TARGET`; the other numbers say whose errors."""
        self._motion, self._config = motion, config
        self._sequence = seed, (trial if config.trial is None else config.trial, stream)
        self.restart()

    def restart(self) -> None:
        """Begin again at the first step, with the same errors."""
        seed, key = self._sequence
        self._stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
        self._errors = self._stream.uniform(-1.0, 1.0, (3, len(self._motion)))
        self._last: Scene | None = None
        self._last_time = 0.0

    def see(self, t: float, truth: Scene | None = None) -> Scene:
        """What the controller is told at its next step, which is at ``t`` (s); ``truth`` is the scene then, where it is
        at hand."""
        config = self._config
        if config.exact:
            return truth if truth is not None else self._motion.at(t)
        measured = self._measured(t - config.delay)
        lost = self._stream.random(len(measured)) < config.dropout
        if self._last is not None and lost.any():
            known = moved(self._last, t - self._last_time) if config.on_dropout == "predict" else self._last
            measured.poses[lost], measured.twists[lost] = known.poses[lost], known.twists[lost]
        self._last, self._last_time = measured, t
        return moved(measured, config.delay) if config.compensate_delay and config.delay > 0.0 else measured

    def _measured(self, t: float) -> Scene:
        config, truth = self._config, self._motion.at(t)
        poses, twists = truth.poses.copy(), truth.twists.copy()
        poses[:, :3] += config.position_noise * self._stream.standard_normal((len(truth), 3))
        speed, heading, elevation = self._errors
        angles = math.radians(config.elevation_error_deg) * elevation, math.radians(config.heading_error_deg) * heading
        twists[:, :3] = (1.0 + config.speed_error * speed)[:, None] * turned(truth.twists[:, :3], *angles)
        return Scene.from_arrays(truth.shapes, truth.names, poses, twists)


def turned(v: Array, elevation: Array, heading: Array) -> Array:
    """Velocities ``v`` (m, 3) raised by ``elevation`` (m,) and turned about z by ``heading`` (m,), rad."""
    level = np.linalg.norm(v[:, :2], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(level[:, None] > 0.0, v[:, :2] / level[:, None], [1.0, 0.0])
    upward = np.column_stack([-v[:, 2:] * along, level])  # |v| k
    raised = np.cos(elevation)[:, None] * v + np.sin(elevation)[:, None] * upward
    c, s = np.cos(heading), np.sin(heading)
    out: Array = np.column_stack(
        [c * raised[:, 0] - s * raised[:, 1], s * raised[:, 0] + c * raised[:, 1], raised[:, 2]]
    )
    return out
