"""A policy that wants to crash: it steers the nearest link at the nearest obstacle, and the filter does not let it.

Stands for any policy, learned or not, whose output nobody has proved anything about. The same policy runs once without
the filter, to show that it means it.

    python docs/examples/crashing_policy.py
"""

from itertools import count

import numpy as np

import cdfctl
from cdfctl.simulation.clearance import nearest  # coal, apart from the filter's own field
from cdfctl.simulation.self_contact import OwnDistances

DT = 0.02  # s
SECONDS = 4.0
SPEED = 1.5  # rad/s


def scene_at(t: float) -> cdfctl.Scene:
    """A ball that comes and goes, a turning beam, and a table."""
    turn = [0.0, 0.0, np.sin(0.4 * t), np.cos(0.4 * t)]
    return cdfctl.Scene(
        [
            cdfctl.Obstacle(
                cdfctl.Sphere(0.08),
                [0.55, 0.35 * np.cos(0.7 * t), 0.6],
                velocity=[0.0, -0.245 * np.sin(0.7 * t), 0.0],
                name="ball",
            ),
            cdfctl.Obstacle(
                cdfctl.Box((0.6, 0.06, 0.06)), [-0.1, 0.6, 0.7], turn, angular_velocity=[0, 0, 0.8], name="beam"
            ),
            cdfctl.Obstacle(cdfctl.Box((0.5, 1.0, 0.04)), [0.65, 0.0, 0.05], name="table"),
        ]
    )


class Policy:
    """Down the gradient of the distance to whatever is nearest, with noise so that it does not get stuck."""

    def __init__(self, robot: cdfctl.Robot) -> None:
        self.field = cdfctl.make_field("sdf", robot)
        self.rng = np.random.default_rng(0)

    def __call__(self, q: np.ndarray, scene: cdfctl.Scene) -> np.ndarray:
        answer = self.field.query(q, scene)
        toward = -answer.dq[np.argmin(answer.d)] + 0.1 * self.rng.normal(size=len(q))
        return SPEED * toward / max(1e-3, np.abs(toward).max())


def run(robot: cdfctl.Robot, safe: cdfctl.SafetyFilter | None) -> None:
    policy, own = Policy(robot), OwnDistances(robot)
    q, least, least_own = robot.home.copy(), np.inf, np.inf
    for k in count():
        if k * DT >= SECONDS or min(least, least_own) <= 0.0:
            break
        scene = scene_at(k * DT)
        u = policy(q, scene)
        if safe is not None:
            u = safe.step(q, scene, u).u
        q = np.clip(q + DT * u, robot.lower, robot.upper)
        least = min(least, nearest(robot, q, scene_at((k + 1) * DT)).distance)
        own.place(q)
        least_own = min(least_own, own.distances().min())
    name = "without the filter" if safe is None else "with the filter"
    end = f"crashed at {k * DT:.2f} s" if min(least, least_own) <= 0.0 else f"ran for {SECONDS:.0f} s"
    print(f"{name}: {end}; least clearance, by coal: {1e3 * least:.1f} mm, to itself {1e3 * least_own:.1f} mm")
    if safe is not None:
        print(f"steps: {dict(safe.counts)}")


def main() -> None:
    robot = cdfctl.load_robot("franka")
    run(robot, None)
    run(robot, cdfctl.SafetyFilter(robot, dt=DT, self_collision=6))


if __name__ == "__main__":
    main()
