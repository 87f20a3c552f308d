"""The plane a planar arm moves in: arm and obstacles at instants of the run, fading back in time, and the paths."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.report.figures.outline import Skeleton, patches, radius_of
from cdfctl.report.figures.part import Part
from cdfctl.report.figures.run_view import RunView
from cdfctl.report.figures.style import (
    BLACK,
    BLUE,
    COLUMN,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILION,
    grid,
    halo,
    mixed,
)
from cdfctl.types import Array, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdfctl.report.figures.part import Canvas

INSTANTS = 9
CHORD = 0.05  # rad: joint motion between two points of a drawn path
BESIDE, ABOVE_AND_BELOW = 2.3, 2.45  # cm: labels and bar of the strobe, and its title, label and legend
LABELLED = 4
"""Of so many obstacles the times are written, where there is room."""
PLANS = 12
"""At most so many plans are drawn, evenly over the run."""


def task_space(view: RunView) -> Part:
    """The strobe of a run of a planar arm."""

    def height(width: float) -> float:
        low, high = extent(view, _picked(view))
        across, up = high - low
        return (width - BESIDE) * float(np.clip(up / across, 0.3, 2.0)) + ABOVE_AND_BELOW

    return Part("task-space", height, lambda canvas, width: _draw(canvas, view), COLUMN)


def _draw(canvas: Canvas, view: RunView) -> None:
    axes = canvas.subplots()
    canvas.suptitle(view.title().replace("; ", "\n", 1), x=0.01, ha="left", fontsize=7.5)
    picked = _picked(view)
    draw_strobe(axes, view, picked)
    handles = draw_paths(axes, view)
    handles += draw_goal(axes, view)
    frame(axes, view, picked)
    _label_times(axes, view, picked)
    canvas.legend(handles=handles, loc="outside lower center", ncols=5)
    if view.steps:
        _time_bar(canvas, axes, view)


def _picked(view: RunView) -> IntArray:
    """The control steps that are drawn."""
    return np.unique(np.linspace(0, view.steps, INSTANTS).round().astype(int))


def draw_strobe(axes: Axes, view: RunView, picked: IntArray) -> None:
    """Arm and obstacles at the control steps ``picked``, the later the darker."""
    skeleton = Skeleton(view.robot)
    end = max(float(view.t[-1]), 1e-9)
    for k in picked:
        share = float(view.t[k]) / end
        draw_arm(axes, skeleton, view.trajectory.q[k], shade(share), 3.0 + share)
        draw_obstacles(axes, view, int(k), share)
        if view.target is not None:
            for pose, shape in zip(view.target.poses(float(view.t[k])), view.target.shapes, strict=True):
                style = {"facecolor": "none", "edgecolor": mixed("white", GREEN, 0.3 + 0.7 * share), "hatch": "xxxx"}
                add_shape(axes, shape, pose, zorder=2.0 + share, **style)
    axes.plot(*skeleton.points(view.trajectory.q[:1])[0, 0], marker="s", color=BLACK, markersize=4.5, zorder=5)


def shade(share: float) -> tuple[float, float, float]:
    """The colour of the arm at ``share`` of the run: from light grey to black."""
    return mixed("#c8c8c8", BLACK, share)


def draw_arm(axes: Axes, skeleton: Skeleton, q: Array, colour: Any, zorder: float, **style: Any) -> None:
    """The arm at ``q`` (n,): a line through its joints, and the outlines of links with a thickness."""
    from matplotlib.patches import Polygon

    for corners in skeleton.links(q):
        axes.add_patch(Polygon(corners, closed=True, facecolor="none", edgecolor=colour, linewidth=0.7, zorder=zorder))
    drawn = {"linewidth": 1.6, "marker": "o", "markersize": 2.2, **style}
    axes.plot(*skeleton.points(q[None, :])[0].T, color=colour, zorder=zorder, **drawn)


def draw_obstacles(axes: Axes, view: RunView, k: int, share: float) -> None:
    """The obstacles at control step ``k``."""
    style = {"facecolor": mixed("white", VERMILION, 0.12 + 0.88 * share), "edgecolor": BLACK if share == 1.0 else GREY}
    for shape, pose in zip(view.motion.shapes, view.trajectory.obstacle_pose[k], strict=True):
        add_shape(axes, shape, pose, zorder=2.0 + share, linewidth=0.5, **style)


def draw_arrows(axes: Axes, view: RunView, k: int, length: float = 0.7) -> None:
    """Which way the obstacles go at control step ``k``, from their origins, ``length`` m for the fastest."""
    places, speeds = view.trajectory.obstacle_pose[k, :, :2], view.trajectory.obstacle_twist[k, :, :2]
    fastest = np.linalg.norm(speeds, axis=1).max(initial=0.0)
    if fastest > 1e-9:
        style = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.008, "zorder": 6}
        axes.quiver(*places.T, *(length * speeds / fastest).T, color=BLACK, **style)


def add_shape(axes: Axes, shape: Any, pose: Array, **style: Any) -> None:
    """What an obstacle of this shape looks like at ``pose`` (7,)."""
    for patch in patches(shape, pose, **style):
        axes.add_patch(patch)


def draw_paths(axes: Axes, view: RunView) -> list[Any]:
    """Paths of the tip and of every joint that moves, and what a predictive controller planned for the tip."""
    skeleton = Skeleton(view.robot)
    points = skeleton.points(dense(view.trajectory.path[1]))
    moving = [i for i in range(1, view.robot.n) if np.ptp(points[:, i], axis=0).max() > 1e-6]
    handles = []
    if view.plan is not None:
        handles += [_draw_plans(axes, view, skeleton)]
    for i in moving:
        (drawn,) = axes.plot(*points[:, i].T, color=ORANGE, linestyle=(0, (3, 1)), linewidth=1.1, zorder=4.5)
        if i == moving[0]:
            drawn.set_label("elbow" if len(moving) == 1 else "joints")
            handles.append(drawn)
    (drawn,) = axes.plot(*points[:, -1].T, color=BLUE, linewidth=1.4, zorder=4.5, label="tip")
    return [drawn, *handles]


def _draw_plans(axes: Axes, view: RunView, skeleton: Skeleton) -> Any:
    drawn: Any = None
    for q in plans(view):
        (drawn,) = axes.plot(
            *skeleton.points(dense(q))[:, -1].T, color=PURPLE, linewidth=0.6, linestyle=":", zorder=4.2, label="plans"
        )
    return drawn


def plans(view: RunView) -> list[Array]:
    """Some of the planned paths (k, n), evenly over the run, without their gaps."""
    if view.plan is None:
        return []
    picked = np.unique(np.linspace(0, len(view.plan[0]) - 1, PLANS).round().astype(int))
    found = [plan_at(view, int(k)) for k in picked]
    return [q for q in found if q is not None]


def plan_at(view: RunView, k: int) -> Array | None:
    """The path (at least 2, n) planned at control step ``k``, None where there is none."""
    if view.plan is None or not 0 <= k < len(view.plan[0]):
        return None
    q = view.plan[0][k]
    q = q[np.isfinite(q).all(axis=1)]
    return q if len(q) > 1 else None


def draw_goal(axes: Axes, view: RunView) -> list[Any]:
    """The arm at its goal; for a reach task a sample of the target's hatch. And a sample of an obstacle."""
    from matplotlib.patches import Patch

    handles: list[Any] = []
    if view.goal is not None:
        (points,) = Skeleton(view.robot).points(view.goal[None, :])
        handles += axes.plot(*points.T, color=GREEN, linestyle=":", linewidth=1.8, zorder=4.1, label="goal")
    if view.target is not None:
        handles.append(Patch(facecolor="none", edgecolor=GREEN, hatch="xxxx", label="target"))
    if len(view.motion):
        handles.append(Patch(facecolor=mixed("white", VERMILION, 0.7), edgecolor=GREY, linewidth=0.5, label="obstacle"))
    return handles


def dense(Q: Array) -> Array:
    """The configurations ``Q`` (k, n), with others between them so that a path of the tip is smooth."""
    parts = [Q[:1]]
    for a, b in itertools.pairwise(Q):
        pieces = max(1, int(np.ceil(np.abs(b - a).sum() / CHORD)))
        parts.append(a + (b - a) * (np.arange(1, pieces + 1) / pieces)[:, None])
    return np.concatenate(parts)


def frame(axes: Axes, view: RunView, picked: IntArray) -> None:
    """Limits around all that the arm touches, and around the obstacles within its reach and a little more."""
    low, high = extent(view, picked)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    grid(axes)


def extent(view: RunView, picked: IntArray) -> tuple[Array, Array]:
    """The least and the greatest x and y (2,) that are shown, m."""
    points = Skeleton(view.robot).points(view.trajectory.q)
    if view.goal is not None:
        points = np.concatenate([points, Skeleton(view.robot).points(view.goal[None, :])])
    base = points[0, 0]
    reach = np.linalg.norm(points - base, axis=2).max()
    origins = [view.trajectory.obstacle_pose[picked][:, :, :2].reshape(-1, 2)]
    if view.target is not None:
        origins += [view.target.poses(float(view.t[k]))[:, :2] for k in picked]
    near = np.concatenate(origins)
    near = near[np.linalg.norm(near - base, axis=1) < 1.25 * reach]
    size = min(max((radius_of(shape) for shape in view.motion.shapes), default=0.0) + 0.1 * reach, 0.4 * reach)
    seen = np.concatenate([points.reshape(-1, 2), near - size, near + size])  # the body, and its time beside it
    pad = 0.12 * reach
    return seen.min(axis=0) - pad, seen.max(axis=0) + pad


def _label_times(axes: Axes, view: RunView, picked: IntArray) -> None:
    """When the first obstacles were where they are first and last seen, beside their way, where there is room.

    A label must be inside the frame as a whole, and clear of the others.
    """
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    half = np.array([0.07, 0.025]) * (high - low)  # of a label
    taken: list[Array] = []
    for i, shape in enumerate(view.motion.shapes[:LABELLED]):
        poses = view.trajectory.obstacle_pose[picked, i]
        seen = picked[((poses[:, :2] > low) & (poses[:, :2] < high)).all(axis=1)]
        for k in dict.fromkeys(seen[[0, -1]].tolist() if len(seen) else ()):
            twist = view.trajectory.obstacle_twist[k, i]
            speed = float(np.linalg.norm(twist[:2]))
            aside = np.array([twist[1], -twist[0]]) / speed if speed > 1e-9 else np.array([1.0, 0.0])
            origin, size = view.trajectory.obstacle_pose[k, i, :2], radius_of(shape)
            for side in (aside, -aside):
                place = np.clip(origin + (size + 1.3 * half) * side, low + half, high - half)
                beside = np.linalg.norm((place - origin) / (size + half)) > 1.0
                if beside and all((np.abs(place - other) > 2.0 * half).any() for other in taken):
                    taken.append(place)
                    x, y = place.tolist()
                    axes.text(
                        x, y, f"{view.t[k]:.1f} s", ha="center", va="center", fontsize=6.5, zorder=6,
                        path_effects=[halo()],
                    )  # fmt: skip
                    break


def _time_bar(canvas: Canvas, axes: Axes, view: RunView) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    colours = LinearSegmentedColormap.from_list("time", [shade(0.0), shade(1.0)])
    bar = canvas.colorbar(ScalarMappable(Normalize(0.0, float(view.t[-1])), colours), ax=axes, pad=0.02, aspect=35)
    bar.set_label("time of the arm's picture [s]")
