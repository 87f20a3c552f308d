"""The paper's third figure: whole-body reaching of a falling target among three discs.

Left both spaces at one instant, right the Lyapunov function and the joint velocities over the whole run, with the times
at which the paper says that its four stages begin. The run is made when the figure is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.report.figures.field_map import both_maps, draw_map, draw_region, joint_axes, level_steps
from cdfctl.report.figures.joint_space import axis_values, draw_path, legend, target_map
from cdfctl.report.figures.made_run import made_run
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.run_view import RunView
from cdfctl.report.figures.style import COLUMN, GREEN, GREY, grid, legend_above
from cdfctl.report.figures.task_space import draw_arrows, draw_paths, draw_strobe, frame
from cdfctl.report.figures.time_course import lyapunov, velocity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas

SNAPSHOT = 2.2  # s: the instant of the paper's snapshots
STAGES = (0.0, 0.8, 1.7, 3.9)  # s: the paper's times at which its four stages begin


def reaching(points: int | None = None) -> Part:
    """The four panels; ``points`` values of either joint, enough for the discs without a number."""
    return Part(
        "reaching",
        lambda width: 0.97 * width if width > 1.4 * COLUMN else 3.6 * width,
        lambda canvas, width: _draw(canvas, width, points),
    )


def _draw(canvas: Canvas, width: float, points: int | None) -> None:
    view = made_run("reach", [])
    two = width > 1.4 * COLUMN
    axes: Any = canvas.subplots(2, 2).ravel() if two else canvas.subplots(4, 1, height_ratios=(1, 1, 0.7, 0.7))
    k = view.step_at(SNAPSHOT)
    _joints(canvas, axes[0], view, k, points)
    _arms(axes[1], view, k)
    lyapunov(axes[2], view)
    axes[2].set_ylabel("V [rad]")
    velocity(axes[3], view)
    axes[3].set_ylabel("velocity u [rad/s]")
    low, high = axes[3].get_ylim()
    axes[3].set_ylim(low, high + 0.08 * (high - low))  # room for the stages' numbers
    for panel in axes[2:]:
        _stages(panel, view)
        panel.set(xlabel="time [s]", xlim=(0.0, view.t[-1]))
        grid(panel)
    handles = [handle for handle in legend(view, True) if handle.get_label() != "path to come"]
    canvas.legend(handles=handles, loc="outside lower center", ncols=6 if two else 3)


def _joints(canvas: Canvas, axes: Axes, view: RunView, k: int, points: int | None) -> None:
    x, y = axis_values(view, points)
    maps = both_maps(view.field("sdf"), view.scene(k), x, y)
    filled, _ = draw_map(axes, maps["cdf"], level_steps(maps["cdf"].top), arrows=13)
    draw_region(axes, maps["sdf"])
    target = target_map(view, k, x, y)
    if target is not None:
        draw_region(axes, target, face=GREEN, hatch="xxxx")
    draw_path(axes, view, k, contacts=True, to_come=False)
    bar = canvas.colorbar(filled, ax=axes, pad=0.02)
    bar.set_label("distance to the discs [rad]")
    joint_axes(axes, ("joint 1", "joint 2"), x, y)
    axes.set_title(f"Joint space at t = {view.t[k]:.1f} s")


def _arms(axes: Axes, view: RunView, k: int) -> None:
    picked = np.unique(np.linspace(0, k, 6).round().astype(int))
    until = view.until(k)
    draw_strobe(axes, until, picked)
    draw_arrows(axes, until, k)
    handles = draw_paths(axes, until)
    frame(axes, view, np.arange(view.steps + 1))
    axes.set_title(f"Task space until t = {view.t[k]:.1f} s")
    axes.legend(handles=handles, loc="upper left")


def _stages(axes: Axes, view: RunView) -> None:
    """The paper's stages as lines, numbered along the top."""
    ends = [*STAGES[1:], float(view.t[-1])]
    for number, (begin, end) in enumerate(zip(STAGES, ends, strict=True), 1):
        if begin > 0.0:
            axes.axvline(begin, color=GREY, linewidth=0.8, linestyle=":")
        axes.annotate(
            f"stage {number}" if end - begin > 1.2 else str(number), (0.5 * (begin + end), 1.0),
            xycoords=("data", "axes fraction"), xytext=(0, -2), textcoords="offset points", ha="center", va="top",
            fontsize=6.5, color="0.3",
        )  # fmt: skip
    legend_above(axes, 3)
