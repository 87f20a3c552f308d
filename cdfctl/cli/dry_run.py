"""``cdfctl run --dry-run``: what would be sent to an arm, on an arm that does at once what it is told."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

from cdfctl.cli.console import write, write_json
from cdfctl.errors import InputError

if TYPE_CHECKING:
    from cdfctl.simulation.assemble import Trial
    from cdfctl.types import Array

COLUMN = 9
"""Characters of one joint: seven of them and the time fit 80."""

LABEL = 20


def rehearse(wired: Trial, *, json: bool, quiet: bool) -> int:
    """Print every command of the run; no arm is needed and no folder written. Returns the exit status of the run.

    Raises:
        InputError: the scenario's plant sends nothing.
    """
    from cdfctl.simulation.plants.franka.plant import FrankaPlant
    from cdfctl.simulation.shapes import vector_of

    plant, robot, scenario = wired.rollout.plant, wired.robot, wired.scenario
    if not isinstance(plant, FrankaPlant):
        raise InputError(f"the plant {scenario.plant.type} sends nothing", "--dry-run goes with --plant franka")
    commands: list[list[float]] = []
    text = not json and not quiet

    def sent(t: float, u: Array, hold: float) -> None:
        commands.append([t, *u.tolist()])
        if text:
            write(f"{t:8.3f}" + "".join(f"{x:{COLUMN}.4f}" for x in u))

    settings = plant.rehearse(vector_of(scenario.robot.q0), sent)
    if text:
        write(f"{scenario.name}: dry run, nothing is sent")
        for name, value in settings.items():
            write(f"  {name:{LABEL}} {value:g}" if isinstance(value, float) else f"  {name:{LABEL}} {value}")
        names = textwrap.fill(", ".join(robot.joint_names), 76 - LABEL)
        write(textwrap.indent(f"{'joints [rad/s]':{LABEL}} {names}", "  ").replace("\n  ", "\n" + (LABEL + 3) * " "))
        write("   t [s]" + "".join(f"{i + 1:{COLUMN}}" for i in range(robot.n)))
    for _ in wired.run():
        pass
    result = wired.result()
    if text:
        write(f"then a stop; {result.verdict.outcome} after {result.trajectory.t[-1]:.3f} s")
    if json:
        document: dict[str, Any] = {
            "scenario": scenario.name,
            "controller": scenario.controller.variant,
            "robot": robot.name,
        }
        document |= {"dry_run": True, "outcome": result.verdict.outcome, "joints": list(robot.joint_names)}
        write_json({**document, **settings, "commands": commands})
    return 0 if result.verdict.success else 1
