"""The scripts of docs/examples around the safety filter run, and keep their distance by coal's word."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "examples"

SAYS = {
    "joystick": [r"'bad-input': [1-9]", r"forearm near panda_\w+", r"acceleration: 15\.00 rad/s\^2"],
    "crashing_policy": [r"without the filter: crashed at", r"with the filter: ran for"],
    "depth_camera": [r"of up to \d{2,} points"],
    "two_arms": [r"14 joints", r"left_panda_\w+ near right_panda_\w+"],
}


@pytest.mark.parametrize("name", SAYS)
def test_an_example_runs_and_nothing_touches(name: str, capsys: pytest.CaptureFixture[str]):
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    out = capsys.readouterr().out
    for pattern in SAYS[name]:
        assert re.search(pattern, out), out
    filtered = [line for line in out.splitlines() if "without the filter" not in line]
    clearances = [float(x) for line in filtered for x in re.findall(r"(-?\d+\.\d) mm", line)]
    assert clearances
    assert all(0.0 < clearance < 200.0 for clearance in clearances), out
