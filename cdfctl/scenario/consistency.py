"""What must agree across a scenario's sections: lengths and names.

These checks read plain data (lists and dicts, as the file has them) and skip what is malformed: so they run, and
report, also where some other part of the file does not validate.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cdfctl.scenario.values import Complaint

ONE_A_JOINT = (("task", "goal"), ("task", "pose"), ("controller", "effort_weight"), ("controller", "smoothness_weight"))
MAX_STEPS = 1_000_000


def inconsistencies(data: dict[str, Any]) -> list[Complaint]:
    """Message, hint and place of everything that disagrees in the scenario ``data``."""
    return [*_joint_counts(data), *_names(data), *_steps(data)]


def _joint_counts(data: dict[str, Any]) -> Iterator[Complaint]:
    start = _get(data, "robot", "q0")
    if not isinstance(start, list | tuple) or not start:
        return
    for place in ONE_A_JOINT:
        value = _get(data, *place)
        if isinstance(value, list | tuple) and value and len(value) != len(start):
            yield (
                f"expected {len(start)} numbers, as many as robot.q0, found {len(value)}",
                "one number a joint, in the order of robot.q0",
                place,
            )


def _names(data: dict[str, Any]) -> Iterator[Complaint]:
    obstacles = data.get("obstacles")
    if not isinstance(obstacles, list | tuple):
        return
    # An obstacle without a name goes by its place, so "1" may clash as well.
    seen = {
        str(i): i for i, item in enumerate(obstacles) if not (isinstance(item, dict) and item.get("name") is not None)
    }
    for i, item in enumerate(obstacles):
        name = item.get("name") if isinstance(item, dict) else None
        if not isinstance(name, str):
            continue
        if name in seen:
            yield f"the name '{name}' is taken by obstacles[{seen[name]}]", None, ("obstacles", i, "name")
        seen.setdefault(name, i)


def _steps(data: dict[str, Any]) -> Iterator[Complaint]:
    dt, limit = _get(data, "simulation", "dt"), _get(data, "simulation", "time_limit")
    if not (_is_number(dt) and _is_number(limit) and dt > 0):
        return
    if limit < dt:
        yield f"time_limit {limit} s is shorter than one step, dt {dt} s", None, ("simulation", "time_limit")
    elif limit / dt > MAX_STEPS:
        yield f"time_limit / dt is over {MAX_STEPS:,} steps", "a longer dt or a shorter limit", ("simulation", "dt")


def _get(data: Any, *keys: str) -> Any:
    for key in keys:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
