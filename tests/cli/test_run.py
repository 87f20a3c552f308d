"""``cdfctl run``: outcomes, statuses, the document, the folder."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from cdfctl.errors import PlantError
from cdfctl.simulation.plants.kinematic import KinematicPlant
from cdfctl.simulation.rollout import Rollout

KEYS = {
    "scenario": str,
    "controller": str,
    "robot": str,
    "seed": int,
    "outcome": str,
    "success": bool,
    "time_to_reach_s": float | None,
    "steps": int,
    "path_length_m": float,
    "joint_path_rad": float,
    "min_clearance_m": float | None,
    "collision_time_s": float | None,
    "infeasible_steps": int,
    "step_ms": dict,
    "run_dir": str,
    "plant": dict,
    "min_self_clearance_m": float | None,
    "self_contact_time_s": float | None,
}
FILES = {"scenario.yaml", "result.json", "trajectory.npz"}
NEVER = "simulation.time_limit=0.2"


def arrays(folder: Path) -> dict[str, np.ndarray]:
    with np.load(folder / "trajectory.npz") as file:
        return {name: file[name] for name in file.files}


def test_a_run_that_reaches_is_0_with_a_summary_and_a_folder(cli, small: Path):
    result = cli("run", small.name)
    assert (result.status, result.err) == (0, "")
    assert "REACHED" in result.out
    assert "The disc is ours." in result.out
    assert max(map(len, result.out.splitlines())) <= 80
    folder = small.parent / "runs" / "small-sdf-tvcbf-qp-0-0"
    assert {path.name for path in folder.iterdir()} == FILES
    assert str(folder.relative_to(small.parent)) in result.out


def test_json_is_one_document_with_the_contract_s_keys(cli, small: Path):
    result = cli("run", small.name, "--json")
    document = result.document()
    assert (result.status, result.err) == (0, "")
    assert list(document) == list(KEYS)
    for key, kind in KEYS.items():
        assert isinstance(document[key], kind), key
    assert set(document["step_ms"]) == {"p50", "p99", "max"}
    assert document["success"] is True
    assert document["outcome"] == "reached"
    record = json.loads((small.parent / document["run_dir"] / "result.json").read_text())
    assert {key: record[key] for key in document} == document


def test_a_run_without_obstacles_has_no_clearance(cli, small: Path):
    result = cli("run", small.name, "--json", "--set", "obstacles=[]")
    assert result.status == 0
    assert result.document()["min_clearance_m"] is None


def test_quiet_says_nothing(cli, small: Path):
    result = cli("run", small.name, "--quiet")
    assert (result.status, result.out, result.err) == (0, "", "")


def test_not_reached_is_1(cli, small: Path):
    result = cli("run", small.name, "--set", NEVER, "--json")
    assert result.status == 1
    assert result.document()["outcome"] == "timeout"
    assert result.document()["time_to_reach_s"] is None


def test_a_collision_is_1_and_names_link_and_obstacle(cli, small: Path):
    """A ball that nothing can dodge: it passes over the base before the goal can be reached."""
    ball = ["--set", "obstacles[0].position=[6.0,0.5,0.0]", "--set", "obstacles[0].velocity=[-10.0,0.0,0.0]"]
    ball += ["--set", "obstacles[0].shape.radius=1.0"]
    shown = cli("run", small.name, *ball)
    assert shown.status == 1
    assert "COLLISION at" in shown.out
    assert "touches disc" in shown.out
    result = cli("run", small.name, *ball, "--json")
    document = result.document()
    assert result.status == 1
    assert document["outcome"] == "collision"
    assert document["min_clearance_m"] <= 1e-6
    assert 0.0 < document["collision_time_s"] < 0.6


def test_a_plant_that_fails_is_4_and_the_partial_run_is_kept(cli, small: Path, monkeypatch):
    steps = KinematicPlant.step

    def fail(self, state, u, dt):
        if state.t > 0.05:
            raise PlantError("the cable came loose")
        return steps(self, state, u, dt)

    monkeypatch.setattr(KinematicPlant, "step", fail)
    result = cli("run", small.name, "--json")
    assert result.status == 4
    assert "the cable came loose" in result.err
    assert result.document()["outcome"] == "error"
    assert len(arrays(small.parent / result.document()["run_dir"])["t"]) == 2


def test_an_interrupt_before_the_first_step_leaves_an_older_run_alone(cli, small: Path, monkeypatch):
    def interrupted(self):
        raise KeyboardInterrupt
        yield

    assert cli("run", small.name, "--quiet").status == 0
    monkeypatch.setattr(Rollout, "steps", interrupted)
    result = cli("run", small.name, "--json")
    assert (result.status, result.out) == (130, "")
    assert "nothing was written" in result.err
    folder = small.parent / "runs" / "small-sdf-tvcbf-qp-0-0"
    assert json.loads((folder / "result.json").read_text())["outcome"] == "reached"


def test_an_interrupt_after_some_steps_keeps_them(cli, small: Path, monkeypatch):
    steps = Rollout.steps

    def interrupted(self):
        for step in steps(self):
            yield step
            if step.index == 2:
                raise KeyboardInterrupt

    monkeypatch.setattr(Rollout, "steps", interrupted)
    result = cli("run", small.name, "--json")
    assert result.status == 130
    assert "interrupted after 3 steps" in result.err
    assert result.document()["steps"] == 3
    assert len(arrays(small.parent / result.document()["run_dir"])["u"]) == 3


def test_the_draw_depends_on_seed_and_trial_alone(cli, small: Path):
    def place(*options: object) -> float:
        document = cli("run", small.name, "--json", *options).document()
        return float(arrays(small.parent / document["run_dir"])["obstacle_pose"][0, 0, 1])

    first = place()
    assert place("--seed", 0, "--trial", 0) == first
    assert place("--controller", "sdf-cbf-qp") == first
    assert place("--seed", 1) != first
    assert place("--trial", 1) != first


def test_a_run_s_own_scenario_gives_the_same_run(cli, small: Path):
    first = small.parent / cli("run", small.name, "--json", "--trial", 3).document()["run_dir"]
    again = cli("run", f"{first}/scenario.yaml", "--json", "--out", "again")
    assert again.status == 0
    one, two = arrays(first), arrays(small.parent / "again")
    assert one.keys() == two.keys()
    for name in one.keys() - {"step_time"}:
        np.testing.assert_array_equal(one[name], two[name])


def test_a_rerun_replaces_its_own_folder(cli, small: Path):
    assert cli("run", small.name, "--out", "here").status == 0
    assert cli("run", small.name, "--out", "here", "--set", NEVER).status == 1
    assert json.loads((small.parent / "here" / "result.json").read_text())["outcome"] == "timeout"


def test_check_says_what_it_found_and_writes_nothing(cli, small: Path):
    result = cli("check", small.name)
    assert (result.status, result.err) == (0, "")
    assert result.out.startswith("small.yaml: valid: planar (2 joints), 1 obstacle, sdf-tvcbf-qp\n")
    assert cli("check", small.name, "--quiet").out == ""
    document = cli("check", small.name, "--json").document()
    assert document.pop("robot")["name"] == "planar"
    assert document == {"file": "small.yaml", "valid": True, "problems": []}
    assert list(small.parent.iterdir()) == [small]


@pytest.mark.parametrize("scenario", ["S1", "S2", "S3", "C1", "C2", "C3", "planar-1"])
def test_every_shipped_scenario_that_can_run_is_valid(cli, here: Path, scenario):
    assert cli("check", scenario).status == 0


def on_terminal(
    arguments: list[str], folder: Path, stream: str, interrupt_at: bytes | None = None, **environment: str
) -> tuple[int, bytes, bytes]:
    """Status of ``cdfctl``, what the terminal behind ``stream`` showed, and what the other stream got.

    Where the terminal has shown ``interrupt_at``, the process is interrupted, as by Ctrl-C.
    """
    leader, follower = pty.openpty()
    other = "stderr" if stream == "stdout" else "stdout"
    with subprocess.Popen(
        [sys.executable, "-m", "cdfctl", *arguments],
        cwd=folder,
        env={**os.environ, "TERM": "xterm-256color", **environment},
        stdin=subprocess.DEVNULL,
        **{stream: follower, other: subprocess.PIPE},
    ) as child:
        os.close(follower)
        shown = b""
        # Linux ends a terminal whose other end is closed with an error, others with nothing.
        with suppress(OSError):
            while part := os.read(leader, 65536):
                shown += part
                if interrupt_at is not None and interrupt_at in shown:
                    child.send_signal(signal.SIGINT)
                    interrupt_at = None
        os.close(leader)
        rest = getattr(child, other).read()
    return child.returncode, shown, rest


def test_ctrl_c_keeps_the_steps_and_is_130_without_a_traceback(small: Path):
    slow = ["--set", "simulation.dt=0.0001", "--set", "simulation.time_limit=60.0", "--set", "controller.gain=0.0001"]
    status, shown, out = on_terminal(
        ["run", small.name, *slow, "--json"], small.parent, "stderr", interrupt_at=b"of at most"
    )
    assert status == 130
    assert b"Traceback" not in shown
    assert b"interrupted after" in shown
    document = json.loads(out)
    assert document["steps"] > 0
    assert document["success"] is False


@pytest.mark.parametrize("quiet", [False, True])
def test_a_progress_bar_appears_on_a_terminal_only_and_never_on_standard_output(small: Path, quiet):
    arguments = ["run", small.name, "--json", *(["--quiet"] if quiet else [])]
    status, shown, out = on_terminal(arguments, small.parent, "stderr")
    assert status == 0
    assert json.loads(out)["success"] is True
    assert (shown == b"") == quiet


@pytest.mark.parametrize("colour", [False, True])
def test_no_color_is_honoured_on_a_terminal(small: Path, colour):
    environment = {} if colour else {"NO_COLOR": "1"}
    status, shown, err = on_terminal(["run", small.name], small.parent, "stdout", **environment)
    assert (status, err) == (0, b"")
    assert b"REACHED" in shown
    assert (re.search(rb"\x1b\[[0-9;]*3[0-9]m", shown) is not None) == colour
