"""A benchmark's store read back, by any code that can read its format: for figures, not for going on with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdfctl.benchmark.lines import TIMES, TRIAL, Record, key_of, read_lines
from cdfctl.benchmark.plan import Cell
from cdfctl.benchmark.statistics import CellSummary, summarise
from cdfctl.benchmark.store import FORMAT, MANIFEST, TIMING, TRIALS, VERSION
from cdfctl.benchmark.sweep import Setting, parse_sweep
from cdfctl.errors import CdfctlError, InputError
from cdfctl.reading import read_json
from cdfctl.scenario.wording import validate

AGAIN = "run the benchmark again"
RIGHT = "name the folder that cdfctl bench wrote"


@dataclass(frozen=True)
class CellTrials:
    """One line of the table, and its trials: lines of ``trials.jsonl``."""

    summary: CellSummary
    records: tuple[Record, ...]

    @property
    def cell(self) -> Cell:
        """Scenario and controller."""
        return self.summary.cell


@dataclass(frozen=True)
class StoredBench:
    """A benchmark: what it is called, its seed, and every cell that has trials, in the order of the plan."""

    suite: str
    seed: int
    cells: tuple[CellTrials, ...]


def read_store(folder: Path) -> StoredBench:
    """The benchmark in ``folder``.

    Raises:
        InputError: it is no store, or a newer one than this code reads, or damaged, or without trials, in one line.
    """
    path = folder / MANIFEST
    manifest = _manifest(folder)
    try:
        configuration = manifest["configuration"]
        seed, suite = int(configuration["seed"]), str(manifest["suite"])
        notes = manifest.get("cells") or [{} for _ in configuration["cells"]]
        cells = [_cell(config, note) for config, note in zip(configuration["cells"], notes, strict=True)]
    except (KeyError, TypeError, ValueError, AttributeError, CdfctlError):
        raise InputError(f"{path}: damaged: not the manifest of a benchmark", AGAIN) from None
    records = read_lines(folder / TRIALS, TRIAL)
    if len({key_of(record) for record in records}) != len(records):
        raise InputError(f"{folder / TRIALS}: damaged: a trial comes twice", AGAIN)
    try:
        timings = read_lines(folder / TIMING, TIMES)
        summaries = summarise(cells, records, timings)
        found = tuple(CellTrials(summary, tuple(r for r in records if _of(r, summary.cell))) for summary in summaries)
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{folder / TRIALS}: damaged: a trial lacks a column", AGAIN) from None
    if not found:
        raise InputError(f"{folder}: a benchmark without a finished trial", AGAIN)
    return StoredBench(suite, seed, found)


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    try:
        manifest = read_json(path)
    except OSError as error:
        raise InputError(f"{folder}: not a benchmark's folder: {MANIFEST}: {error.strerror or error}", RIGHT) from None
    except ValueError:
        raise InputError(f"{path}: damaged: not JSON", AGAIN) from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputError(f"{folder}: not a benchmark's folder of cdfctl", RIGHT)
    version = manifest.get("version")
    if not isinstance(version, int) or version < 1:
        raise InputError(f"{path}: damaged: no version", AGAIN)
    if version > VERSION:
        raise InputError(f"{path}: written by a newer cdfctl (format {version}, this one reads {VERSION})", "update it")
    return manifest


def _cell(config: dict[str, Any], note: dict[str, Any]) -> Cell:
    scenario, complaints = validate(config["scenario"])
    if scenario is None:
        raise ValueError(complaints[0][0])
    settings: list[Setting] = []
    for field, text in note.get("sweep", {}).items():
        settings += parse_sweep(f"{field}={text}")
    return Cell(scenario, tuple(settings), bool(note.get("shipped", False)), config.get("table"))


def _of(record: Record, cell: Cell) -> bool:
    key = (record["scenario"], record["controller"], record["on_infeasible"])
    return key == (cell.name, cell.controller, cell.on_infeasible)
