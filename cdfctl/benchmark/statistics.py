"""The two statistics of the table, and what a cell's trials come to.

Wilson interval of k successes in n at 95 %: for small n and rates near 0 and 1 it still covers. McNemar's exact test on
paired trials: of the trials that only one of two methods solved, is the split what a fair coin would give?
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdfctl.benchmark.lines import Record
from cdfctl.benchmark.plan import Cell
from cdfctl.benchmark.solvable.trials import Share, shares
from cdfctl.types import OUTCOMES


def wilson(k: int, n: int) -> tuple[float, float]:
    """The 95 % Wilson interval of a rate, from ``k`` successes in ``n >= 1`` trials."""
    from scipy.stats import binomtest  # two seconds: only where a table is made

    interval = binomtest(k, n).proportion_ci(0.95, method="wilson")
    return float(interval.low), float(interval.high)


def mcnemar(first: Sequence[bool], other: Sequence[bool]) -> float:
    """The two-sided p-value of McNemar's exact test on paired outcomes; 1 where no pair differs."""
    from scipy.stats import binomtest

    only_first = sum(a and not b for a, b in zip(first, other, strict=True))
    only_other = sum(b and not a for a, b in zip(first, other, strict=True))
    return float(binomtest(only_first, only_first + only_other).pvalue) if only_first + only_other else 1.0


@dataclass(frozen=True)
class Spread:
    """Least, greatest and mean value; None where there is none."""

    min: float | None
    max: float | None
    mean: float | None

    @classmethod
    def of(cls, values: Sequence[float], mean_of: Sequence[float] | None = None) -> Spread:
        """The spread of ``values``; the mean of ``mean_of`` where that is another list."""
        averaged = values if mean_of is None else mean_of
        return cls(
            min(values, default=None),
            max(values, default=None),
            float(np.mean(averaged)) if len(averaged) else None,
        )


@dataclass(frozen=True)
class CellSummary:
    """What the trials of a cell come to.

    Attributes:
        cell: scenario and controller.
        trials: how many were run.
        successes, ci95: reached without contact at any instant, and the 95 % interval of that rate.
        successes_sampled: the same, looking at control steps only.
        time: s; least and greatest over successes, the mean with each failure counted as the time limit.
        path: of the tip, m, over successes.
        joint_path: rad, over successes.
        outcomes: how many trials ended in each.
        min_clearance: least over all trials, m; None without obstacles.
        infeasible_trials, infeasible_steps: trials with a step that no velocity satisfied, and all such steps.
        step_ms: median and 99 % of all control steps, ms; None where no time was kept.
        p_value: of McNemar's test against the first method of the scenario, None for that one.
        share: of its trials that can be solved at all, None where that was not asked.
    """

    cell: Cell
    trials: int
    successes: int
    ci95: tuple[float, float]
    successes_sampled: int
    time: Spread
    path: Spread
    joint_path: Spread
    outcomes: dict[str, int]
    min_clearance: float | None
    infeasible_trials: int
    infeasible_steps: int
    step_ms: tuple[float | None, float | None]
    p_value: float | None
    share: Share | None = None

    @property
    def success_rate(self) -> float:
        """Reached, and no contact at any instant."""
        return self.successes / self.trials

    @property
    def success_rate_sampled(self) -> float:
        """The paper's protocol."""
        return self.successes_sampled / self.trials


def summarise(
    cells: Sequence[Cell], records: Sequence[Record], timings: Sequence[Record], solvable: Sequence[Record] = ()
) -> list[CellSummary]:
    """A summary of every cell that has trials, in order. ``records``, ``timings`` and ``solvable`` are lines of the
    store; compared are the trials that both of two cells have."""
    groups: dict[tuple[str, str, str], list[Record]] = {}
    for record in records:
        groups.setdefault(_cell_key(record), []).append(record)
    times: dict[tuple[str, str, str], dict[int, list[int]]] = {}
    for line in timings:
        times.setdefault(_cell_key(line), {})[line["trial"]] = line["step_us"]  # a trial run again: the last time
    solved = {key: {record["trial"]: _reached(record) for record in group} for key, group in groups.items()}
    share = shares(cells, solvable, solved)
    first: dict[tuple[str, str], list[Record]] = {}
    summaries = []
    for cell in cells:
        key = cell.identity
        own = groups.get(key, [])
        if not own:
            continue
        reference = first.setdefault((cell.name, cell.on_infeasible), own)
        p_value = None if reference is own else _paired(reference, own)
        steps = [step for trial in times.get(key, {}).values() for step in trial]
        summaries.append(replace(_summary(cell, own, steps, p_value), share=share.get(key)))
    return summaries


def _cell_key(record: Record) -> tuple[str, str, str]:
    return record["scenario"], record["controller"], record["on_infeasible"]


def _paired(first: Sequence[Record], other: Sequence[Record]) -> float:
    a, b = ({record["trial"]: _reached(record) for record in group} for group in (first, other))
    both = sorted(set(a) & set(b))
    return mcnemar([a[i] for i in both], [b[i] for i in both])


def _reached(record: Record, column: str = "outcome") -> bool:
    return bool(record[column] == "reached")


def _summary(cell: Cell, records: Sequence[Record], steps: Sequence[int], p_value: float | None) -> CellSummary:
    good = [record for record in records if _reached(record)]
    limit = cell.scenario.simulation.time_limit
    reached = [float(record["time_to_reach_s"]) for record in good]
    clearances = [record["min_clearance_m"] for record in records if record["min_clearance_m"] is not None]
    p50, p99 = (float(x) / 1e3 for x in np.percentile(steps, [50, 99])) if steps else (None, None)
    return CellSummary(
        cell=cell,
        trials=len(records),
        successes=len(good),
        ci95=wilson(len(good), len(records)),
        successes_sampled=sum(_reached(record, "outcome_sampled") for record in records),
        time=Spread.of(reached, [*reached, *[limit] * (len(records) - len(good))]),
        path=Spread.of([record["path_length_m"] for record in good]),
        joint_path=Spread.of([record["joint_path_rad"] for record in good]),
        outcomes={outcome: sum(record["outcome"] == outcome for record in records) for outcome in OUTCOMES},
        min_clearance=min(clearances, default=None),
        infeasible_trials=sum(record["infeasible_steps"] > 0 for record in records),
        infeasible_steps=sum(record["infeasible_steps"] for record in records),
        step_ms=(p50, p99),
        p_value=p_value,
    )
