"""What surrounds a command may be as it likes: closed streams, a full one, no terminal, no folder, no home."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import cdfctl
from cdfctl.benchmark.store import folder_name
from cdfctl.cli.main import main
from cdfctl.errors import CdfctlError
from cdfctl.robots.robot_file import DATA
from cdfctl.types import TrialKey

CDFCTL = f"{sys.executable} -m cdfctl"


def shell(line: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """``line`` run by sh in ``folder``, with ``cdfctl`` meaning this one."""
    line = line.replace("cdfctl", CDFCTL)
    everything = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **environment}
    return subprocess.run(["sh", "-c", line], cwd=folder, env=everything, capture_output=True, text=True, check=False)


def test_closed_streams_are_as_good_as_the_null_device(tmp_path: Path) -> None:
    """With standard error closed, errors went among the results; with standard output closed, all was a bug."""
    assert (shell("cdfctl schema >&-", tmp_path).returncode, shell("cdfctl scenarios >&-", tmp_path).stderr) == (0, "")
    wrong = shell("cdfctl check nope 2>&-", tmp_path)
    assert (wrong.returncode, wrong.stdout) == (2, "")
    out = tmp_path / "run"
    line = f"cdfctl run planar-1 --set simulation.time_limit=0.1 --json --out {out}"
    assert json.loads(shell(f"{line} 2>&-", tmp_path).stdout)["outcome"] == "timeout"
    none = shell(f"{line} <&- >&- 2>&-", tmp_path)
    assert (none.returncode, none.stdout, none.stderr) == (1, "", "")
    # A file that became the standard stream would hold what is printed.
    assert "cdfctl" not in (out / "scenario.yaml").read_text(encoding="utf-8")
    assert json.loads((out / "result.json").read_text(encoding="utf-8"))["outcome"] == "timeout"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
def test_notes_that_nobody_takes_change_no_status(tmp_path: Path) -> None:
    assert shell("cdfctl check nope 2>/dev/full", tmp_path).returncode == 2
    # Nor where its reader has gone: the status is that of cdfctl, the pipe's other end has none.
    line = "{ cdfctl check nope; echo $? > status; } 2>&1 | true; cat status"
    assert shell(line, tmp_path).stdout == "2\n"


@pytest.mark.parametrize("columns", ["0", "1", "99999999999", "-5", "x"])
def test_a_width_that_is_none_is_taken_for_a_usual_one(
    columns: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert main(["scenarios"]) == 0
    lines = capfd.readouterr().out.splitlines()
    assert len(lines) > 10
    assert 40 < max(map(len, lines)) <= 81


def test_a_folder_that_is_gone_and_a_home_that_never_was_are_said(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    answer = shell("rmdir ../gone; cdfctl check S1", gone)
    assert (answer.returncode, "current folder" in answer.stderr) == (2, True)
    answer = shell("cdfctl check S1", tmp_path, CDFCTL_CACHE="~nobody-of-this-name/x")
    assert (answer.returncode, "CDFCTL_CACHE" in answer.stderr) == (2, True)


@pytest.mark.parametrize(
    "words", [["plot", "x\033[31m"], ["check", "x\033.yaml"], ["\u202e"], ["build-cdf", "x\033.urdf"]]
)
def test_names_do_not_steer_the_terminal(words: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert all(c.isprintable() or c == "\n" for c in capfd.readouterr().err)


LONG = "x" * 300


@pytest.mark.parametrize(
    "words",
    [
        ["run", "planar-1", "--out", LONG],
        ["run", "planar-1", "--out", "loop/x"],
        ["run", "planar-1", "--out", "\udcff"],
        ["plot", LONG],
        ["view", LONG, "--live"],
        ["build-cdf", f"{LONG}.urdf"],
        ["check", "planar-1", "--set", f"obstacles[{'9' * 5000}].velocity=[0,0,0]"],
        ["check", "planar-1", "--set", "\udcff=1"],
        ["bench", "--scenario", "planar-1", "--trials", "1000000000"],
    ],
)
def test_names_and_numbers_that_are_none_are_said(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("pool")
    Path("pool").symlink_to("loop")
    assert main(words) == 2
    assert "error: " in capfd.readouterr().err


def test_a_robots_name_stays_in_the_folder_of_its_table(tmp_path: Path) -> None:
    """The table of a robot called ../../x was written above the cache."""
    path = tmp_path / "arm.yaml"
    path.write_text((DATA / "planar.yaml").read_text(encoding="utf-8").replace("name: planar", "name: ../../x"))
    with pytest.raises(CdfctlError, match="robot's name"):
        cdfctl.load_robot(path)


def test_what_a_sweep_sets_makes_no_folders_name_too_long() -> None:
    names = {folder_name(TrialKey(f"S1[description={'ü' * 300}{i}]", "c", "brake", 0, 0)) for i in range(2)}
    assert len(names) == 2
    assert max(len(name.encode()) for name in names) < 200


def test_a_bench_that_is_told_to_end_takes_its_workers_along(tmp_path: Path) -> None:
    """Merely killed, it left them waiting for work for five minutes."""
    words = ["bench", "--scenario", "planar-1", "--trials", "5000", "--jobs", "2", "--quiet", "--out", "store"]
    bench = subprocess.Popen(
        [sys.executable, "-m", "cdfctl", *words],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    trials = tmp_path / "store" / "trials.jsonl"
    while not trials.exists() and bench.poll() is None:
        time.sleep(0.05)
    bench.send_signal(signal.SIGTERM)
    # It ends when nobody has the stream open any more: the workers have it from their parent.
    said = bench.communicate(timeout=120)[1]
    assert (bench.returncode, "the same command goes on from there" in said) == (130, True)
