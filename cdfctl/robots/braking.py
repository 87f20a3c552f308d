"""Velocity limits that fall towards a position limit: those of an arm that insists it could still brake.

A joint that decelerates at a from the speed v_max(q) comes to rest before its end stop, with an offset o to spare:

    v_max(q) = min( v, max(0, -o + sqrt(2 a (q_max - q))) ),      v_min(q) likewise from q_min, with its sign turned

(Franka Robotics, control parameters, limits for Franka Research 3.) A velocity u that is held for a step dt must obey
the limit at the end of the step too, where it is lower: u = v_max(q + u dt) gives

    u = -(o + a dt) + sqrt( (o + a dt)^2 - o^2 + 2 a (q_max - q) )
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.robot_file import RobotFile
from cdfctl.types import Array


@dataclass(frozen=True)
class Braking:
    """What the limits are made of, joint by joint.

    Attributes:
        lower, upper: (n,) the end stops, rad; infinite where the velocity limit does not depend on position.
        deceleration: (n,) a, rad/s².
        offset: (n,) o, rad/s.
    """

    lower: Array
    upper: Array
    deceleration: Array
    offset: Array

    def bounds(self, q: Array, dt: float = 0.0) -> tuple[Array, Array]:
        """Least and greatest velocity (n,) at ``q`` (n,) that may be held for ``dt`` (s); not yet within v."""
        ahead, o = self.offset + self.deceleration * dt, self.offset
        up, down = (
            np.maximum(0.0, np.sqrt(np.maximum(0.0, ahead**2 - o**2 + 2.0 * self.deceleration * room)) - ahead)
            for room in (self.upper - q, q - self.lower)
        )
        return -down, up


def braking_of(file: RobotFile, names: Sequence[str], known: Collection[str]) -> Braking | None:
    """The braking of the joints ``names``, None where the file says nothing of any.

    Raises:
        InputError: a joint that is none of the URDF's (``known``), or end stops that do not ascend.
    """
    for name, joint in file.braking.items():
        if name not in known:
            raise InputError(f"robot '{file.name}': braking: unknown joint '{name}'", hint=name_hint(name, known))
        if not joint.lower < joint.upper:
            found = f"[{joint.lower}, {joint.upper}]"
            raise InputError(
                f"robot '{file.name}': braking: the end stops of joint '{name}' must ascend, found {found}"
            )
    if not any(name in file.braking for name in names):
        return None
    joints = [file.braking.get(name) for name in names]
    return Braking(
        lower=np.array([-np.inf if joint is None else joint.lower for joint in joints]),
        upper=np.array([np.inf if joint is None else joint.upper for joint in joints]),
        deceleration=np.array([1.0 if joint is None else joint.deceleration for joint in joints]),
        offset=np.array([0.0 if joint is None else joint.offset for joint in joints]),
    )
