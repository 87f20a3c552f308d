"""How obstacles really move, from positions that are noisy and velocities that are wrong for good.

A velocity that is off by the same b at every step shows in the positions: they do not go where it leads. For each
obstacle p and b are estimated by a Kalman filter, all coordinates alike,

    p <- p + (v - b) T,     z = p + noise

with z and v the position and velocity measured, v the mean of two, T the time between them. What is believed is p and
v - b. The motion need not be straight: where v turns, v - b turns with it. A velocity that changes has changed at any
time within T, so that p is then uncertain by T |change| / 2, and its new error is another: b is uncertain by a share of
the change. Where positions and velocities agree, nothing is changed.

A position that is the same as before has been held and not measured; one that does not fit begins the obstacle anew.
"""

from __future__ import annotations

import numpy as np

from cdfctl.types import Array, Scene

NOISE = 0.01  # m: standard deviation of a coordinate of a position
SHARE = 0.15  # of the speed: standard deviation of a coordinate of the velocity's error,
SLOW = 0.1  # m/s: and that much of any velocity, so that none at all will do,
DRIFT = 0.05  # m/s in a second: and so much does it change
GATE = 5.0  # standard deviations: a position farther off than this does not fit


class Tracker:
    """Estimates over the scenes of one loop."""

    def __init__(self, dt: float, noise: float = NOISE, share: float = SHARE) -> None:
        """``dt`` (s) is the time from scene to scene; ``noise`` (m) and ``share`` are what is expected of positions and
        velocities."""
        self._dt, self._noise, self._share = dt, noise, share
        self.reset()

    def reset(self) -> None:
        """Forget the scenes so far."""
        self._names: tuple[str, ...] | None = None

    def update(self, scene: Scene) -> Scene:
        """What is to be believed of ``scene``, at the time it was measured."""
        z, v = scene.poses[:, :3], scene.twists[:, :3]
        if scene.names != self._names:
            self._names, self._age = scene.names, np.zeros(len(scene))
            self._z, self._v, self._p, self._b = z.copy(), v.copy(), z.copy(), np.zeros_like(v)
            self._pp, self._pb, self._bb = self._begun(self._v)
            return scene
        self._age += self._dt
        T, change = self._age, np.linalg.norm(v - self._v, axis=1)
        p = self._p + (0.5 * (v + self._v) - self._b) * T[:, None]
        pp = self._pp - 2.0 * T * self._pb + T * T * self._bb + (0.5 * T * change) ** 2
        pb = self._pb - T * self._bb
        bb = self._bb + (self._share * change) ** 2 + DRIFT**2 * T
        gap, spread = z - p, pp + self._noise**2
        held = (z == self._z).all(axis=1)
        fits = (gap * gap).sum(axis=1) <= GATE**2 * spread
        p += (pp / spread)[:, None] * gap
        b = self._b + (pb / spread)[:, None] * gap
        pp, pb, bb = pp * self._noise**2 / spread, pb * self._noise**2 / spread, bb - pb * pb / spread
        if not fits.all():
            p[~fits], b[~fits] = z[~fits], 0.0
            pp[~fits], pb[~fits], bb[~fits] = self._begun(v[~fits])
        if held.any():
            p[held], b[held], T = self._p[held], self._b[held], np.where(held, T, 0.0)
            pp[held], pb[held], bb[held] = self._pp[held], self._pb[held], self._bb[held]
            v = np.where(held[:, None], self._v, v)
        else:
            T = np.zeros(len(scene))
        self._p, self._b, self._pp, self._pb, self._bb = p, b, pp, pb, bb
        self._z, self._v, self._age = z.copy(), v.copy(), T
        poses, twists = scene.poses.copy(), scene.twists.copy()
        poses[:, :3] = p
        twists[:, :3] -= b
        return Scene.from_arrays(scene.shapes, scene.names, poses, twists)

    def _begun(self, v: Array) -> tuple[Array, Array, Array]:
        """The variances (m,) of p, of p and b, of b, of obstacles measured for the first time at velocities ``v``."""
        m = len(v)
        return np.full(m, self._noise**2), np.zeros(m), self._share**2 * (v * v).sum(axis=1) + SLOW**2
