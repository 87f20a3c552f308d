"""Runs to be drawn: one made, and one written by hand that has everything a run can have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdfctl.report.figures.made_run import made_run
from cdfctl.report.figures.run_view import RunView
from cdfctl.scenario.overrides import parse_override


@pytest.fixture(scope="session")
def small_run() -> RunView:
    """The planar arm past one disc, by the signed distance."""
    settings = ("controller.variant=sdf-tvcbf-qp", "obstacles[0].velocity=[0, 1.5, 0]", "simulation.time_limit=1.5")
    return made_run("planar-1", [parse_override(setting) for setting in settings])


@pytest.fixture(scope="session")
def full_run(small_run: RunView) -> RunView:
    """The same with two infeasible steps, both barriers, contacts, a Lyapunov function and plans; a contact too."""
    arrays, N = small_run.trajectory, small_run.steps
    infeasible = np.zeros(N, dtype=np.bool_)
    infeasible[[3, 4]] = True
    contact_q = np.full((N, 1, 2), 0.5)
    contact_q[0] = np.nan
    h = arrays.h.copy()
    h[:2] = np.inf
    trajectory = replace(
        arrays, h=h, h_sdf=arrays.h - 0.1, contact_q=contact_q, infeasible=infeasible, V=np.linspace(1.0, 0.0, N),
        slack=np.linspace(0.0, 1.0, N),
    )  # fmt: skip
    scenario = small_run.scenario
    controller = scenario.controller.model_copy(update={"variant": "dual-tvcbf-qp"})
    view = replace(
        small_run,
        trajectory=trajectory,
        scenario=scenario.model_copy(update={"controller": controller}),
        document={**small_run.document, "outcome": "collision", "collision_time_s": 0.42, "min_clearance_m": -0.01},
    )
    plan_q, plan_t = np.full((N, 4, 2), np.nan), np.full((N, 4), np.nan)
    plan_q[5:] = arrays.q[5, :] + np.arange(4)[:, None] * 0.1
    plan_t[5:] = np.arange(4) * 0.1
    object.__setattr__(view, "plan", (plan_q, plan_t))  # in the place of the cached property
    return view
