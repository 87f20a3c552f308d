"""Draws: every ``{uniform: [a, b]}`` of a scenario becomes a number, the same one on every machine.

The stream of trial i is PCG64 seeded by ``SeedSequence(seed, spawn_key=(i,))``. Numbers are taken from it in the order
of the schema's fields (robot.q0, then task, then obstacles) and of the items of a list, whatever the order of keys in
the file. A controller's section holds no draws, so trial i is the same set-up for every controller.
"""

from __future__ import annotations

from typing import Any

from numpy.random import PCG64, Generator, SeedSequence
from pydantic import BaseModel

from cdfctl.errors import InputError
from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.values import Uniform


def draw(scenario: Scenario, seed: int, trial: int) -> Scenario:
    """The set-up of one trial: ``scenario`` with every draw replaced by a number in [a, b], and ``seed`` written in.

    Raises:
        InputError: ``seed`` or ``trial`` is negative.
    """
    for name, value in (("seed", seed), ("trial", trial)):
        if value < 0:
            raise InputError(f"{name} must be at least 0, found {value}")
    stream = Generator(PCG64(SeedSequence(seed, spawn_key=(trial,))))
    drawn: Scenario = _drawn(scenario, stream)
    return drawn.model_copy(update={"seed": seed})


def has_draws(scenario: Scenario) -> bool:
    """Whether a trial of this scenario differs from the next."""
    return _holds(scenario)


def _drawn(value: Any, stream: Generator) -> Any:
    if isinstance(value, Uniform):
        low, high = value.uniform
        # Rounding may carry low + (high - low) u past high.
        return min(low + (high - low) * float(stream.random()), high)
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        return value.model_copy(update={name: _drawn(getattr(value, name), stream) for name in fields})
    if isinstance(value, tuple):
        return tuple(_drawn(item, stream) for item in value)
    return value


def _holds(value: Any) -> bool:
    if isinstance(value, Uniform):
        return True
    if isinstance(value, BaseModel):
        return any(_holds(getattr(value, name)) for name in type(value).model_fields)
    return isinstance(value, tuple) and any(_holds(item) for item in value)
