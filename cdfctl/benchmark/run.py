"""Many trials at once: joblib over worker processes of this machine (loky), or over a Dask cluster by the same calls.

A worker that dies takes the trials in flight with it. Each of those is run once more, by itself; what dies again is
recorded as an error, with the reason, and the rest goes on.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

import joblib

from cdfctl.benchmark.plan import Cell, Plan
from cdfctl.benchmark.solvable.trials import Record
from cdfctl.benchmark.solvable.trials import answer as solvable_answer
from cdfctl.benchmark.trial import Answer, Keep, failed, run_trial
from cdfctl.errors import CdfctlError

DIED = "the worker process died twice in this trial"

IDLE = 20
"""A worker without work ends after so many seconds: it notices in no other way that this process was killed."""


@dataclass
class Runner:
    """Runs trials of a plan.

    Attributes:
        plan: what to run.
        jobs: worker processes of this machine; one means this process itself.
        keep: whose runs to hand back.
        cluster: a Dask client, or None for this machine.
    """

    plan: Plan
    jobs: int
    keep: Keep
    cluster: Any = None
    _sent: list[int] = field(default_factory=list, repr=False)

    def run(self, places: Sequence[int]) -> Generator[Answer, None, None]:
        """The answers of the trials at these places of the plan, as they come."""
        waiting = list(places)
        while waiting:
            self._sent = []
            back = set()
            try:
                with closing(self._parallel(waiting)) as answers:
                    for place, answer in answers:
                        back.add(place)
                        yield answer
                return
            except BrokenExecutor:
                suspects = [place for place in self._sent if place not in back]
            for place in suspects:
                yield self._alone(place)
            waiting = [place for place in waiting if place not in back and place not in suspects]

    def _alone(self, place: int) -> Answer:
        try:
            with closing(self._parallel([place])) as answers:
                answer: Answer = next(answers)[1]
                return answer
        except BrokenExecutor:
            cell, trial = self.plan[place]
            return Answer(failed(cell.key(trial), DIED), 0.0)

    def _parallel(self, places: Sequence[int]) -> Any:
        """A generator of (place, answer), in the order in which they come."""
        # One trial a task: what is sent ahead is what a death can take along.
        return self._workers("generator_unordered", len(places))(self._tasks(places))

    def solve(self, questions: Sequence[tuple[Cell, int]]) -> Generator[Record, None, None]:
        """What is proved of these set-ups (see :mod:`cdfctl.benchmark.solvable`), in order.

        Raises:
            CdfctlError: a worker died.
        """
        try:
            workers = self._workers("generator", len(questions))
            with closing(workers(joblib.delayed(solvable_answer)(*q) for q in questions)) as found:
                yield from found
        except BrokenExecutor:
            raise CdfctlError("a worker process died", "the same command goes on from there") from None

    def _workers(self, order: str, tasks: int) -> Any:
        if self.cluster is not None:
            backend, jobs = joblib.parallel_config(backend="dask", client=self.cluster), -1
        else:
            backend = joblib.parallel_config(backend="loky", inner_max_num_threads=1, idle_worker_timeout=IDLE)
            # It starts every worker at once, needed or not; and one job would be this process, which has to outlive a
            # trial that kills its worker.
            jobs = min(self.jobs, max(2, tasks))
        with backend:
            return joblib.Parallel(jobs, return_as=order, batch_size=1, pre_dispatch="2*n_jobs")

    def _tasks(self, places: Sequence[int]) -> Iterator[Any]:
        for place in places:
            self._sent.append(place)
            cell, trial = self.plan[place]
            yield joblib.delayed(_placed)(place, cell, trial, self.keep)


def _placed(place: int, *arguments: Any) -> tuple[int, Answer]:
    return place, run_trial(*arguments)


def processors() -> int:
    """How many processors this process may use."""
    return int(joblib.cpu_count())
