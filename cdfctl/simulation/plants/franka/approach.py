"""The way to a scenario's start: the same safety rows, a joint goal, and a low speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdfctl.control.controller import Controller, build
from cdfctl.robots.robot import Robot
from cdfctl.scenario.resolve import resolve_controller
from cdfctl.scenario.schema import ControllerConfig, JointGoalTask, Scenario
from cdfctl.scenario.variants import TASKS_OF, VARIANTS
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.stream.motion import MeasuredMotion
from cdfctl.types import Array, Scene, State


class SlowApproach:
    """The joint velocity that takes a robot to the start of a scenario, among its obstacles as they are at t = 0."""

    def __init__(self, scenario: Scenario, robot: Robot, motion: SceneMotion, speed: float) -> None:
        """``scenario`` is drawn and resolved; no joint moves faster than ``speed`` (rad/s)."""
        self._scenario, self._motion = scenario, motion
        self._slow = replace(robot, velocity_limit=np.minimum(robot.velocity_limit, speed))
        self._controller: Controller | None = None

    def __call__(self, t: float, q: Array) -> Array:
        """The velocity (n,), rad/s, at ``q`` (n,), ``t`` (s) after setting out; 0 while an obstacle's place is not
        known."""
        if self._controller is None:
            scenario = self._scenario
            task = JointGoalTask(type="joint-goal", goal=scenario.robot.q0)
            config = controller_for(scenario.controller)
            self._controller = build(self._slow, config, task, scenario.simulation.dt)
        scene = self._scene(t)
        if isinstance(self._motion, MeasuredMotion) and self._motion.stale(t):
            return np.zeros_like(q)
        return self._controller.step(State(t, q), scene).u

    def _scene(self, t: float) -> Scene:
        """The obstacles: declared ones stand still where they are at t = 0, measured ones are where they are."""
        motion = self._motion
        if isinstance(motion, MeasuredMotion):
            return motion.at(t)
        return Scene.from_arrays(motion.shapes, motion.names, motion.poses(0.0), np.zeros((len(motion), 6)))


def controller_for(config: ControllerConfig) -> ControllerConfig:
    """The scenario's controller, or the default one where it cannot go to a configuration."""
    if "joint-goal" in TASKS_OF[VARIANTS[config.variant].task]:
        return config
    return resolve_controller(ControllerConfig(margin=config.margin))
