"""The plane of the joints of a two-joint robot: the path over the field at instants of the run.

At an instant stand the level sets and gradients of the field of the obstacles as they were then, the configurations in
contact, the path until then (solid) and after (dotted), and the nearest contact that the controller saw.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.report.figures.field_map import (
    NAMES,
    FieldMap,
    both_maps,
    draw_map,
    draw_region,
    joint_axes,
    level_steps,
)
from cdfctl.report.figures.outline import Skeleton, radius_of
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.run_view import RunView
from cdfctl.report.figures.style import BLACK, COLUMN, GREEN, ORANGE, PAGE, PURPLE, SKY, VERMILION
from cdfctl.report.figures.task_space import plan_at
from cdfctl.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas

POINTS = (81, 201)
"""Fewest and most values of a joint at which the fields are sampled."""
ARROWS = 11
WHITE_EDGE = 1.4  # points


def joint_space(view: RunView, fields: Sequence[str], instants: Sequence[int], points: int | None = None) -> Part:
    """One row a field, one column an instant (control steps); on a page of one column the other way round.

    ``points`` values of each joint are taken; without a number, enough for the smallest obstacle.
    """

    def shape(width: float) -> tuple[int, int]:
        counts = (len(fields), len(instants))
        return counts if width > 1.4 * COLUMN else (counts[1], counts[0])

    def height(width: float) -> float:
        rows, columns = shape(width)
        return rows * ((width - 2.9) / columns + 0.8) + (2.1 if width > 1.4 * COLUMN else 3.8)

    def draw(canvas: Canvas, width: float) -> None:
        _draw(canvas, view, fields, instants, points, turned=width <= 1.4 * COLUMN)

    return Part("joint-space", height, draw, PAGE)


def default_instants(view: RunView) -> list[int]:
    """The control steps at the start, at the least clearance and at the end; without obstacles the last two fall away.

    Where the least clearance is at the start or the end, the middle takes its place.
    """
    if view.steps == 0 or not len(view.motion):
        return [0] if view.steps == 0 else [0, view.steps]
    times, clearance = view.clearance
    nearest = view.step_at(float(times[int(np.argmin(clearance.min(axis=1)))]))
    if nearest in (0, view.steps):
        nearest = view.steps // 2
    return sorted({0, nearest, view.steps})


def axis_values(view: RunView, points: int | None = None) -> tuple[Array, Array]:
    """Values of either joint: all between its limits, a turn where there are none; the path is inside.

    Without a number of ``points``, so close that a ball as small as the smallest obstacle, at the arm's full reach, is
    two steps wide; within :data:`POINTS`.
    """
    sizes = [radius_of(shape) for shape in view.motion.shapes]
    found = []
    for lower, upper, q in zip(view.robot.lower, view.robot.upper, view.trajectory.q.T, strict=True):
        low, high = (lower, upper) if upper - lower <= 4.0 * pi + 1e-6 else (-pi, pi)
        low, high = min(low, q.min()), max(high, q.max())
        wanted = (high - low) * reach(view) / max(min(sizes, default=1.0), 1e-3)
        found.append(np.linspace(low, high, points or int(np.clip(wanted, *POINTS))))
    return found[0], found[1]


def reach(view: RunView) -> float:
    """About how far (m) the arm reaches from its first joint: the length of its stretched skeleton."""
    points = Skeleton(view.robot).points(view.trajectory.q[:1])[0]
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _draw(
    canvas: Canvas, view: RunView, fields: Sequence[str], instants: Sequence[int], points: int | None, *, turned: bool
) -> None:
    rows, columns = (len(instants), len(fields)) if turned else (len(fields), len(instants))
    grid: Any = canvas.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    grid = grid.T if turned else grid
    title = view.title()
    canvas.suptitle(title.replace("; ", "\n", 1) if turned else title, x=0.01, ha="left")
    x, y = axis_values(view, points)
    maps = [both_maps(view.field("sdf"), view.scene(k), x, y) for k in instants]
    targets = [target_map(view, k, x, y) for k in instants]
    for axes_of_field, name in zip(grid, fields, strict=True):
        steps = level_steps(max(found[name].top for found in maps))
        for axes, found, target, k in zip(axes_of_field, maps, targets, instants, strict=True):
            filled, _ = draw_map(axes, found[name], steps, arrows=ARROWS)
            draw_region(axes, found["sdf"])
            if target is not None:
                draw_region(axes, target, face=GREEN, hatch="xxxx")
            draw_path(axes, view, k, contacts=name == "cdf")
            joint_axes(axes, ("joint 1", "joint 2"), x, y)
            axes.label_outer()
            axes.set_title(f"t = {view.t[k]:.2f} s")
            if name == "cdf" and not np.isfinite(found[name].d).any():
                axes.text(0.5, 0.05, "no obstacle in reach", transform=axes.transAxes, ha="center")
        bar = canvas.colorbar(filled, ax=list(axes_of_field), pad=0.01, aspect=30)
        bar.set_label(NAMES[name])
    canvas.legend(handles=legend(view, "cdf" in fields), loc="outside lower center", ncols=2 if turned else 5)


def draw_path(axes: Axes, view: RunView, k: int, *, contacts: bool, to_come: bool = True) -> None:
    """Path, start, present and goal at control step ``k``; the plan made then and the nearest contacts seen then."""
    from matplotlib.patheffects import withStroke

    edge = [withStroke(linewidth=1.4 + WHITE_EDGE, foreground="white")]
    q = view.trajectory.q
    if to_come:
        axes.plot(*q[k:].T, color=BLACK, linewidth=1.1, linestyle=(0, (1, 1)), zorder=3.9, path_effects=edge)
    axes.plot(*q[: k + 1].T, color=BLACK, linewidth=1.4, zorder=4.0, path_effects=edge)
    plan = plan_at(view, min(k, view.steps - 1))
    if plan is not None:
        axes.plot(*plan.T, color=PURPLE, linewidth=1.0, linestyle="--", zorder=4.1, path_effects=edge)
    if contacts and view.trajectory.contact_q is not None and view.steps:
        for contact in view.trajectory.contact_q[min(k, view.steps - 1)]:
            if np.isfinite(contact).all():
                axes.plot(*np.array([q[min(k, view.steps - 1)], contact]).T, color=SKY, linewidth=0.8, zorder=4.2)
                axes.plot(*contact, **_mark("X", SKY, 4.5), zorder=4.3)
    axes.plot(*q[0], **_mark("o", "white", 4.0), zorder=4.4)
    if view.goal is not None:
        axes.plot(*view.goal, **_mark("*", GREEN, 7.5), zorder=4.4)
    axes.plot(*q[k], **_mark("D", ORANGE, 4.0), zorder=4.5)
    for step in np.flatnonzero(view.trajectory.infeasible[:k]):
        axes.plot(*q[step], **_mark("v", VERMILION, 4.0), zorder=4.4)


def _mark(shape: str, face: str, size: float) -> dict[str, Any]:
    return {
        "marker": shape, "markerfacecolor": face, "markeredgecolor": BLACK, "markeredgewidth": 0.6,
        "markersize": size, "linestyle": "none",
    }  # fmt: skip


def target_map(view: RunView, k: int, x: Array, y: Array) -> FieldMap | None:
    """The signed distance to the target at control step ``k``, None for a task without one."""
    if view.target is None:
        return None
    return both_maps(view.field("sdf"), view.target.at(float(view.t[k])), x, y)["sdf"]


def legend(view: RunView, contacts: bool) -> list[Any]:
    """Samples of all that a panel may show."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=BLACK, linewidth=1.4, label="path so far"),
        Line2D([], [], color=BLACK, linewidth=1.1, linestyle=(0, (1, 1)), label="path to come"),
        Line2D([], [], **_mark("o", "white", 4.0), label="start"),
        Line2D([], [], **_mark("D", ORANGE, 4.0), label="now"),
    ]
    if view.goal is not None:
        handles.append(Line2D([], [], **_mark("*", GREEN, 7.5), label="goal"))
    if view.target is not None:
        handles.append(Patch(facecolor=GREEN, edgecolor=BLACK, hatch="xxxx", label="touches the target"))
    if len(view.motion):
        handles.append(Patch(facecolor=VERMILION, edgecolor=BLACK, label="in contact"))
    if contacts and view.trajectory.contact_q is not None:
        handles.append(Line2D([], [], **_mark("X", SKY, 4.5), label="nearest contact"))
    if view.plan is not None:
        handles.append(Line2D([], [], color=PURPLE, linewidth=1.0, linestyle="--", label="plan"))
    if view.trajectory.infeasible.any():
        handles.append(Line2D([], [], **_mark("v", VERMILION, 4.0), label="infeasible step"))
    return handles
