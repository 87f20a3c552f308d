"""The time of a replay: it plays, stands, and goes where it is sent."""

from __future__ import annotations

from dataclasses import dataclass

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass
class Clock:
    """A clock that runs from 0 to an end.

    Attributes:
        t: the time, s.
        playing: whether it moves.
        speed: seconds of the run a second.
        loop: begin again at the end, instead of standing there.
        following: keep up with a run in progress: never behind its last state by more than needed, and no end but the
            run's own.
    """

    t: float = 0.0
    playing: bool = True
    speed: float = 1.0
    loop: bool = True
    following: bool = False

    def tick(self, elapsed: float, end: float) -> None:
        """Let ``elapsed`` (s) of wall clock pass; the run goes on until ``end`` (s)."""
        if not self.playing:
            return
        t = self.t + self.speed * elapsed
        if t < end:
            self.t = t
        elif self.following:
            self.t = end
        elif self.t < end:
            self.t = end  # the end is seen once before it begins again
        elif self.loop:
            self.t = 0.0
        else:
            self.playing = False

    def go_to(self, t: float) -> None:
        """Stand at ``t`` (s)."""
        self.t, self.playing = t, False

    def toggle(self, end: float) -> None:
        """Play or stand; from the end, play from the beginning."""
        self.playing = not self.playing
        if self.playing and self.t >= end and not self.following:
            self.t = 0.0
