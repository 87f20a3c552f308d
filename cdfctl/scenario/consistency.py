"""What must agree across a scenario's sections: lengths and names.

These checks read plain data (lists and dicts, as the file has them) and skip what is malformed: so they run, and
report, also where some other part of the file does not validate.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from cdfctl.scenario.feed import measured_only
from cdfctl.scenario.placing import MOST_COPIES, MOST_OBSTACLES
from cdfctl.scenario.plant import MujocoConfig, expanded
from cdfctl.scenario.values import Complaint, Place

ONE_A_JOINT = (("task", "goal"), ("task", "pose"), ("controller", "effort_weight"), ("controller", "smoothness_weight"))
MAX_STEPS = 1_000_000


def inconsistencies(data: dict[str, Any]) -> list[Complaint]:
    """Message, hint and place of everything that disagrees in the scenario ``data``."""
    checks = (_joint_counts, _names, _steps, _physics_steps, _rules, measured_only, _measured_twice)
    return [complaint for check in checks for complaint in check(data)]


def _joint_counts(data: dict[str, Any]) -> Iterator[Complaint]:
    start = _get(data, "robot", "q0")
    if not isinstance(start, list | tuple) or not start:
        return
    for place in ONE_A_JOINT:
        value = _get(data, *place)
        if isinstance(value, list | tuple) and value and len(value) != len(start):
            yield (
                f"expected {len(start)} numbers, as many as robot.q0, found {len(value)}",
                "one number a joint in both lists: either may be the wrong one",
                place,
            )


def _names(data: dict[str, Any]) -> Iterator[Complaint]:
    obstacles = data.get("obstacles")
    if not isinstance(obstacles, list | tuple):
        return
    # An obstacle without a name goes by its place, so "1" may clash as well.
    taken: dict[str, int] = {}
    before = 0
    for i, item in enumerate(obstacles):
        if not (isinstance(item, dict) and item.get("name") is not None):
            taken |= {str(before + k): i for k in range(_members(item))}
        before += _members(item)
    for i, item in enumerate(obstacles):
        name = item.get("name") if isinstance(item, dict) else None
        if not isinstance(name, str):
            continue
        group = item.get("count") is not None or item.get("grid") is not None
        for own in [f"{name}-{k}" for k in range(1, _members(item) + 1)] if group else [name]:
            if own in taken:
                yield f"the name '{own}' is taken by obstacles[{taken[own]}]", None, ("obstacles", i, "name")
                break
            taken[own] = i


def _members(item: object) -> int:
    """How many obstacles an item becomes when drawn."""
    grid = _get(item, "grid", "counts")
    counts = [_get(item, "count"), *(grid if isinstance(grid, list | tuple) else ())]
    known = [c for c in counts if isinstance(c, int) and not isinstance(c, bool) and 0 < c <= MOST_COPIES]
    return min(math.prod(known), MOST_OBSTACLES)


def _rules(data: dict[str, Any]) -> Iterator[Complaint]:
    """A rule must have something to speak of: a goal pose, a straight path."""
    obstacles = data.get("obstacles")
    items = list(enumerate(obstacles)) if isinstance(obstacles, list | tuple) else []
    places: list[Place] = [("redraw_within",), *(("obstacles", i, "redraw_within") for i, _ in items)]
    holders = [data, *(item for _, item in items)]
    reach = _get(data, "task", "type") == "reach"
    for place, holder in zip(places, holders, strict=True):
        if reach and _get(holder, "redraw_within", "goal") is not None:
            yield "a reach task has no goal pose", "leave goal out", (*place, "goal")
    if _get(data, "redraw_within", "segment") is not None:
        for i, item in items:
            if _get(item, "motion") is not None:
                hint = "the segment of redraw_within needs straight paths: velocity or approach"
                yield "segment and motion exclude each other", hint, ("obstacles", i, "motion")


def _steps(data: dict[str, Any]) -> Iterator[Complaint]:
    dt, limit = _get(data, "simulation", "dt"), _get(data, "simulation", "time_limit")
    if not (_is_number(dt) and _is_number(limit) and dt > 0):
        return
    if limit < dt:
        yield f"time_limit {limit} s is shorter than one step, dt {dt} s", None, ("simulation", "time_limit")
    elif limit / dt > MAX_STEPS:
        yield f"time_limit / dt is over {MAX_STEPS:,} steps", "a longer dt or a shorter limit", ("simulation", "dt")


def _physics_steps(data: dict[str, Any]) -> Iterator[Complaint]:
    """A control step of the plant ``mujoco`` is a whole number of steps of the physics."""
    plant = expanded(data.get("plant"))
    if not isinstance(plant, dict) or plant.get("type") != "mujoco":
        return
    dt, step = _get(data, "simulation", "dt"), plant.get("timestep", MujocoConfig.model_fields["timestep"].default)
    if not (_is_number(dt) and _is_number(step) and dt > 0.0 and step > 0.0):
        return
    count = round(min(dt / step, 1e9))
    if count < 1 or abs(count * step - dt) > 1e-9:
        what = "is longer than" if step > dt else "does not divide"
        parts = next((k for k in (1, 2, 4, 5, 8, 10, 16, 20, 25, 40, 50) if k >= dt / step), 100)
        hint = f"for example plant.timestep={dt / parts:g}"
        yield f"the step of the physics, {step:g} s, {what} the control step, {dt:g} s", hint, ("plant", "timestep")


def _measured_twice(data: dict[str, Any]) -> Iterator[Complaint]:
    """Errors are of a picture we make ourselves, and a delay is made up for once."""
    measurement = data.get("measurement")
    if not isinstance(measurement, dict):
        return
    sizes = ("delay", "position_noise", "speed_error", "heading_error_deg", "elevation_error_deg", "dropout")
    if data.get("feed") is not None and any(measurement.get(name) for name in sizes):
        yield "measured obstacles have errors of their own", "leave measurement out", ("measurement",)
    if measurement.get("delay") and measurement.get("compensate_delay", True) and _get(data, "controller", "delay"):
        hint = "measurement.compensate_delay: false, or leave controller.delay out"
        yield "the delay is made up for already, by measurement.compensate_delay", hint, ("controller", "delay")


def _get(data: Any, *keys: str) -> Any:
    for key in keys:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
