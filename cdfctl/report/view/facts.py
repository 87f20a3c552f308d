"""What stands above the charts: which run it is and what became of it."""

from __future__ import annotations

from cdfctl.scenario.schema import Scenario
from cdfctl.simulation.run_folder import Run


def title_of(scenario: Scenario) -> str:
    """Scenario and controller."""
    return f"{scenario.name}: {scenario.controller.variant}"


def facts_of(run: Run) -> list[str]:
    """The outcome and the figures of a finished run, a line each, from its ``result.json``."""
    document = run.document
    outcome = str(document.get("outcome", "unknown"))
    lines = [f"{document.get('robot', '')}, seed {document.get('seed')}, trial {document.get('trial')}"]
    reach, hit = document.get("time_to_reach_s"), document.get("collision_time_s")
    if isinstance(reach, int | float):
        outcome += f" in {reach:.2f} s"
    elif isinstance(hit, int | float):
        outcome += f" at {hit:.2f} s"
    clearance, infeasible = document.get("min_clearance_m"), document.get("infeasible_steps")
    if isinstance(clearance, int | float):
        outcome += f"; least clearance {clearance:.3f} m"
    lines.append(outcome)
    if isinstance(infeasible, int) and infeasible:
        lines.append(f"{infeasible} of {document.get('steps')} steps infeasible")
    return lines
