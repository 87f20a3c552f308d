"""A million control steps in one process: memory and step time stay where they were."""

from __future__ import annotations

import resource
import time
from pathlib import Path

import numpy as np
import pytest

import cdfctl

STEPS = 1_000_000
PARTS = 20


def resident_mb() -> float:
    """Memory of this process now (its peak where /proc is not at hand), MB."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * resource.getpagesize() / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


@pytest.mark.long
@pytest.mark.timeout(7200)
def test_a_million_steps(capsys: pytest.CaptureFixture[str]) -> None:
    robot = cdfctl.load_robot("planar")
    safe = cdfctl.SafetyFilter(robot, variant="dual-tvcbf-qp", dt=0.01)
    q, goal = np.zeros(2), np.array([1.0, 0.5])
    memory, step = [], []
    for part in range(PARTS):
        began = time.perf_counter()
        for i in range(STEPS // PARTS):
            t = 0.01 * (part * (STEPS // PARTS) + i)
            angle = 0.7 * t
            centre = [3.2 * np.cos(angle), 3.2 * np.sin(angle), 0.0]
            velocity = [-2.24 * np.sin(angle), 2.24 * np.cos(angle), 0.0]
            scene = cdfctl.Scene([cdfctl.Obstacle(cdfctl.Sphere(0.3), centre, velocity=velocity)])
            q = q + 0.01 * safe.step(q, scene, 2.0 * (goal - q)).u
        step.append((time.perf_counter() - began) / (STEPS // PARTS))
        memory.append(resident_mb())
    with capsys.disabled():
        print(
            f"\nmemory {memory[1]:.1f} .. {memory[-1]:.1f} MB, step {1e3 * min(step):.3f} .. {1e3 * max(step):.3f} ms"
        )
    assert np.all(np.isfinite(q))
    assert memory[-1] - memory[1] < 5.0  # MB; 16 bytes leaked a step would be 15
