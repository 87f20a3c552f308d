"""What a benchmark runs: cells, each a scenario under one controller, and the order of their trials.

Trial i of a scenario is the same set-up in every cell: its draws come from ``SeedSequence(seed, spawn_key=(i,))`` and
a controller's section holds none. The plan goes trial by trial, each through all cells, so that more trials only add to
its end and paired results arrive together.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdfctl.benchmark.sweep import Setting, label
from cdfctl.benchmark.tables import table_mark
from cdfctl.errors import InputError
from cdfctl.reading import check_regular
from cdfctl.robots.robot import Robot
from cdfctl.scenario.library import ScenarioFile, load_scenario
from cdfctl.scenario.overrides import Override
from cdfctl.scenario.resolve import resolve
from cdfctl.scenario.schema import Scenario
from cdfctl.scenario.shapes import CloudShape, MeshShape
from cdfctl.scenario.variants import variant_named
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.checks import robot_of
from cdfctl.types import TrialKey


@dataclass(frozen=True)
class Cell:
    """One line of the table.

    Attributes:
        scenario: resolved, with its draws still in it; ``seed`` is the benchmark's.
        settings: what a sweep set in it.
        shipped: it is a shipped scenario as it stands, so the paper's figures may stand beside it.
        table: mark of the contact table it uses (see :mod:`cdfctl.benchmark.tables`).
    """

    scenario: Scenario
    settings: tuple[Setting, ...] = ()
    shipped: bool = False
    table: str | None = None

    @property
    def name(self) -> str:
        """The scenario's name, and what a sweep set in it: ``S1[alpha=2]``."""
        return self.scenario.name + (f"[{label(self.settings)}]" if self.settings else "")

    @property
    def controller(self) -> str:
        """The variant's name."""
        return self.scenario.controller.variant

    @property
    def on_infeasible(self) -> str:
        """The rule for steps that no velocity satisfies."""
        return str(self.scenario.controller.on_infeasible)

    @property
    def identity(self) -> tuple[str, str, str]:
        """What tells it from the other cells of its plan: name, controller, rule."""
        return self.name, self.controller, self.on_infeasible

    def key(self, trial: int) -> TrialKey:
        """The key of one of its trials."""
        return TrialKey(self.name, self.controller, self.on_infeasible, self.scenario.seed, trial)


@dataclass(frozen=True)
class Plan:
    """Cells and a number of trials each.

    Attributes:
        suite: what the store is called.
        cells: in the order of the table; the first of a scenario is what the others are compared with.
        trials: of each cell.
        seed: of all draws.
        robots: hash of each cell's robot, by the robot's section.
    """

    suite: str
    cells: tuple[Cell, ...]
    trials: int
    seed: int
    robots: Mapping[str, str]

    def __len__(self) -> int:
        return self.trials * len(self.cells)

    def __getitem__(self, index: int) -> tuple[Cell, int]:
        """The cell and the trial at a place of the plan."""
        trial, cell = divmod(index, len(self.cells))
        return self.cells[cell], trial

    def keys(self) -> Iterator[TrialKey]:
        """The keys of all trials, in order."""
        return (cell.key(trial) for trial in range(self.trials) for cell in self.cells)

    def configuration(self) -> dict[str, Any]:
        """Everything that decides the results, but for the number of trials and the code."""
        return {
            "seed": self.seed,
            "cells": [
                {
                    "name": cell.name,
                    "scenario": cell.scenario.model_dump(mode="json", exclude_none=True),
                    "robot": self.robots[robot_key(cell.scenario)],
                    "files": _files(cell.scenario),
                    "table": cell.table,
                }
                for cell in self.cells
            ],
        }


def make_plan(
    scenarios: Sequence[str],
    controllers: Sequence[str],
    rules: Sequence[str],
    sweep: Sequence[tuple[Setting, ...]],
    *,
    trials: int,
    seed: int,
    suite: str | None = None,
    overrides: Sequence[Override] = (),
) -> Plan:
    """The plan of scenarios x sweep x rules x controllers, every cell checked as a run would be.

    Args:
        scenarios: shipped names or paths.
        controllers: variants; none for each scenario's own.
        rules: values of ``on_infeasible``; none for each scenario's own.
        sweep: combinations of settings (see :mod:`cdfctl.benchmark.sweep`); one empty combination for no sweep.
        trials: of each cell, at least 1.
        seed: of the draws.
        suite: its name; without one, the names of the scenarios.
        overrides: fields set in every scenario.

    Raises:
        InputError: an unknown scenario, controller or field, or one that does not fit; all of a cell's at once.
    """
    for name in controllers:
        variant_named(name)
    robots: dict[str, Robot] = {}
    cells: dict[tuple[str, str, str], Cell] = {}
    for source in scenarios:
        for settings in sweep:
            for rule, controller in itertools.product(rules or (None,), controllers or (None,)):
                changes = [*overrides, *(setting.override for setting in settings), *_chosen(controller, rule)]
                changes.append(Override(("seed",), seed, f"--seed {seed}"))
                file = load_scenario(source, changes)
                _check_repeatable(file)
                place = robot_key(file.scenario)
                wired = assemble(file, robot=robots.get(place))
                robots[place] = wired.robot
                as_shipped = "/" not in source and not Path(source).suffix and not settings and not overrides
                cell = Cell(resolve(file.scenario), settings, as_shipped, table_mark(file.scenario, wired.robot))
                same = cells.setdefault(cell.identity, cell)
                if same.scenario != cell.scenario:
                    raise InputError(f"two scenarios are called '{cell.name}'", "give one of them another name")
    names = list(dict.fromkeys(cell.scenario.name for cell in cells.values()))
    return Plan(
        suite=suite or ("+".join(names) if len(names) <= 3 else f"{len(names)}-scenarios"),
        cells=tuple(cells.values()),
        trials=trials,
        seed=seed,
        robots={place: robot.hash for place, robot in robots.items()},
    )


def _check_repeatable(file: ScenarioFile) -> None:
    """A benchmark's trial is the same for every controller: nothing in it may come from outside."""
    found = []
    if file.scenario.feed is not None:
        found.append(file.located("obstacles", "a benchmark cannot repeat what is measured", "declare the obstacles"))
    if file.scenario.plant.type == "franka":
        found.append(file.located("plant", "a benchmark does not drive an arm", "plant: kinematic or mujoco"))
    if found:
        raise file.errors(found)


def robot_key(scenario: Scenario) -> str:
    """What a scenario says of its robot apart from where it starts: equal keys, equal robots."""
    return scenario.robot.model_dump_json(exclude={"q0"})


def robot_for(scenario: Scenario, known: dict[str, Robot]) -> Robot:
    """The robot of ``scenario``, from ``known`` where it is there (it is loaded once a process)."""
    place = robot_key(scenario)
    if place not in known:
        known[place] = robot_of(scenario.robot)
    return known[place]


def digest(document: Mapping[str, Any]) -> str:
    """A short hash of a JSON document."""
    text = json.dumps(document, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _chosen(controller: str | None, rule: str | None) -> Iterator[Override]:
    if controller is not None:
        yield Override(("controller", "variant"), controller, f"--controller {controller}")
    if rule is not None:
        yield Override(("controller", "on_infeasible"), rule, f"--on-infeasible {rule}")


def _files(scenario: Scenario) -> dict[str, str]:
    """Hashes of the files of shapes, by path."""
    bodies = [*scenario.obstacles, getattr(scenario.task, "target", None)]
    shapes = [body.shape for body in bodies if body is not None]
    paths = {shape.file for shape in shapes if isinstance(shape, MeshShape | CloudShape) and shape.file is not None}
    try:
        return {path: _hash(Path(path)) for path in sorted(paths)}
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be read: {error.strerror}") from None


def _hash(path: Path) -> str:
    check_regular(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
