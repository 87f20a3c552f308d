"""Contact tables decide which contacts a search finds: a benchmark says which it used, and workers must agree."""

from __future__ import annotations

import hashlib
from functools import lru_cache

from cdfctl.errors import MissingError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.variants import VARIANTS

NO_TABLE = "none"


def table_mark(scenario: Scenario, robot: Robot) -> str | None:
    """A short hash of the contact table that the scenario's controller would use here, ``none`` where it would use
    none; None for a controller that has no use for one."""
    return None if VARIANTS[scenario.controller.variant].field == "sdf" else _mark(robot)


@lru_cache(maxsize=8)
def _mark(robot: Robot) -> str:
    from cdfctl.fields.table.store import table_status

    status = table_status(robot)
    return hashlib.sha256(status.path.read_bytes()).hexdigest()[:12] if status.state == "ready" else NO_TABLE


def check_table(scenario: Scenario, robot: Robot, expected: str | None) -> None:
    """Refuse to mix results of two tables. Raises :class:`MissingError` where this process has another one."""
    here = table_mark(scenario, robot)
    if here != expected:
        raise MissingError(
            f"a worker's contact table of {robot.name} is not the one of this benchmark: {here} instead of {expected}",
            "build or copy the same table on every machine: cdfctl build-cdf",
        )
