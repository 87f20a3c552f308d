"""A replay of a run that goes on: it grows while the run does, and becomes the run folder's when that is there."""

from __future__ import annotations

from pathlib import Path

from cdfctl.errors import InputError
from cdfctl.report.view.replay import Body, Replay
from cdfctl.simulation.journal import JournalReader, is_going_on, live_folder
from cdfctl.simulation.run_folder import Run, read_run


class Following:
    """The source of a run in progress.

    Attributes:
        replay: what there was of it at first.
        run: the finished run once its folder is there, None before, and for ever where the run died.
        complete: no more is to come.
    """

    def __init__(self, folder: Path) -> None:
        """Raises :class:`cdfctl.errors.InputError` where no run into ``folder`` is going on."""
        self._folder = folder
        self._reader = JournalReader(live_folder(folder))
        self._body = Body(self._reader.scenario)
        trajectory = self._reader.poll()
        if trajectory is None:
            raise InputError(f"{folder}: the run in progress has no step yet", "wait for it")
        self.replay = Replay(self._body, trajectory)
        self.run: Run | None = None
        self.complete = False

    def poll(self) -> Replay | None:
        """The replay with what has come since the last time, None where nothing has."""
        going_on = self._reader.going_on  # asked first: what is written after the answer is read at the next poll
        trajectory = self._reader.poll()
        if going_on:
            return None if trajectory is None else Replay(self._body, trajectory)
        self.complete = True
        self._reader.close()
        try:
            self.run = read_run(self._folder)
        except InputError:
            return None if trajectory is None else Replay(self._body, trajectory)
        if self.run.scenario != self._body.scenario:
            self.run = None  # the folder is an older run's, and this one died
            return None
        return Replay(self._body, self.run.trajectory)


def can_follow(folder: Path) -> bool:
    """Whether a run into ``folder`` is going on."""
    return is_going_on(live_folder(folder))
