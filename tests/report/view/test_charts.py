"""The charts: what is in them, and that a long curve keeps its extremes."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from cdfctl.report.view.chart_html import MOST_POINTS, ChartPanel, _strokes
from cdfctl.report.view.charts import MOST_CURVES, Chart, Curve, charts_of, clearance_curve
from cdfctl.report.view.replay import Replay
from cdfctl.simulation.judge import clearance_curve as judged_curve
from cdfctl.simulation.motion import SceneMotion


@pytest.fixture(scope="module")
def charts(replay):
    return charts_of(replay, clearance_curve(replay))


def test_h_of_every_obstacle_the_clearance_and_v(replay, charts):
    assert [(c.unit, len(c.curves)) for c in charts] == [("rad", 2), ("m", 2), ("m", 1), ("rad", 1)]
    np.testing.assert_array_equal(charts[0].curves[0].values, replay.trajectory.h[:, 0])
    np.testing.assert_array_equal(charts[3].curves[0].values, replay.trajectory.V)
    assert np.isnan(charts[0].curves[1].values[10:]).all()  # +inf: there is no contact to be far from


def test_the_clearance_is_the_judge_s(replay):
    motion = SceneMotion(replay.body.scenario.obstacles)
    expected = judged_curve(replay.body.robot, motion, replay.trajectory)
    np.testing.assert_allclose(clearance_curve(replay), expected, atol=1e-7)
    np.testing.assert_allclose(clearance_curve(replay, 15), expected[15:], atol=1e-7)


def test_without_v_there_is_no_chart_of_it(replay):
    run = replace(replay.trajectory, V=np.full(20, np.nan))
    assert len(charts_of(Replay(replay.body, run), clearance_curve(replay))) == 3


def test_many_obstacles_become_one_curve():
    from cdfctl.report.view.charts import _per_obstacle

    values = np.random.default_rng(0).normal(size=(6, MOST_CURVES + 1))
    values[3] = np.inf
    (curve,) = _per_obstacle(values, tuple(map(str, range(MOST_CURVES + 1))))
    np.testing.assert_array_equal(curve.values[:3], values[:3].min(axis=1))
    assert np.isnan(curve.values[3])


def test_the_cursor_and_the_numbers_follow_the_time(replay, charts):
    panel = ChartPanel(charts, replay.duration, np.array([0.5]))
    at = {t: [float(x) for x in re.findall(r'class="cursor" x1="([\d.]+)"', panel.html(t))] for t in (0.0, 1.0, 2.0)}
    assert all(len(set(xs)) == 1 for xs in at.values())  # one time for all charts
    assert at[1.0][0] == pytest.approx(0.5 * (at[0.0][0] + at[2.0][0]), abs=0.1)
    numbers = re.findall(r'class="value">([^<]*)<', panel.html(1.2))
    assert numbers[:2] == [f"{replay.trajectory.h[12, 0]:.3f}", "none"]


def test_names_are_text_and_nothing_is_loaded(charts):
    named = replace(charts[0], curves=(replace(charts[0].curves[0], name="<img src=x onerror=1>"),))
    drawn = ChartPanel([named], 2.0, np.zeros(0)).html(0.0)
    assert "<img" not in drawn
    assert "&lt;img" in drawn
    assert not re.search(r"https?:|url\(|src=\"", drawn)


def test_a_long_curve_keeps_its_extremes_and_its_gaps():
    count = 20 * MOST_POINTS
    values = np.sin(np.linspace(0.0, 40.0, count))
    values[[777, 9000]] = 5.0, -7.0
    values[12000:12100] = np.nan
    curve = Curve("h", "#000000", values)
    strokes = list(_strokes(np.arange(count, dtype=float), curve))
    assert len(strokes) <= MOST_POINTS
    assert {5.0, -7.0} <= {value for _, _, value in strokes}
    assert [pen for pen, _, _ in strokes].count("M") == 2


@pytest.mark.parametrize("values", [[0.0, 0.0], [3.0, 3.0], [np.nan, 1e-9], [1e6, -1e6], [np.nan, np.nan]])
def test_any_range_can_be_drawn(values):
    chart = Chart("h", "m", np.array([0.0, 1.0]), (Curve("a", "#000000", np.array(values)),), 0.0, "margin")
    assert "nan" not in ChartPanel([chart], 1.0, np.zeros(0)).html(0.5)
