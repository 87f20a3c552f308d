"""The small scenario as a file, and plans of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdfctl.benchmark.plan import Plan, make_plan

from .helpers import SMALL


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder but for ``small.yaml``."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SMALL)
    return tmp_path


@pytest.fixture
def plan(here: Path) -> Plan:
    """Two controllers, four trials each."""
    return make_plan(["./small.yaml"], ["sdf-tvcbf-qp", "sdf-cbf-qp"], [], [()], trials=4, seed=0)
