"""What only the robot can tell about a scenario: all of it at once, each at its place in the file."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cdfctl.errors import InputError
from cdfctl.scenario.draws import draw
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.problems import ScenarioErrors
from cdfctl.scenario.resolve import resolve
from cdfctl.simulation.assemble import assemble, assemble_scenario

PLANAR = """\
version: 1
name: mine
robot:
  name: planar
  q0: [0.0, 0.5]
task:
  type: joint-goal
  goal: [1.0, 0.5]
obstacles:
  - shape: {type: ball, radius: 0.3}
    position: [0.0, 3.0, 0.0]
  - shape: {type: ball, radius: 0.3}
    position: [0.0, -3.0, 0.0]
"""

URDF = """\
<robot name="wheel">
  <link name="base"/>
  <joint name="spin" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><limit velocity="1" effort="1"/>
  </joint>
  <link name="arm"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
</robot>
"""


def problems(path: Path, text: str, *overrides: str) -> dict[str | None, str]:
    """Field -> message of everything found wrong."""
    path.write_text(text)
    with pytest.raises(ScenarioErrors) as caught:
        assemble(load_scenario(path, list(overrides)))
    for problem in caught.value.problems:
        assert problem.line is not None or problem.origin is not None
    return {problem.field: f"{problem.message} | {problem.hint}" for problem in caught.value.problems}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "mine.yaml"


def test_a_good_scenario_assembles(file: Path) -> None:
    file.write_text(PLANAR)
    trial = assemble(load_scenario(file))
    assert trial.robot.n == 2
    assert trial.scenario.controller.alpha == 3.0  # resolved: the default of dual-tvcbf-qp


def test_counts_of_joints(file: Path) -> None:
    text = PLANAR.replace("[0.0, 0.5]", "[0.0, 0.5, 0.1]").replace("[1.0, 0.5]", "[1.0, 0.5, 0.1]")
    found = problems(file, text + "controller: {effort_weight: [1, 1, 1]}\n")
    assert set(found) == {"robot.q0", "task.goal", "controller.effort_weight"}
    assert "expected 2 numbers, one a joint of planar, found 3 | joints: joint1, joint2" in found["robot.q0"]


def test_limits_and_degrees(file: Path) -> None:
    found = problems(file, PLANAR.replace("[0.0, 0.5]", "[90.0, 3.2]").replace("[1.0, 0.5]", "[1.0, -4.0]"))
    assert set(found) == {"robot.q0[0]", "robot.q0[1]", "task.goal[1]"}
    assert "radians" in found["robot.q0[0]"]
    assert "radians" not in found["robot.q0[1]"]
    assert "outside the limits of joint 'joint2', [-3.14159, 3.14159] rad" in found["task.goal[1]"]


def test_degrees_of_a_continuous_joint(file: Path) -> None:
    (file.parent / "wheel.urdf").write_text(URDF)
    text = PLANAR.replace("name: planar", "urdf: wheel.urdf").replace("[0.0, 0.5]", "[5.0]")
    found = problems(file, text.replace("[1.0, 0.5]", "[90.0]"))
    assert list(found) == ["task.goal[0]"]
    assert "more than a turn" in found["task.goal[0]"]


def test_narrowed_limits_count(file: Path) -> None:
    found = problems(file, PLANAR, "robot.limits.position={joint1: [0.5, 1.5]}")
    assert list(found) == ["robot.q0[0]"]


def test_start_in_contact_names_every_obstacle_and_the_link(file: Path) -> None:
    text = PLANAR.replace("[0.0, 3.0, 0.0]", "[1.0, 0.25, 0.0]").replace("[0.0, -3.0, 0.0]", "[3.0, 0.6, 0.0]")
    found = problems(file, text)
    assert set(found) == {"obstacles[0].position", "obstacles[1].position"}
    # link1 lies along x: the ball at y = 0.25 is 0.05 m deep.
    assert "'0' is in contact with link1 (50.0 mm deep)" in found["obstacles[0].position"]
    assert "link2" in found["obstacles[1].position"]
    assert "lengths are in metres" not in str(found)
    assert "lengths are in metres" in str(problems(file, PLANAR.replace("radius: 0.3", "radius: 300")))


def test_unknown_joints_of_each_section(file: Path) -> None:
    lock = problems(file, PLANAR, "robot.lock={joint3: 0.0}")
    assert "unknown joint 'joint3' of planar" in lock["robot.lock.joint3"]
    assert "joint1" in lock["robot.lock.joint3"]
    assert list(problems(file, PLANAR, "robot.limits.position={elbow: [0, 1]}")) == ["robot.limits.position.elbow"]
    assert list(problems(file, PLANAR, "robot.limits.velocity={elbow: 1.0}")) == ["robot.limits.velocity.elbow"]


def test_unknown_robot_tip_and_solver(file: Path) -> None:
    assert "did you mean planar?" in problems(file, PLANAR, "robot.name=planr")["robot.name"]
    assert "unknown tip frame 'hand'" in problems(file, PLANAR, "robot.tip=hand")["robot.tip"]
    assert "not installed" in problems(file, PLANAR, "controller.solver=dapq")["controller.solver"]


def test_broken_urdf(file: Path) -> None:
    (file.parent / "wheel.urdf").write_text("<robot")
    text = PLANAR.replace("name: planar", "urdf: wheel.urdf")
    assert list(problems(file, text)) == ["robot.urdf"]


def test_shape_files(file: Path) -> None:
    (file.parent / "cloud.txt").write_text("1 2\n")
    (file.parent / "part.stl").write_text("not a mesh")
    text = PLANAR.replace("{type: ball, radius: 0.3}", "{type: point-cloud, file: cloud.txt}", 1)
    text = text.replace("{type: ball, radius: 0.3}", "{type: mesh, file: part.stl}", 1)
    assert set(problems(file, text)) == {"obstacles[0].shape", "obstacles[1].shape"}


def test_everything_at_once(file: Path) -> None:
    (file.parent / "cloud.txt").write_text("1 2\n")
    text = PLANAR.replace("[0.0, 0.5]", "[9.0, 0.5]").replace("[1.0, 0.5]", "[1.0, -9.0]")
    text = text.replace("{type: ball, radius: 0.3}", "{type: point-cloud, file: cloud.txt}", 1)
    found = problems(file, text + "controller: {solver: nope, smoothness_weight: [1, 2]}\n")
    assert set(found) == {"robot.q0[0]", "task.goal[1]", "obstacles[0].shape", "controller.solver"}


def test_without_a_file_the_same_is_an_input_error() -> None:
    scenario = resolve(draw(load_scenario("S1", ["robot.q0=[4.0, 0.5]"]).scenario, 0, 0))
    with pytest.raises(InputError, match=r"robot\.q0\[0\]: 4 rad is outside") as caught:
        assemble_scenario(scenario)
    assert "\n" not in caught.value.message


def test_a_given_robot_is_used(file: Path) -> None:
    file.write_text(PLANAR)
    first = assemble(load_scenario(file))
    assert assemble(load_scenario(file), robot=first.robot).robot is first.robot


def test_a_task_the_default_controller_does_not_do_is_shown_where_it_stands(file: Path) -> None:
    target = "type: reach\n  target: {position: [2.0, 2.0, 0.0], shape: {type: ball, radius: 0.3}}"
    text = PLANAR.replace("type: joint-goal\n  goal: [1.0, 0.5]", target)
    assert "controller:" not in text
    found = problems(file, text)
    assert list(found) == ["task.type"]
    assert "the controller taken where none is named, 'dual-tvcbf-qp', cannot do task 'reach'" in found["task.type"]


def test_a_task_the_controller_does_not_do_is_named() -> None:
    with pytest.raises(ScenarioErrors, match="cannot do task 'reach'"):
        assemble(load_scenario("reach", ["controller.variant=sdf-tvcbf-qp"]))


def test_the_file_of_a_target_s_shape_is_looked_at(file: Path, tmp_path: Path) -> None:
    (tmp_path / "flat.stl").write_text("solid\nendsolid\n")
    target = "type: reach\n  target: {position: [2.0, 2.0, 0.0], shape: {type: mesh, file: flat.stl}}"
    text = PLANAR.replace("type: joint-goal\n  goal: [1.0, 0.5]", target)
    file.write_text(text + "controller: {variant: sdf-tvcbf-tvclf-qp}\n")
    with pytest.raises(ScenarioErrors) as caught:
        assemble(load_scenario(file))
    assert [problem.field for problem in caught.value.problems] == ["task.target.shape"]


def test_limits_of_the_planar_arm_are_pi(file: Path) -> None:
    """A goal on a limit is inside it."""
    file.write_text(PLANAR.replace("[1.0, 0.5]", f"[{math.pi!r}, 0.5]"))
    assert assemble(load_scenario(file)).robot.upper[0] == math.pi
