"""Where the tip and the obstacles have been: lines in pieces, each shown from the instant at which it is complete.

Pieces, because a recording of a line that grows would hold the whole line once a picture.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdfctl.report.view.colours import TIP, obstacle_colour, rgb
from cdfctl.report.view.replay import Replay
from cdfctl.types import Array

TIP_PIECES = 60
OBSTACLE_PIECES = 15
MOST_OBSTACLES = 12
"""With more obstacles than this their trails are left out: they would hide the arm."""


class Trail:
    """One line over time under a node of a viser scene."""

    def __init__(self, scene: Any, path: str, colour: str, thickness: float, pieces: int) -> None:
        """``path`` is the node's name, ``thickness`` in m, ``pieces`` about how many a whole run gets."""
        self._scene, self._path, self._colour, self._thickness = scene, path, colour, thickness
        self._pieces = pieces
        self._nodes: list[tuple[float, Any]] = []
        self._shown = 0
        self._until: float | None = None

    def extend(self, times: Array, points: Array, *, complete: bool, expected: int) -> None:
        """Draw what has come since of a line through ``points`` (k, 3) at ``times`` (k,).

        ``complete`` where it ends there; about ``expected`` points will have come by the end.
        """
        last = len(times) - 1
        stride = max(1, expected // self._pieces)
        first = 0 if self._until is None else max(0, int(np.searchsorted(times, self._until + 1e-9)) - 1)
        while first < last and (complete or first + stride <= last):
            end = min(first + stride, last)
            piece = points[first : end + 1]
            node = self._scene.add_line_segments(
                f"{self._path}/{len(self._nodes):04d}",
                np.stack([piece[:-1], piece[1:]], axis=1).astype(np.float32),
                rgb(self._colour),
                thickness=self._thickness,
                visible=False,
            )
            self._nodes.append((float(times[end]), node))
            self._until = float(times[end])
            first = end

    def show(self, t: float) -> None:
        """Show what is past at ``t`` (s), hide the rest."""
        while self._shown < len(self._nodes) and self._nodes[self._shown][0] <= t + 1e-9:
            self._nodes[self._shown][1].visible = True
            self._shown += 1
        while self._shown > 0 and self._nodes[self._shown - 1][0] > t + 1e-9:
            self._shown -= 1
            self._nodes[self._shown][1].visible = False


class Trails:
    """Those of a replay: the tip's, and the obstacles' where there are few."""

    def __init__(self, scene: Any, path: str, replay: Replay, size: float) -> None:
        """``size`` is the robot's, m."""
        self._tip = Trail(scene, f"{path}/tip", TIP, 0.006 * size, TIP_PIECES)
        count = len(replay.body.names) if len(replay.body.names) <= MOST_OBSTACLES else 0
        self._obstacles = [
            Trail(scene, f"{path}/{i}", obstacle_colour(i), 0.003 * size, OBSTACLE_PIECES) for i in range(count)
        ]

    def extend(self, replay: Replay, *, complete: bool) -> None:
        """Draw what has come since; ``complete`` where no more is to come."""
        run, simulation = replay.trajectory, replay.body.scenario.simulation
        most = simulation.time_limit / simulation.dt
        expected = len(replay.path_t) if complete else math.ceil(most)
        self._tip.extend(replay.path_t, replay.tip, complete=complete, expected=expected)
        for i, trail in enumerate(self._obstacles):
            trail.extend(run.t, run.obstacle_pose[:, i, :3], complete=complete, expected=expected)

    def show(self, t: float) -> None:
        """Show what is past at ``t`` (s)."""
        for trail in (self._tip, *self._obstacles):
            trail.show(t)
