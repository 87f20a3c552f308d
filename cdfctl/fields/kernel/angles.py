"""Sine and cosine of many angles at once: half of the time of forward kinematics was spent on them.

Each angle is brought to r in [-π/4, π/4] by whole quarter turns, of which π/2 is subtracted in two parts, the first of
so few digits that its product with their number is exact (Cody and Waite); then Taylor's series, whose first term left
out is below 1e-16. There is no branch in the loop, so the compiler takes four or eight angles in one instruction, where
the mathematical library takes them one by one. Errors are below 3e-16.
"""

from __future__ import annotations

from math import cos, floor, pi, sin

from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array

WIDTH = 8  # angles that one instruction may take: arrays are as long as a multiple of it
MANY = 1e5  # rad: greater angles are left to the library
QUARTER = float.fromhex("0x1.921fb544p+0")  # the first 33 bits of π/2
REST = float.fromhex("0x1.0b4611a626331p-34")  # and the next 53


def padded(n: int) -> int:
    """The length of arrays for n angles."""
    return -(-n // WIDTH) * WIDTH


@njit
def sines_and_cosines(q: Array, angle: Array, sine: Array, cosine: Array) -> None:
    """The sine and cosine of every number of ``q`` (n,) into arrays that are :func:`padded`; ``angle`` is for that."""
    large = False
    for i in range(q.shape[0]):
        angle[i] = q[i]
        large = large or not abs(q[i]) < MANY
    if large:
        for i in range(q.shape[0]):
            sine[i], cosine[i] = sin(q[i]), cos(q[i])
        return
    for i in range(angle.shape[0]):
        turns = floor(angle[i] * (2.0 / pi) + 0.5)
        r = (angle[i] - turns * QUARTER) - turns * REST
        z = r * r
        # By Horner's rule: 1/3!, 1/5!, ... 1/15!, and 1/2!, 1/4!, ... 1/16!.
        s = -1.0 / 1307674368000.0
        s = 1.0 / 6227020800.0 + z * s
        s = -1.0 / 39916800.0 + z * s
        s = 1.0 / 362880.0 + z * s
        s = -1.0 / 5040.0 + z * s
        s = 1.0 / 120.0 + z * s
        s = -1.0 / 6.0 + z * s
        s = r + r * z * s
        c = 1.0 / 20922789888000.0
        c = -1.0 / 87178291200.0 + z * c
        c = 1.0 / 479001600.0 + z * c
        c = -1.0 / 3628800.0 + z * c
        c = 1.0 / 40320.0 + z * c
        c = -1.0 / 720.0 + z * c
        c = 1.0 / 24.0 + z * c
        c = 1.0 - 0.5 * z + z * z * c
        quarter = turns - 4.0 * floor(0.25 * turns)
        odd = quarter == 1.0 or quarter == 3.0
        first, second = (c, s) if odd else (s, c)
        sine[i] = -first if quarter >= 2.0 else first
        cosine[i] = -second if quarter == 1.0 or quarter == 2.0 else second
