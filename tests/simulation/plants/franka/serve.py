"""franky-sim with one arm at a given configuration, as a process of its own: ``python serve.py HOST q1 … q7``."""

import os
import sys
import threading
import time

import franky_sim
from franky_sim.mujoco_simulator import MujocoSimulator


def end_with_the_parent(parent: int) -> None:
    """No simulator outlives the test that started it, not even one that was killed."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=end_with_the_parent, args=(os.getppid(),), daemon=True).start()
    host, q0 = sys.argv[1], tuple(float(x) for x in sys.argv[2:])
    with MujocoSimulator() as simulator:
        simulator.add_robot(initial_q=q0)
        with franky_sim.SimulationServer(simulator, hostname_candidates=[host]) as server:
            print("ready", flush=True)
            server.run_forever()
