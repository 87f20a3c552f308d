"""How well the arm plant keeps its rate against franky-sim: ``python tests/benchmarks/bench_franka.py [seconds]``.

A simulated arm is started at an address of its own, and holds a pose at 100 Hz while three balls swing before it, under
the default controller. Missed ticks, lag and response are in the arm's time. Not a test: it is not collected by pytest.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import assemble

HOST = "127.77.7.1"
SERVE = Path(__file__).parents[1] / "simulation" / "plants" / "franka" / "serve.py"
START = [-0.6, 0.1, 0.0, -1.9, 0.0, 2.0, 0.785]
BALL = {"shape": {"type": "ball", "radius": 0.05}}


def main(seconds: float) -> None:
    """Run, and print the report."""
    balls = [
        {**BALL, "position": [0.7, y, 0.6], "motion": {"type": "sinusoid", "amplitude": [0, 0.3, 0], "frequency": 0.2}}
        for y in (-0.3, 0.0, 0.3)
    ]
    changes = [
        "plant.type=franka",
        f"plant.host={HOST}",
        "robot.limits={velocity: 0.5, acceleration: 10.0}",
        f"obstacles={json.dumps(balls)}",
        f"task={{type: hold, pose: {START}}}",
        f"simulation.time_limit={seconds}",
    ]
    trial = assemble(load_scenario("real-slow", changes))
    command = [sys.executable, str(SERVE), HOST, *map(str, START)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        server.stdout.readline()
        try:
            for _ in trial.run():
                pass
        finally:
            server.kill()
    result = trial.result()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; {result.verdict.outcome}, {result.reason}")
    for name, value in {**result.plant, **result.document("")["step_ms"]}.items():
        print(f"{name:24} {value:.4g}" if isinstance(value, float) else f"{name:24} {value}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
