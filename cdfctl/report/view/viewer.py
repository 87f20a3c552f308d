"""The live page: one clock, one stage, one panel, and a source that may still be growing."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from cdfctl.report.view.charts import clearance_curve
from cdfctl.report.view.clock import Clock
from cdfctl.report.view.panel import Panel
from cdfctl.report.view.replay import Replay
from cdfctl.report.view.stage import Stage

PERIOD = 1.0 / 30.0
"""Between two pictures, s."""

POLL = 0.2
"""Between two looks at a run in progress, s."""


PANEL_SHARE = 0.16
"""By how much of the picture's height the run is moved to the left, out of the panel's way."""


class Source(Protocol):
    """Where a replay comes from."""

    def poll(self) -> Replay | None:
        """A longer replay of the same body, None where nothing has come."""
        ...

    @property
    def complete(self) -> bool:
        """No more is to come."""
        ...


class Finished:
    """A run that is over."""

    complete = True

    def poll(self) -> Replay | None:
        """Nothing more."""
        return None


class Viewer:
    """A replay on a viser server.

    Attributes:
        clock: the time shown.
        stage: the picture.
        replay: as long as it is by now.
    """

    def __init__(self, server: Any, replay: Replay, title: str, facts: list[str], source: Source | None = None) -> None:
        """Build the page; ``server`` is a running ``viser.ViserServer``."""
        self._server, self._source = server, source if source is not None else Finished()
        self.replay = replay
        self.clock = Clock(following=not self._source.complete)
        if self.clock.following:
            self.clock.t = replay.duration
        with server.atomic():
            self.stage = Stage(server.scene, replay, complete=self._source.complete)
            self.stage.camera.apply(server.initial_camera, -PANEL_SHARE)  # the panel is on the right
            self._panel = Panel(server.gui, self.clock, self.stage, replay, title, facts)
            self._clearance = clearance_curve(replay)
            self._panel.load(replay, self._clearance)
            self._show()

    def run(self, stop: Callable[[], bool]) -> None:
        """Keep the page alive until ``stop`` says so; a KeyboardInterrupt passes through."""
        before = polled = time.monotonic()
        while not stop():
            time.sleep(PERIOD)
            now = time.monotonic()
            grown = not self._source.complete and now - polled >= POLL and self._poll()
            polled = now if now - polled >= POLL else polled
            self.clock.tick(now - before, self.replay.duration)
            before = now
            if grown or (self.clock.t, self.clock.playing) != self._shown:
                with self._server.atomic():
                    self._show()

    def _poll(self) -> bool:
        longer = self._source.poll()
        complete = self._source.complete
        if longer is not None:
            known = len(self.replay.trajectory.t)
            self.replay = longer
            self._clearance = np.concatenate([self._clearance, clearance_curve(longer, known)])
        if longer is not None or complete:
            self.clock.following = not complete
            self.stage.extend(self.replay, complete=complete)
            self._panel.load(self.replay, self._clearance)
        return longer is not None or complete

    def _show(self) -> None:
        self._shown = (self.clock.t, self.clock.playing)
        instant = self.replay.at(self._shown[0])
        self.stage.show(instant, self.replay)
        self._panel.show(instant, self.replay)
