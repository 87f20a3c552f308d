"""The paper's real experiment with two simulated arms: one lowers a ball on a stick past the goal of the other.

Both are franky-sim robots behind the real arm's network interface. The second is really commanded: its hand goes down
at 0.05 or 0.15 m/s. Where that takes the ball is all that cdfctl learns of it, as measurements on a UDP port:

    python docs/examples/real_experiment.py real-slow
    python docs/examples/real_experiment.py real-fast

It needs the extra franka, and franky-sim. Nothing leaves this machine.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

HOSTS = ("127.0.0.1", "127.0.0.2")
PORT = 5005

# The second arm's start: its hand 0.55 m before it and 0.95 m up, pointing forward. Turning the hand about the stick
# on the way down keeps the arm inside its limits and does not move the ball.
HOME = (0.0, -0.2461, 0.0, -1.4871, 0.0, 2.8118, -2.3562)
HAND = np.array([0.55, 0.0, 0.95])
TURN = np.deg2rad(130.0)
REACH = np.array([0.0, -0.82, 0.0])  # from the hand to the ball, world axes: the stick goes on to the hand
STICK = np.array([0.0, 0.225, 0.0])  # from the ball to the middle of what the scenario knows of the stick
DOWN = 0.85  # m


def serve(hosts: list[str], start: list[float], base: list[float]) -> None:
    """Simulate both arms until ended; the second stands at ``base``."""
    import franky_sim
    from franky_sim.mujoco_simulator import MujocoSimulator

    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    with MujocoSimulator() as simulator:
        simulator.add_robot(initial_q=start)
        simulator.add_robot(initial_q=HOME, position=tuple(base))
        with franky_sim.SimulationServer(simulator, hostname_candidates=hosts) as server:
            print("ready", flush=True)
            server.run_forever()


def carry(host: str, port: int, base: list[float], speed: float) -> None:
    """Publish where the ball and the stick are; after a line on standard input, lower them at ``speed`` (m/s)."""
    import franky

    robot = franky.Robot(host, realtime_config=franky.RealtimeConfig.Ignore)
    robot.recover_from_errors()
    down = franky.Twist(np.array([0.0, 0.0, -speed]), np.array([0.0, TURN * speed / DOWN, 0.0]))
    outlet = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    going, sent = False, -1.0
    print("ready", flush=True)
    while True:
        state = robot.state
        t, hand = state.time.to_sec(), np.array(state.O_T_EE.translation) + base
        if t > sent:
            for name, offset in (("ball", REACH), ("stick", REACH + STICK)):
                line = {"name": name, "t": t, "position": (hand + offset).tolist()}
                outlet.sendto(json.dumps(line).encode(), ("127.0.0.1", port))
            sent = t
        going = _told() or going
        if going and hand[2] > HAND[2] - DOWN - 0.02:
            # Renewed at every turn: like the first arm, this one stops by itself when nobody tells it to go on.
            robot.move(franky.CartesianVelocityMotion(down, duration=franky.Duration(100)), asynchronous=True)
        time.sleep(0.004)


def _told() -> bool:
    """Whether a line has come on standard input; its end, which is that of who started this process, ends this one."""
    if not select.select([sys.stdin], [], [], 0.0)[0]:
        return False
    if not sys.stdin.readline():
        raise SystemExit
    return True


def _end_with_the_parent() -> None:
    sys.stdin.read()
    os._exit(0)


@contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """This file as another process, ready; it ends with the block."""
    command = [sys.executable, str(Path(__file__).resolve()), *arguments]
    child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert child.stdout is not None
        while (line := child.stdout.readline()) != "ready\n":
            if not line:
                raise SystemExit(f"{arguments[0]}: ended before it was ready")
        yield child
    finally:
        child.send_signal(signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            child.wait(5.0)
        child.kill()
        child.communicate()


def experiment(name: str, hosts: tuple[str, str] = HOSTS, port: int = PORT, *settings: str) -> dict[str, object]:
    """Run the scenario ``name`` with two arms; the document of the run, and the ball's measured speed (m/s)."""
    from cdfctl.scenario.library import load_scenario
    from cdfctl.simulation.assemble import assemble
    from cdfctl.simulation.run_folder import write_run

    declared = load_scenario(name).scenario
    ball = np.array(declared.obstacles[0].position)
    speed = -float(declared.obstacles[0].velocity[2])
    base = ball - REACH - HAND
    items = []
    for body in declared.obstacles:
        item = body.model_dump(mode="json", exclude_none=True)
        items.append({key: item[key] for key in ("name", "shape", "position", "orientation")})
    measured = {"source": "udp", "port": port, "max_age": 0.1, "items": items}
    changes = [f"obstacles={json.dumps(measured)}", "plant.type=franka", f"plant.host={hosts[0]}", *settings]
    trial = assemble(load_scenario(name, changes))
    place, q0 = json.dumps(base.tolist()), json.dumps(list(declared.robot.q0))
    with (
        process("serve", json.dumps(hosts), q0, place),
        process("carry", hosts[1], str(port), place, str(speed)) as carrier,
    ):
        assert carrier.stdin is not None
        for step in trial.run():
            if step.index == 0:
                carrier.stdin.write("go\n")
                carrier.stdin.flush()
    result = trial.result()
    document = write_run(Path("runs") / f"{name}-two-arms", result)
    z, t = result.trajectory.obstacle_pose[:, 0, 2], result.trajectory.t
    way = (z < HAND[2] - 0.1) & (z > HAND[2] - 0.5)
    document["ball_speed_m_s"] = float(-np.polyfit(t[way], z[way], 1)[0]) if way.sum() > 2 else None
    return document


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("name", nargs="?", default="real-slow", help="real-slow or real-fast")
    document = experiment(parser.parse_args().name)
    print(json.dumps(document, indent=2))
    return 0 if document["success"] else 1


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["serve", hosts, start, base]:
            serve(json.loads(hosts), json.loads(start), json.loads(base))
        case ["carry", host, port, base, speed]:
            carry(host, int(port), json.loads(base), float(speed))
        case _:
            sys.exit(main())
