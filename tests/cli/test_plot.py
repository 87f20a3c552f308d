"""``plot``: figures of runs, of benchmarks and by name, into files by suffix or a folder."""

from __future__ import annotations

import shutil
import sys

import pytest

from cdfctl.report.figures import animation, joint_space, levels

from .helpers import files_below


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """The same figures on a coarse grid."""
    monkeypatch.setattr(levels, "POINTS", 9)
    monkeypatch.setattr(joint_space, "POINTS", (9, 9))
    monkeypatch.setattr(animation, "POINTS", 9)
    monkeypatch.setattr(animation, "HOLD", 0.1)
    monkeypatch.setattr(animation, "SIZE", (8.0, 4.3))
    monkeypatch.setattr(animation, "RATE", {".mp4": 2, ".gif": 2})


@pytest.fixture
def run(cli, here, small):
    """A run folder of two seconds."""
    assert cli("run", "small.yaml", "--out", "run", "--quiet").status == 0
    small.unlink()
    return here / "run"


def test_a_figure_goes_into_the_current_folder(cli, here):
    result = cli("plot", "--figure", "levels")
    assert (result.status, result.out, result.err) == (0, "", "wrote levels.png\n")
    assert (here / "levels.png").read_bytes().startswith(b"\x89PNG")


def test_the_suffix_says_how(cli, here):
    result = cli("plot", "--figure", "levels", "--out", "a.svg", "--json")
    assert result.document() == {"source": None, "figures": [{"figure": "levels", "file": "a.svg"}]}
    assert "<svg" in (here / "a.svg").read_text()


def test_a_run_gets_its_figures_in_a_folder_of_its_own(cli, run):
    result = cli("plot", "run", "--format", "svg")
    names = ("task-space", "joint-space", "time")
    assert (result.status, result.out) == (0, "")
    assert result.err.splitlines() == [f"wrote run/figures/{name}.svg" for name in names]
    assert all("<svg" in (run / "figures" / f"{name}.svg").read_text() for name in names)
    again = cli("plot", "run", "--figure", "time", "--at", "0.5", "--quiet")
    assert (again.status, again.out, again.err) == (0, "", "")
    assert (run / "figures" / "time.png").exists()
    late = cli("plot", "run", "--at", "99")
    assert (late.status, late.err.startswith("cdfctl: error: --at 99 is after the end of the run, ")) == (2, True)


def test_one_file_gets_them_all(cli, here, run):
    result = cli("plot", "run", "--out", "all.pdf", "--field", "both", "--at", "0", "--at", "0.4", "--json")
    assert result.document() == {"source": "run", "figures": [{"figure": "overview", "file": "all.pdf"}]}
    assert (here / "all.pdf").read_bytes().startswith(b"%PDF")
    assert not (run / "figures").exists()
    assert cli("plot", "run", "--figure", "time", "--out", "new/folder").status == 0
    assert (here / "new" / "folder" / "time.png").exists()


def test_a_run_is_animated(cli, here, run, monkeypatch):
    assert cli("plot", "run", "--animate", "--out", "a.gif").err == "wrote a.gif\n"
    assert (here / "a.gif").read_bytes().startswith(b"GIF8")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    result = cli("plot", "run", "--animate")
    assert result.err.splitlines() == ["ffmpeg is not installed: a GIF instead of an MP4", "wrote run/figures/film.gif"]
    refused = cli("plot", "run", "--animate", "--out", "a.mp4")
    assert refused.status == 3
    assert "install ffmpeg" in refused.err


def test_a_benchmark_is_drawn(cli, here, small):
    arguments = ("--scenario", "small.yaml", "--trials", "2", "--jobs", "1", "--out", "store", "--quiet")
    assert cli("bench", *arguments).status == 0
    result = cli("plot", "store", "--json")
    names = ["success", "time", "path", "clearance"]
    assert [figure["figure"] for figure in result.document()["figures"]] == names
    assert all((here / "store" / "figures" / f"{name}.png").exists() for name in names)
    assert "are for runs" in cli("plot", "store", "--at", "1").err
    assert "unknown figure of a benchmark 'joint-space'" in cli("plot", "store", "--figure", "joint-space").err
    # It goes on as a store: what was drawn does not disturb it.
    assert cli("bench", *arguments).status == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--figure", "level"), "did you mean levels?"),
        (("--figure", "levels", "--out", "a.gif"), ".png, .svg, .pdf"),
        (("--figure", "levels", "--out", "no/a.png"), "no such folder: no"),
        (("--figure", "levels", "--out", "a.png", "--format", "svg"), "say different things"),
        (("--animate",), "--animate is for a run"),
        (("nowhere",), "nowhere: no such folder"),
        ((".",), ".: not a run folder"),
        ((), "--figure: levels, avoidance, reaching"),
    ],
)
def test_bad_input_writes_nothing(cli, here, arguments, words):
    result = cli("plot", *arguments)
    assert result.status == 2
    assert words in result.err
    assert len(result.err.splitlines()) <= 2
    assert not list(here.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--figure", "success"), "allowed: task-space, joint-space, time, overview"),
        (("--animate", "--out", "a.png"), ".mp4, .gif"),
        (("--out", "run/result.json"), "cannot write a figure as"),
        (("--out", "here"), "here is a file, not a folder"),
    ],
)
def test_bad_options_of_a_run_write_nothing(cli, here, run, arguments, words):
    (here / "here").touch()
    before = files_below(here)
    result = cli("plot", "run", *arguments)
    assert result.status == 2
    assert words in result.err
    assert files_below(here) == before


def test_links_in_a_run_lead_nothing_astray(cli, here, run):
    """A run folder may be a stranger's: figures go into it, and into no other place."""
    theirs = here / "theirs"
    theirs.mkdir()
    (theirs / "file").write_text("precious")
    (run / "figures").mkdir(exist_ok=True)
    (run / "figures" / ".time.png.new").symlink_to(theirs / "file")
    assert cli("plot", run, "--figure", "time", "--dpi", "50").status == 0
    assert (theirs / "file").read_text() == "precious"
    shutil.rmtree(run / "figures")
    (run / "figures").symlink_to(theirs)
    result = cli("plot", run, "--figure", "time", "--dpi", "50")
    assert result.status == 2
    assert "is a symbolic link" in result.err
    assert [path.name for path in theirs.iterdir()] == ["file"]
    (run / "figures").unlink()


def test_a_damaged_run_is_one_line(cli, here, run):
    (run / "trajectory.npz").write_bytes((run / "trajectory.npz").read_bytes()[:500])
    result = cli("plot", "run")
    assert result.status == 2
    assert result.err.startswith("cdfctl: error: run/trajectory.npz: damaged")
    assert not (run / "figures").exists()


def test_a_missing_package_is_status_3_with_the_command(cli, here, run, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    for arguments in (("--figure", "levels"), ("run",), ("run", "--animate")):
        result = cli("plot", *arguments)
        assert result.status == 3
        assert "python -m pip install 'cdfctl[plot]'" in result.err
