"""The figure of the paper's real experiment on the page of plants: both runs, made anew at every build."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from sphinx.application import Sphinx

from cdfctl.report.figures.output import save_figure
from cdfctl.report.figures.style import BLACK, BLUE, GREY, VERMILION, grid, new_figure, styled
from cdfctl.robots.robot import Robot
from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import Trial, assemble
from cdfctl.simulation.judge import clearance_curve
from cdfctl.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEP = 0.02
"""s, the control step of the figure: a fifth of the work, and no difference to be seen."""

RADIUS = 0.05  # m, of the ball
SPEEDS = {"real-slow": ("0.05 m/s", BLUE, "-"), "real-fast": ("0.15 m/s", VERMILION, "--")}


def experiment_figure() -> Figure:
    """Above, the arm as seen along -x at the start, when it is nearest to the ball, and at its goal; below, both runs
    over time."""
    trials = {name: _run(name) for name in SPEEDS}
    with styled():
        figure = new_figure(17.5, 13.0, compress=False)
        axes: Any = figure.subplots(2, 2, height_ratios=[1.6, 1.0])
        for place, (name, trial) in zip(axes[0], trials.items(), strict=True):
            _view(place, trial, *SPEEDS[name])
        for name, trial in trials.items():
            _courses(axes[1, 0], axes[1, 1], trial, *SPEEDS[name])
        axes[1, 0].axhline(0.05, color=GREY, linewidth=0.8, linestyle=":", label="margin")
        axes[1, 0].set_ylim(0.0, 0.35)
        axes[1, 0].set_ylabel("clearance [m]")
        axes[1, 1].set_ylabel("distance to the goal [rad]")
        for place in axes[1]:
            place.set_xlabel("time [s]")
            place.set_xlim(0.0, 17.0)
            place.legend()
            grid(place)
    return figure


def _run(name: str) -> Trial:
    trial = assemble(load_scenario(name, [f"simulation.dt={STEP}"]))
    for _ in trial.run():
        pass
    return trial


def _view(axes: Axes, trial: Trial, speed: str, colour: str, style: str) -> None:
    trajectory, robot = trial.rollout.trajectory(), trial.robot
    curve = clearance_curve(robot, trial.motion, trajectory)
    nearest = int(np.argmin(curve))
    ball = trajectory.obstacle_pose[:, 0, 1:3]
    axes.plot(*ball[[0, -1]].T, color=GREY, linewidth=0.8, linestyle=":")
    for k, shade, width in ((0, "0.75", 1.5), (len(curve) - 1, "0.5", 1.5), (nearest, colour, 2.5)):
        axes.plot(*_skeleton(robot, trajectory.q[k])[:, 1:].T, color=shade, linewidth=width, marker="o", markersize=2.5)
    tips = robot.tip_path(trajectory.q)[:, 1:]
    axes.plot(*tips.T, color=BLACK, linewidth=0.9)
    y, z = ball[nearest]
    axes.add_patch(_disc(y, z))
    axes.plot([y + RADIUS, y + RADIUS + 0.35], [z, z], color=BLACK, linewidth=1.5)
    for text, k, shade in (("start", 0, "0.6"), ("goal", len(curve) - 1, "0.35")):
        axes.annotate(text, tips[k], (5, -8), textcoords="offset points", color=shade)
    at = f"nearest at {trajectory.t[nearest]:.1f} s: {curve[nearest]:.3f} m"
    axes.set_title(f"ball at {speed}, {at}", loc="left")
    axes.set_aspect("equal")
    axes.set_xlim(-0.5, 0.85)
    axes.set_ylim(-0.02, 1.05)
    axes.set_xlabel("y [m]")
    axes.set_ylabel("z [m]")
    grid(axes)


def _disc(y: float, z: float) -> Any:
    from matplotlib.patches import Circle

    return Circle((y, z), RADIUS, facecolor="0.8", edgecolor=BLACK)


def _skeleton(robot: Robot, q: Array) -> Array:
    """Origins (n + 2, 3) of base, joints and tip."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    joints = [np.array(frame.translation) for frame in data.oMi]
    return np.array([*joints, robot.tip_position(q)])


def _courses(clear: Axes, off: Axes, trial: Trial, speed: str, colour: str, style: str) -> None:
    trajectory = trial.rollout.trajectory()
    curve = clearance_curve(trial.robot, trial.motion, trajectory)
    pose = np.array(trial.scenario.task.pose)  # type: ignore[union-attr]  # it is a hold task
    clear.plot(trajectory.t, curve, color=colour, linestyle=style, label=speed)
    off.plot(trajectory.t, np.linalg.norm(trajectory.q - pose, axis=1), color=colour, linestyle=style, label=speed)


def draw(app: Sphinx) -> None:
    """Draw it, before the pages are read."""
    folder = Path(app.srcdir) / "_figures"
    folder.mkdir(exist_ok=True)
    save_figure(experiment_figure(), folder / "experiment.png")


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("builder-inited", draw)
    return {"parallel_read_safe": True}
