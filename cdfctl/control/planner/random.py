"""A stream of random numbers whose state is one word: the same everywhere, whatever else draws numbers.

Source: Steele, Lea and Flood's SplitMix64.
"""

from __future__ import annotations

from math import cos, log, pi, sqrt
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cdfctl.control.planner.jit import njit

Stream: TypeAlias = NDArray[np.uint64]

_STEP: Any = np.uint64(0x9E3779B97F4A7C15)
_MIX_1: Any = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2: Any = np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


def new_stream(seed: int) -> Stream:
    """The stream of ``seed``."""
    return np.array([seed & 0xFFFFFFFFFFFFFFFF], dtype=np.uint64)


@njit
def uniform(stream: Stream) -> float:
    """The next number, uniform in [0, 1)."""
    stream[0] += _STEP
    z = stream[0]
    z = (z ^ (z >> _30)) * _MIX_1
    z = (z ^ (z >> _27)) * _MIX_2
    z = z ^ (z >> _31)
    return float(z >> _11) * (1.0 / 9007199254740992.0)


@njit
def normal(stream: Stream) -> float:
    """The next number, of the standard normal distribution (Box and Muller)."""
    radius = sqrt(-2.0 * log(1.0 - uniform(stream)))
    return radius * cos(2.0 * pi * uniform(stream))
