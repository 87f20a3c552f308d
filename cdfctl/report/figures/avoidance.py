"""The paper's second figure: the planar arm passes one disc at four speeds, by either field's time-varying barrier.

Above the plane of the joints, over the level sets of the field with the disc where it starts; below the plane of the
arm, with the disc's way and the paths of the tip (thick) and the elbow (thin). Every run is made when the figure is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.report.figures.field_map import both_maps, draw_map, draw_region, joint_axes, level_steps
from cdfctl.report.figures.joint_space import axis_values
from cdfctl.report.figures.made_run import made_run
from cdfctl.report.figures.outline import Skeleton
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.run_view import RunView
from cdfctl.report.figures.style import BLACK, BLUE, COLUMN, GREEN, PURPLE, VERMILION, grid, mixed
from cdfctl.report.figures.task_space import dense
from cdfctl.scenario.overrides import Override, parse_override
from cdfctl.types import Array, Sphere

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas

SPEEDS = (0.5, 1.5, 2.5, 4.5)  # m/s
CONTROLLERS = ("cdf-tvcbf-qp", "sdf-tvcbf-qp")
LINES: tuple[tuple[str, Any, str], ...] = (
    (BLACK, "-", "o"), (VERMILION, (0, (5, 1.2)), "s"), (BLUE, (0, (1.2, 1.2)), "^"), (PURPLE, "-.", "D"),
)  # fmt: skip
INSTANTS = 8


def avoidance(points: int | None = None, speeds: tuple[float, ...] = SPEEDS) -> Part:
    """The four panels; ``points`` values of either joint, enough for the disc without a number."""
    return Part(
        "avoidance",
        lambda width: 0.95 * width if width > 1.4 * COLUMN else 4.1 * width,
        lambda canvas, width: _draw(canvas, width, points, speeds),
    )


def runs(controller: str, speeds: tuple[float, ...] = SPEEDS) -> list[RunView]:
    """The runs of the shipped scenario under ``controller``, one a speed."""
    return [
        made_run(
            "planar-1",
            [
                parse_override(f"obstacles[0].velocity=[0.0, {speed}, 0.0]"),
                Override(("controller", "variant"), controller, "the figure"),
            ],
        )
        for speed in speeds
    ]


def _draw(canvas: Canvas, width: float, points: int | None, speeds: tuple[float, ...]) -> None:
    if width > 1.4 * COLUMN:
        axes: Any = canvas.subplots(2, 2).T
    else:
        axes = canvas.subplots(4, 1).reshape(2, 2)
    for (above, below), controller in zip(axes, CONTROLLERS, strict=True):
        views = runs(controller, speeds)
        name = controller[:3]
        _joints(canvas, above, views, name, points)
        above.set_title(f"Joint space: {controller}")
        _arms(below, views)
        below.set_title(f"Task space: {controller}")
    canvas.legend(handles=_legend(speeds), loc="outside lower center", ncols=4 if width > 1.4 * COLUMN else 2)


def _joints(canvas: Canvas, axes: Axes, views: list[RunView], name: str, points: int | None) -> None:
    x, y = axis_values(views[0], points)
    maps = both_maps(views[0].field("sdf"), views[0].scene(0), x, y)
    filled, _ = draw_map(axes, maps[name], level_steps(maps[name].top), arrows=13)
    draw_region(axes, maps["sdf"])
    for view, (colour, style, marker) in zip(views, LINES, strict=False):
        edge = _edge()
        axes.plot(
            *view.trajectory.q.T, color=colour, linestyle=style, linewidth=1.5, path_effects=edge, zorder=4,
            marker=marker, markersize=3.6, markevery=10, markeredgecolor=BLACK, markeredgewidth=0.5,
        )  # fmt: skip
    start, goal = views[0].trajectory.q[0], views[0].goal
    axes.plot(*start, marker="o", markerfacecolor="white", markeredgecolor=BLACK, markersize=5, zorder=5)
    if goal is not None:
        axes.plot(*goal, marker="*", markerfacecolor=GREEN, markeredgecolor=BLACK, markersize=9, zorder=5)
    bar = canvas.colorbar(filled, ax=axes, pad=0.02)
    bar.set_label("distance at t = 0 s " + ("[rad]" if name == "cdf" else "[m]"))
    joint_axes(axes, ("joint 1", "joint 2"), x, y)


def _edge() -> list[Any]:
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.7, foreground="white")]


def _arms(axes: Axes, views: list[RunView]) -> None:
    from matplotlib.patches import Circle

    skeleton = Skeleton(views[0].robot)
    start, disc = views[0].trajectory.obstacle_pose[0, 0, :2], views[0].motion.shapes[0]
    assert isinstance(disc, Sphere)  # the shipped scenario's
    for height in np.linspace(0.0, 5.6, INSTANTS):
        share = 0.1 + 0.5 * height / 5.6
        face = mixed("white", VERMILION, share)
        axes.add_patch(
            Circle((start[0], start[1] + height), disc.radius, facecolor=face, edgecolor="0.55", linewidth=0.5)
        )
    axes.annotate(
        "", (start[0], start[1] + 5.6), (start[0], start[1]), zorder=3, arrowprops={"arrowstyle": "-|>", "color": BLACK}
    )
    for view, (colour, style, marker) in zip(views, LINES, strict=False):
        points = skeleton.points(dense(view.trajectory.q))
        axes.plot(*points[:, 1].T, color=colour, linestyle=style, linewidth=0.8, zorder=4)
        axes.plot(*points[:, 2].T, color=colour, linestyle=style, linewidth=1.6, zorder=4)
        tips = skeleton.points(view.trajectory.q)[::10, 2]
        axes.plot(*tips.T, color=colour, linestyle="none", marker=marker, markersize=2.8, zorder=4)
    ends: tuple[tuple[Array | None, str, Any], ...] = (
        (views[0].trajectory.q[0], "o", "white"),
        (views[0].goal, "*", GREEN),
    )
    for q, shape, face in ends:
        if q is not None:
            arm = skeleton.points(q[None, :])[0]
            axes.plot(*arm.T, color="0.35", linewidth=1.6, marker="o", markersize=2.2, zorder=3)
            axes.plot(*arm[-1], marker=shape, markerfacecolor=face, markeredgecolor=BLACK, markersize=7, zorder=5)
    axes.plot(0.0, 0.0, marker="s", color=BLACK, markersize=4.5, zorder=5)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-4.3, 4.3), ylim=(-4.3, 4.3))
    grid(axes)


def _legend(speeds: tuple[float, ...]) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=colour, linestyle=style, linewidth=1.5, marker=marker, markersize=3, label=f"{speed} m/s")
        for speed, (colour, style, marker) in zip(speeds, LINES, strict=False)
    ]
    mark: dict[str, Any] = {"linestyle": "none", "markeredgecolor": BLACK}
    handles.append(Line2D([], [], marker="o", markerfacecolor="white", markersize=5, label="start", **mark))
    handles.append(Line2D([], [], marker="*", markerfacecolor=GREEN, markersize=8, label="goal", **mark))
    handles.append(Patch(facecolor=VERMILION, edgecolor=BLACK, label="in contact at t = 0 s"))
    handles.append(Patch(facecolor=mixed("white", VERMILION, 0.4), edgecolor="0.55", label="the disc on its way"))
    return handles
