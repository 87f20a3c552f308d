"""The same scenario and seed give the same bytes: in two processes, with one job and with eight, under load."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

CDFCTL = [sys.executable, "-m", "cdfctl"]


def spin() -> None:
    while True:
        pass


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("loaded", [False, True])
def test_a_run_and_a_bench(loaded: bool, tmp_path: Path) -> None:
    hogs = [multiprocessing.get_context("spawn").Process(target=spin, daemon=True) for _ in range(4 * loaded)]
    for hog in hogs:
        hog.start()
    try:
        for name in ("a", "b"):
            run = [*CDFCTL, "run", "C2", "--trial", "4", "--out", str(tmp_path / name), "--quiet"]
            assert subprocess.run(run, check=False, capture_output=True).returncode in (0, 1)
        for jobs in (1, 8):
            bench = [*CDFCTL, "bench", "--scenario", "S3", "--scenario", "C2", "--trials", "8", "--jobs", str(jobs)]
            subprocess.run(
                [*bench, "--out", str(tmp_path / f"jobs-{jobs}"), "--quiet"], check=True, capture_output=True
            )
    finally:
        for hog in hogs:
            hog.kill()
    with np.load(tmp_path / "a" / "trajectory.npz") as a, np.load(tmp_path / "b" / "trajectory.npz") as b:
        assert a.files == b.files
        for name in a.files:
            if name != "step_time":
                assert a[name].tobytes() == b[name].tobytes(), name
    assert (tmp_path / "jobs-1" / "trials.jsonl").read_bytes() == (tmp_path / "jobs-8" / "trials.jsonl").read_bytes()
