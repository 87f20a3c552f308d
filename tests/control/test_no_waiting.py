"""After the first step, no step of a loop waits for code to be compiled or loaded."""

from __future__ import annotations

import subprocess
import sys

LOOP = """
import sys
import numpy as np
from numba.core.dispatcher import Dispatcher
from cdfctl import Obstacle, SafetyFilter, Scene, Sphere, load_robot

def loaded():
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("cdfctl")]
    functions = {f for module in modules for f in vars(module).values() if isinstance(f, Dispatcher)}
    return {(f.__module__, f.__name__, str(s)) for f in functions for s in f.signatures}

robot = load_robot("franka")
safe = SafetyFilter(robot, dt=0.001, self_collision=2)
still, forth = np.zeros(7), np.array([0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0])

def step(position, velocity=(0.0, 0.0, 0.0), nominal=still, q=robot.home):
    return safe.step(q, Scene([Obstacle(Sphere(0.05), position, velocity=velocity)]), nominal).status

step([2.0, 2.0, 2.0])
before = loaded(), set(sys.modules)
said = {
    step([0.5, 0.3, 0.5]),
    step([0.5, 0.0, 0.75], nominal=forth),
    step([0.45, 0.0, 0.75], (0.0, 0.0, -3.0)),
    step([0.35, 0.0, 0.62], (0.0, 0.0, -30.0)),
    step([0.3, 0.0, 0.6]),
    step([2.0, 2.0, 2.0], nominal=100.0 * forth, q=robot.upper),
}
after = loaded(), set(sys.modules)
assert said == {"optimal", "least-violation"}, said
assert len(before[0]) > 5
print(sorted(after[0] - before[0]) + sorted(after[1] - before[1]))
"""


def test_a_filter_has_all_it_needs_after_its_first_step() -> None:
    done = subprocess.run([sys.executable, "-c", LOOP], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr
