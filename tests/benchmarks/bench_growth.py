"""How the cost of a step grows: ``python tests/benchmarks/bench_growth.py [--cpu]``.

With the number of obstacles, for both fields and the whole step of the default controller, among balls around a Franka;
and with the number of joints, for planar chains of n links among six balls, made here. A power law a m^b is fitted to
each.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from bench_filter import DT, steps
from scenes import crowd
from timing import Measurement, show, timed

from cdfctl import SafetyFilter, load_robot
from cdfctl.control.safety_filter import DEFAULT_VARIANT
from cdfctl.fields.field import make_field
from cdfctl.robots.robot import Robot

OBSTACLES = (1, 2, 5, 10, 20, 50, 100, 200, 500)
JOINTS = (2, 3, 4, 5, 6, 7, 8, 10, 12, 14)
REACH = 1.0  # m, of a chain
SHEETS = 4

JOINT = """
  <joint name="joint{i}" type="revolute"><parent link="link{before}"/><child link="link{i}"/>
    <origin xyz="{x} 0 0"/><axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" velocity="2" effort="1"/></joint>
  <link name="link{i}"><collision><origin xyz="{half} 0 0" rpy="0 1.5707963267948966 0"/>
    <geometry><cylinder radius="0.02" length="{length}"/></geometry></collision></link>"""


def chain(n: int) -> Robot:
    """A planar arm of n equal links, each a thin cylinder, 1 m long in all."""
    length = REACH / n
    numbers = {"half": 0.5 * length, "length": 0.9 * length}
    joints = [JOINT.format(i=i, before=i - 1, x=length if i > 1 else 0.0, **numbers) for i in range(1, n + 1)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"chain{n}.urdf"
        path.write_text(f'<robot name="chain{n}"><link name="link0"/>{"".join(joints)}</robot>')
        return load_robot(path)


def along(robot: Robot, count: int, box: tuple[list[float], list[float]] | None = None) -> Iterator[Measurement]:
    """The step among ``count`` balls, and both fields at the same places."""
    scene = crowd(robot, count) if box is None else crowd(robot, count, box)
    times, where = steps([SafetyFilter(robot, DEFAULT_VARIANT, dt=DT)], scene, max(20, 200 - 10 * count))
    yield Measurement("step", times[:, 0])
    for name in ("cdf", "sdf"):
        field = make_field(name, robot)
        ask = partial(field.contacts, sheets=SHEETS)
        yield Measurement(name, np.array([timed(partial(ask, q, now))[0] for q, now in where])[5:])


def by_obstacles() -> Iterator[Measurement]:
    """A Franka among 1 to 500 balls."""
    robot = load_robot("franka")
    for count in OBSTACLES:
        for found in along(robot, count):
            yield found._replace(name=f"{found.name}, {count} balls")


def by_joints() -> Iterator[Measurement]:
    """Chains of 2 to 14 links among six balls."""
    for n in JOINTS:
        for found in along(chain(n), 6, ([-REACH, -REACH, 0.0], [REACH, REACH, 0.0])):
            yield found._replace(name=f"{found.name}, {n} joints")


def power_law(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """a and b of y = a x^b, by least squares of the logarithms."""
    b, log_a = np.polyfit(np.log(x), np.log(y), 1)
    return float(np.exp(log_a)), float(b)


def show_laws(measurements: Sequence[Measurement]) -> None:
    """Print the power laws of what was measured above."""
    medians = {m.name: m.median for m in measurements}
    for of, values in (("balls", OBSTACLES), ("joints", JOINTS)):
        for name in ("step", "cdf", "sdf"):
            found = [medians.get(f"{name}, {value} {of}") for value in values]
            if None not in found:
                a, b = power_law(values, found)
                last = np.log(found[-1] / found[-2]) / np.log(values[-1] / values[-2])
                print(f"{name}: {a:.3f} ms x {of}^{b:.2f}; {of}^{last:.2f} from {values[-2]} to {values[-1]}")


if __name__ == "__main__":
    show_laws([*show(by_obstacles()), *show(by_joints())])
