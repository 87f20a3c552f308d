"""Whole runs among measured obstacles: through a pipe and a UDP port, honest and lying; and what no run may have."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdfctl.cli.main import main
from cdfctl.errors import InputError
from cdfctl.scenario.dump import dump
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.overrides import set_fields
from cdfctl.simulation.assemble import Trial, assemble
from cdfctl.simulation.run_folder import read_run, write_run
from cdfctl.simulation.stream.motion import MeasuredMotion
from cdfctl.simulation.stream.source import MAX_LINE, StdinSource, UdpSource

SCENARIO = """\
version: 1
name: measured
robot: {name: planar, q0: [0.0, 0.5], limits: {velocity: 1.0}}
task: {type: joint-goal, goal: [0.6, 0.5]}
obstacles:
  source: udp
  port: PORT
  items:
    - {name: ball, shape: {type: ball, radius: 0.3}, position: [3.0, -2.4, 0]}
controller: {variant: sdf-tvcbf-qp, gain: 4.0}
simulation: {dt: 0.02, time_limit: 1.6, tolerance: 0.1}
"""


class Script:
    """A source that gives at look k what ``lines(k)`` says."""

    def __init__(self, lines: Callable[[int], list[bytes]]) -> None:
        self._lines, self._looks = lines, -1

    def lines(self) -> list[bytes]:
        self._looks += 1
        return self._lines(self._looks)

    def close(self) -> None:
        pass


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@pytest.fixture
def path(tmp_path: Path, port: int) -> Path:
    path = tmp_path / "measured.yaml"
    path.write_text(SCENARIO.replace("PORT", str(port)))
    return path


def said(t: float, x: float = 3.0, y: float = -2.4, name: str = "ball", **more: Any) -> bytes:
    return json.dumps({"name": name, "t": t, "position": [x, y, 0.0], **more}).encode()


def scripted(path: Path, lines: Callable[[int], list[bytes]]) -> Trial:
    trial = assemble(load_scenario(path))
    assert isinstance(trial.motion, MeasuredMotion)
    trial.motion._source = Script(lines)
    return trial


def run(trial: Trial) -> Any:
    for _ in trial.run():
        pass
    return trial.result()


def test_an_honest_stream(path: Path) -> None:
    """The ball moves up at 0.5 m/s: that is what the controller sees, and what the judge scores."""
    result = run(scripted(path, lambda k: [said(0.02 * k, y=-2.4 + 0.01 * k)]))
    assert result.verdict.outcome == "reached"
    assert result.measured["garbage"] == 0
    assert result.measured["braked_steps"] <= 3  # until there is a velocity
    trajectory = result.trajectory
    after = trajectory.t > 0.1
    np.testing.assert_allclose(trajectory.obstacle_twist[after, 0, 1], 0.5, rtol=0.2)
    # Real time: as many seconds as the wall clock saw, which is why this test lasts as long as the run.
    ahead = trajectory.obstacle_pose[-1, 0, 1] - (-2.4 + 0.5 * trajectory.t[-1])
    assert abs(ahead) < 0.1


def test_a_stream_that_ends_brakes_the_arm(path: Path) -> None:
    result = run(scripted(path, lambda k: [said(0.02 * k)] if k < 20 else []))
    u, t = result.trajectory.u, result.trajectory.t[:-1]
    assert result.verdict.outcome == "timeout"
    assert np.any(u[t < 0.3] != 0.0)
    assert np.all(u[t > 0.6] == 0.0)
    assert result.measured["braked_steps"] > 40
    assert np.all(np.isnan(result.trajectory.h[t > 0.6]))


def test_nothing_ever_comes(path: Path) -> None:
    result = run(scripted(path, lambda k: []))
    assert np.all(result.trajectory.u == 0.0)
    np.testing.assert_array_equal(result.trajectory.q[-1], [0.0, 0.5])
    assert result.infeasible_steps == 0


def test_lies_are_counted_and_never_a_command(path: Path) -> None:
    """Between honest messages every kind of lie; what is commanded is what the honest ones alone ask for."""

    def honest(k: int) -> list[bytes]:
        return [said(0.02 * k)]

    def lying(k: int) -> list[bytes]:
        lies = [said(0.02 * k + 0.005, x=2.0), said(0.02 * k - 3.0), b"{garbage", said(0.02 * k, name="bull")]
        lies.append(b'{"name": "ball", "t": 1, "position": [NaN, 0, 0]}')
        return [*honest(k), *(lies if k > 5 else [])]

    told, lied_to = run(scripted(path, honest)), run(scripted(path, lying))
    assert lied_to.verdict.outcome == told.verdict.outcome == "reached"
    np.testing.assert_allclose(lied_to.trajectory.q[-1], told.trajectory.q[-1], atol=0.05)
    counts = lied_to.measured
    lies = lied_to.measured["accepted"] - 6
    for kind in ("jump", "backward", "unknown"):
        assert lies - 8 <= counts[kind] <= lies + 2
    assert counts["garbage"] >= 2 * (lies - 8)
    assert counts["braked_steps"] == told.measured["braked_steps"]


def test_the_folder_of_a_measured_run(path: Path, tmp_path: Path) -> None:
    result = run(scripted(path, lambda k: [said(0.02 * k)]))
    write_run(tmp_path / "run", result)
    kept = read_run(tmp_path / "run")
    assert kept.scenario == result.scenario
    assert kept.document["measured"] == result.measured
    text = (tmp_path / "run" / "scenario.yaml").read_text()
    assert "source: udp" in text
    assert "feed" not in text


def test_over_udp(path: Path, port: int, tmp_path: Path) -> None:
    """The whole way: a sender on loopback, the command line, and its document."""
    done = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outlet:
            while not done.wait(0.01):
                outlet.sendto(said(time.time()) + b"\n" + said(time.time(), name="bull"), ("127.0.0.1", port))

    sender = threading.Thread(target=send)
    sender.start()
    try:
        assert main(["run", str(path), "--out", str(tmp_path / "run"), "--quiet"]) == 0
    finally:
        done.set()
        sender.join()
    counts = json.loads((tmp_path / "run" / "result.json").read_text())["measured"]
    assert counts["accepted"] > 20
    assert counts["unknown"] > 20


def test_a_port_that_is_taken(path: Path, port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
        with pytest.raises(InputError, match=f"cannot listen at 127.0.0.1:{port}"):
            run(assemble(load_scenario(path)))


@pytest.fixture
def pipe() -> Iterator[tuple[StdinSource, int]]:
    read, write = os.pipe()
    yield StdinSource(read), write
    os.close(read)


def test_a_pipe_is_read_without_waiting(pipe: tuple[StdinSource, int]) -> None:
    source, write = pipe
    assert source.lines() == []
    os.write(write, b"one\ntwo\nthr")
    assert source.lines() == [b"one", b"two"]
    os.write(write, b"ee\n\n \n")
    assert source.lines() == [b"three"]
    os.write(write, b"x" * (MAX_LINE // 2))
    assert source.lines() == []
    os.close(write)
    assert source.lines() == []
    assert source.lines() == []


def test_an_endless_line_is_garbage(pipe: tuple[StdinSource, int]) -> None:
    source, write = pipe
    seen: list[bytes] = []
    for _ in range(6):
        os.write(write, b"x" * 30_000)
        seen += source.lines()
    assert [len(line) > MAX_LINE for line in seen] == [True, True]  # given up as it grows, never kept
    os.close(write)


def test_datagrams_of_several_lines(port: int) -> None:
    source = UdpSource("127.0.0.1", port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outlet:
        outlet.sendto(b"one\ntwo\n", ("127.0.0.1", port))
        outlet.sendto(b"three", ("127.0.0.1", port))
    deadline, seen = time.monotonic() + 5.0, []
    while len(seen) < 3 and time.monotonic() < deadline:
        seen += source.lines()
    assert seen == [b"one", b"two", b"three"]
    source.close()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("obstacles.port=0", "must be from 1 to 65535"),
        ("obstacles.source=tcp", "unknown value 'tcp'"),
        ("obstacles.max_agee=1", "did you mean max_age?"),
        ("obstacles.max_age=0", "must be greater than 0"),
        ("obstacles={source: udp, items: []}", "missing key 'port'"),
        ("obstacles={source: stdin, port: 5, items: []}", "port goes with source: udp"),
        ("obstacles={source: stdin}", "missing key 'items'"),
        ("obstacles={port: 5, items: []}", "missing key 'source'"),
        ("obstacles.items[0].velocity=[1,0,0]", "a measured obstacle has no velocity of its own"),
        ("obstacles.items[0].shape.radius=-1", "obstacles.items[0].shape.radius"),
        ("feed={source: stdin}", "unknown key 'feed'"),
    ],
)
def test_bad_sections(path: Path, change: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        load_scenario(path, [change])
    assert said in str(refused.value)


def test_a_scenario_reads_back(path: Path, tmp_path: Path) -> None:
    scenario = load_scenario(path).scenario
    copy = tmp_path / "copy.yaml"
    copy.write_text(dump(scenario))
    assert load_scenario(copy).scenario == scenario
    changed = set_fields(scenario, {"obstacles.max_age": 0.3})
    assert changed.feed is not None
    assert changed.feed.max_age == 0.3
    assert changed.obstacles == scenario.obstacles


def test_no_benchmark_of_what_cannot_be_repeated(path: Path, tmp_path: Path, capsys: Any) -> None:
    assert main(["bench", "--scenario", str(path), "--trials", "1", "--out", str(tmp_path / "store")]) == 2
    assert "a benchmark cannot repeat what is measured" in capsys.readouterr().err
