"""The charts as HTML with drawings in it (SVG): the same in the live page and in the page of its own.

They hold no script and load nothing. What moves is marked with classes: ``cursor`` is the line at the present time, and
``value`` the number of a curve then.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterator, Sequence

import numpy as np

from cdfctl.report.view.charts import Chart, Curve
from cdfctl.report.view.colours import OBSTACLES
from cdfctl.types import Array

WIDTH, HEIGHT = 300, 108
LEFT, RIGHT, TOP, BOTTOM = 42, 8, 6, 18
MOST_POINTS = 4 * WIDTH
"""A curve of more points than this is drawn by its lowest and highest in each column of pixels."""

STYLE = """
.cdfctl-charts { font: 12px/1.4 system-ui, sans-serif; color: #20262d; padding: 0 2px 6px 8px; }
.cdfctl-charts h2 { margin: 8px 0 0; font-size: 12px; font-weight: 600; }
.cdfctl-charts ul { margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 0 12px; list-style: none; }
.cdfctl-charts li { white-space: nowrap; font-variant-numeric: tabular-nums; }
.cdfctl-charts li i { display: inline-block; width: 12px; height: 3px; margin: 0 5px 3px 0; }
.cdfctl-charts svg { display: block; }
.cdfctl-charts text { font: 10px system-ui, sans-serif; fill: #4a525b; }
.cdfctl-charts .now { font-weight: 600; font-variant-numeric: tabular-nums; }
.cdfctl-charts .bad { color: #b23c00; }
"""


class ChartPanel:
    """The charts of one run, drawn once; :meth:`html` puts the cursor where it belongs."""

    def __init__(self, charts: Sequence[Chart], span: float, infeasible: Array) -> None:
        """``span`` is the length of the time axis and ``infeasible`` (k,) the steps without a solution, both in s."""
        self._charts, self._span = charts, max(span, 1e-9)
        self._fixed = [_drawing(chart, self._span, infeasible) for chart in charts]

    def html(self, t: float) -> str:
        """All charts at time ``t`` (s)."""
        x = f"{_x(min(t, self._span), self._span):.1f}"
        parts = [f"<style>{STYLE}</style>"]
        for i, (chart, fixed) in enumerate(zip(self._charts, self._fixed, strict=True)):
            k = max(0, int(np.searchsorted(chart.t, t + 1e-6, side="right")) - 1)
            items = "".join(
                f'<li><i style="background:{curve.colour}"></i>{html.escape(curve.name)} '
                f'<span class="value">{number(curve.values[k])}</span></li>'
                for curve in chart.curves
            )
            parts.append(
                f"<h2>{html.escape(chart.title)} [{html.escape(chart.unit)}]</h2>"
                f'<ul data-chart="{i}">{items}<li>- - {html.escape(chart.level_name)}</li></ul>'
                f'<svg data-chart="{i}" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}">{fixed}'
                f'<line class="cursor" x1="{x}" x2="{x}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="#20262d" '
                'stroke-width="1.5"/></svg>'
            )
        return f'<div class="cdfctl-charts">{"".join(parts)}</div>'


def number(value: float) -> str:
    """A value as the legend shows it."""
    return f"{value:.3f}" if math.isfinite(value) else "none"


def _drawing(chart: Chart, span: float, infeasible: Array) -> str:
    low, high = _limits(chart)

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / (high - low)

    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    parts = []
    for t in _columns(np.array([_x(float(t), span) for t in infeasible])):
        parts.append(_line(t, TOP, t, bottom, OBSTACLES[0], 'stroke-opacity="0.25" stroke-width="2"'))
    for value in _ticks(low, high, 3):
        label = f'<text x="{LEFT - 5}" y="{y(value) + 3:.1f}" text-anchor="end">{value:g}</text>'
        parts += [_line(LEFT, y(value), right, y(value), "#e3e6ea"), label]
    times = _ticks(0.0, span, 5)
    for t in times:
        label = f"{t:g} s" if t == times[-1] else f"{t:g}"
        x = min(_x(t, span), WIDTH - 3.2 * len(label))  # a label at the end must not be cut off
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - 5}" text-anchor="middle">{label}</text>')
    parts.append(_line(LEFT, y(chart.level), right, y(chart.level), "#20262d", 'stroke-dasharray="4 3"'))
    for curve in chart.curves:
        path = "".join(f"{pen}{_x(t, span):.1f} {y(value):.1f}" for pen, t, value in _strokes(chart.t, curve))
        parts.append(f'<path d="{path}" fill="none" stroke="{curve.colour}" stroke-width="1.6"/>')
    return "".join(parts)


def _x(t: float, span: float) -> float:
    return LEFT + (WIDTH - LEFT - RIGHT) * t / span


def _line(x1: float, y1: float, x2: float, y2: float, colour: str, more: str = "") -> str:
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" {more}/>'


def _limits(chart: Chart) -> tuple[float, float]:
    values = np.concatenate([[chart.level], *(curve.values for curve in chart.curves)])
    values = values[np.isfinite(values)]
    low, high = float(values.min()), float(values.max())
    margin = 0.06 * ((high - low) or 1.0)
    return low - margin, high + margin


def _ticks(low: float, high: float, count: int) -> list[float]:
    """Round numbers within [low, high], about ``count`` of them."""
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(k * power for k in (1, 2, 5, 10) if k * power >= raw * (1.0 - 1e-9))
    return [round(k * step, 10) for k in range(math.ceil(low / step), math.floor(high / step + 1e-9) + 1)]


def _strokes(t: Array, curve: Curve) -> Iterator[tuple[str, float, float]]:
    """``M`` or ``L``, time and value of each point that is drawn; the pen lifts where the curve is undefined."""
    shown = _thinned(curve.values)
    pen = "M"
    for k in shown:
        if math.isfinite(curve.values[k]):
            yield pen, float(t[k]), float(curve.values[k])
            pen = "L"
        else:
            pen = "M"


def _thinned(values: Array) -> list[int]:
    """Indices of the points to draw: all, or of a long curve the lowest and highest of each column, and every gap."""
    count = len(values)
    if count <= MOST_POINTS:
        return list(range(count))
    kept: set[int] = {0, count - 1}
    for part in np.array_split(np.arange(count), MOST_POINTS // 4):
        finite = part[np.isfinite(values[part])]
        if len(finite) < len(part):
            kept.add(int(part[~np.isfinite(values[part])][0]))
        if len(finite):
            kept |= {int(finite[values[finite].argmin()]), int(finite[values[finite].argmax()])}
    return sorted(kept)


def _columns(xs: Array) -> list[float]:
    """``xs`` without those that fall on the same pixel."""
    return [float(x) for x in np.unique(np.round(xs))]
