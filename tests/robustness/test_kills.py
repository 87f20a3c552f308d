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


def killed(words: list[str], out: str, kills: int, seed: int) -> list[Path]:
    """Run ``words`` into ``out``-0, killing it and its workers at random moments and starting it again until it ends;
    then into ``out``-1, and so on until ``kills`` have struck. What was written."""
    rng, struck, written = random.Random(seed), 0, []
    whole = seconds([*words, "--out", out.format("whole")])
    while struck < kills:
        path = out.format(len(written))
        process = subprocess.Popen(
            [*words, "--out", path], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        try:
            process.wait(timeout=rng.uniform(0.1, whole))
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            struck += 1
        _, said = process.communicate()
        assert process.returncode in (0, -signal.SIGKILL), said
        if process.returncode == 0:
            written.append(Path(path))
    path = out.format(len(written))
    subprocess.run([*words, "--out", path], check=True, capture_output=True)
    return [*written, Path(path)]


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
    stores = killed([*CDFCTL, *BENCH, "--jobs", str(jobs)], "store-{}", 25, jobs)
    whole = (tmp_path / "store-whole" / "trials.jsonl").read_bytes()
    for store in stores:
        assert (store / "trials.jsonl").read_bytes() == whole, store


@pytest.mark.long
@pytest.mark.timeout(7200)
def test_a_build_killed_again_and_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tables = killed([*CDFCTL, *BUILD], "{}.safetensors", 20, 7)
    whole = Path("whole.safetensors").read_bytes()
    for table in tables:
        assert table.read_bytes() == whole, table
    assert {path.name for path in tmp_path.iterdir()} == {"whole.safetensors", *(table.name for table in tables)}
