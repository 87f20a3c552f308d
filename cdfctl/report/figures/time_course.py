"""A run over time, of any robot: barriers, clearance, Lyapunov function, velocities, joints, and the step's time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cdfctl.report.figures.part import Part
from cdfctl.report.figures.run_view import RunView
from cdfctl.report.figures.style import (
    BLACK,
    BLUE,
    COLUMN,
    FAINT,
    GREEN,
    GREY,
    MOST_SERIES,
    PAGE,
    VERMILION,
    grid,
    halo,
    legend_above,
    line,
    signed,
)
from cdfctl.scenario.variants import variant_named
from cdfctl.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas

PANEL = 4.3  # cm, height of a panel
MOST_LABELLED = 7
"""With more obstacles than this, their lines are grey but for the least of all."""

CONTACT: dict[str, Any] = {"color": VERMILION, "linewidth": 0.6, "linestyle": "-"}
"""The line at which there is contact: solid, for the second of some series is dashed in the same colour."""


class Panel(NamedTuple):
    """One panel: its axis, and what draws its content."""

    label: str
    draw: Callable[[Axes], None]


def time_course(view: RunView) -> Part:
    """Everything there is of a run over time, in two columns on a page."""
    shown = list(panels(view))

    def columns(width: float) -> int:
        return 2 if width > 1.4 * COLUMN else 1

    def height(width: float) -> float:
        return PANEL * -(-len(shown) // columns(width)) + 1.4

    return Part("time", height, lambda canvas, width: _draw(canvas, view, shown, columns(width)), PAGE)


def _draw(canvas: Canvas, view: RunView, shown: list[Panel], columns: int) -> None:
    rows = -(-len(shown) // columns)
    grid_of_axes: Any = canvas.subplots(rows, columns, squeeze=False, sharex=True)
    title = view.title()
    canvas.suptitle(title if columns > 1 else title.replace("; ", "\n", 1), x=0.01, ha="left")
    every = list(grid_of_axes.T.flat)
    for axes, panel in zip(every, shown, strict=False):
        panel.draw(axes)
        axes.set_ylabel(panel.label)
        mark_steps(axes, view)
        grid(axes)
    for axes in every[len(shown) :]:
        axes.remove()
    for axes in every[: len(shown)]:
        axes.set_xlim(0.0, max(float(view.t[-1]), 1e-3))
    for column in range(columns):
        last = every[min((column + 1) * rows, len(shown)) - 1]
        last.set_xlabel("time [s]")
        last.tick_params(labelbottom=True)
    canvas.legend(handles=_marks(view), loc="outside lower center", ncols=5 if columns > 1 else 2)


def panels(view: RunView) -> Iterator[Panel]:
    """The panels that this run has something for, in order."""
    arrays, unit = view.trajectory, {"cdf": "rad", "sdf": "m"}
    fields = view.field_names
    if len(view.motion):
        yield Panel(f"h of the {fields[0].upper()} [{unit[fields[0]]}]", lambda axes: barrier(axes, view, arrays.h))
        h_sdf = arrays.h_sdf
        if h_sdf is not None:
            yield Panel("h of the SDF [m]", lambda axes: barrier(axes, view, h_sdf))
        yield Panel("clearance [m]", lambda axes: clearance(axes, view))
    if np.isfinite(arrays.V).any():
        of = unit[fields[0]]
        yield Panel(f"V [{of}]", lambda axes: lyapunov(axes, view))
        yield Panel(f"slack δ [{of}/s]", lambda axes: _steps(axes, view, arrays.slack[:, None], [""]))
    yield Panel(f"velocity u [{_joint_unit(view, '/s')}]", lambda axes: velocity(axes, view))
    yield Panel(f"position q [{_joint_unit(view)}]", lambda axes: position(axes, view))
    if _common(view.robot.lower, view.robot.upper) is None:
        yield Panel(f"room to a limit [{_joint_unit(view)}]", lambda axes: room(axes, view))
    yield Panel("time of the step [ms]", lambda axes: step_time(axes, view))


def barrier(axes: Axes, view: RunView, h: Array) -> None:
    """h of every obstacle (N, m), zero at the margin; contact is at minus the margin."""
    _obstacle_lines(axes, view, view.t[:-1], h)
    axes.axhline(0.0, color=BLACK, linewidth=0.8, linestyle="-")
    if variant_named(view.scenario.controller.variant).safety != "hyperplane" and view.margin > 0.0:
        axes.axhline(-view.margin, **CONTACT)
    finite = h[np.isfinite(h)]
    if finite.size:
        low, high = min(float(finite.min()), -view.margin), max(_ceiling(h), view.margin)
        pad = 0.06 * (high - low)
        axes.set_ylim(low - pad, high + pad)


def clearance(axes: Axes, view: RunView) -> None:
    """Distance of every obstacle on the judge's geometry, and the least of the run, between the steps too."""
    times, found = view.clearance
    _obstacle_lines(axes, view, times, found)
    axes.axhline(0.0, **CONTACT)
    if found.shape[1] > MOST_LABELLED and np.isfinite(found).any():
        top = max(_ceiling(found), 0.1)
        axes.set_ylim(min(0.0, float(found.min())) - 0.06 * top, 1.06 * top)
    least = view.document.get("min_clearance_m")
    if least is not None:
        axes.axhline(least, color=BLACK, linewidth=0.7, linestyle=":")
        axes.annotate(
            f"least {signed(least)} m", (1.0, least), xycoords=("axes fraction", "data"), xytext=(-2, 2),
            textcoords="offset points", ha="right", va="bottom", fontsize=6.5, path_effects=[halo()],
        )  # fmt: skip


def _obstacle_lines(axes: Axes, view: RunView, t: Array, values: Array) -> None:
    """One line an obstacle, gaps where there is nothing finite."""
    values = np.where(np.isfinite(values), values, np.nan)
    dots: dict[str, Any] = {"marker": "."} if len(t) < 3 else {}
    if values.shape[1] <= MOST_LABELLED:
        for i, column in enumerate(values.T):
            axes.plot(t, column, label=view.obstacle(i), **line(i), **dots)
        legend_above(axes, 4 if max(len(view.obstacle(i)) for i in range(values.shape[1])) < 9 else 3)
        return
    axes.plot(t, values, color="0.7", linewidth=0.5)
    least = np.where(np.isnan(values).all(axis=1), np.nan, np.where(np.isnan(values), np.inf, values).min(axis=1))
    axes.plot(t, least, color=BLUE, label=f"least of {values.shape[1]} obstacles", **dots)
    legend_above(axes, 2)


def _ceiling(values: Array) -> float:
    """The greatest value to be shown of (N, m). Of many obstacles most are far: up to three times the least of all."""
    values = np.where(np.isfinite(values), values, -np.inf)
    if values.shape[1] <= MOST_LABELLED:
        return float(values.max())
    least = np.where(values > -np.inf, values, np.inf).min(axis=1)
    return min(float(values.max()), 3.0 * float(least[np.isfinite(least)].max(initial=0.0)))


def lyapunov(axes: Axes, view: RunView) -> None:
    """V and the value at which the target counts as reached."""
    dots: dict[str, Any] = {"marker": "."} if view.steps < 3 else {}
    axes.plot(view.t[:-1], view.trajectory.V, color=BLUE, **dots)
    tolerance = view.scenario.controller.reach_tolerance
    if tolerance is not None:
        axes.axhline(tolerance, color=GREEN, linewidth=0.9, linestyle="--", label=f"reached at {tolerance:g}")
        legend_above(axes, 2)
    axes.set_ylim(bottom=min(0.0, float(np.nanmin(view.trajectory.V))))


def velocity(axes: Axes, view: RunView) -> None:
    """u, constant over a step, and its limits."""
    limit = view.robot.velocity_limit
    _steps(axes, view, view.trajectory.u, _joint_labels(view))
    _limits(axes, -limit, limit)


def position(axes: Axes, view: RunView) -> None:
    """q, its goal, and its limits where all joints have the same."""
    labels = _joint_labels(view)
    for i, q in enumerate(view.trajectory.q.T):
        axes.plot(view.t, q, label=labels[i], **line(i))
        if view.goal is not None:
            # Its tip at the end of the axis and its body inside: outside, half of it would be off the page.
            axes.plot(view.t[-1], view.goal[i], marker=5, color=line(i)["color"], markersize=4, zorder=5)
    legend_above(axes, MOST_SERIES)
    if _common(view.robot.lower, view.robot.upper) is not None:
        _limits(axes, view.robot.lower, view.robot.upper)


def room(axes: Axes, view: RunView) -> None:
    """How far each joint is from the nearer of its limits; a joint without limits has no line."""
    labels = _joint_labels(view)
    for i, q in enumerate(view.trajectory.q.T):
        left = np.minimum(q - view.robot.lower[i], view.robot.upper[i] - q)
        if np.isfinite(left).all():
            axes.plot(view.t, left, label=labels[i], **line(i))
    axes.axhline(0.0, color=GREY, linewidth=0.9, linestyle="--")
    legend_above(axes, MOST_SERIES)


def step_time(axes: Axes, view: RunView) -> None:
    """Wall-clock time of the controller's step, and the control period."""
    from matplotlib.ticker import LogFormatter

    taken = 1e3 * view.trajectory.step_time
    axes.plot(view.t[:-1], taken, linestyle="none", marker=".", markersize=2.5, color=BLUE)
    period = 1e3 * view.scenario.simulation.dt
    axes.axhline(period, color=GREY, linewidth=0.9, linestyle="--", label=f"control period, {period:g} ms")
    if len(taken) and (taken > 0.0).all():
        axes.set_yscale("log")
        # Powers of ten are formulas to matplotlib, which the style does not read.
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(LogFormatter())
        axes.set_ylim(taken.min() / 1.6, 1.6 * max(period, taken.max()))
    legend_above(axes, 2)


def _steps(axes: Axes, view: RunView, values: Array, labels: list[str]) -> None:
    """Values (N, k) that hold for a step."""
    for i, column in enumerate(values.T):
        held = np.append(column, column[-1:])
        axes.plot(view.t[: len(held)], held, drawstyle="steps-post", label=labels[i], **line(i))
    if any(labels):
        legend_above(axes, MOST_SERIES)


def _limits(axes: Axes, lower: Array, upper: Array) -> None:
    for low, high in sorted(set(zip(lower.tolist(), upper.tolist(), strict=True))):
        for value in (low, high):
            if np.isfinite(value):
                axes.axhline(value, color=GREY, linewidth=0.9, linestyle="--")


def _common(lower: Array, upper: Array) -> tuple[float, float] | None:
    """The limits, where all joints have the same."""
    found = set(zip(lower.tolist(), upper.tolist(), strict=True))
    return found.pop() if len(found) == 1 else None


def _joint_labels(view: RunView) -> list[str]:
    return [f"joint {i + 1}" if view.robot.n < 4 or i == 0 else str(i + 1) for i in range(view.robot.n)]


def _joint_unit(view: RunView, a_second: str = "") -> str:
    slides = view.robot.prismatic
    units = ["m"] if slides.all() else ["rad", "m"] if slides.any() else ["rad"]
    return " or ".join(f"{unit}{a_second}" for unit in units)


def mark_steps(axes: Axes, view: RunView) -> None:
    """Infeasible steps as bands, the first contact as a line."""
    for k in np.flatnonzero(view.trajectory.infeasible):
        axes.axvspan(view.t[k], view.t[k + 1], facecolor=FAINT, edgecolor=GREY, hatch="////", linewidth=0.0, zorder=0)
    contact = view.document.get("collision_time_s")
    if contact is not None:
        axes.axvline(contact, color=VERMILION, linewidth=1.0, linestyle="-.")


def _marks(view: RunView) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Line2D([], [], color=GREY, linewidth=0.9, linestyle="--", label="limit")]
    if len(view.motion):
        handles.append(Line2D([], [], color=BLACK, linewidth=0.8, label="h = 0: at the margin"))
        handles.append(Line2D([], [], **CONTACT, label="contact with an obstacle"))
    if view.document.get("collision_time_s") is not None:
        handles.append(Line2D([], [], color=VERMILION, linewidth=1.0, linestyle="-.", label="time of first contact"))
    if view.trajectory.infeasible.any():
        handles.append(Patch(facecolor=FAINT, edgecolor=GREY, hatch="////", linewidth=0.0, label="infeasible step"))
    if view.goal is not None:
        handles.append(Line2D([], [], color=BLACK, marker=5, markersize=4, linestyle="none", label="goal"))
    return handles
