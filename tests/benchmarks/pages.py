"""The tables of ``docs/performance.md``, from what was measured."""

from __future__ import annotations

from collections.abc import Sequence

from bench_growth import JOINTS, OBSTACLES
from timing import Measurement


def tables(measurements: Sequence[Measurement]) -> str:
    """All that can be made of ``measurements``, in Markdown."""
    medians = {m.name: m.median for m in measurements}
    parts = [_goals([m for m in measurements if m.goal is not None])]
    for of, values in (("balls", OBSTACLES), ("joints", JOINTS)):
        if f"step, {values[-1]} {of}" in medians:
            parts.append(_growth(medians, of, values))
    return "\n".join(parts)


def _goals(measurements: Sequence[Measurement]) -> str:
    lines = ["| | median, ms | 99 %, ms | goal |", "| --- | --- | --- | --- |"]
    for m in measurements:
        late = "" if m.goal_late is None else f", 99 % ≤ {m.goal_late:g}"
        lines.append(f"| {m.name.strip()} | {_digits(m.median)} | {_digits(m.late)} | ≤ {m.goal:g}{late} |")
    return "\n".join(lines) + "\n"


def _growth(medians: dict[str, float], of: str, values: Sequence[int]) -> str:
    head = [of, *map(str, values)]
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for name, title in (("step", "whole step"), ("cdf", "CDF query"), ("sdf", "SDF query")):
        found = [_digits(medians[f"{name}, {value} {of}"]) for value in values]
        lines.append(f"| {title} | {' | '.join(found)} |")
    return "\n".join(lines) + "\n"


def _digits(ms: float) -> str:
    return f"{ms:.0f}" if ms >= 100.0 else f"{ms:.1f}" if ms >= 10.0 else f"{ms:.2f}"
