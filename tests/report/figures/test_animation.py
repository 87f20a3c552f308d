"""Films: real time, the same bytes every time, and what is said where a film cannot be made."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from cdfctl.errors import InputError, MissingError
from cdfctl.report.figures import animation
from cdfctl.report.figures.animation import animate, at_time, frame_times


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Small pictures, and few."""
    monkeypatch.setattr(animation, "SIZE", (8.0, 4.3))
    monkeypatch.setattr(animation, "DPI", 63.5)
    monkeypatch.setattr(animation, "HOLD", 0.1)


def test_the_pictures_are_in_real_time(small_run):
    times = frame_times(small_run, 25)
    end = small_run.t[-1]
    moving = times[: int(np.argmax(times == end)) + 1]
    np.testing.assert_allclose(np.diff(moving[:-1]), 0.04)
    assert np.diff(moving)[-1] <= 0.04 + 1e-9
    assert moving[0] == 0.0
    assert len(times) - len(moving) == round(0.1 * 25)


def test_between_steps_the_state_is_interpolated(small_run):
    t, arrays = small_run.t, small_run.trajectory
    for at in (0.0, 0.03, float(t[3]), 0.37, float(t[-1])):
        now = at_time(small_run, at).trajectory
        expected = [np.interp(at, t, arrays.q[:, i]) for i in range(2)]
        np.testing.assert_allclose(now.q[-1], expected, atol=1e-12)
        np.testing.assert_allclose(now.obstacle_pose[-1, 0, 1], np.interp(at, t, arrays.obstacle_pose[:, 0, 1]))
        assert now.t[-1] == at


def test_a_gif_is_the_same_every_time(tmp_path, small_run):
    short = small_run.until(3)
    for name in ("a.gif", "b.gif"):
        count = animate(short, ("sdf",), tmp_path / name, points=9)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    with Image.open(tmp_path / "a.gif") as film:
        assert 3 <= film.n_frames <= count, "pictures that do not differ are one"
        assert film.info["duration"] == 100
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gif", "b.gif"]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg here")
def test_an_mp4_is_the_same_every_time(tmp_path, small_run):
    short = small_run.until(2)
    for name in ("a.mp4", "b.mp4"):
        count = animate(short, ("cdf",), tmp_path / name, points=9)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    if shutil.which("ffprobe"):
        asked = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,codec_name",
                 "-of", "csv=p=0", str(tmp_path / "a.mp4")]  # fmt: skip
        assert subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip() == f"h264,{count}"


def test_without_ffmpeg_an_mp4_is_refused_and_a_gif_is_named(tmp_path, small_run, monkeypatch):
    monkeypatch.setattr(animation.shutil, "which", lambda name: None)
    with pytest.raises(MissingError, match="needs ffmpeg") as caught:
        animate(small_run, ("sdf",), tmp_path / "a.mp4")
    assert "--out FILE.gif" in caught.value.hint


def test_what_cannot_be_animated_is_refused(tmp_path, small_run):
    with pytest.raises(InputError, match="without a step"):
        animate(small_run.until(0), ("sdf",), tmp_path / "a.gif")
    other = replace(small_run)
    object.__setattr__(other, "in_plane", False)
    with pytest.raises(InputError, match="planar arms of two joints"):
        animate(other, ("sdf",), tmp_path / "a.gif")
    assert not list(tmp_path.iterdir())
