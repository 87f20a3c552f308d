"""Bad input: one message a problem, the right status, no traceback, and nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest

from .helpers import PLANAR, files_below


def variant(old: str, new: str) -> str:
    """The small scenario with one thing changed."""
    assert old in PLANAR
    return PLANAR.replace(old, new, 1)


START, GOAL, RADIUS = "q0: [0.5, 0.5]", "goal: [2.5, 0.4]", "radius: 0.3"
PLACE = "position: [-3.0, {uniform: [-3.0, -2.0]}, 0.0]"
BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)

FILES = {
    "NaN": (variant(START, "q0: [.nan, 0.5]"), "robot.q0[0]"),
    "infinity": (variant(START, "q0: [0.5, .inf]"), "robot.q0[1]"),
    "infinite limit": (variant("time_limit: 5.0", "time_limit: .inf"), "simulation.time_limit"),
    "text for a number": (variant("gain: 9.9", 'gain: "9.9"'), "controller.gain"),
    "yes for a number": (variant("gain: 9.9", "gain: true"), "controller.gain"),
    "leading zero": (variant("time_limit: 5.0", "time_limit: 010"), "simulation.time_limit"),
    "wrong length": (variant(START, "q0: [0.5, 0.5, 0.5]"), "joint"),
    "wrong length of a position": (variant(PLACE, "position: [3.0, 2.0]"), "obstacles[0].position"),
    "negative radius": (variant(RADIUS, "radius: -0.3"), "radius"),
    "negative step": (variant("dt: 0.1", "dt: -0.1"), "simulation.dt"),
    "unknown key": (variant("velocity:", "velocty:"), "did you mean velocity?"),
    "duplicate key": (PLANAR + "name: again\n", "duplicate key 'name'"),
    "missing key": (variant("task:\n  type: joint-goal\n  goal: [2.5, 0.4]\n", ""), "task"),
    "unknown robot": (variant("name: planar", "name: plannar"), "planar"),
    "unknown controller": (variant("sdf-tvcbf-qp", "sdf-tvcbf-pq"), "sdf-tvcbf-qp"),
    "unknown solver": (variant("gain: 9.9", "gain: 9.9, solver: dapq"), "daqp"),
    "newer version": (variant("version: 1", "version: 2"), "newer"),
    "goal outside limits": (variant(GOAL, "goal: [3.5, 0.4]"), "limits"),
    "degrees": (variant(GOAL, "goal: [90.0, 0.4]"), "radians"),
    "start in contact": (variant(PLACE, "position: [2.0, 1.0, 0.0]"), "contact"),
    "missing mesh": (variant("{type: ball, radius: 0.3}", "{type: mesh, file: none.stl}"), "none.stl"),
    "missing URDF": (variant("name: planar", "urdf: none.urdf"), "none.urdf"),
    "not YAML": ("robot: [", "not valid YAML"),
    "a tag": (variant("name: small", "name: !!python/object:os.system small"), "tags"),
    "empty": ("", "empty"),
    "a list": ("- 1\n", "mapping"),
    "bomb of aliases": (BOMB, "aliases"),
}


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize("case", list(FILES))
def test_a_bad_file_is_refused(cli, here: Path, command, case):
    text, expected = FILES[case]
    (here / "mine.yaml").write_text(text)
    before = files_below(here)
    result = cli(command, "mine.yaml")
    assert (result.status, result.out) == (2, "")
    assert expected in result.err
    assert result.err.startswith("mine.yaml")
    assert "nothing was run" in result.err
    assert "Traceback" not in result.err
    assert "pydantic" not in result.err
    assert files_below(here) == before


def test_all_problems_are_told_at_once(cli, here: Path):
    (here / "mine.yaml").write_text(variant(RADIUS, "radius: -0.3").replace("velocity:", "velocty:"))
    result = cli("check", "mine.yaml")
    assert result.err.count(": error: ") == 2
    assert "2 problems in mine.yaml" in result.err


def test_check_json_lists_the_problems(cli, here: Path):
    (here / "mine.yaml").write_text(variant("velocity:", "velocty:"))
    result = cli("check", "mine.yaml", "--json")
    assert result.status == 2
    document = result.document()
    assert document["valid"] is False
    (problem,) = document["problems"]
    assert problem["field"] == "obstacles[0].velocty"
    assert problem["line"] == 13
    assert "velocity" in problem["hint"]


def test_a_big_file_is_refused_quickly(cli, here: Path):
    (here / "big.yaml").write_text("a: [" + "x, " * 17_000_000 + "]\n")
    result = cli("check", "big.yaml")
    assert result.status == 2
    assert "too large" in result.err


def test_bytes_that_are_no_text_are_refused(cli, here: Path):
    (here / "mine.yaml").write_bytes(b"name: \xff\xfe\n")
    result = cli("check", "mine.yaml")
    assert result.status == 2
    assert "UTF-8" in result.err


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("C11", "did you mean C1?"),
        ("none.yaml", "no such file"),
        ("./none", "no such file"),
        ("folder.yaml", "directory"),
        ("", "scenario"),
    ],
)
def test_a_scenario_that_is_no_readable_file_is_refused(cli, here: Path, argument, expected):
    (here / "folder.yaml").mkdir()
    before = files_below(here)
    result = cli("run", argument)
    assert (result.status, result.out) == (2, "")
    assert expected in result.err
    assert "Traceback" not in result.err
    assert files_below(here) == before


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--controller", "sdf-tvcbf-pq"], "did you mean sdf-tvcbf-qp?"),
        (["--set", "controller.alpha"], "FIELD=VALUE"),
        (["--set", "controller.alpha="], "missing"),
        (["--set", "controller.alpah=1"], "did you mean"),
        (["--set", "controller.alpha=one"], "controller.alpha"),
        (["--set", "controller.alpha=-1"], "controller.alpha"),
        (["--set", "obstacles[7].velocity=[0,0,0]"], "obstacles"),
        (["--set", "=1"], "path"),
        (["--set", "robot.q0=[.nan,0]"], "robot.q0[0]"),
        (["--seed", "99999999999999999999"], "seed"),
    ],
)
def test_a_bad_override_is_refused_under_its_own_name(cli, small: Path, arguments, expected):
    before = files_below(small.parent)
    result = cli("run", small.name, *arguments)
    assert (result.status, result.out) == (2, "")
    assert expected in result.err
    assert arguments[0] in result.err
    assert "Traceback" not in result.err
    assert files_below(small.parent) == before


def test_a_task_that_a_controller_cannot_do_names_what_it_can(cli, here: Path):
    result = cli("run", "reach", "--controller", "sdf-tvcbf-qp")
    assert (result.status, result.out) == (2, "")
    assert "joint-goal" in result.err
    assert list(here.iterdir()) == []


def test_an_output_folder_that_cannot_be_made_is_refused_before_the_run(cli, small: Path):
    (small.parent / "file").write_text("")
    before = files_below(small.parent)
    for out in ("file", "file/below", "file/far/below", "/proc/cdfctl/run"):
        result = cli("run", small.name, "--out", out)
        assert (result.status, result.out) == (2, ""), out
        assert "Traceback" not in result.err
        assert files_below(small.parent) == before


def test_a_folder_that_is_not_ours_is_left_alone(cli, small: Path):
    folder = small.parent / "precious"
    folder.mkdir()
    (folder / "thesis.tex").write_text("x")
    result = cli("run", small.name, "--out", folder)
    assert result.status == 2
    assert "not empty" in result.err
    assert [path.name for path in folder.iterdir()] == ["thesis.tex"]
