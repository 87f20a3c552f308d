"""The solvable share of a benchmark: which trials it asks about, one at a time as a worker does, and what they come to.

The answer belongs to the set-up, not to a controller: cells that differ in the controller or in what it measures share
it. A controller that solves a trial proves it solvable too.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from cdfctl.benchmark.plan import Cell, Plan, digest, robot_for
from cdfctl.errors import InputError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.draws import UndrawableError
from cdfctl.scenario.schema import HoldTask, JointGoalTask, Scenario

Record = dict[str, Any]

APART = {"name", "description", "source", "assumptions", "controller", "measurement", "plant"}
"""The sections of a scenario that the answer does not depend on."""

_ROBOTS: dict[str, Robot] = {}


@dataclass(frozen=True)
class Share:
    """What is known of a cell's trials, each by its number.

    Attributes:
        yes: solved by a motion that the judge passed, the search's or any controller's.
        no: proved impossible.
        open: neither.
        missed: solvable, and failed by this cell's controller.
        successes: trials of those asked about that this cell's controller solved.
    """

    yes: tuple[int, ...]
    no: tuple[int, ...]
    open: tuple[int, ...]
    missed: tuple[int, ...]
    successes: int

    @property
    def trials(self) -> int:
        """How many were asked about."""
        return len(self.yes) + len(self.no) + len(self.open)

    @property
    def bounds(self) -> tuple[float, float]:
        """The solvable share, from below and from above."""
        return len(self.yes) / self.trials, 1.0 - len(self.no) / self.trials

    @property
    def of_solvable(self) -> tuple[float | None, float | None]:
        """Successes over solvable trials, from below and from above; None where none is solvable."""
        most, least = self.trials - len(self.no), len(self.yes)
        return (self.successes / most if most else None, self.successes / least if least else None)


def check_solvable(scenario: Scenario) -> None:
    """Refuse what the bound cannot do.

    Raises:
        InputError: the robot has not two joints, or the task is not a joint goal or a hold.
    """
    joints = len(scenario.robot.q0)
    if joints != 2:
        raise InputError(
            f"--solvable needs a robot with two joints; that of '{scenario.name}' has {joints}",
            "it searches a grid over both joints and time; robot.lock leaves fewer joints",
        )
    if not isinstance(scenario.task, JointGoalTask | HoldTask):
        raise InputError(
            f"--solvable needs a task joint-goal or hold; that of '{scenario.name}' is {scenario.task.type}",
            "it searches for a configuration, not for a touch",
        )


def problem_id(cell: Cell) -> str:
    """The same for cells whose trials are the same set-ups, asked of the same code."""
    scenario = cell.scenario.model_dump(mode="json", exclude_none=True, exclude=APART)
    own = bool(cell.scenario.controller.self_collision)  # the one thing in it that the judge asks for
    return digest({"scenario": scenario, "self_collision": own, "bound": _source()})


@cache
def _source() -> str:
    found = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        found.update(path.read_bytes())
    return found.hexdigest()[:12]


def questions(plan: Plan, known: Iterable[Record]) -> list[tuple[Cell, int]]:
    """A cell and a trial for each set-up of the plan of which nothing is recorded yet."""
    cells = {problem_id(cell): cell for cell in reversed(plan.cells)}
    done = {(record["problem"], record["trial"]) for record in known}
    return [(cell, i) for i in range(plan.trials) for place, cell in cells.items() if (place, i) not in done]


def answer(cell: Cell, trial: int) -> Record:
    """A line of ``solvable.jsonl``: what can be proved of one set-up."""
    from cdfctl.benchmark.solvable.bounds import Solvable, solvable  # compiled code: in the workers only
    from cdfctl.simulation.drawing import draw_trial

    robot = robot_for(cell.scenario, _ROBOTS)
    try:
        found = solvable(draw_trial(cell.scenario, trial, robot), robot)
    except UndrawableError:
        found = Solvable("no", math.nan)  # no set-up, no motion: the trial itself says why
    verdict = found.verdict
    return {
        "problem": problem_id(cell),
        "scenario": cell.scenario.name,
        "seed": cell.scenario.seed,
        "trial": trial,
        "answer": found.answer,
        "width": _finite(found.width),
        "time_to_reach_s": _finite(verdict.time_to_reach) if verdict else None,
        "joint_path_rad": _finite(verdict.joint_path) if verdict else None,
        "min_clearance_m": _finite(verdict.min_clearance) if verdict else None,
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def shares(
    cells: Sequence[Cell], known: Sequence[Record], solved: Mapping[tuple[str, str, str], Mapping[int, bool]]
) -> dict[tuple[str, str, str], Share]:
    """The share of each cell of which something is known, by the cell's key in ``solved``: trial -> success."""
    answers: dict[str, dict[int, str]] = {}
    for record in known:
        answers.setdefault(record["problem"], {})[record["trial"]] = record["answer"]
    same: dict[str, set[int]] = {}
    for cell in cells:
        won = {trial for trial, good in solved.get(cell.identity, {}).items() if good}
        same.setdefault(problem_id(cell), set()).update(won)
    found = {}
    for cell in cells:
        place, own = problem_id(cell), solved.get(cell.identity, {})
        asked = {trial: said for trial, said in answers.get(place, {}).items() if trial in own}
        if asked:
            found[cell.identity] = _share(asked, own, same[place])
    return found


def _share(asked: Mapping[int, str], own: Mapping[int, bool], solved: set[int]) -> Share:
    yes = [i for i in sorted(asked) if asked[i] == "yes" or i in solved]
    rest = [i for i in sorted(asked) if i not in yes]
    return Share(
        yes=tuple(yes),
        no=tuple(i for i in rest if asked[i] == "no"),
        open=tuple(i for i in rest if asked[i] != "no"),
        missed=tuple(i for i in yes if not own[i]),
        successes=sum(own[i] for i in asked),
    )
