"""Whole-body reaching from scenario to verdict, on the two shipped scenarios."""

from __future__ import annotations

import numpy as np

from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.result import RunResult


def run(name: str, *overrides: str) -> RunResult:
    wired = assemble(load_scenario(name, overrides))
    for _ in wired.run():
        pass
    return wired.result()


def test_reach_touches_the_falling_target_and_no_disc() -> None:
    result = run("reach")
    assert result.verdict.outcome == "reached"
    # The paper reaches at 6.7 s. The search without a table ends a little off some contacts, which costs steps.
    assert 6.5 <= result.verdict.time_to_reach <= 7.5
    assert result.verdict.min_clearance > 0.1
    V, t = result.trajectory.V, result.trajectory.t[:-1]
    assert V[-1] < 0.03
    # The target falls out of the first link's reach: V jumps to the second link's, between 3.6 and 4 s. (At 1.7 s the
    # search misses the nearest contact for one step: that blip is no switch.)
    jump = int(np.argmax(np.where(t[:-1] > 3.0, np.diff(V), 0.0)))
    assert V[jump + 1] > V[jump] + 0.1
    assert 3.6 <= t[jump] <= 3.9
    assert (np.diff(V)[t[:-1] > 4.0] < 0.0).all()


def test_a_collinear_target_is_reached_by_the_cdf_and_not_by_the_sdf() -> None:
    assert run("reach-collinear").verdict.outcome == "reached"
    stuck = run("reach-collinear", "controller.variant=sdf-tvcbf-tvclf-qp")
    assert stuck.verdict.outcome == "timeout"
    assert not stuck.trajectory.u.any()
    assert np.isnan(stuck.trajectory.slack).all()  # no gradient, so no row
