"""Draws: every ``{uniform: [a, b]}`` of a scenario becomes a number, the same one on every machine.

The stream of trial i is PCG64 seeded by ``SeedSequence(seed, spawn_key=(i,))``. Numbers are taken from it in the order
of the schema's fields (robot.q0, then task, then obstacles) and of the items of a list, whatever the order of keys in
the file; a mirrored draw takes a second one, its sign. A controller's section holds no draws, so trial i is the same
set-up for every controller.

What a rule of ``redraw_within`` refuses is drawn again from the same stream: an obstacle as soon as it is drawn, the
whole set-up once it is complete. The distances that the rules speak of come from above, as a :class:`Geometry`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Protocol

from numpy.random import PCG64, Generator, SeedSequence
from pydantic import BaseModel

from cdfctl.errors import InputError
from cdfctl.scenario.placing import RedrawConfig
from cdfctl.scenario.schema import HoldTask, JointGoalTask, Scenario
from cdfctl.scenario.shapes import Body, ObstacleConfig
from cdfctl.scenario.values import Place, Uniform, floats

ATTEMPTS = 1000
"""How often an obstacle, or a whole set-up, is drawn before it counts as impossible."""

Obstacles = tuple[ObstacleConfig, ...]


class Geometry(Protocol):
    """The distances that the rules ask for, of obstacles without draws in them."""

    def clearance(self, q: Sequence[float], obstacles: Obstacles, /) -> float:
        """Least signed distance (m) of the robot at ``q`` to the obstacles at t = 0."""
        ...

    def path_clearance(self, ends: tuple[Sequence[float], Sequence[float]], obstacles: Obstacles, /) -> float:
        """Least signed distance (m) of a segment to the balls around the obstacles, over all t >= 0."""
        ...


class UndrawableError(InputError):
    """A set-up that no attempt could draw; ``place`` is the rule's path in the scenario."""

    def __init__(self, message: str, hint: str | None, place: Place) -> None:
        super().__init__(message, hint)
        self.place = place

    def __reduce__(self) -> tuple[type[UndrawableError], tuple[str, str | None, Place]]:
        return type(self), (self.message, self.hint, self.place)


def draw(scenario: Scenario, seed: int, trial: int, geometry: Geometry | None = None) -> Scenario:
    """The set-up of one trial: ``scenario`` with every draw replaced by a number in [a, b], every group by its
    obstacles, every approach by position and velocity, and ``seed`` written in.

    Raises:
        InputError: ``seed`` or ``trial`` is negative, or there are rules but no ``geometry`` to keep them by.
        UndrawableError: every attempt was refused by a rule.
    """
    for name, value in (("seed", seed), ("trial", trial)):
        if value < 0:
            raise InputError(f"{name} must be at least 0, found {value}")
    if geometry is None and has_rules(scenario):
        raise InputError(f"the draws of '{scenario.name}' depend on the robot's distances (redraw_within)")
    stream = Generator(PCG64(SeedSequence(seed, spawn_key=(trial,))))
    refusals: Counter[str] = Counter()
    while refusals.total() < ATTEMPTS:
        drawn = _set_up(scenario, stream, geometry)
        rule = _broken(scenario.redraw_within, drawn, drawn.obstacles, geometry)
        if rule is None:
            return drawn.model_copy(update={"seed": seed, "redraw_within": None})
        refusals[rule] += 1
    raise _undrawable("the set-up", refusals, ("redraw_within",))


def has_draws(scenario: Scenario) -> bool:
    """Whether a trial of this scenario differs from the next."""
    return _holds(scenario)


def has_rules(scenario: Scenario) -> bool:
    """Whether a draw of this scenario may be refused, so that it takes a :class:`Geometry`."""
    return scenario.redraw_within is not None or any(o.redraw_within is not None for o in scenario.obstacles)


def sources(scenario: Scenario) -> tuple[int, ...]:
    """Of each obstacle of a drawn ``scenario``, its place in the list of the file."""
    return tuple(i for i, obstacle in enumerate(scenario.obstacles) for _ in range(obstacle.members))


def _set_up(scenario: Scenario, stream: Generator, geometry: Geometry | None) -> Scenario:
    parts = {"robot": _drawn(scenario.robot, stream), "task": _drawn(scenario.task, stream)}
    drawn = scenario.model_copy(update=parts)
    obstacles: list[ObstacleConfig] = []
    for i, item in enumerate(scenario.obstacles):
        group: list[ObstacleConfig] = []
        for _ in range(item.count or 1):
            group += _member(drawn, i, stream, geometry)
        obstacles += _named(item, group)
    return drawn.model_copy(update={"obstacles": tuple(obstacles)})


def _member(drawn: Scenario, i: int, stream: Generator, geometry: Geometry | None) -> Obstacles:
    """One draw of an obstacle with its copies, in a set-up whose robot and task are drawn."""
    item = drawn.obstacles[i]
    refusals: Counter[str] = Counter()
    while refusals.total() < ATTEMPTS:
        copies = _copies(_drawn(item, stream))
        rule = _broken(item.redraw_within, drawn, copies, geometry)
        if rule is None:
            return copies
        refusals[rule] += 1
    raise _undrawable(f"'{item.name or i}'", refusals, ("obstacles", i, "redraw_within"))


def _copies(one: ObstacleConfig) -> Obstacles:
    plain = one.model_copy(update={"count": None, "grid": None, "redraw_within": None})
    if one.grid is None or plain.position is None:
        return (plain,)
    at = floats(plain.position)
    places = [tuple(a + b for a, b in zip(at, offset, strict=True)) for offset in one.grid.offsets()]
    return tuple(plain.model_copy(update={"position": place}) for place in places)


def _named(item: ObstacleConfig, group: list[ObstacleConfig]) -> list[ObstacleConfig]:
    if item.name is None or (item.count is None and item.grid is None):
        return group
    return [one.model_copy(update={"name": f"{item.name}-{k}"}) for k, one in enumerate(group, start=1)]


def _broken(rules: RedrawConfig | None, drawn: Scenario, obstacles: Obstacles, geometry: Geometry | None) -> str | None:
    """The first rule that the obstacles break, in words; None where they keep all."""
    if rules is None or geometry is None or not obstacles:
        return None
    segment = rules.segment
    if segment is not None and geometry.path_clearance(segment.ends, obstacles) < segment.distance:
        return f"its path comes within {segment.distance:g} m of the segment"
    if rules.start is not None and geometry.clearance(floats(drawn.robot.q0), obstacles) < rules.start:
        return f"within {rules.start:g} m of the robot at the start"
    goal = _goal(drawn)
    if rules.goal is not None and goal is not None and geometry.clearance(goal, obstacles) < rules.goal:
        return f"within {rules.goal:g} m of the robot at the goal"
    return None


def _goal(drawn: Scenario) -> tuple[float, ...] | None:
    match drawn.task:
        case JointGoalTask():
            return floats(drawn.task.goal)
        case HoldTask():
            return floats(drawn.task.pose)
        case _:
            return None


def _undrawable(what: str, refusals: Counter[str], place: Place) -> UndrawableError:
    reasons = ", ".join(f"{count} times {rule}" for rule, count in refusals.most_common())
    message = f"{what} was drawn {refusals.total()} times and refused each time: {reasons}"
    return UndrawableError(message, "a smaller distance here, or wider draws", place)


def _drawn(value: Any, stream: Generator) -> Any:
    if isinstance(value, Uniform):
        low, high = value.uniform
        # Rounding may carry low + (high - low) u past high.
        drawn = min(low + (high - low) * float(stream.random()), high)
        return -drawn if value.mirrored and stream.random() < 0.5 else drawn
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        copy = value.model_copy(update={name: _drawn(getattr(value, name), stream) for name in fields})
        return _placed(copy) if isinstance(copy, Body) else copy
    if isinstance(value, tuple):
        return tuple(_drawn(item, stream) for item in value)
    return value


def _placed(body: Body) -> Body:
    if body.approach is None:
        return body
    position, velocity = body.approach.place()
    return body.model_copy(update={"position": position, "velocity": velocity, "approach": None})


def _holds(value: Any) -> bool:
    if isinstance(value, Uniform):
        return True
    if isinstance(value, BaseModel):
        return any(_holds(getattr(value, name)) for name in type(value).model_fields)
    return isinstance(value, tuple) and any(_holds(item) for item in value)
