"""A benchmark as JSON: the keys of ``cdfctl bench --json``, and the fuller ones of ``summary.json``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from cdfctl.benchmark.paper import Printed, printed
from cdfctl.benchmark.plan import Plan
from cdfctl.benchmark.solvable.trials import Share
from cdfctl.benchmark.statistics import CellSummary
from cdfctl.benchmark.versions import versions


def paper_cell(summary: CellSummary) -> Printed | None:
    """The paper's figures for a summary: only for a shipped scenario as it stands."""
    return printed(summary.cell.name, summary.cell.controller) if summary.cell.shipped else None


def document(plan: Plan, summaries: Sequence[CellSummary]) -> dict[str, Any]:
    """The document of ``bench --json``. Where a benchmark has several rules for infeasible steps, or sweeps a field,
    each result also says which it is: ``on_infeasible``, ``sweep``. Where it was asked what can be solved, ``solvable``
    says so."""
    several = len({cell.on_infeasible for cell in plan.cells}) > 1
    results = []
    for summary in summaries:
        result = _result(summary)
        if several:
            result["on_infeasible"] = summary.cell.on_infeasible
        if summary.cell.settings:
            result["sweep"] = {setting.field: setting.override.value for setting in summary.cell.settings}
        if summary.share is not None:
            result["solvable"] = _share(summary.share)
        results.append(result)
    return {"trials": plan.trials, "seed": plan.seed, "results": results}


def full_document(plan: Plan, summaries: Sequence[CellSummary]) -> dict[str, Any]:
    """The document of ``summary.json``: the same, more of each cell, and what code made it."""
    short = document(plan, summaries)
    for result, summary in zip(short["results"], summaries, strict=True):
        result |= {
            "on_infeasible": summary.cell.on_infeasible,
            "successes": summary.successes,
            "successes_sampled": summary.successes_sampled,
            "infeasible_trials": summary.infeasible_trials,
            "infeasible_steps": summary.infeasible_steps,
            "mcnemar_p": summary.p_value,
            "assumptions": list(summary.cell.scenario.assumptions),
        }
    return {"format": "cdfctl-bench-summary", "version": 1, "suite": plan.suite, **short, "versions": versions()}


def _share(share: Share) -> dict[str, Any]:
    return {
        "trials": share.trials,
        "share": list(share.bounds),
        "success_of_solvable": list(share.of_solvable),
        "yes": list(share.yes),
        "no": list(share.no),
        "open": list(share.open),
        "missed": list(share.missed),
    }


def _result(summary: CellSummary) -> dict[str, Any]:
    paper = paper_cell(summary)
    p50, p99 = summary.step_ms
    return {
        "scenario": summary.cell.scenario.name,
        "controller": summary.cell.controller,
        "trials": summary.trials,
        "success_rate": summary.success_rate,
        "success_ci95": list(summary.ci95),
        "success_rate_sampled": summary.success_rate_sampled,
        "time_to_reach_s": asdict(summary.time),
        "path_length_m": asdict(summary.path),
        "joint_path_rad": asdict(summary.joint_path),
        "errors": summary.outcomes["error"],
        "collisions": summary.outcomes["collision"],
        "timeouts": summary.outcomes["timeout"],
        "infeasible": summary.outcomes["infeasible"],
        "min_clearance_m": summary.min_clearance,
        "step_ms": {"p50": p50, "p99": p99},
        "paper": None if paper is None else paper.document(),
    }
