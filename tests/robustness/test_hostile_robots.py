"""Hostile robot descriptions and meshes end in a message: no traceback, no hang, nothing run, nothing written."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("seed", "count"), [(0, 60), pytest.param(1, 5000, marks=pytest.mark.long)])
def test_every_description_ends_in_a_status_and_a_message(seed: int, count: int, tmp_path: Path) -> None:
    words = [sys.executable, str(HERE / "robot_worker.py"), str(seed), str(count)]
    done = subprocess.run(words, cwd=tmp_path, env=os.environ, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines() if line.startswith('{"case"')]
    assert len(answers) == count + 1
    assert answers[0]["status"] == 0  # the good one
    for answer in answers:
        assert answer["status"] in (0, 2), answer
        assert (answer["status"] == 0) == ("error: " not in answer["err"]), answer
        assert "Traceback" not in answer["err"], answer
        assert not answer["seen"], answer
        assert answer["s"] < 5.0, answer
        assert answer["MB"] < 1024, answer
