"""kill -9 at random moments: what goes on afterwards ends in the bytes of an undisturbed run."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ..benchmark.helpers import SMALL

CDFCTL = [sys.executable, "-m", "cdfctl"]
BENCH = ["bench", "--scenario", "./small.yaml", "--trials", "400", "--seed", "3", "--quiet"]
BUILD = ["build-cdf", "planar", "--resolution", "60", "--starts", "48", "--jobs", "1", "--quiet"]


def killed_until_done(words: list[str], kills: int, rng: random.Random, longest: float) -> int:
    """Run ``words``, killing it and its workers ``kills`` times, each at a random moment; then let it finish."""
    done = 0
    for _ in range(kills):
        process = subprocess.Popen(words, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            process.wait(timeout=rng.uniform(0.5, longest))
        except subprocess.TimeoutExpired:
            done += 1
        else:
            assert process.returncode == 0, process.stderr.read() if process.stderr else ""
        os.killpg(process.pid, signal.SIGKILL) if process.poll() is None else None
        process.communicate()
    last = subprocess.run(words, capture_output=True, text=True, check=False)
    assert last.returncode == 0, last.stderr
    return done


def seconds(words: list[str]) -> float:
    began = time.monotonic()
    subprocess.run(words, check=True, capture_output=True)
    return time.monotonic() - began


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_bench_killed_again_and_again(jobs: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL)
    whole = seconds([*CDFCTL, *BENCH, "--jobs", "2", "--out", "whole"])
    words = [*CDFCTL, *BENCH, "--jobs", str(jobs), "--out", "torn"]
    hit = killed_until_done(words, 25, random.Random(jobs), whole)
    assert hit >= 5  # the rest found the bench ended
    trials = [(tmp_path / store / "trials.jsonl").read_bytes() for store in ("torn", "whole")]
    assert trials[0] == trials[1]


@pytest.mark.long
@pytest.mark.timeout(7200)
def test_a_build_killed_again_and_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    whole = seconds([*CDFCTL, *BUILD, "--out", "whole.safetensors"])
    hit = killed_until_done([*CDFCTL, *BUILD, "--out", "torn.safetensors"], 20, random.Random(7), 0.7 * whole)
    assert hit >= 3
    assert Path("torn.safetensors").read_bytes() == Path("whole.safetensors").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["torn.safetensors", "whole.safetensors"]
