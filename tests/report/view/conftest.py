"""One run for all of these tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdfctl.report.view.replay import Replay
from cdfctl.simulation.run_folder import read_run

from .made import write_by_hand


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a Franka's run of 2 s."""
    return write_by_hand(tmp_path_factory.mktemp("by-hand"), steps=20)


@pytest.fixture(scope="session")
def replay(run_folder: Path) -> Replay:
    """Its replay."""
    return Replay.of(read_run(run_folder))
