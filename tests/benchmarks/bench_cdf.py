"""How long the configuration-space distance takes: ``python tests/benchmarks/bench_cdf.py [--cpu]``.

``--cpu`` counts the processor time of the thread instead, which other work on the machine disturbs less.

One thread, after warm-up, median and 99th percentile in ms of a whole call from Python, beside the goals. The scenes
are those of the scenario C3: a Franka among six flying balls, under ``dual-tvcbf-qp`` with four sheets, with a control
period of 0.01 s. A warm query follows the steps of such a trial; a cold one has forgotten them. Not a test: pytest does
not collect it. It begins with what a fresh process waits for its first answer; with an empty ``CDFCTL_CACHE`` that is
compilation. A contact table is used if ``CDFCTL_CACHE`` holds one.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

start = time.perf_counter()

from cdfctl.fields.cdf import CDF  # noqa: E402 - the import is part of what is timed
from cdfctl.fields.field import make_field  # noqa: E402
from cdfctl.robots.robot import Robot, load_robot  # noqa: E402
from cdfctl.types import Array, Obstacle, Scene, Sphere, State  # noqa: E402

TRIALS, COLD = 4, 300
WORKSPACE = ([-0.7, -0.7, 0.1], [0.7, 0.7, 1.0])
CLOCK = time.thread_time if "--cpu" in sys.argv else time.perf_counter


def first_answer(robot: Robot) -> None:
    """The first query of this process."""
    make_field("cdf", robot).query(robot.home, Scene([Obstacle(Sphere(0.05), [0.5, 0.3, 0.5])]))
    print(f"first answer of this process, imports and robot included: {time.perf_counter() - start:.2f} s (goal 2)")


def timed(call: Callable[[], Any]) -> float:
    """How long ``call`` takes, ms."""
    begin = CLOCK()
    call()
    return 1e3 * (CLOCK() - begin)


def report(name: str, times: list[float] | Array, goals: str) -> None:
    """One row: median and 99th percentile of ``times``, ms."""
    median, late = np.percentile(times, [50, 99])
    print(f"{name:45s} median {median:6.3f}  99 % {late:6.3f}   goal {goals}   ({len(times)} calls)")


def steps_of_c3(period: float) -> tuple[list[list[tuple[Array, Scene]]], list[float]]:
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
        for q, scene in runs[-1]:
            times.append(timed(partial(controller.step, State(0.0, q), scene)))
    return runs, times


def along(field: CDF, runs: list[list[tuple[Array, Scene]]], sheets: int) -> list[float]:
    """Times of warm queries along ``runs``, the first of each left out."""
    times = []
    for run in runs:
        field.reset()
        times += [timed(partial(field.contacts, q, scene, sheets=sheets)) for q, scene in run][1:]
    return times


def at(scene: Scene, positions: Array) -> Scene:
    """``scene`` with its balls at ``positions`` (m, 3): what a loop does, which builds its shapes once."""
    poses = scene.poses.copy()
    poses[:, :3] = positions
    return Scene.from_arrays(scene.shapes, scene.names, poses, scene.twists)


def cold(field: CDF, robot: Robot) -> list[float]:
    """Times of first queries of one ball, anywhere in the workspace, a tenth of the time out of reach."""
    rng, times, ball = np.random.default_rng(0), [], Scene([Obstacle(Sphere(0.05), [0.0, 0.0, 0.0])])
    for _ in range(COLD):
        scene = at(ball, rng.uniform(*WORKSPACE))
        q = robot.home + rng.normal(0.0, 0.4, robot.n)
        field.reset()
        times.append(timed(partial(field.query, q, scene)))
    return times


def many(field: CDF, robot: Robot) -> list[float]:
    """Times of warm queries of fifty balls that drift through the workspace, some of them into the arm."""
    rng = np.random.default_rng(1)
    p, v = rng.uniform(*WORKSPACE, (50, 3)), rng.normal(0.0, 0.3, (50, 3))
    first = Scene([Obstacle(Sphere(0.05), p[i], velocity=v[i]) for i in range(50)])
    return along(field, [[(robot.home, at(first, p + 0.01 * step * v)) for step in range(200)]], 1)


def main() -> None:
    """Print the table."""
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    robot = load_robot("franka")
    first_answer(robot)
    field = make_field("cdf", robot)
    assert isinstance(field, CDF)
    cold(field, robot)
    runs, steps = steps_of_c3(0.01)
    report("6 balls, warm, 1 sheet", along(field, runs, 1), "0.3")
    report("6 balls, warm, 4 sheets", along(field, runs, 4), "0.6")
    report("1 ball, cold", cold(field, robot), "0.3")
    report("50 balls, warm, 1 sheet", many(field, robot), "2.5")
    report("control step of C3, period 0.01 s", steps, "0.8, 1.5")
    report("control step of C3, period 0.1 s", steps_of_c3(0.1)[1], "0.8, 1.5")


if __name__ == "__main__":
    sys.exit(main())
