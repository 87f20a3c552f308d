"""Files of figures: the same every time, whole or not at all, refused before the work."""

from __future__ import annotations

import sys

import matplotlib
import pytest

from cdfctl.errors import InputError, MissingError
from cdfctl.report.figures import style
from cdfctl.report.figures.joint_space import joint_space
from cdfctl.report.figures.output import SUFFIXES, check_output, save_figure
from cdfctl.report.figures.part import figure_of
from cdfctl.report.figures.task_space import task_space
from cdfctl.report.figures.time_course import time_course


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_figure_is_the_same_every_time(tmp_path, full_run, suffix, monkeypatch):
    part = joint_space(full_run, ("cdf",), [0], points=9) if suffix == ".svg" else task_space(full_run)
    for name in ("a", "b"):
        save_figure(figure_of([part]), tmp_path / f"{name}{suffix}", dpi=50)
        # What a user has set must not matter.
        monkeypatch.setitem(matplotlib.rcParams, "font.size", 20.0)
        monkeypatch.setitem(matplotlib.rcParams, "svg.hashsalt", "another")
    data = (tmp_path / f"a{suffix}").read_bytes()
    assert data == (tmp_path / f"b{suffix}").read_bytes()
    assert b"dc:date" not in data
    assert b"CreationDate" not in data
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"a{suffix}", f"b{suffix}"]


def test_what_cannot_be_written_is_said_before_the_work(tmp_path):
    for name, message in (("a.gif", "cannot write a figure as"), ("a", "cannot"), ("no/a.png", "no such folder")):
        with pytest.raises(InputError, match=message):
            check_output(tmp_path / name)
    (tmp_path / "b.png").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        check_output(tmp_path / "b.png")


def test_a_failed_write_leaves_the_old_file(tmp_path, full_run, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    figure = figure_of([time_course(full_run)])

    def full(draft, **_):
        draft.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", full)
    with pytest.raises(InputError, match=r"cannot write .*a\.png: No space left"):
        save_figure(figure, path)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_without_matplotlib_the_command_that_installs_it_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingError, match="matplotlib") as caught:
        check_output(tmp_path / "a.png")
    assert caught.value.hint == style.INSTALL
