"""The obstacles of a run as they are measured: where they are by now, and afterwards where they have been."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from cdfctl.scenario.feed import FeedConfig
from cdfctl.scenario.shapes import Body, ObstacleConfig, WaypointMotion
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.stream.message import parse
from cdfctl.simulation.stream.source import Source, source_of
from cdfctl.simulation.stream.track import Track
from cdfctl.types import Array, Scene

PAUSE = 0.5
"""Where nobody has looked for so long (s, wall clock), what has queued up is dropped and every track begins anew."""

COUNTED = ("accepted", "garbage", "unknown", "backward", "jump")


class MeasuredMotion(SceneMotion):
    """Obstacles whose poses come from outside.

    :meth:`at` takes what has come. Between measurements an obstacle keeps its velocity. Once the run is over,
    :meth:`settled` gives the motion that was measured.

    Attributes:
        counts: messages by what became of them: accepted, garbage, unknown (name), backward (time), jump.
    """

    def __init__(self, items: Sequence[ObstacleConfig], config: FeedConfig, source: Source | None = None) -> None:
        """``source`` is for tests; without it the one of ``config`` is opened when first it is looked at."""
        super().__init__(items)
        self._items, self._config, self._source = items, config, source
        self._index = {name: i for i, name in enumerate(self.names)}
        self._first = super().poses(0.0)
        self._looked = -np.inf
        self._now = 0.0
        self.counts: Counter[str] = Counter(dict.fromkeys(COUNTED, 0))
        self._restart()

    def at(self, t: float) -> Scene:
        """The scene at time ``t`` (s), which is now, with all that has been measured by now."""
        self._poll(t)
        return super().at(t)

    def poses(self, t: float) -> Array:
        """(m, 7) by the measurements so far."""
        return np.array([track.pose(t) for track in self._tracks]).reshape(len(self), 7)

    def twists(self, t: float) -> Array:
        """(m, 6) by the measurements so far."""
        return np.array([track.twist() for track in self._tracks]).reshape(len(self), 6)

    def stale(self, t: float) -> list[str]:
        """The obstacles of which nothing has been heard for too long."""
        return [name for name, track in zip(self.names, self._tracks, strict=True) if self._old(track, t)]

    def close(self) -> None:
        """Let go of the source."""
        if self._source is not None:
            self._source.close()

    def settled(self) -> SceneMotion:
        """What was measured, as a motion: straight from one measurement to the next, at rest after the last."""
        return SceneMotion([_measured(item, track.log) for item, track in zip(self._items, self._tracks, strict=True)])

    def _old(self, track: Track, t: float) -> bool:
        return track.age(t) > self._config.max_age

    def _restart(self) -> None:
        self._tracks = [Track(pose, self._config.max_speed) for pose in self._first]

    def _poll(self, t: float) -> None:
        if self._source is None:
            self._source = source_of(self._config)
        lines, looked = self._source.lines(), time.monotonic()
        if t < self._now or looked - self._looked > PAUSE:
            self._restart()
            lines = []
        self._now, self._looked = t, looked
        for line in lines:
            self.counts[self._take(line, t)] += 1

    def _take(self, line: bytes, t: float) -> str:
        measured = parse(line)
        if measured is None:
            return "garbage"
        index = self._index.get(measured.name)
        if index is None:
            return "unknown"
        return self._tracks[index].offer(measured, t) or "accepted"


def _measured(item: ObstacleConfig, log: Sequence[tuple[float, Array]]) -> Body:
    """``item`` moving through what was measured of it."""
    if len(log) < 2:
        pose = log[0][1].tolist() if log else None
        return item if pose is None else item.model_copy(update={"position": pose[:3], "orientation": pose[3:]})
    # Constructed without a check: the numbers are ours, and there may be thousands.
    motion = WaypointMotion.model_construct(
        type="waypoints",
        times=tuple(t for t, _ in log),
        positions=tuple(tuple(pose[:3].tolist()) for _, pose in log),
        orientations=tuple(tuple(pose[3:].tolist()) for _, pose in log),
    )
    return item.model_copy(update={"position": None, "motion": motion})
