"""How wrong the controller's picture of the obstacles is. The judge, and the plant, always see them as they are."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator

from cdfctl.scenario.values import Flag, PlainNonNegative, Share, Strict, Whole, about


class MeasurementConfig(Strict):
    """Errors of what the controller is told of the obstacles (and of a reach task's target) at each control step.

    Positions get new noise at every step. The errors of a velocity are drawn once an obstacle and trial, so they do not
    average out: a wrong estimate stays wrong. Shapes, orientations and angular velocities are measured without error,
    but for the delay.
    """

    delay: Annotated[PlainNonNegative, about("age of what the controller is told", "s")] = 0.0
    compensate_delay: Annotated[
        Flag, about("what is told is moved on by the delay, at the measured velocity, before the controller sees it")
    ] = True
    position_noise: Annotated[
        PlainNonNegative, about("standard deviation of each world coordinate, new at every step", "m")
    ] = 0.0
    speed_error: Annotated[
        Share, about("the speed is wrong by up to this share of it, uniformly: 0.2 is within 20 %")
    ] = 0.0
    heading_error_deg: Annotated[
        PlainNonNegative, about("the velocity is turned about world z by up to this, uniformly", "degrees")
    ] = 0.0
    elevation_error_deg: Annotated[
        PlainNonNegative, about("and out of the horizontal by up to this, uniformly", "degrees")
    ] = 0.0
    dropout: Annotated[Share, about("probability that an obstacle is not measured at a step; never at the first")] = 0.0
    on_dropout: Annotated[
        Literal["predict", "hold"],
        about("what is told then: the last measurement moved on at its velocity, or as it was"),
    ] = "predict"
    trial: Annotated[
        int | None,
        BeforeValidator(Whole(0, 2**53 - 1)),
        about("whose errors, of the scenario's seed; without it, those of the trial that is run"),
    ] = None

    @property
    def exact(self) -> bool:
        """Whether the controller is told the truth."""
        errors = self.position_noise, self.speed_error, self.heading_error_deg, self.elevation_error_deg
        return not (self.delay or self.dropout or any(errors))
