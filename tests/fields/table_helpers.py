"""What the tests of tables share: small tables, and distances by coal on Pinocchio's placements."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from cdfctl.fields.kernel.starts import Table
from cdfctl.fields.table.accuracy import measure_accuracy
from cdfctl.fields.table.build import BuildParameters, build_table
from cdfctl.fields.table.store import save_table
from cdfctl.robots.robot import Robot


def small_table(robot: Robot, folder: Path, resolution: int = 6, starts: int = 24, **parameters: object) -> Table:
    """A table built in ``folder``, not written."""
    chosen = BuildParameters(resolution=resolution, starts=starts, **parameters)
    return build_table(robot, chosen, folder / "small.safetensors", jobs=1)


def write_small(robot: Robot, path: Path, table: Table, resolution: int = 6, starts: int = 24) -> None:
    """Write a table with a short report."""
    accuracy = measure_accuracy(robot, table, 0.05, 0, points=4, jobs=1)
    save_table(path, robot, table, BuildParameters(resolution=resolution, starts=starts), accuracy)


def points_of(table: Table) -> np.ndarray:
    """(e, 3) the grid point of every entry."""
    index = np.repeat(np.arange(len(table.first) - 1), np.diff(table.first))
    return table.origin + table.spacing * np.stack(np.unravel_index(index, tuple(table.shape)), axis=1)


def link_distance(robot: Robot, link: int, q: np.ndarray, centre: np.ndarray, radius: float) -> list[float]:
    """Signed distances of every collision geometry of ``link`` and a ball, by coal and Pinocchio."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, np.asarray(q, dtype=np.float64))
    ball = coal.Sphere(radius)
    found = []
    for name, geometry in zip(robot.geometry_links, robot.geometry.geometryObjects, strict=True):
        if name != robot.links[link]:
            continue
        placement = data.oMi[geometry.parentJoint] * geometry.placement
        pose = coal.Transform3s(placement.rotation, placement.translation)
        place = coal.Transform3s(np.eye(3), centre)
        request = coal.DistanceRequest(True, True)
        found.append(coal.distance(geometry.geometry, pose, ball, place, request, coal.DistanceResult()))
    return found
