"""The summary of one run, for people: what happened first, then the figures, then what was assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.text import Text

from cdfctl.report.tables import bullets, facts
from cdfctl.simulation.plants import Report
from cdfctl.simulation.result import RunResult, step_milliseconds
from cdfctl.types import Outcome, Verdict

STYLES: Mapping[Outcome, str] = {
    "reached": "green",
    "collision": "red",
    "timeout": "yellow",
    "infeasible": "yellow",
    "error": "red",
}


UNITS: Mapping[str, str] = {
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_rad": "rad",
    "_Hz": "Hz",
    "_Nm": "Nm",
    "_mm": "mm",
    "_ms": "ms",
    "_m": "m",
    "_s": "s",
}
"""How a plant's names end, and the unit that says; a longer one before its own ending."""


OTHER_UNITS: Mapping[str, str] = {"servo_gain": "N m s/rad"}
"""Units of names that do not end in theirs."""


def run_summary(result: RunResult, run_dir: str, tip: str, notes: Sequence[str] = ()) -> RenderableType:
    """The whole summary, legible at 80 columns and without colour.

    Args:
        result: the run.
        run_dir: where it was written.
        tip: the frame whose path length is reported.
        notes: what the robot states about its geometry.
    """
    scenario, style = result.scenario, STYLES[result.verdict.outcome]
    parts: list[RenderableType] = []
    if scenario.description:
        parts += [Text(scenario.description), Text()]
    parts += [Text(headline(result), style=f"bold {style}"), Text(), facts(figures(result, run_dir, tip))]
    title = Text(f"{scenario.name}: {scenario.controller.variant} on {result.robot}")
    panel = Panel(Group(*parts), title=title, title_align="left", border_style=style, padding=(1, 2))
    below: list[RenderableType] = []
    for heading, items in (("Assumed", scenario.assumptions), ("Robot model", notes)):
        if items:
            below += [Text(heading, style="bold"), bullets(items)]
    return Group(panel, *below)


def headline(result: RunResult) -> str:
    """The outcome in one sentence."""
    verdict, simulation = result.verdict, result.scenario.simulation
    but_itself = "" if verdict.self_contact is None else " but with itself"
    match verdict.outcome:
        case "reached":
            return f"REACHED in {seconds(verdict.time_to_reach)}, without contact{but_itself}"
        case "collision":
            contact = verdict.contact
            if contact is None:
                return f"COLLISION: {result.reason}"  # the plant felt what the judge does not see
            return f"COLLISION at {seconds(contact.time)}: {contact.link} touches {contact.obstacle}"
        case "timeout":
            text = f"TIMEOUT: not reached within {simulation.time_limit:g} s, without contact{but_itself}"
            return text + ("; the target was never within reach" if never_within_reach(result) else "")
        case "infeasible":
            return f"INFEASIBLE at {seconds(float(result.trajectory.t[-1]))}: no velocity satisfies all constraints"
        case "error":
            return f"ERROR at {seconds(float(result.trajectory.t[-1]))}: {result.reason or 'the run did not finish'}"


def never_within_reach(result: RunResult) -> bool:
    """Whether no configuration touched the target at any step: V, the distance to it, is infinite throughout."""
    values = result.trajectory.V
    return bool(len(values)) and bool(np.isposinf(values).all())


def figures(result: RunResult, run_dir: str, tip: str) -> list[tuple[str, str]]:
    """Names and values with units."""
    verdict, scenario = result.verdict, result.scenario
    steps = len(result.trajectory.u)
    infeasible = f"{result.infeasible_steps} of {steps}"
    if result.infeasible_steps:
        infeasible += f" (on_infeasible: {scenario.controller.on_infeasible})"
    times = step_milliseconds(result.trajectory)
    return [
        ("time to reach", seconds(verdict.time_to_reach)),
        ("path of the tip", f"{verdict.path_length:.3f} m ({tip})"),
        ("path of the joints", f"{verdict.joint_path:.3f} rad"),
        ("least clearance", clearance(verdict)),
        *self_clearance(verdict, counts=bool(scenario.controller.self_collision)),
        ("infeasible steps", infeasible),
        *plant_figures(result.plant),
        *measured_figures(result.measured),
        ("step time", f"{milliseconds(times['p50'])} median, {milliseconds(times['p99'])} p99"),
        ("draw", f"seed {scenario.seed}, trial {result.trial}"),
        ("run folder", run_dir),
    ]


def plant_figures(report: Report) -> list[tuple[str, str]]:
    """What a plant reports, an entry a line, without those that are None; its unit is the end of its name."""
    kind, *entries = report.items()
    lines = [("plant", str(kind[1]))] if entries else []
    for name, value in entries:
        if value is None:
            continue
        suffix = next((s for s in UNITS if name.endswith(s)), "")
        unit = UNITS.get(suffix, OTHER_UNITS.get(name))
        large = isinstance(value, float) and abs(value) >= 1000.0
        shown = str(value) if not isinstance(value, float) else f"{value:.0f}" if large else f"{value:.3g}"
        label = name.removesuffix(suffix).replace("_", " ")
        lines.append((label, f"{shown} {unit}" if unit else shown))
    return lines


def measured_figures(report: Report | None) -> list[tuple[str, str]]:
    """What became of the messages about measured obstacles, in a line."""
    if report is None:
        return []
    counts = {name: count for name, count in report.items() if name != "braked_steps"}
    told = ", ".join(f"{count} {name}" for name, count in counts.items() if count or name == "accepted")
    return [("measurements", told), ("braked for want of", f"{report['braked_steps']} steps")]


def clearance(verdict: Verdict) -> str:
    """The least signed distance and when it was."""
    if verdict.min_clearance_time is None or not math.isfinite(verdict.min_clearance):
        return "no obstacle"
    return f"{verdict.min_clearance:.4f} m at {seconds(verdict.min_clearance_time)}"


def self_clearance(verdict: Verdict, *, counts: bool) -> list[tuple[str, str]]:
    """The robot's least distance to itself, where that is asked for or there was contact."""
    contact = verdict.self_contact
    if math.isinf(verdict.min_self_clearance) or (contact is None and not counts):
        return []
    text = f"{verdict.min_self_clearance:.4f} m"
    if contact is not None:
        text += f": {contact.link} touches {contact.obstacle} at {seconds(contact.time)}"
        text += "" if counts else " (not counted: controller.self_collision is 0)"
    return [("clearance to itself", text)]


def seconds(value: float | None) -> str:
    """``value`` in seconds, or a dash."""
    return "-" if value is None else f"{value:.2f} s"


def milliseconds(value: float | None) -> str:
    """``value`` in milliseconds, or a dash (a run of no steps has no step time)."""
    return "-" if value is None or not math.isfinite(value) else f"{value:.2f} ms"
