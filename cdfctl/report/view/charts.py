"""The charts beside the picture: what is drawn over time, the same in the live page and in the page of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdfctl.report.view.colours import DISTANCE, TARGET, obstacle_colour
from cdfctl.report.view.replay import Replay
from cdfctl.scenario.variants import VARIANTS
from cdfctl.types import Array

MOST_CURVES = 8
"""With more obstacles than this a chart shows the least of them only."""


@dataclass(frozen=True)
class Curve:
    """One quantity over the times of its chart; NaN where it is undefined."""

    name: str
    colour: str
    values: Array


@dataclass(frozen=True)
class Chart:
    """``curves`` over ``t`` (k,) in s, all in one ``unit``; ``level`` is a line to stay above or get below."""

    title: str
    unit: str
    t: Array
    curves: tuple[Curve, ...]
    level: float
    level_name: str


def charts_of(replay: Replay, clearance: Array) -> list[Chart]:
    """h of each obstacle, V where there is one, and ``clearance`` (N+1,), the judge's distance at the states, m."""
    run, names = replay.trajectory, replay.body.names
    controller = replay.body.scenario.controller
    t, charts = run.t[:-1], []
    field = VARIANTS[controller.variant].field
    kinds = [(run.h, "m" if field == "sdf" else "rad")]
    if run.h_sdf is not None:
        kinds.append((run.h_sdf, "m"))
    for values, unit in kinds:
        if len(names) and len(t):
            of = "signed distance" if unit == "m" else "distance in joint space"
            charts.append(Chart(f"h: {of}", unit, t, _per_obstacle(values, names), 0.0, "margin"))
    if np.isfinite(clearance).any():
        curve = Curve("judge", DISTANCE, np.where(np.isfinite(clearance), clearance, np.nan))
        charts.append(Chart("least distance to an obstacle", "m", run.t, (curve,), 0.0, "contact"))
    if np.isfinite(run.V).any():
        level = controller.reach_tolerance if controller.reach_tolerance is not None else 0.0
        charts.append(Chart("V: distance to the target", "rad", t, (Curve("V", TARGET, run.V),), level, "reached"))
    return charts


def clearance_curve(replay: Replay, first: int = 0) -> Array:
    """The judge's least distance at the states from ``first`` on, m; +inf without obstacles."""
    run, clearance = replay.trajectory, replay.body.clearance
    found = np.full(len(run.t) - first, np.inf)
    for i, (q, poses) in enumerate(zip(run.q[first:], run.obstacle_pose[first:], strict=True)):
        clearance.place(q, poses)
        found[i] = clearance.distances().min(initial=np.inf)
    return found


def _per_obstacle(values: Array, names: tuple[str, ...]) -> tuple[Curve, ...]:
    finite = np.where(np.isfinite(values), values, np.nan)
    if len(names) <= MOST_CURVES:
        return tuple(Curve(name, obstacle_colour(i), finite[:, i]) for i, name in enumerate(names))
    least = np.min(values, axis=1)
    return (Curve(f"least of {len(names)}", DISTANCE, np.where(np.isfinite(least), least, np.nan)),)
