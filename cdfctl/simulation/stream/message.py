"""One line from outside as a measurement, or why it is none."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdfctl.types import Array

KEYS = {
    "name": None,
    "t": 1,
    "position": 3,
    "orientation": 4,
    "velocity": 3,
    "angular_velocity": 3,
}
"""The keys of a message and how many numbers each has; the first three are required."""


@dataclass(frozen=True)
class Measurement:
    """Where an obstacle is at the sender's time ``t`` (s): world frame, m; None for what was not measured."""

    name: str
    t: float
    position: Array
    orientation: Array | None
    velocity: Array | None
    angular_velocity: Array | None


def parse(line: bytes) -> Measurement | None:
    """The measurement in ``line``; None where it is not exactly one: unknown keys, too few numbers, NaN."""
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or set(data) - set(KEYS) or not isinstance(data.get("name"), str):
        return None
    found = {key: _numbers(data[key], count) for key, count in KEYS.items() if count is not None and key in data}
    if "t" not in found or "position" not in found or any(value is None for value in found.values()):
        return None
    numbers: dict[str, Any] = found
    orientation = numbers.get("orientation")
    if orientation is not None:
        norm = float(np.linalg.norm(orientation))
        if not 0.5 < norm < 2.0:
            return None
        orientation = orientation / norm
    return Measurement(
        data["name"],
        float(numbers["t"][0]),
        numbers["position"],
        orientation,
        numbers.get("velocity"),
        numbers.get("angular_velocity"),
    )


def _numbers(value: object, count: int) -> Array | None:
    items = [value] if count == 1 else value
    if not isinstance(items, list) or len(items) != count:
        return None
    if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in items):
        return None
    try:
        numbers = np.array([float(x) for x in items])
    except OverflowError:
        return None
    return numbers if all(math.isfinite(x) and abs(x) < 1e12 for x in numbers) else None
