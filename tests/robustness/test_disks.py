"""A full disk, a read-only one, two writers at once, a clock set back: one message, or the same bytes."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from cdfctl.cli.main import main

from ..benchmark.helpers import SMALL
from .scenarios import DUAL

HERE = Path(__file__).parent
CDFCTL = [sys.executable, "-m", "cdfctl"]


def mounted(script: str) -> list[str]:
    """``script`` as a command that may mount: in a mount namespace of its own, which nobody else sees."""
    own = [] if os.geteuid() == 0 else ["--map-root-user"]
    return ["unshare", *own, "--mount", "sh", "-ec", script]


def can_mount(folder: Path) -> bool:
    if shutil.which("unshare") is None:
        return False
    trial = mounted(f"mount -t tmpfs -o size=64k tmpfs '{folder}'")
    return subprocess.run(trial, capture_output=True, check=False).returncode == 0


@pytest.mark.timeout(900)
def test_disks_that_are_full_or_read_only(tmp_path: Path) -> None:
    for name in ("inside", "readonly", "full", "cache"):
        (tmp_path / name).mkdir()
    if not can_mount(tmp_path / "full"):
        pytest.skip("no file system can be mounted here (unshare --mount)")
    (tmp_path / "cache" / "kernels").symlink_to(Path(os.environ["CDFCTL_CACHE"]) / "kernels")
    (tmp_path / "inside" / "small.yaml").write_text(DUAL)
    script = (
        f"mount -t tmpfs -o ro tmpfs '{tmp_path}/readonly'; mount -t tmpfs -o size=2M tmpfs '{tmp_path}/full';"
        f"exec '{sys.executable}' '{HERE / 'disk_worker.py'}' '{tmp_path}/readonly' '{tmp_path}/full'"
    )
    done = subprocess.run(
        mounted(script),
        cwd=tmp_path / "inside",
        env=os.environ | {"CDFCTL_CACHE": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    *answers, end = (json.loads(line) for line in done.stdout.splitlines() if line.startswith('{"disk"'))
    for answer in answers:
        check_answer(answer)
    assert end["same"] == [True, True]
    # Of what the full disk refused, nothing is left that is half a file of ours.
    assert not [name for name in end["left"] if Path(name).suffix not in ("", ".jsonl", ".chunk")]


def check_answer(answer: dict[str, Any]) -> None:
    """A good disk is written; the others are refused in one message, but that a run goes on without its journal."""
    disk, status, said = answer["disk"], answer["status"], answer["err"]
    assert "Traceback" not in said, answer
    if disk in ("good", "emptied"):
        assert status in (0, 1), answer
    else:
        assert status == 2, answer
        assert said.count("error: ") == 1, answer
        assert "No space left" in said or "ead-only" in said or "cannot be written" in said, answer


@pytest.mark.long
def test_two_benches_on_one_store_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL)
    words = [*CDFCTL, "bench", "--scenario", "./small.yaml", "--trials", "60", "--jobs", "1", "--quiet"]
    words += ["--out", "store"]
    both = [subprocess.Popen(words, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate()[1] for process in both]
    for process, text in zip(both, said, strict=True):
        # The second waits for nothing: it is refused, unless the first was done before it looked.
        assert process.returncode == 0 or (process.returncode == 2 and "another bench is writing" in text), text
    assert 0 in (both[0].returncode, both[1].returncode)
    lines = Path("store/trials.jsonl").read_text().splitlines()
    assert [json.loads(line)["trial"] for line in lines] == list(range(60))


def test_a_clock_set_back_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A day at every look at it: a bench, resumed, is that of a good clock."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL)
    bench = ["bench", "--scenario", "./small.yaml", "--jobs", "1", "--quiet"]
    assert main([*bench, "--trials", "6", "--out", "good"]) == 0
    now, looks = time.time(), itertools.count(1)
    monkeypatch.setattr(time, "time", lambda: now - 86_400.0 * next(looks))
    for trials in ("3", "6"):
        assert main([*bench, "--trials", trials, "--out", "back"]) == 0
    assert Path("back/trials.jsonl").read_bytes() == Path("good/trials.jsonl").read_bytes()
