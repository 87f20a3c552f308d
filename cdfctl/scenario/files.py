"""Files that a scenario names: where they are, and whether they are there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cdfctl.scenario.problems import Path as Place
from cdfctl.scenario.values import Complaint

SUFFIXES = (".yaml", ".yml")


def absolute(data: Any, base: Path) -> tuple[Any, list[Complaint]]:
    """Paths in ``data`` made absolute (in place): a copy of the scenario elsewhere must still find its files."""
    missing: list[Complaint] = []
    for holder, key, place in _file_fields(data):
        value = holder[key]
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            continue
        path = base / value
        if not os.path.exists(path):
            missing.append((f"no such file: {value}", f"looked for {path}", place))
        holder[key] = str(path)
    return data, missing


def _file_fields(data: Any) -> Iterator[tuple[Any, Any, Place]]:
    robot = data.get("robot") if isinstance(data, dict) else None
    if isinstance(robot, dict):
        name = robot.get("name")
        if isinstance(name, str) and ("/" in name or Path(name).suffix in SUFFIXES):
            yield robot, "name", ("robot", "name")
        if "urdf" in robot:
            yield robot, "urdf", ("robot", "urdf")
        if "srdf" in robot:
            yield robot, "srdf", ("robot", "srdf")
        folders = robot.get("package_dirs")
        if isinstance(folders, list):
            for i in range(len(folders)):
                yield folders, i, ("robot", "package_dirs", i)
    bodies: list[tuple[Any, Place]] = []
    if isinstance(data, dict):
        obstacles = data.get("obstacles")
        bodies += [(body, ("obstacles", i)) for i, body in enumerate(obstacles if isinstance(obstacles, list) else [])]
        task = data.get("task")
        bodies.append((task.get("target") if isinstance(task, dict) else None, ("task", "target")))
    for body, place in bodies:
        shape = body.get("shape") if isinstance(body, dict) else None
        if isinstance(shape, dict) and "file" in shape:
            yield shape, "file", (*place, "shape", "file")
