"""Run folders, stores, tables, caches and journals, damaged: refused with what to do, or read as what they are."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
SLOW = 5.0  # s of processor time
NEEDED = {"result.json", "trajectory.npz", "manifest.json", "steps.bin"}  # which nothing can be read without
HOPELESS = {"empty", "foreign", "folder", "link"}


@pytest.mark.timeout(7200)
@pytest.mark.parametrize(("seed", "count"), [(0, 16), pytest.param(1, 1000, marks=pytest.mark.long)])
def test_every_file_is_refused_or_read(seed: int, count: int, tmp_path: Path) -> None:
    inside, cache = tmp_path / "inside", tmp_path / "cache"
    inside.mkdir()
    cache.mkdir()
    (cache / "kernels").symlink_to(Path(os.environ["CDFCTL_CACHE"]) / "kernels")
    words = [sys.executable, str(HERE / "damage_worker.py"), str(seed), str(count)]
    environment = os.environ | {"CDFCTL_CACHE": str(cache)}
    done = subprocess.run(words, cwd=inside, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines() if line.startswith('{"case"')]
    assert {answer["case"] for answer in answers} == set(range(count))
    wrong = [(what, answer) for answer in answers if (what := wrong_with(answer))]
    assert wrong == [], wrong[0]
    assert not list(tmp_path.rglob("pwned"))
    assert not (cache / "log").exists()  # where bugs are written down


def wrong_with(answer: dict[str, Any]) -> str | None:
    """What is wrong with the answer to one damaged file; None for nothing."""
    status, said = answer["status"], answer["err"]
    read = answer["words"][0] in ("plot", "view", "bench")
    if status not in (0, 1, 2, 3):
        return "status"
    if "Traceback" in said or answer["seen"] or answer["s"] > SLOW or answer["MB"] > 1024:
        return "conduct"
    if status in (2, 3) and (said.count("error: ") < 1 or not ("hint" in said or "nothing was run" in said)):
        return "it does not say what to do"
    if status == 0 and answer["same"] is False and answer["how"] != "forged":
        return "other bytes than without the damage"
    if answer["file"] in NEEDED and answer["how"] in HOPELESS and read and status != 2:
        return "not refused"
    return None
