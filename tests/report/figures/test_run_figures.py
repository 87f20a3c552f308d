"""Figures of runs: what is in them, and that every axis has its unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from cdfctl.errors import InputError
from cdfctl.report.figures import style
from cdfctl.report.figures.joint_space import axis_values, default_instants, joint_space
from cdfctl.report.figures.output import save_figure
from cdfctl.report.figures.part import figure_of
from cdfctl.report.figures.run_view import LONGEST_LABEL, MOST_INSTANTS, RunView, view_run
from cdfctl.report.figures.task_space import dense, plan_at, plans, task_space
from cdfctl.report.figures.time_course import panels, time_course
from cdfctl.robots.robot import load_robot
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.resolve import resolve
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.run_folder import write_npz
from cdfctl.types import Trajectory


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in (axes.xaxis.label, axes.yaxis.label)]


def legend_of(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


@pytest.fixture(scope="module")
def arm_run():
    """A Franka among two balls, its trajectory made up."""
    robot = load_robot("franka")
    scenario = resolve(load_scenario("C1").scenario)
    motion = SceneMotion(load_scenario("reach").scenario.obstacles[:2])
    N, rng = 4, np.random.default_rng(0)
    pose = np.zeros((N + 1, 2, 7))
    pose[:, :, 6], pose[:, 0, 0], pose[:, 1, 0] = 1.0, 1.5, -2.0
    trajectory = Trajectory(
        t=0.1 * np.arange(N + 1), q=robot.home + 0.1 * rng.normal(size=(N + 1, 7)), u=rng.normal(size=(N, 7)),
        obstacle_pose=pose, obstacle_twist=np.zeros((N + 1, 2, 6)), h=rng.normal(size=(N, 2)),
        V=np.full(N, np.nan), slack=np.full(N, np.nan), infeasible=np.zeros(N, dtype=bool),
        step_time=np.full(N, 1e-3),
    )  # fmt: skip
    return RunView(scenario, {"outcome": "timeout"}, trajectory, robot, motion, None)


@pytest.mark.parametrize("width", [8.5, 17.5])
def test_every_axis_has_its_unit(full_run, arm_run, width):
    for view in (full_run, arm_run):
        parts = [time_course(view)]
        if view.in_plane:
            parts += [task_space(view), joint_space(view, ("cdf", "sdf"), [0, 5], points=9)]
        figure = figure_of(parts, width)
        labels = [label for label in texts(figure) if label]
        assert len(labels) >= 7
        assert all("[" in label and "]" in label for label in labels), labels


def test_a_run_has_a_panel_for_everything_it_recorded(small_run, full_run, arm_run):
    planar = [panel.label for panel in panels(small_run)]
    assert planar == [
        "h of the SDF [m]", "clearance [m]", "velocity u [rad/s]", "position q [rad]", "time of the step [ms]",
    ]  # fmt: skip
    full = [panel.label for panel in panels(full_run)]
    assert full[:5] == ["h of the CDF [rad]", "h of the SDF [m]", "clearance [m]", "V [rad]", "slack δ [rad/s]"]
    assert "room to a limit [rad]" in [panel.label for panel in panels(arm_run)], "its joints have limits of their own"


def test_the_curves_are_the_arrays(full_run):
    figure = figure_of([time_course(full_run)])
    by_label = {axes.get_ylabel(): axes for axes in figure.axes}
    arrays = full_run.trajectory
    (h,) = [line for line in by_label["h of the CDF [rad]"].lines if line.get_label() == "disc-1"]
    np.testing.assert_array_equal(h.get_ydata()[2:], arrays.h[2:, 0])
    assert np.isnan(h.get_ydata()[:2]).all(), "a gap where there is no row"
    levels = {float(line.get_ydata()[0]) for line in by_label["h of the CDF [rad]"].lines if len(line.get_ydata()) == 2}
    assert levels >= {0.0, -full_run.margin}, "the margin and contact"
    u = [line for line in by_label["velocity u [rad/s]"].lines if line.get_label().startswith("joint")]
    for line, column in zip(u, arrays.u.T, strict=True):
        np.testing.assert_array_equal(line.get_ydata()[:-1], column)
        assert line.get_drawstyle() == "steps-post"
    limits = {float(line.get_ydata()[0]) for line in by_label["velocity u [rad/s]"].lines if line not in u}
    assert limits >= {-2.0, 2.0}


def test_the_clearance_is_that_of_the_closed_form(small_run):
    """Of two segments of 2 m and the disc, at the control steps and between them."""
    times, found = small_run.clearance
    assert set(small_run.t.round(9)) < set(times.round(9))
    for k in range(0, len(times), 7):
        now = times[k]
        q = np.array([np.interp(now, small_run.t, column) for column in small_run.trajectory.q.T])
        centre = [np.interp(now, small_run.t, column) for column in small_run.trajectory.obstacle_pose[:, 0, :2].T]
        elbow = 2.0 * np.array([np.cos(q[0]), np.sin(q[0])])
        tip = elbow + 2.0 * np.array([np.cos(q.sum()), np.sin(q.sum())])
        along = [np.linspace(a, b, 4001) for a, b in ((np.zeros(2), elbow), (elbow, tip))]
        truth = np.linalg.norm(np.concatenate(along) - centre, axis=1).min() - 0.3
        assert found[k, 0] == pytest.approx(truth, abs=1e-5)


def test_infeasible_steps_and_contact_are_marked(full_run, small_run):
    marked = figure_of([time_course(full_run)])
    names = legend_of(marked)
    assert "infeasible step" in names
    assert "time of first contact" in names
    axes = marked.axes[0]
    bands = sorted(patch.get_x() for patch in axes.patches)
    np.testing.assert_allclose(bands, full_run.t[[3, 4]])
    assert any(np.allclose(line.get_xdata(), 0.42) for line in axes.lines)
    plain = legend_of(figure_of([time_course(small_run)]))
    assert "infeasible step" not in plain
    assert "time of first contact" not in plain


def test_plans_are_drawn_where_there_are_any(full_run, small_run):
    assert plan_at(full_run, 0) is None
    assert plan_at(full_run, 5).shape == (4, 2)
    assert 0 < len(plans(full_run)) <= 12
    assert plans(small_run) == []
    assert "plans" in legend_of(figure_of([task_space(full_run)]))
    assert "plan" in legend_of(figure_of([joint_space(full_run, ("sdf",), [6], points=9)]))
    assert "plans" not in legend_of(figure_of([task_space(small_run)]))


def test_an_array_nobody_knows_of_does_not_disturb(tmp_path, small_run):
    from cdfctl.scenario.dump import dump
    from cdfctl.simulation.run_folder import arrays_of

    record = {"format": "cdfctl-run", "version": 1, **small_run.document}
    import json

    (tmp_path / "result.json").write_text(json.dumps(record))
    (tmp_path / "scenario.yaml").write_text(dump(small_run.scenario))
    write_npz(tmp_path / "trajectory.npz", {**arrays_of(small_run.trajectory), "tau": np.zeros(3)})
    view = view_run(tmp_path)
    np.testing.assert_array_equal(view.trajectory.q, small_run.trajectory.q)
    assert figure_of([time_course(view)]).axes


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: {"q": a.q[:, :1], "u": a.u[:, :1]}, "is of 1 joints, but the scenario's robot 'planar' has 2"),
        (
            lambda a: {
                "h": np.tile(a.h, 2), "obstacle_pose": np.tile(a.obstacle_pose, (1, 2, 1)),
                "obstacle_twist": np.tile(a.obstacle_twist, (1, 2, 1)),
            },
            "is of 2 obstacles, but the scenario has 1",
        ),
        (lambda a: {"q": np.full_like(a.q, np.nan)}, "is not finite"),
    ],
)  # fmt: skip
def test_a_foreign_or_damaged_trajectory_is_one_line(tmp_path, small_run, change, message):
    import json

    from cdfctl.scenario.dump import dump
    from cdfctl.simulation.run_folder import arrays_of

    record = {"format": "cdfctl-run", "version": 1, **small_run.document}
    (tmp_path / "result.json").write_text(json.dumps(record))
    (tmp_path / "scenario.yaml").write_text(dump(small_run.scenario))
    arrays = {**arrays_of(small_run.trajectory), **change(small_run.trajectory)}
    write_npz(tmp_path / "trajectory.npz", arrays)
    with pytest.raises(InputError, match=message) as caught:
        view_run(tmp_path)
    assert "\n" not in caught.value.message


def test_a_run_without_a_step_is_drawn(small_run):
    none = small_run.until(0)
    assert default_instants(none) == [0]
    figure = figure_of([task_space(none), joint_space(none, ("sdf",), [0], points=9), time_course(none)])
    figure.draw_without_rendering()


def test_a_part_of_a_run_has_the_moments_of_its_plant_until_then(small_run):
    fine = np.linspace(0.0, small_run.t[-1], 4 * small_run.steps + 1)
    q = np.stack([np.interp(fine, small_run.t, column) for column in small_run.trajectory.q.T], axis=1)
    view = replace(small_run, trajectory=replace(small_run.trajectory, plant_t=fine, plant_q=q))
    t, path = view.until(3).trajectory.path
    assert t[-1] == pytest.approx(small_run.t[3])
    np.testing.assert_allclose(path[-1], small_run.trajectory.q[3], atol=1e-9)


def test_the_instants_are_start_least_clearance_and_end(small_run):
    times, found = small_run.clearance
    nearest = int(np.argmin(np.abs(small_run.t - times[np.argmin(found[:, 0])])))
    expected = {0, nearest if 0 < nearest < small_run.steps else small_run.steps // 2, small_run.steps}
    assert default_instants(small_run) == sorted(expected)
    assert len(times) <= MOST_INSTANTS


def test_the_joints_are_shown_between_their_limits(small_run):
    x, y = axis_values(small_run)
    for values in (x, y):
        np.testing.assert_allclose(values[[0, -1]], [-np.pi, np.pi])
    # The disc, 0.6 m wide at 4 m, takes 0.15 rad: two steps, but for the rounding to a number of points.
    assert np.diff(x)[0] == pytest.approx(0.3 / 4.0, rel=0.03)


def test_a_dense_path_goes_through_its_points():
    Q = np.array([[0.0, 0.0], [0.3, -0.2], [0.3, 0.4]])
    found = dense(Q)
    assert np.abs(np.diff(found, axis=0)).sum(axis=1).max() <= 0.05 + 1e-12
    for q in Q:
        assert np.isclose(found, q).all(axis=1).any()


def test_series_differ_without_colour():
    styles = {str(style.line(i)["linestyle"]) for i in range(7)}
    assert len(styles) == 7
    assert len({style.marker(i)["marker"] for i in range(style.MOST_SERIES)}) == style.MOST_SERIES


def test_the_arm_darkens_with_time():
    from cdfctl.report.figures.task_space import shade

    light = [np.mean(to_rgb(shade(share))) for share in np.linspace(0.0, 1.0, 9)]
    assert (np.diff(light) < 0.0).all()


def test_many_obstacles_share_one_line(small_run):
    m = 20
    arrays = small_run.trajectory
    motion = SceneMotion(small_run.scenario.obstacles * m)
    wide = replace(
        arrays, h=np.tile(arrays.h, m), obstacle_pose=np.tile(arrays.obstacle_pose, (1, m, 1)),
        obstacle_twist=np.tile(arrays.obstacle_twist, (1, m, 1)),
    )  # fmt: skip
    figure = figure_of([time_course(replace(small_run, trajectory=wide, motion=motion))])
    (least,) = [line for line in figure.axes[0].lines if line.get_label() == f"least of {m} obstacles"]
    np.testing.assert_array_equal(least.get_ydata(), arrays.h[:, 0])


def test_times_and_goals_are_inside_what_is_drawn(small_run, arm_run):
    """A text or marker that crosses the frame is cut, and one that crosses the page as well."""
    strobe = figure_of([task_space(small_run)])
    strobe.draw_without_rendering()
    axes = strobe.axes[0]
    frame = axes.get_window_extent()
    times = [text for text in axes.texts if text.get_text().endswith(" s")]
    assert [text.get_text() for text in times] == ["0.0 s", "1.5 s"]
    for text in times:
        box = text.get_window_extent()
        assert frame.x0 <= box.x0
        assert box.x1 <= frame.x1
        assert frame.y0 <= box.y0
        assert box.y1 <= frame.y1
    course = figure_of([time_course(arm_run)])
    course.draw_without_rendering()
    goals = [line for axes in course.axes for line in axes.lines if line.get_marker() == 5]
    assert len(goals) == 7
    assert all(line.get_clip_on() for line in goals)


def test_the_second_unit_of_a_velocity_is_a_velocity(arm_run):
    slides = arm_run.robot.prismatic.copy()
    slides[3] = True
    view = replace(arm_run, robot=replace(arm_run.robot, prismatic=slides))
    assert "velocity u [rad/s or m/s]" in [panel.label for panel in panels(view)]


def test_any_name_of_an_obstacle_is_drawn_as_it_is(tmp_path, small_run):
    """A formula that is none ended in matplotlib's parser, and a name with a line in front had no place in legends."""
    motion = SceneMotion(small_run.scenario.obstacles)
    motion.names = ("_$\\frac{$ \u4e2d" + "x" * 99,)
    figure = figure_of([time_course(replace(small_run, motion=motion))])
    (name,) = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert name.startswith("obstacle _$\\frac{$ \u4e2dx")
    assert len(name) == LONGEST_LABEL
    save_figure(figure, tmp_path / "time.svg")
    ticks = [
        tick.get_text() for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for tick in axis.get_ticklabels()
    ]
    assert not any("$" in tick for tick in ticks)  # nor is any of our own read as a formula
