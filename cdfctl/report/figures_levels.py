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
from cdfctl.report.figures import BLACK, BLUE, ORANGE, STYLE, VERMILION, new_figure
from cdfctl.robots.robot import load_robot
from cdfctl.types import Array, Obstacle, Scene, Sphere

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cdfctl.fields.field import Field

LINK = 2.0  # m
DISC = (1.5, 2.0)  # m
RADIUS = 0.3  # m
POINTS = 101  # along each joint
ARROWS = 17  # along each joint
FLAT = 1e-6  # m/rad: the norm of a gradient that says nothing
ARMS = 6


@dataclass(frozen=True)
class Panel:
    """How one field is shown: ``spacing`` of the level sets, and the level ``shown`` in the plane of the arm."""

    title: str
    spacing: float
    shown: float


PANELS = {"rad": Panel("Configuration-space distance", 0.5, 1.0), "m": Panel("Signed distance", 0.25, 0.5)}


@dataclass(frozen=True)
class Levels:
    """A field over the plane of two joints.

    Attributes:
        unit: of ``d``.
        q: (k,) the values of either joint, rad.
        d: (k, k) the distance; the second joint along the first axis.
        dq: (k, k, 2) its gradient.
    """

    unit: str
    q: Array
    d: Array
    dq: Array


def sample(field: Field, scene: Scene, points: int) -> Levels:
    """``field`` of the one obstacle of ``scene``, over one turn of two joints.

    Every point is asked twice: on a walk to and fro, where a query starts from the contact of the neighbour, and on its
    own. Every contact found is a contact, so the nearer one is the better answer.
    """
    q = np.linspace(-pi, pi, points)
    d, dq = np.full((points, points), np.inf), np.zeros((points, points, 2))
    for alone in (False, True):
        field.reset()
        for i in range(points):
            for j in range(points)[:: 1 if i % 2 == 0 else -1]:
                if alone:
                    field.reset()
                answer = field.query(np.array([q[j], q[i]]), scene)
                if abs(answer.d[0]) < abs(d[i, j]):
                    d[i, j], dq[i, j] = answer.d[0], answer.dq[0]
    return Levels(field.unit, q, d, dq)


def levels_figure(points: int = POINTS) -> Figure:
    """The four panels, from ``points`` values of either joint.

    Raises:
        MissingError: matplotlib is not installed.
    """
    figure = new_figure(9.6, 7.6)
    from matplotlib import rc_context

    robot = load_robot("planar")
    scene = Scene([Obstacle(Sphere(RADIUS), position=[*DISC, 0.0])])
    fields: tuple[Field, ...] = (CDF(robot), SDF(robot))
    with rc_context(STYLE):
        axes = figure.subplots(2, 2, height_ratios=(1.0, 0.8))
        for column, field in enumerate(fields):
            levels = sample(field, scene, points)
            chosen = along_level(levels, PANELS[levels.unit].shown)
            draw_joints(figure, axes[0, column], levels, chosen)
            draw_arms(axes[1, column], levels.unit, chosen)
    return figure


def along_level(levels: Levels, level: float, count: int = ARMS) -> Array:
    """``count`` configurations (count, 2), evenly along the longest line of the set of that level."""
    from contourpy import contour_generator

    lines: Any = contour_generator(levels.q, levels.q, levels.d).lines(level)
    lengths = [np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]) for line in lines]
    length, line = max(zip(lengths, lines, strict=True), key=lambda pair: float(pair[0][-1]))
    at = (np.arange(count) + 0.5) / count * length[-1]
    return np.stack([np.interp(at, length, line[:, joint]) for joint in (0, 1)], axis=1)


def draw_joints(figure: Figure, axes: Axes, levels: Levels, chosen: Array) -> None:
    """Level sets, gradients, the obstacle's region, and the configurations of the panel below."""
    panel, q, d = PANELS[levels.unit], levels.q, levels.d
    top = panel.spacing * np.ceil(d.max() / panel.spacing)
    steps = np.arange(0.0, top + 0.5 * panel.spacing, panel.spacing)
    filled = axes.contourf(q, q, d, steps, cmap="cividis")
    axes.contour(q, q, d, steps[1:], colors=BLACK, linewidths=0.6)
    axes.contourf(q, q, d, [d.min() - 1.0, 0.0], colors=[VERMILION])
    axes.contour(q, q, d, [0.0], colors="white", linewidths=1.6)
    norm = np.linalg.norm(levels.dq, axis=2)
    flat = bool((norm < FLAT).any())
    if flat:
        axes.contourf(q, q, (norm < FLAT).astype(float), [0.5, 1.5], colors="none", hatches=["///"])
    pick = np.linspace(0, len(q) - 1, ARROWS + 2).round().astype(int)[1:-1]
    x, y = np.meshgrid(q[pick], q[pick])
    arrow = levels.dq[np.ix_(pick, pick)]
    seen = (norm[np.ix_(pick, pick)] >= FLAT) & (d[np.ix_(pick, pick)] > 0.0)
    scale = norm.max()
    arrows = axes.quiver(
        x[seen], y[seen], *(arrow[seen] / scale).T, color="white", edgecolor=BLACK, linewidth=0.4,
        angles="xy", scale_units="xy", scale=3.6, width=0.006, pivot="mid",
    )  # fmt: skip
    arrows.set_zorder(3)
    for number, point in enumerate(chosen, 1):
        _number(axes, point, number)
    bar = figure.colorbar(filled, ax=axes, pad=0.03)
    bar.set_label(f"distance [{levels.unit}], a line every {panel.spacing:g} {levels.unit}")
    title = f"{panel.title} (hatched: gradient zero)" if flat else panel.title
    axes.set(title=title, xlabel="joint 1 [rad]", ylabel="joint 2 [rad]", aspect="equal")
    ticks = [-pi, -pi / 2, 0.0, pi / 2, pi]
    axes.set_xticks(ticks, labels=["-π", "-π/2", "0", "π/2", "π"])
    axes.set_yticks(ticks, labels=["-π", "-π/2", "0", "π/2", "π"])


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
        axes.plot(*np.array([[0.0, 0.0], elbow, tip]).T, color=BLUE, linewidth=2.2, marker="o", markersize=4, zorder=3)
        _number(axes, tip, number)
    axes.plot(0.0, 0.0, marker="s", color=BLACK, markersize=7, zorder=4)
    axes.set(
        title=f"The arm at {panel.shown:g} {unit} from contact",
        xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-4.2, 4.2), ylim=(-2.6, 4.2),
    )  # fmt: skip
    axes.grid(color="0.85", linewidth=0.6)
    axes.set_axisbelow(True)


def _number(axes: Axes, point: Array, number: int) -> None:
    box = {"boxstyle": "circle,pad=0.15", "facecolor": ORANGE, "edgecolor": BLACK, "linewidth": 0.7}
    axes.text(point[0], point[1], str(number), fontsize=7, ha="center", va="center", bbox=box, zorder=5)
