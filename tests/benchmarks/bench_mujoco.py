"""How much faster than real time the MuJoCo plant runs: ``python tests/benchmarks/bench_mujoco.py [scenario …]``.

One thread, the controller asked at 100 Hz. Per control step, medians of the controller's and of the plant's time (ms),
and what they come to: seconds simulated in a second, of the plant alone and with the controller. The last figure is the
whole loop by the wall clock, recording included, which other work on the machine disturbs most. Not a test: it is not
collected by pytest.
"""

from __future__ import annotations

import os
import platform
import sys
import time

import numpy as np

from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import Trial, assemble, plant_of

PERIOD = 0.01  # s
SETTINGS = ["plant.type=mujoco", f"simulation.dt={PERIOD}"]


def bench(name: str, variant: str) -> None:
    """Print one line."""
    trial = assemble(load_scenario(name, [*SETTINGS, f"controller.variant={variant}"]))
    steps = trial.run()
    next(steps)  # compiles
    start = time.perf_counter()
    count = sum(1 for _ in steps)
    wall = time.perf_counter() - start
    controller = float(np.median(trial.rollout.trajectory().step_time))
    plant = plant_time(trial)
    print(
        f"{name:10s} {variant:14s} controller {1e3 * controller:5.2f} ms  plant {1e3 * plant:5.2f} ms  "
        f"plant alone x {PERIOD / plant:5.1f}  with controller x {PERIOD / (plant + controller):5.1f}  "
        f"loop x {PERIOD * count / wall:5.1f}"
    )


def plant_time(trial: Trial) -> float:
    """Median time (s) of a control step of the plant, given the run's commands again."""
    plant, trajectory = plant_of(trial.scenario, trial.robot, trial.motion), trial.rollout.trajectory()
    state, times = plant.start(trajectory.q[0]), []
    for u in trajectory.u:
        start = time.perf_counter()
        state = plant.step(state, u, PERIOD)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def main() -> None:
    """The scenarios named on the command line, otherwise some of a Franka's."""
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for name in sys.argv[1:] or ["real-slow", "C1", "C3"]:
        for variant in ("dual-tvcbf-qp", "sdf-tvcbf-qp"):
            bench(name, variant)


if __name__ == "__main__":
    main()
