"""Bounds on the speed of a robot's bodies within a control step.

Joint j turns a point of a body at |u_j| times the point's distance from the joint's axis. That distance is known at
both ends of the step (of the centre of a ball around the body) and in between changes only by the joints beyond j, at
most as fast as those move the point. So, from the joint nearest the body to the base, with step length T:

    D_j   = T * sum over joints i between j and the body of |u_i| r_i
    r_j   = ( dist_j(t_k) + dist_j(t_k+1) + D_j ) / 2 + radius          (a sliding joint: r_j = 1)
    speed = sum over all joints j that move the body of |u_j| r_j
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdfctl.robots.robot import Chain
from cdfctl.types import Array


def speed_bounds(
    chain: Chain, parents: Sequence[int], t: Array, q: Array, axes: Array, origins: Array, centres: Array, radii: Array
) -> Array:
    """Bounds (N, g) on the speed of any point of g bodies within each of N steps of straight joint motion, m/s.

    Args:
        chain: the kinematic tree of n joints.
        parents: (g,) the joint each body hangs on, -1 for the base.
        t: (N+1,) s.
        q: (N+1, n) configurations.
        axes: (N+1, n, 3) and
        origins: (N+1, n, 3) the joints' axes and origins, world frame.
        centres: (N+1, g, 3) and
        radii: (g,) balls around the bodies, world frame, m.
    """
    length = np.diff(t)
    rate = np.abs(np.diff(q, axis=0)) / length[:, None]
    speed = np.zeros((len(length), len(parents)))
    for body, parent in enumerate(parents):
        joint = parent
        while joint >= 0:
            if chain.prismatic[joint]:
                speed[:, body] += rate[:, joint]
            else:
                offset = np.cross(centres[:, body] - origins[:, joint], axes[:, joint])
                distance = np.linalg.norm(offset, axis=1)
                drift = length * speed[:, body]
                reach = 0.5 * (distance[:-1] + distance[1:] + drift) + radii[body]
                speed[:, body] += rate[:, joint] * reach
            joint = int(chain.parent[joint])
    return speed
