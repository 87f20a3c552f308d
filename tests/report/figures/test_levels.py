"""The levels figure: configurations along a level, and four panels with units."""

from __future__ import annotations

import numpy as np

from cdfctl.report.figures.field_map import FieldMap
from cdfctl.report.figures.levels import along_level, levels
from cdfctl.report.figures.part import figure_of


def test_configurations_along_a_level_are_on_it():
    q = np.linspace(-np.pi, np.pi, 201)
    x, y = np.meshgrid(q, q)
    chosen = along_level(FieldMap("rad", q, q, np.hypot(x, y), np.zeros((201, 201, 2))), 1.5, 5)
    np.testing.assert_allclose(np.linalg.norm(chosen, axis=1), 1.5, atol=1e-3)
    steps = np.linalg.norm(np.diff(chosen, axis=0), axis=1)
    np.testing.assert_allclose(steps, 2.0 * 1.5 * np.sin(np.pi / 5), rtol=1e-2)


def test_the_levels_have_four_panels_with_units():
    figure = figure_of([levels(points=13)])
    panels = [axes for axes in figure.axes if axes.get_title()]
    labels = sorted((axes.get_xlabel(), axes.get_ylabel()) for axes in panels)
    assert labels == [("joint 1 [rad]", "joint 2 [rad]")] * 2 + [("x [m]", "y [m]")] * 2
    bars = [axes.get_ylabel() for axes in figure.axes if not axes.get_title()]
    assert sorted(bars) == ["distance [m], a line every 0.25 m", "distance [rad], a line every 0.5 rad"]
