"""A simulated arm that speaks the real one's protocol, and a scenario for it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cdfctl.scenario.library import load_scenario
from cdfctl.simulation.assemble import Trial, assemble

START = (-1.09, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20)

SCENARIO = """\
version: 1
name: arm
robot:
  name: fr3
  q0: [-1.09, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20]
  limits: {velocity: 0.5, acceleration: 10.0}
task: {type: joint-goal, goal: [-0.94, 0.35, -0.32, -1.70, 0.18, 2.05, -0.20]}
obstacles:
  - {name: ball, shape: {type: ball, radius: 0.05}, position: [0.6, 0.5, 0.5], velocity: [0, -0.1, 0]}
controller: {variant: sdf-tvcbf-qp, gain: 4.0}
simulation: {dt: 0.01, time_limit: 6.0}
plant: {type: franka, host: HOST}
"""


class Server:
    """franky-sim in a process of its own, at an address of the loopback net that nobody else uses."""

    def __init__(self) -> None:
        self.host = f"127.{100 + os.getpid() % 100}.{os.getpid() // 100 % 250}.1"
        self.process: subprocess.Popen[str] | None = None

    def start(self, q0: tuple[float, ...] = START) -> None:
        command = [sys.executable, str(Path(__file__).with_name("serve.py")), self.host, *map(str, q0)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def signal(self, number: signal.Signals) -> None:
        assert self.process is not None
        self.process.send_signal(number)

    def end(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None

    def restart(self, q0: tuple[float, ...] = START) -> None:
        self.end()
        self.start(q0)


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    pytest.importorskip("franky", reason="franky-control is not installed")
    pytest.importorskip("franky_sim", reason="franky-sim is not installed")
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux has the whole net 127.0.0.0/8 for itself")
    server = Server()
    server.start()
    yield server
    server.end()


@pytest.fixture
def scenario(tmp_path: Path) -> Callable[..., Path]:
    def write(host: str = "127.0.0.1", **replaced: str) -> Path:
        text = SCENARIO.replace("HOST", host)
        for old, new in replaced.items():
            text = "\n".join(new if line.startswith(f"{old}:") else line for line in text.splitlines())
        path = tmp_path / "arm.yaml"
        path.write_text(text + "\n")
        return path

    return write


@pytest.fixture
def assembled(scenario: Callable[..., Path]) -> Callable[..., Trial]:
    def make(host: str, *changes: str) -> Trial:
        return assemble(load_scenario(scenario(host), list(changes)))

    return make
