"""The level sets of both distance fields of the planar arm and one disc, side by side: the paper's first figure.

Left the configuration-space distance, right the signed distance; above the plane of the joints, below the plane the arm
moves in. The gradient of the first has norm one, so its level sets lie a fixed motion of the joints apart. The second
is flat where the point of the arm nearest to the disc does not move: there no gradient says where to go.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.fields.cdf import CDF
from cdfctl.fields.sdf import SDF
from cdfctl.report.figures.field_map import FieldMap, draw_map, draw_region, joint_axes, sample
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.style import BLACK, BLUE, COLUMN, ORANGE, PAGE, VERMILION, grid
from cdfctl.robots.robot import load_robot
from cdfctl.types import Array, Obstacle, Scene, Sphere

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.fields.field import Field
    from cdfctl.report.figures.part import Canvas

LINK = 2.0  # m
DISC = (1.5, 2.0)  # m
RADIUS = 0.3  # m
POINTS = 101  # along each joint
ARMS = 6


@dataclass(frozen=True)
class Panel:
    """How one field is shown: ``spacing`` of the level sets, and the level ``shown`` in the plane of the arm."""

    title: str
    spacing: float
    shown: float


PANELS = {"rad": Panel("Configuration-space distance", 0.5, 1.0), "m": Panel("Signed distance", 0.25, 0.5)}


def levels(points: int | None = None) -> Part:
    """The four panels, from ``points`` values of either joint; :data:`POINTS` without a number."""
    return Part(
        "levels",
        lambda width: 0.8 * width if width > 1.4 * COLUMN else 3.0 * width,
        lambda canvas, width: _draw(canvas, width, points or POINTS),
        PAGE,
    )


def _draw(canvas: Canvas, width: float, points: int) -> None:
    robot = load_robot("planar")
    scene = Scene([Obstacle(Sphere(RADIUS), position=[*DISC, 0.0])])
    fields: tuple[Field, ...] = (CDF(robot), SDF(robot))
    q = np.linspace(-pi, pi, points)
    maps = [sample(field, scene, q, q) for field in fields]
    if width > 1.4 * COLUMN:
        axes: Any = canvas.subplots(2, 2, height_ratios=(1.0, 0.8)).T
    else:
        axes = canvas.subplots(4, 1, height_ratios=(1.0, 0.8, 1.0, 0.8)).reshape(2, 2)
    for (above, below), found in zip(axes, maps, strict=True):
        chosen = along_level(found, PANELS[found.unit].shown)
        draw_joints(canvas, above, found, maps[1], chosen)
        draw_arms(below, found.unit, chosen)


def along_level(found: FieldMap, level: float, count: int = ARMS) -> Array:
    """``count`` configurations (count, 2), evenly along the longest line of the set of that level."""
    from contourpy import contour_generator

    lines: Any = contour_generator(found.x, found.y, found.d).lines(level)
    lengths = [np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]) for line in lines]
    length, line = max(zip(lengths, lines, strict=True), key=lambda pair: float(pair[0][-1]))
    at = (np.arange(count) + 0.5) / count * length[-1]
    return np.stack([np.interp(at, length, line[:, joint]) for joint in (0, 1)], axis=1)


def draw_joints(canvas: Canvas, axes: Axes, found: FieldMap, signed: FieldMap, chosen: Array) -> None:
    """Level sets, gradients, the obstacle's region, and the configurations of the panel below."""
    panel = PANELS[found.unit]
    steps = panel.spacing * np.arange(np.ceil(found.top / panel.spacing) + 1)
    filled, flat = draw_map(axes, found, steps, arrows=17)
    draw_region(axes, signed)
    for number, point in enumerate(chosen, 1):
        _number(axes, point, number)
    bar = canvas.colorbar(filled, ax=axes, pad=0.02)
    bar.set_label(f"distance [{found.unit}], a line every {panel.spacing:g} {found.unit}")
    joint_axes(axes, ("joint 1", "joint 2"), found.x, found.y)
    axes.set_title(f"{panel.title} (hatched: gradient zero)" if flat else panel.title)


def draw_arms(axes: Axes, unit: str, chosen: Array) -> None:
    """The arm at the chosen configurations, and the disc."""
    from matplotlib.patches import Circle

    panel = PANELS[unit]
    axes.add_patch(Circle(DISC, RADIUS, facecolor=VERMILION, edgecolor=BLACK, zorder=2))
    if unit == "m":
        axes.add_patch(Circle(DISC, RADIUS + panel.shown, fill=False, edgecolor=BLACK, linestyle="--", linewidth=0.8))
    for number, (first, second) in enumerate(chosen, 1):
        elbow = LINK * np.array([np.cos(first), np.sin(first)])
        tip = elbow + LINK * np.array([np.cos(first + second), np.sin(first + second)])
        axes.plot(*np.array([[0.0, 0.0], elbow, tip]).T, color=BLUE, linewidth=1.6, marker="o", markersize=3, zorder=3)
        _number(axes, tip, number)
    axes.plot(0.0, 0.0, marker="s", color=BLACK, markersize=5, zorder=4)
    axes.set(
        title=f"The arm at {panel.shown:g} {unit} from contact",
        xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-4.2, 4.2), ylim=(-2.6, 4.2),
    )  # fmt: skip
    grid(axes)


def _number(axes: Axes, point: Array, number: int) -> None:
    box = {"boxstyle": "circle,pad=0.15", "facecolor": ORANGE, "edgecolor": BLACK, "linewidth": 0.6}
    axes.text(point[0], point[1], str(number), fontsize=6.5, ha="center", va="center", bbox=box, zorder=5)
