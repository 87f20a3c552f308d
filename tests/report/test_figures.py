"""Figures: the levels they show, and files that are the same every time."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from cdfctl.errors import InputError, MissingError
from cdfctl.fields.cdf import CDF
from cdfctl.fields.sdf import SDF
from cdfctl.report import figures
from cdfctl.report.figures import check_output, new_figure, save_figure
from cdfctl.report.figures_levels import DISC, RADIUS, Levels, along_level, levels_figure, sample
from cdfctl.robots.robot import load_robot
from cdfctl.types import Obstacle, Scene, Sphere

POINTS = 25


@pytest.fixture(scope="module")
def scene():
    return Scene([Obstacle(Sphere(RADIUS), position=[*DISC, 0.0])])


@pytest.fixture(scope="module")
def planar():
    return load_robot("planar")


def signed_distance(q1, q2):
    """Of two segments of 2 m and the disc, in closed form."""
    elbow = 2.0 * np.stack([np.cos(q1), np.sin(q1)], axis=-1)
    tip = elbow + 2.0 * np.stack([np.cos(q1 + q2), np.sin(q1 + q2)], axis=-1)
    least = np.inf
    for start, end in ((np.zeros_like(elbow), elbow), (elbow, tip)):
        along = np.clip(((DISC - start) * (end - start)).sum(-1) / 4.0, 0.0, 1.0)[..., None]
        least = np.minimum(least, np.linalg.norm(DISC - start - along * (end - start), axis=-1))
    return least - RADIUS


def test_the_signed_distance_is_sampled_in_its_place(planar, scene):
    levels = sample(SDF(planar), scene, POINTS)
    np.testing.assert_allclose(levels.d, signed_distance(*np.meshgrid(levels.q, levels.q)), atol=1e-6)
    assert (np.linalg.norm(levels.dq, axis=2) < 1e-6).mean() > 0.1, "it has flat regions"


def test_the_configuration_space_distance_is_that_to_the_zero_set(planar, scene):
    """The truth by brute force: the nearest sign change of the closed form on a fine grid."""
    levels = sample(CDF(planar), scene, POINTS)
    fine = np.linspace(-np.pi, np.pi, 1001)
    q1, q2 = np.meshgrid(fine, fine)
    inside = signed_distance(q1, q2) < 0.0
    edge = np.zeros_like(inside)
    edge[:, 1:] |= inside[:, 1:] != inside[:, :-1]
    edge[1:, :] |= inside[1:, :] != inside[:-1, :]
    contacts = np.stack([q1[edge], q2[edge]], axis=1)
    x, y = np.meshgrid(levels.q, levels.q)
    truth = np.array([np.linalg.norm(contacts - q, axis=1).min() for q in np.stack([x.ravel(), y.ravel()], axis=1)])
    truth = truth.reshape(POINTS, POINTS) * np.where(signed_distance(x, y) < 0.0, -1.0, 1.0)
    # The search may miss the nearest contact of a point here and there; the grid of the truth is 0.006 rad wide.
    assert np.mean(np.abs(levels.d - truth) < 0.02) >= 0.99
    assert np.max(np.abs(levels.d - truth)) < 0.1
    assert np.mean(np.abs(levels.d - truth) < 0.01) > 0.97
    np.testing.assert_allclose(np.linalg.norm(levels.dq, axis=2), 1.0, atol=1e-6)


def test_configurations_along_a_level_are_on_it():
    q = np.linspace(-np.pi, np.pi, 201)
    x, y = np.meshgrid(q, q)
    chosen = along_level(Levels("rad", q, np.hypot(x, y), np.zeros((201, 201, 2))), 1.5, 5)
    np.testing.assert_allclose(np.linalg.norm(chosen, axis=1), 1.5, atol=1e-3)
    steps = np.linalg.norm(np.diff(chosen, axis=0), axis=1)
    np.testing.assert_allclose(steps, 2.0 * 1.5 * np.sin(np.pi / 5), rtol=1e-2)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_figure_is_the_same_every_time(tmp_path, suffix):
    for name in ("a", "b"):
        figure = new_figure(2.0, 2.0)
        figure.subplots().plot([0.0, 1.0], label="line")
        save_figure(figure, tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_the_levels_have_four_panels_with_units():
    figure = levels_figure(points=13)
    panels = [axes for axes in figure.axes if axes.get_title()]
    assert [axes.get_xlabel() for axes in panels] == ["joint 1 [rad]"] * 2 + ["x [m]"] * 2
    assert [axes.get_ylabel() for axes in panels] == ["joint 2 [rad]"] * 2 + ["y [m]"] * 2
    bars = [axes.get_ylabel() for axes in figure.axes if not axes.get_title()]
    assert bars == ["distance [rad], a line every 0.5 rad", "distance [m], a line every 0.25 m"]


def test_what_cannot_be_written_is_said_before_the_work(tmp_path):
    for name, message in (("a.gif", "cannot write a figure as"), ("a", "cannot"), ("no/a.png", "no such folder")):
        with pytest.raises(InputError, match=message):
            check_output(tmp_path / name)
    (tmp_path / "b.png").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        check_output(tmp_path / "b.png")


def test_without_matplotlib_the_command_that_installs_it_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingError, match="matplotlib") as caught:
        check_output(tmp_path / "a.png")
    assert caught.value.hint == figures.INSTALL
