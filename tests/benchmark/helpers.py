"""What the tests of the benchmark share: a scenario whose trials take milliseconds, and the command in a process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SMALL = """\
version: 1
name: small
robot: {name: planar, q0: [0.5, 0.5]}
task: {type: joint-goal, goal: [2.5, 0.4]}
obstacles:
  - name: disc
    shape: {type: ball, radius: 0.3}
    position: [{uniform: [-3.0, 3.0]}, {uniform: [2.5, 4.0]}, 0.0]
    velocity: [0.1, {uniform: [-3.0, 0.0]}, 0.0]
controller: {variant: sdf-tvcbf-qp, gain: 9.9}
simulation: {dt: 0.1, time_limit: 3.0, tolerance: 0.1}
assumptions:
  - The disc is ours.
"""

TWO = ("--controller", "sdf-tvcbf-qp", "--controller", "sdf-cbf-qp")


def command(folder: Path, *arguments: object) -> list[str]:
    return [sys.executable, "-m", "cdfctl", "bench", "--scenario", str(folder / "small.yaml"), *map(str, arguments)]


def bench(folder: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """``cdfctl bench`` in a process of its own."""
    return subprocess.run(
        command(folder, *arguments), cwd=folder, env={**os.environ, "COLUMNS": "80"}, capture_output=True, text=True,
        check=False, timeout=200,
    )  # fmt: skip
