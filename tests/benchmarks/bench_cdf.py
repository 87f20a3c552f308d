"""How long the configuration-space distance takes: ``python tests/benchmarks/bench_cdf.py [--cpu]``.

The scenes are those of the scenario C3: a Franka among six flying balls, under ``dual-tvcbf-qp`` with four sheets. A
warm query follows the steps of such a trial, with a control period of 0.01 s; a cold one has forgotten them. A contact
table is used if ``CDFCTL_CACHE`` holds one.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from scenes import WORKSPACE, crowd, moving
from timing import Measurement, show, timed

from cdfctl.fields.cdf import CDF
from cdfctl.fields.field import make_field
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.types import Array, Scene, State

TRIALS, COLD = 4, 300


def steps_of_c3(period: float) -> tuple[list[list[tuple[Array, Scene]]], Array]:
    """The configurations and scenes of some trials of C3, and how long each control step took, ms."""
    from cdfctl.control.controller import build
    from cdfctl.scenario.library import load_scenario
    from cdfctl.simulation.assemble import assemble

    file = load_scenario("C3", [f"simulation.dt={period}"])
    runs, times = [], []
    for index in range(TRIALS):
        trial = assemble(file, trial=index)
        runs.append([(step.state.q, step.scene) for step in trial.run()])
        controller = build(trial.robot, trial.scenario.controller, trial.scenario.task, period)
        controller.step(State(0.0, runs[-1][0][0]), runs[-1][0][1])  # makes the workspaces
        controller.reset()
        times += [timed(partial(controller.step, State(0.0, q), scene))[0] for q, scene in runs[-1]]
    return runs, np.array(times)


def along(field: CDF, runs: list[list[tuple[Array, Scene]]], sheets: int) -> Array:
    """Times of warm queries along ``runs``, the first of each left out."""
    times = []
    for run in runs:
        field.reset()
        times += [timed(partial(field.contacts, q, scene, sheets=sheets))[0] for q, scene in run][1:]
    return np.array(times)


def cold(field: CDF, robot: Robot) -> Array:
    """Times of first queries of one ball, anywhere in the workspace, a tenth of the time out of reach."""
    rng, times, p = np.random.default_rng(0), [], np.zeros((1, 3))
    ball = moving(lambda t: (p, np.zeros((1, 3))))
    for _ in range(COLD):
        p[:] = rng.uniform(*WORKSPACE, (1, 3))
        q = robot.home + rng.normal(0.0, 0.4, robot.n)
        field.reset()
        times.append(timed(partial(field.query, q, ball(0.0)))[0])
    return np.array(times)


def measure(robot: Robot) -> Iterator[Measurement]:
    """Queries, then control steps."""
    field = make_field("cdf", robot)
    assert isinstance(field, CDF)
    cold(field, robot)
    runs, steps = steps_of_c3(0.01)
    yield Measurement("cdf, 6 balls, warm, 1 sheet", along(field, runs, 1), 0.3)
    yield Measurement("cdf, 6 balls, warm, 4 sheets", along(field, runs, 4), 0.6)
    yield Measurement("cdf, 1 ball, cold", cold(field, robot), 0.3)
    many = crowd(robot, 50)
    still = [[(robot.home, many(0.01 * step)) for step in range(100)]]
    yield Measurement("cdf, 50 balls, warm, 1 sheet", along(field, still, 1), 2.5)
    yield Measurement("step of C3, period 0.01 s", steps, 0.5, 1.0)
    yield Measurement("step of C3, period 0.1 s", steps_of_c3(0.1)[1], 0.5, 1.0)


if __name__ == "__main__":
    show(measure(load_robot("franka")))
