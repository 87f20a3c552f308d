"""``cdfctl check``: validate a scenario, say what was made of its robot, and do nothing else."""

from __future__ import annotations

from dataclasses import asdict

from cdfctl.cli import options
from cdfctl.cli.console import show, write, write_json


def check(
    scenario: options.Scenario,
    controller: options.Controller = None,
    seed: options.Seed = None,
    trial: options.Trial = 0,
    settings: options.Settings = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
    debug: options.Debug = False,
) -> None:
    """Validate a scenario against its robot; run nothing."""
    from cdfctl.scenario.library import load_scenario
    from cdfctl.scenario.problems import ScenarioErrors

    try:
        file = load_scenario(scenario, options.overrides(settings, controller, seed))
        from cdfctl.simulation.assemble import assemble  # heavy: once the file is known to be good

        wired = assemble(file, trial=trial)
    except ScenarioErrors as errors:
        if json:
            write_json({"file": errors.file, "valid": False, "problems": [asdict(p) for p in errors.problems]})
        raise
    from cdfctl.report.robot_summary import joint_facts, robot_summary

    if json:
        robot = {"name": wired.robot.name, "joints": joint_facts(wired.robot), "notes": wired.robot.notes}
        write_json({"file": file.shown, "valid": True, "problems": [], "robot": robot})
    elif not quiet:
        count = len(wired.scenario.obstacles)
        obstacles = "1 obstacle" if count == 1 else f"{count} obstacles"
        named = f"{wired.robot.name} ({wired.robot.n} joints)"
        write(f"{scenario}: valid: {named}, {obstacles}, {wired.scenario.controller.variant}")
        show(robot_summary(wired.robot))
