"""A planar run as a film: the plane of the arm and the plane of the joints side by side, in real time.

MP4 is written by ffmpeg, GIF by Pillow, which comes with matplotlib. Between control steps the configuration and the
obstacles are interpolated; the level sets are those of the control step before.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.errors import InputError, MissingError
from cdfctl.reading import drafted
from cdfctl.report.figures.field_map import both_maps, draw_map, draw_region, joint_axes, level_steps
from cdfctl.report.figures.joint_space import axis_values, draw_path, target_map
from cdfctl.report.figures.outline import Skeleton
from cdfctl.report.figures.output import check_output
from cdfctl.report.figures.run_view import RunView
from cdfctl.report.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILION, new_figure, styled
from cdfctl.report.figures.task_space import add_shape, dense, draw_arm, draw_arrows, draw_goal, frame, plan_at
from cdfctl.types import Array, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SUFFIXES = (".mp4", ".gif")
SIZE, DPI = (16.0, 8.6), 127  # cm; 800 x 430 pixels: a film of H.264 has even sides
RATE = {".mp4": 25, ".gif": 10}  # pictures a second
POINTS = 61  # of either joint
HOLD = 1.0  # s, the last picture
FFMPEG = "install ffmpeg (Debian: apt-get install ffmpeg), or ask for a GIF: --out FILE.gif"


def check_animation(path: Path) -> None:
    """Say at once, before the work, that a film cannot be written into ``path``.

    Raises:
        InputError: its suffix is neither .mp4 nor .gif, its folder is not there, or it is a folder.
        MissingError: matplotlib, or for an MP4 ffmpeg, is not there.
    """
    check_output(path, SUFFIXES)
    if path.suffix.lower() == ".mp4" and not has_ffmpeg():
        raise MissingError("an MP4 needs ffmpeg, which is not installed", hint=FFMPEG)


def has_ffmpeg() -> bool:
    """Whether MP4 can be written here."""
    return shutil.which("ffmpeg") is not None


def animate(view: RunView, fields: tuple[str, ...], path: Path, points: int = POINTS) -> int:
    """Write the film of a run into ``path``, with the first of ``fields`` in the plane of the joints.

    Returns:
        The number of pictures.

    Raises:
        InputError: the run is not of a planar arm of two joints, or has no step, or the file cannot be written.
        MissingError: as :func:`check_animation`.
    """
    check_animation(path)
    if not (view.in_plane and view.two_joints):
        raise InputError(
            f"--animate is for planar arms of two joints, and '{view.robot.name}' is none",
            hint="cdfctl view shows any robot",
        )
    if view.steps == 0:
        raise InputError("a run without a step cannot be animated")
    suffix = path.suffix.lower()
    draft = path.with_name(f".{path.stem}.new{suffix}")
    times = frame_times(view, RATE[suffix])
    try:
        with drafted(path, draft), styled():
            _write(view, fields[0], times, draft, RATE[suffix], points)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None
    return len(times)


def frame_times(view: RunView, rate: float) -> Array:
    """Instants (s) of the pictures: real time, and the last one held."""
    end = float(view.t[-1])
    moving = np.append(np.arange(0.0, end - 1e-9, 1.0 / rate), end)
    return np.append(moving, np.full(round(HOLD * rate), end))


def _write(view: RunView, name: str, times: Array, path: Path, rate: int, points: int) -> None:
    from matplotlib.animation import FFMpegWriter, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    writer: Any
    if path.suffix == ".mp4":
        exact = ["-fflags", "+bitexact", "-flags:v", "+bitexact", "-threads", "1", "-pix_fmt", "yuv420p"]
        writer = FFMpegWriter(fps=rate, codec="h264", extra_args=exact)
    else:
        writer = PillowWriter(fps=rate)
    figure = new_figure(*SIZE)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    x, y = axis_values(view, points)
    steps = level_steps(_top(view, name, x, y))
    picked = np.arange(view.steps + 1)
    drawn = -1
    with writer.saving(figure, str(path), DPI):
        for t in times:
            k = min(int(np.searchsorted(view.t, t + 1e-9, side="right")) - 1, view.steps)
            now = at_time(view, float(t))
            if k != drawn:
                _joints(right, view, name, k, x, y, steps)
                drawn = k
            for artist in [a for a in right.lines if a.get_gid() == "now"]:
                artist.remove()
            right.plot(
                *now.trajectory.q[-1], marker="D", markerfacecolor=ORANGE, markeredgecolor=BLACK, markersize=6,
                gid="now", zorder=6,
            )  # fmt: skip
            _arms(left, view, now, picked)
            figure.suptitle(f"{view.scenario.name}, {view.scenario.controller.variant}: t = {t:5.2f} s", fontsize=9)
            if t == times[0]:
                figure.draw_without_rendering()
                figure.set_layout_engine("none")  # nothing moves from here on, and a picture takes half the time
            writer.grab_frame()


def _top(view: RunView, name: str, x: Array, y: Array) -> float:
    """The greatest finite distance at some instants of the run, so that the colours mean the same in all pictures."""
    coarse = x[:: max(1, len(x) // 20)], y[:: max(1, len(y) // 20)]
    instants = np.unique(np.linspace(0, view.steps, 6).round().astype(int))
    return max(both_maps(view.field("sdf"), view.scene(int(k)), *coarse)[name].top for k in instants)


def at_time(view: RunView, t: float) -> RunView:
    """The run until ``t`` (s), its last state interpolated."""
    k = min(int(np.searchsorted(view.t, t, side="right")) - 1, view.steps - 1)
    until = view.until(k + 1)
    arrays = until.trajectory
    share = min(1.0, (t - float(view.t[k])) / max(float(view.t[k + 1] - view.t[k]), 1e-12))
    for name in ("q", "obstacle_pose"):
        whole = getattr(view.trajectory, name)
        last = getattr(arrays, name)
        last[-1] = (1.0 - share) * whole[k] + share * whole[k + 1]
    quaternions = arrays.obstacle_pose[-1, :, 3:]
    quaternions /= np.maximum(np.linalg.norm(quaternions, axis=1, keepdims=True), 1e-12)
    arrays.t[-1] = t
    return until


def _joints(axes: Axes, view: RunView, name: str, k: int, x: Array, y: Array, steps: Array) -> None:
    axes.clear()
    maps = both_maps(view.field("sdf"), view.scene(k), x, y)
    draw_map(axes, maps[name], steps, arrows=11)
    draw_region(axes, maps["sdf"])
    target = target_map(view, k, x, y)
    if target is not None:
        draw_region(axes, target, face=GREEN, hatch="xxxx")
    draw_path(axes, view, k, contacts=name == "cdf", to_come=False)
    joint_axes(axes, ("joint 1", "joint 2"), x, y)


def _arms(axes: Axes, view: RunView, now: RunView, picked: IntArray) -> None:
    axes.clear()
    skeleton = Skeleton(view.robot)
    t = float(now.t[-1])
    for shape, pose in zip(view.motion.shapes, now.trajectory.obstacle_pose[-1], strict=True):
        add_shape(axes, shape, pose, facecolor=VERMILION, edgecolor=BLACK, linewidth=0.6, zorder=2.5)
    draw_arrows(axes, now, now.steps)
    if view.target is not None:
        for shape, pose in zip(view.target.shapes, view.target.poses(t), strict=True):
            add_shape(axes, shape, pose, facecolor="none", edgecolor=GREEN, hatch="xxxx", zorder=2.4)
    draw_goal(axes, view)
    for q in _shadows(now):
        draw_arm(axes, skeleton, q, "0.8", 2.6, linewidth=1.0)
    points = skeleton.points(dense(now.trajectory.q))
    axes.plot(*points[:, -1].T, color=BLUE, linewidth=1.3, zorder=4.5)
    for i in range(1, view.robot.n):
        axes.plot(*points[:, i].T, color=ORANGE, linestyle=(0, (3, 1)), linewidth=1.0, zorder=4.4)
    plan = plan_at(view, now.steps - 1)
    if plan is not None:
        axes.plot(*skeleton.points(dense(plan))[:, -1].T, color=PURPLE, linestyle="--", linewidth=0.9, zorder=4.6)
    draw_arm(axes, skeleton, now.trajectory.q[-1], BLACK, 5.0, linewidth=2.2, markersize=3.5)
    frame(axes, view, picked)


def _shadows(now: RunView) -> Iterator[Array]:
    """Earlier configurations, about two a second."""
    last = -1.0
    for t, q in zip(now.t[:-1], now.trajectory.q[:-1], strict=True):
        if t - last >= 0.5:
            last = float(t)
            yield q
