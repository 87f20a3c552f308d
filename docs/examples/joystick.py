"""Teleoperation: a joystick moves the hand, the filter keeps the arm off a person's arm, itself and its limits.

The stick commands a velocity of the hand; the pseudo-inverse of the Jacobian turns it into a nominal joint velocity.
The radio drops out for a moment, which arrives here as NaN: the filter brakes and counts it.

    python docs/examples/joystick.py
"""

import numpy as np
import pinocchio as pin

import cdfctl
from cdfctl.simulation.clearance import nearest  # coal, apart from the filter's own field

DT = 0.02  # s
SECONDS = 3.0


def stick(t: float) -> np.ndarray:
    """What the operator's hand does (m/s): to and fro across the person's arm, sometimes nothing but noise."""
    if 1.9 < t < 2.0:
        return np.full(3, np.nan)
    return np.array([0.25, 0.45 * np.sin(2.2 * t), -0.25 * np.cos(1.1 * t)])


def hand_jacobian(robot: cdfctl.Robot, data: pin.Data, q: np.ndarray) -> np.ndarray:
    """Linear velocity of the tip frame per joint velocity (3, n), world axes."""
    frame = robot.model.getFrameId(robot.tip)
    return pin.computeFrameJacobian(robot.model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)[:3]


def main() -> None:
    robot = cdfctl.load_robot("franka", acceleration_limits=15.0)
    safe = cdfctl.SafetyFilter(robot, dt=DT, margin=0.03, self_collision=6, on_bad_input="brake")
    forearm = cdfctl.Capsule(radius=0.06, length=0.3)
    lying = [0.0, np.sin(np.pi / 4), 0.0, np.cos(np.pi / 4)]  # its axis along x
    data = robot.model.createData()

    q, u_last = robot.home.copy(), np.zeros(robot.n)
    least, steepest, held = np.inf, 0.0, set()
    for k in range(int(SECONDS / DT)):
        t = k * DT
        place = [0.75, 0.25 * np.sin(0.8 * t), 0.45]
        scene = cdfctl.Scene(
            [cdfctl.Obstacle(forearm, place, lying, velocity=[0.0, 0.2 * np.cos(0.8 * t), 0.0], name="forearm")]
        )
        u_nominal = np.linalg.pinv(hand_jacobian(robot, data, q), rcond=0.05) @ stick(t)
        decision = safe.step(q, scene, u_nominal)
        held.update(decision.active)
        steepest = max(steepest, float(np.abs(decision.u - u_last).max()) / DT)
        q, u_last = q + DT * decision.u, decision.u
        least = min(least, nearest(robot, q, scene).distance)

    print(f"steps: {dict(safe.counts)}")
    print(f"held by: {', '.join(sorted(held))}")
    print(f"greatest joint acceleration: {steepest:.2f} rad/s^2")
    print(f"least clearance, by coal: {1e3 * least:.1f} mm")


if __name__ == "__main__":
    main()
