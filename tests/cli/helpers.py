"""What the tests of the command line share."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PLANAR = """\
version: 1
name: small
robot:
  name: planar
  q0: [0.5, 0.5]
task:
  type: joint-goal
  goal: [2.5, 0.4]
obstacles:
  - name: disc
    shape: {type: ball, radius: 0.3}
    position: [-3.0, {uniform: [-3.0, -2.0]}, 0.0]
    velocity: [0.1, 0.0, 0.0]
controller: {variant: sdf-tvcbf-qp, gain: 9.9}
simulation: {dt: 0.1, time_limit: 5.0, tolerance: 0.1}
assumptions:
  - The disc is ours.
"""


@dataclass(frozen=True)
class Result:
    """What a command did."""

    status: int
    out: str
    err: str

    def document(self) -> Any:
        """Standard output as one JSON document: anything else there fails."""
        return json.loads(self.out)


Cli = Callable[..., Result]


def files_below(folder: Path) -> set[Path]:
    """Everything in a folder."""
    return set(folder.rglob("*"))
