"""Robot files."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from cdfctl.errors import InputError, MissingError
from cdfctl.robots.robot import load_robot
from cdfctl.robots.robot_file import DATA, read_robot_file, shipped_names, shipped_robots

MINIMAL = """version: 1
name: mine
description: an arm
source: ours
licence: none
urdf: arm.urdf
"""


@pytest.fixture
def arm(write_urdf, xml):
    return write_urdf(
        *(xml.link(name) for name in ("base", "l1", "l2", "f1", "f2")),
        xml.joint("j1", "base", "l1"),
        xml.joint("j2", "l1", "l2"),
        xml.joint("g1", "l2", "f1", "prismatic"),
        xml.joint("g2", "l2", "f2", "prismatic"),
    )


def write(arm, text: str):
    path = arm.parent / "mine.yaml"
    path.write_text(MINIMAL + text)
    return path


def test_every_shipped_robot_is_described_and_called_as_its_file():
    robots = shipped_robots()
    assert [robot.name for robot in robots] == list(shipped_names())
    assert {"planar", "franka", "ur5", "ur10", "xarm7", "kinova", "z1"} <= set(shipped_names())
    for robot in robots:
        assert robot.description
        assert read_robot_file(DATA / f"{robot.name}.yaml").licence


def test_the_list_of_robots_is_cheap():
    code = "import sys; from cdfctl.robots.robot import shipped_robots; shipped_robots(); print(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"pinocchio", "coal", "scipy", "numba", "torch"} & set(result.stdout.split())


def test_a_robot_file_of_ones_own(arm):
    text = "lock: {g1: 0.5, g2: -5e-1}\nmerge: {fingers: [f1, f2]}\nhome: [0.5, 0]\ntip: f2\n"
    text += "position_limits: {j1: [-0.5, 1]}\nvelocity_limits: {j2: 1e-1}\nnotes: [a fact]\n"
    robot = load_robot(write(arm, text))
    assert robot.name == "mine"
    assert robot.links == ("l1", "l2", "fingers")
    assert robot.base_links == ("base",)
    assert robot.geometry_links == ("base", "l1", "l2", "fingers")
    assert robot.home.tolist() == [0.5, 0.0]
    assert robot.lower.tolist() == [-0.5, -1.0]
    assert robot.velocity_limit.tolist() == [2.0, 0.1]
    assert robot.tip == "f2"
    assert robot.notes == (
        "g1 locked at 0.5 m",
        "g2 locked at -0.5 m",
        "f1, f2 merged into one hull, 'fingers'",
        "a fact",
    )
    fingers = robot.pieces[-1]
    assert fingers.joint == 1
    assert fingers.vertices.shape == (8, 3)  # two boxes of 0.4 m that have slid apart by 1 m along their length
    spans = np.linalg.norm(fingers.vertices[:, None] - fingers.vertices[None], axis=2)
    assert spans.max() == pytest.approx(np.linalg.norm([0.2, 0.1, 1.4]))
    assert load_robot(arm.parent / "mine.yaml", velocity_limits=0.3).velocity_limit.tolist() == [0.3, 0.3]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("velocty_limits: {}\n", "mine.yaml:7:1: error: unknown key 'velocty_limits'"),
        ("velocty_limits: {}\n", "did you mean velocity_limits?"),
        ("home: [a, 0]\n", "home[0]"),
        ("home: [.nan, 0]\n", "home[0]"),
        ("lock: {g1: '0'}\n", "lock.g1"),
        ("tip: [\n", "not valid YAML"),
        ("tip: a\ntip: b\n", "duplicate key 'tip'"),
        ("home: [0.0]\nlock: {g1: 0.0, g2: 0.0}\n", "home must have 2 numbers, found 1"),
        ("merge: {fingers: [f1, f3]}\nlock: {g1: 0.0, g2: 0.0}\n", "merge 'fingers': unknown link 'f3'"),
        ("merge: {fingers: [f1, f2]}\n", "only boxes and meshes that move together can be merged"),
        ("merge: {l1: [f1, f2]}\nlock: {g1: 0.0, g2: 0.0}\n", "there is a link of that name already"),
        ("merge: {fingers: []}\n", "names no link"),
    ],
)
def test_robot_files_that_are_refused(arm, text, message):
    with pytest.raises(InputError) as caught:
        load_robot(write(arm, text))
    assert message in str(caught.value)


def test_every_problem_at_once(arm):
    with pytest.raises(InputError) as caught:
        load_robot(write(arm, "tpi: a\nhome: 3\n"))
    assert "2 problems in" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("- 1\n", "mine.yaml:1:1"),
        ("version: 2\n" + MINIMAL.removeprefix("version: 1\n"), "version"),
        (MINIMAL.replace("licence: none\n", ""), "'licence' is missing"),
        ("a" * (2 << 20), "larger than"),
    ],
)
def test_files_that_are_no_robot_file(tmp_path, text, message):
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_robot(tmp_path / "mine.yaml")
    assert message in str(caught.value)


def test_no_file_a_directory_and_bytes(tmp_path):
    (tmp_path / "d.yaml").mkdir()
    (tmp_path / "b.yaml").write_bytes(b"\xff\xfe\x00")
    for name, message in (("none", "no such robot file"), ("d", "is a directory"), ("b", "is not UTF-8 text")):
        with pytest.raises(InputError, match=message):
            load_robot(tmp_path / f"{name}.yaml")


def test_a_data_package_that_is_not_installed(tmp_path):
    (tmp_path / "mine.yaml").write_text(MINIMAL + "package: {distribution: no-such-robot-data, root: share}\n")
    with pytest.raises(MissingError, match="no-such-robot-data, which is not installed"):
        load_robot(tmp_path / "mine.yaml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("frnka", "unknown robot 'frnka'"),
        ("", "unknown robot ''"),
        ("arm.txt", "arm.txt: not a robot"),
        ("some/arm", "some/arm: not a robot"),
    ],
)
def test_names_that_are_no_robot(name, message):
    with pytest.raises(InputError, match=message):
        load_robot(name)
