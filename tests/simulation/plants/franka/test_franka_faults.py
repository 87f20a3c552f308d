"""What the simulator never does: a reflex, a user stop, commands beyond the limits; on an arm in memory."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from cdfctl.cli.main import main
from cdfctl.errors import InputError, MissingError, PlantError
from cdfctl.robots.robot import load_robot
from cdfctl.scenario.plant import FrankaConfig
from cdfctl.simulation.assemble import Trial
from cdfctl.simulation.plants.franka.arm import connect
from cdfctl.simulation.plants.franka.limits import limits_of, published
from cdfctl.simulation.plants.franka.plant import FrankaPlant

START = np.array([-1.09, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20])
Assembled = Callable[..., Trial]


@pytest.fixture
def franky(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("fake_franky", Path(__file__).with_name("fake_franky.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "fake_franky", module)
    spec.loader.exec_module(module)
    module.Robot.start = START
    monkeypatch.setitem(sys.modules, "franky", module)
    return module


def plant_of(**options: Any) -> FrankaPlant:
    config = FrankaConfig(type="franka", **options)
    return FrankaPlant(config, load_robot("fr3"), 0.01, connect, lambda t, q: np.clip(4.0 * (START - q), -0.2, 0.2))


def ended(trial: Trial) -> Any:
    for _ in trial.run():
        pass
    return trial.result()


def test_commands_are_sent_as_they_are(franky: ModuleType) -> None:
    plant = plant_of(acceleration=8.0, jerk=4000.0)
    state, u = plant.start(START), np.linspace(-0.3, 0.3, 7)
    for k in range(5):
        state = plant.step(state, u, 0.01)
        assert state.t == pytest.approx(0.01 * (k + 1), abs=0.004)
        inside = plant.between()
        assert np.all((inside.t > state.t - 0.02) & (inside.t < state.t))
    robot = franky.Robot.newest
    assert len(robot.sent) == 5
    for motion in robot.sent:
        np.testing.assert_array_equal(motion.target, u)
        assert motion.duration == 25  # 2.5 ticks of 10 ms
    np.testing.assert_array_equal(robot.joint_acceleration_limit.value, 8.0)
    np.testing.assert_array_equal(robot.joint_jerk_limit.value, 4000.0)
    plant.close()
    assert isinstance(robot.sent[-1], franky.JointVelocityStopMotion)
    plant.close()
    assert len(robot.sent) == 6  # once is enough
    report = plant.report()
    assert (report["ticks"], report["missed_ticks"], report["expired_commands"]) == (5, 0, 0)


def test_a_reflex_ends_the_run(franky: ModuleType, scenario: Any, tmp_path: Path, capsys: Any) -> None:
    reflex = franky.ControlException('libfranka: Move command aborted:\nmotion aborted by reflex! ["joint_reflex"]')
    franky.Robot.faults = {30: reflex}
    folder = tmp_path / "run"
    assert main(["run", str(scenario("127.0.0.1")), "--out", str(folder), "--json"]) == 4
    told = capsys.readouterr()
    assert told.err.count("\n") == 1
    assert (
        'the arm has stopped by itself: libfranka: Move command aborted: motion aborted by reflex! ["joint' in told.err
    )
    document = json.loads(told.out)
    assert (document["outcome"], document["steps"]) == ("error", 29)
    assert len(franky.Robot.newest.sent) == 30  # and not one command after it


@pytest.mark.parametrize("fault", ["NetworkException", "RuntimeError"])
def test_a_lost_network_ends_the_run(franky: ModuleType, assembled: Assembled, fault: str) -> None:
    kind = RuntimeError if fault == "RuntimeError" else franky.NetworkException
    franky.Robot.faults = {10: kind("UDP receive: Timeout")}
    result = ended(assembled("127.0.0.1"))
    assert (result.stop, len(result.trajectory.u)) == ("error", 9)
    assert result.reason == "127.0.0.1: the connection to the arm is lost: UDP receive: Timeout"
    assert len(franky.Robot.newest.sent) == 10


def test_a_stale_state_ends_the_run(franky: ModuleType, assembled: Assembled) -> None:
    def freeze(robot: Any) -> None:
        robot.frozen = True

    franky.Robot.faults = {10: freeze}
    began = time.monotonic()
    result = ended(assembled("127.0.0.1", "plant.state_timeout=0.1"))
    assert time.monotonic() - began < 20.0
    assert result.stop == "error"
    noticed = re.search(r"no new state of the arm for (\d+\.\d+) s", result.reason)
    assert noticed is not None
    assert float(noticed[1]) >= 0.1


def test_a_reflex_before_the_run_is_recovered_from(franky: ModuleType) -> None:
    franky.Robot.mode = franky.RobotMode.Reflex
    plant_of().start(START)
    assert franky.Robot.newest.recovered == 1


def test_a_user_stop_is_respected(franky: ModuleType, scenario: Any, tmp_path: Path, capsys: Any) -> None:
    franky.Robot.mode = franky.RobotMode.UserStopped
    with pytest.raises(PlantError, match="the arm is in mode UserStopped"):
        plant_of().start(START)
    assert franky.Robot.newest.sent == []
    assert main(["run", str(scenario("127.0.0.1")), "--out", str(tmp_path / "run"), "--quiet"]) == 4
    told = capsys.readouterr().err
    assert told.startswith("cdfctl: error: 127.0.0.1: the arm is in mode UserStopped")


def test_a_late_command_is_counted(franky: ModuleType) -> None:
    plant = plant_of()
    state = plant.start(START)
    state = plant.step(state, np.full(7, 0.1), 0.01)
    robot = franky.Robot.newest
    robot.ms += 45  # the controller took so long
    state = plant.step(state, np.full(7, 0.1), 0.01)
    assert state.t == pytest.approx(0.06, abs=0.004)  # the next tick that can be met
    report = plant.report()
    assert report["expired_commands"] == 1  # 25 ms of it were held, then the arm began to stop
    assert report["missed_ticks"] + report["missed_by_arm"] == 4
    assert report["lag_max_s"] == pytest.approx(0.045, abs=0.004)


def test_a_command_beyond_the_limits_is_scaled_whole(franky: ModuleType) -> None:
    """The limit falls towards the end stop of joint 1: there the whole vector shrinks, direction kept."""
    plant = plant_of()
    near = START.copy()
    near[0] = 2.8
    franky.Robot.start = near
    state = plant.start(near)
    u = np.array([2.0, 1.0, 0.0, 0.0, 0.0, 0.0, -0.5])
    plant.step(state, u, 0.01)
    sent = franky.Robot.newest.sent[0].target
    most = np.sqrt(2.0 * 6.0 * (2.9007 - 2.8)) - 0.652  # by hand, from Franka's formula for joint 1
    np.testing.assert_allclose(sent, u * most / 2.0, rtol=1e-9)
    assert plant.report()["scaled_commands"] == 1


def test_the_way_to_the_start(franky: ModuleType) -> None:
    franky.Robot.start = START + 0.05
    with pytest.raises(InputError, match="not at the scenario's start"):
        plant_of().start(START)
    assert franky.Robot.newest.sent == []
    plant = plant_of(move_to_start=True)
    state = plant.start(START)
    assert state.t == 0.0
    assert np.abs(state.q - START).max() < 0.01
    report = plant.report()
    assert (report["ticks"], report["scaled_commands"]) == (0, 0)
    assert report["approach_s"] > 0.05 / 0.2


def test_another_arm_is_refused_with_its_numbers(franky: ModuleType) -> None:
    """Not an FR3, by its own description."""
    joint = '<joint type="revolute" name="j{}"><limit lower="-1" upper="1" velocity="{}"/></joint>'
    franky.Robot.model_urdf = "<robot>" + "".join(joint.format(i, 2.0) for i in range(6)) + "</robot>"
    with pytest.raises(InputError, match="fr3 has 7 joints, the arm has 6"):
        plant_of().start(START)
    franky.Robot.model_urdf = "<robot>" + "".join(joint.format(i, 2.0) for i in range(7)) + "</robot>"
    with pytest.raises(InputError, match=r"'panda_joint1' may be anywhere in \[-2.9007, 2.9007\] rad, the arm only in"):
        plant_of().start(START)


def test_limits_without_a_description(franky: ModuleType) -> None:
    assert limits_of("") is published()
    assert limits_of("<robot/>") is published()
    plain = limits_of('<robot><joint type="revolute"><limit lower="-1" upper="1" velocity="2"/></joint></robot>')
    low, high = plain(np.array([0.999]))
    assert (low[0], high[0]) == (-2.0, 2.0)


def test_without_franky(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "franky", None)
    with pytest.raises(MissingError, match="needs franky") as missing:
        plant_of().start(START)
    assert "cdfctl[franka]" in str(missing.value.hint)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["robot.name=ur5", "robot.q0=[0,0,0,0,0,0]", "task.goal=[0,0,0,0,0,0]"], "ur5 has 6 joints, a Franka Resear"),
        (["robot.name=franka"], "'panda_joint6' may be anywhere in [-0.0175, 3.7525] rad, a Franka Research 3 only in"),
        (["robot.limits.velocity=3"], "'panda_joint1' may move at 3 rad/s, a Franka Research 3 at most at 2.62 rad/s"),
        (["simulation.dt=0.0005"], "2000 Hz is more than the arm takes, 1000 Hz"),
        (["plant.hold=0.005"], "a command held for 0.005 s does not fit a control step of 0.01 s"),
        (["plant.hold=2"], "a command held for 2 s does not fit"),
        (["plant.acceleration=20"], "20 rad/s^2 is more than the arm's 10 rad/s^2"),
        (["plant.jerk=1e4"], "10000 rad/s^3 is more than the arm's 5000 rad/s^3"),
        (["plant.move_to_start=yes"], "expected true or false, found text 'yes'"),
        (["plant.hoost=x"], "did you mean host?"),
    ],
)
def test_what_no_arm_can_do_is_refused_before_one_is_asked(assembled: Assembled, changes: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        assembled("127.0.0.1", *changes)
    assert said in str(refused.value)


def test_dry_run(scenario: Any, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """What would be sent, without an arm and without a folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "franky", None)  # it needs no franky either
    path = str(scenario("10.0.0.1"))
    assert main(["run", path, "--dry-run"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "nothing is sent" in lines[0]
    assert any(line.split() == ["host", "10.0.0.1"] for line in lines)
    head = next(i for i, line in enumerate(lines) if line.startswith("   t [s]"))
    rows = [[float(x) for x in line.split()] for line in lines[head + 1 : -1]]
    assert all(len(row) == 8 for row in rows)
    assert max(len(line) for line in lines) <= 80
    assert main(["run", path, "--dry-run", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(np.array(document["commands"])[: len(rows)], rows, atol=1e-4)
    assert (document["outcome"], document["hold_s"], document["rate_Hz"]) == ("reached", 0.025, 100.0)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["arm.yaml"]
    assert main(["run", path, "--dry-run", "--plant", "kinematic"]) == 2
