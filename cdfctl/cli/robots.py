"""``cdfctl robots``: what robots are shipped."""

from __future__ import annotations

from cdfctl.cli import options
from cdfctl.cli.console import show, write, write_json


def robots(json: options.Json = False, quiet: options.NamesOnly = False, debug: options.Debug = False) -> None:
    """List the shipped robots, one line each."""
    from cdfctl.robots.robot_file import shipped_robots

    shipped = shipped_robots()
    if json:
        write_json({"robots": [{"name": robot.name, "description": robot.description} for robot in shipped]})
    elif quiet:
        write("\n".join(robot.name for robot in shipped))
    else:
        from cdfctl.report.tables import listing

        show(listing(("robot", "description"), [(robot.name, robot.description) for robot in shipped]))
