"""The summary of one run, for people: what happened first, then the figures, then what was assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.text import Text

from cdfctl.report.tables import bullets, facts
from cdfctl.types import Outcome, Verdict

STYLES: Mapping[Outcome, str] = {
    "reached": "green",
    "collision": "red",
    "timeout": "yellow",
    "infeasible": "yellow",
    "error": "red",
}


@dataclass(frozen=True)
class RunReport:
    """What a summary needs to know.

    Attributes:
        document: the keys of ``run --json``.
        verdict: the judge's.
        trial: which draw of the seed.
        description: the scenario's one line.
        tip: the frame whose path length is reported.
        time_limit, dt: of the scenario, s.
        assumptions: what the source of the scenario leaves open, as the scenario states it.
        notes: what the robot file states about its geometry.
        reason: why the outcome is ``error``.
    """

    document: Mapping[str, Any]
    verdict: Verdict
    trial: int
    description: str
    tip: str
    time_limit: float
    dt: float
    assumptions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    reason: str | None = None


def run_summary(report: RunReport) -> RenderableType:
    """The whole summary, legible at 80 columns and without colour."""
    document, outcome = report.document, report.verdict.outcome
    title = f"{document['scenario']}: {document['controller']} on {document['robot']}"
    parts: list[RenderableType] = []
    if report.description:
        parts += [Text(report.description), Text()]
    parts += [Text(headline(report), style=f"bold {STYLES[outcome]}"), Text(), facts(figures(report))]
    below: list[RenderableType] = []
    for heading, items in (("Assumed", report.assumptions), ("Robot model", report.notes)):
        if items:
            below += [Text(heading, style="bold"), bullets(items)]
    panel = Panel(
        Group(*parts), title=Text(title), title_align="left", border_style=STYLES[outcome], expand=True, padding=(1, 2)
    )
    return Group(panel, *below)


def headline(report: RunReport) -> str:
    """The outcome in one sentence."""
    verdict = report.verdict
    steps = report.document["steps"]
    match verdict.outcome:
        case "reached":
            return f"REACHED in {seconds(verdict.time_to_reach)}, without contact"
        case "collision" if verdict.contact is not None:
            contact = verdict.contact
            return f"COLLISION at {seconds(contact.time)}: {contact.link} touches {contact.obstacle}"
        case "timeout":
            return f"TIMEOUT: not reached within {report.time_limit:g} s, without contact"
        case "infeasible":
            at = seconds(steps * report.dt)
            return f"INFEASIBLE: no velocity satisfies all constraints at {at}, and the run stops there"
        case _:
            return f"{verdict.outcome.upper()}: {report.reason or 'the run did not finish'}"


def figures(report: RunReport) -> list[tuple[str, str]]:
    """Names and values with units."""
    document, verdict = report.document, report.verdict
    steps = int(document["steps"])
    infeasible = int(document["infeasible_steps"])
    share = f" of {steps}, each handled as the scenario's on_infeasible says" if infeasible else f" of {steps}"
    times = document["step_ms"]
    return [
        ("time to reach", seconds(verdict.time_to_reach)),
        ("path of the tip", f"{verdict.path_length:.3f} m ({report.tip})"),
        ("path of the joints", f"{verdict.joint_path:.3f} rad"),
        ("least clearance", clearance(verdict)),
        ("infeasible steps", f"{infeasible}{share}"),
        ("step time", f"{milliseconds(times['p50'])} median, {milliseconds(times['p99'])} p99"),
        ("draw", f"seed {document['seed']}, trial {report.trial}"),
        ("run folder", str(document["run_dir"])),
    ]


def clearance(verdict: Verdict) -> str:
    """The least signed distance and when it was."""
    if verdict.min_clearance_time is None or not math.isfinite(verdict.min_clearance):
        return "no obstacle"
    return f"{verdict.min_clearance:.4f} m at {seconds(verdict.min_clearance_time)}"


def seconds(value: float | None) -> str:
    """``value`` in seconds, or a dash."""
    return "-" if value is None else f"{value:.2f} s"


def milliseconds(value: float | None) -> str:
    """``value`` in milliseconds, or a dash (a run of no steps has no step time)."""
    return "-" if value is None or not math.isfinite(value) else f"{value:.2f} ms"
