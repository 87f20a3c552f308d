"""A small valid scenario, and a way to load an edited one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from cdfctl.scenario import Override, ScenarioErrors, ScenarioFile, load_scenario

GOOD = """\
version: 1
name: mine
robot:
  name: planar
  q0: [2.5, 0.5]
task:
  type: joint-goal
  goal: [-2.7, 0.5]
obstacles:
  - name: disc-1
    shape: {type: ball, radius: 0.3}
    position: [2.4, -2.4, 0.0]
    velocity: [0.0, 0.5, 0.0]
controller:
  variant: sdf-tvcbf-qp
  gain: 9.9
"""


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., ScenarioFile]:
    """Load GOOD with pieces of text replaced; each piece must be there exactly once."""

    def loader(*edits: tuple[str, str], overrides: Sequence[str | Override] = (), text: str = GOOD) -> ScenarioFile:
        for old, new in edits:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = tmp_path / "mine.yaml"
        path.write_text(text, encoding="utf-8")
        return load_scenario(path, overrides)

    return loader


@pytest.fixture
def problems(load: Callable[..., ScenarioFile]) -> Callable[..., list[tuple[object, ...]]]:
    """(line, column, field, message, hint) of every problem of GOOD as edited; and no word of pydantic's."""

    def failing(*edits: tuple[str, str], **options: object) -> list[tuple[object, ...]]:
        with pytest.raises(ScenarioErrors) as caught:
            load(*edits, **options)
        text = str(caught.value)
        for jargon in ("Input should", "pydantic", "type=", "Value error", "valid dictionary"):
            assert jargon not in text
        return [(p.line, p.column, p.field, p.message, p.hint) for p in caught.value.problems]

    return failing
