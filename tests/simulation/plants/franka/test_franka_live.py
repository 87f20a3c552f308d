"""The plant against franky-sim, which speaks the arm's protocol over a simulated one: runs, and every way to fail."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdfctl.cli.main import main
from cdfctl.errors import InputError, MissingError
from cdfctl.simulation.assemble import Trial
from cdfctl.simulation.plants.franka.limits import limits_of, published
from cdfctl.simulation.plants.franka.ticks import Ticks

Assembled = Callable[..., Trial]


def run(trial: Trial) -> None:
    for _ in trial.run():
        pass


def state_of(server: Any) -> Any:
    """What another client reads, once the last one has gone."""
    import franky

    robot = franky.Robot(server.host, realtime_config=franky.RealtimeConfig.Ignore)
    return robot.state


@pytest.fixture
def at_tick(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, Callable[[], None]], None]:
    """Have something done in flight: just before the command of a tick."""

    def arrange(tick: int, what: Callable[[], None]) -> None:
        step = Ticks.step

        def watched(self: Ticks, u: Any) -> Any:
            if self.count == tick:
                what()
            return step(self, u)

        monkeypatch.setattr(Ticks, "step", watched)

    return arrange


def test_the_arm_says_what_the_shipped_robot_says(server: Any) -> None:
    """fr3 is written from Franka's description; the arm sends its own."""
    from franky_sim.urdf import FR3_URDF

    sent, shipped = limits_of(FR3_URDF), published()
    rng = np.random.default_rng(0)
    for q in rng.uniform(shipped.lower, shipped.upper, (50, 7)):
        for own, ours in zip(sent(q), shipped(q), strict=True):
            np.testing.assert_allclose(own, ours, atol=1e-12)


def test_a_short_run(server: Any, assembled: Assembled) -> None:
    server.restart()
    trial = assembled(server.host)
    run(trial)
    result = trial.result()
    assert (result.verdict.outcome, result.reason) == ("reached", None)
    trajectory, report = result.trajectory, result.plant
    # The time is the arm's: ticks at 10 ms of it, but for those that a busy machine made us miss.
    assert np.all(np.diff(trajectory.t) > 0.0)
    steps = len(trajectory.u) + report["missed_ticks"] + report["missed_by_arm"]  # type: ignore[operator]
    assert trajectory.t[-1] == pytest.approx(0.01 * steps, abs=0.02)
    assert report["ticks"] == len(trajectory.u)
    assert report["scaled_commands"] == 0
    # It went where it was told, a little later; then it stopped, and stays.
    travelled = float((trajectory.u * np.diff(trajectory.t)[:, None]).sum(axis=0)[0])
    assert trajectory.q[-1, 0] - trajectory.q[0, 0] == pytest.approx(travelled, abs=0.05)
    assert 0.0 < report["response_s"] < 0.3  # type: ignore[operator]
    first = np.array(state_of(server).q)
    time.sleep(0.2)
    second = np.array(state_of(server).q)
    np.testing.assert_allclose(first, second, atol=2e-3)
    assert 0.0 <= first[0] - trajectory.q[-1, 0] < 0.03  # what it took to stop from 0.2 rad/s


def test_an_arm_elsewhere_is_refused_and_can_be_brought(server: Any, assembled: Assembled) -> None:
    elsewhere = (-1.14, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20)
    server.restart(elsewhere)
    with pytest.raises(InputError, match=r"panda_joint1 is at -1\.140, not -1\.090 rad") as refused:
        run(assembled(server.host))
    assert refused.value.hint is not None
    assert "--move-to-start" in refused.value.hint
    np.testing.assert_allclose(state_of(server).q, elsewhere, atol=1e-3)
    trial = assembled(server.host, "plant.move_to_start=true", "plant.approach_speed=0.1")
    run(trial)
    result = trial.result()
    assert result.verdict.outcome == "reached"
    assert np.abs(result.trajectory.q[0] - trial.scenario.robot.q0).max() < 0.01
    assert result.plant["approach_s"] > 0.04 / 0.1  # type: ignore[operator]  # no faster than it was allowed


def test_a_second_client_is_turned_away(server: Any, assembled: Assembled) -> None:
    import franky

    server.restart()
    other = franky.Robot(server.host, realtime_config=franky.RealtimeConfig.Ignore)
    began = time.monotonic()
    with pytest.raises(MissingError, match="no answer from an arm") as refused:
        run(assembled(server.host, "plant.connect_timeout=0.5"))
    assert time.monotonic() - began < 10.0  # franky itself would wait for ever
    assert refused.value.exit_status == 3
    assert other.state is not None
    del other
    server.restart()  # the constructor that was given up would be served next


def test_no_arm_at_the_host(server: Any, assembled: Assembled) -> None:
    with pytest.raises(MissingError, match=r"no arm at 127\.99\.99\.99") as refused:
        run(assembled("127.99.99.99"))
    assert refused.value.exit_status == 3


def test_killed_in_flight_and_reconnected(
    server: Any,
    scenario: Callable[..., Path],
    at_tick: Any,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    server.restart()
    folder = tmp_path / "run"
    with monkeypatch.context() as patch:
        step = Ticks.step

        def watched(self: Ticks, u: Any) -> Any:
            if self.count == 20:
                server.end()
            return step(self, u)

        patch.setattr(Ticks, "step", watched)
        assert main(["run", str(scenario(server.host)), "--out", str(folder), "--quiet"]) == 4
    said = capsys.readouterr().err.strip()
    assert said.count("\n") == 0  # one line
    assert server.host in said
    document = json.loads((folder / "result.json").read_text())
    assert (document["outcome"], document["steps"]) == ("error", 20)
    assert len(np.load(folder / "trajectory.npz")["u"]) == 20
    server.start()
    assert main(["run", str(scenario(server.host)), "--out", str(folder), "--quiet"]) == 0
    assert json.loads((folder / "result.json").read_text())["outcome"] == "reached"


def test_stopped_in_flight(server: Any, assembled: Assembled, at_tick: Any) -> None:
    """A server that hangs sends nothing more: that is noticed long before libfranka's own second is over."""
    server.restart()
    at_tick(20, lambda: server.signal(signal.SIGSTOP))
    trial = assembled(server.host)
    try:
        run(trial)
    finally:
        server.signal(signal.SIGCONT)
    result = trial.result()
    assert (result.verdict.outcome, len(result.trajectory.u)) == ("error", 20)
    assert result.reason is not None
    noticed = re.search(r"no new state of the arm for (\d+\.\d+) s", result.reason)
    assert noticed is not None  # not libfranka's own word, which comes after a second
    assert float(noticed[1]) >= 0.5


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_interrupted_in_flight(
    server: Any, scenario: Callable[..., Path], at_tick: Any, tmp_path: Path, number: signal.Signals
) -> None:
    server.restart()
    at_tick(20, lambda: os.kill(os.getpid(), number))
    folder = tmp_path / "run"
    assert main(["run", str(scenario(server.host)), "--out", str(folder), "--quiet"]) == 130
    document = json.loads((folder / "result.json").read_text())
    assert (document["outcome"], document["steps"]) == ("error", 20)
    first = np.array(state_of(server).q)
    time.sleep(0.2)
    np.testing.assert_allclose(state_of(server).q, first, atol=2e-3)  # it stands
