"""Three-vectors as tuples of floats: they live in registers, and formulas read like the mathematics.

``Rot`` is a rotation matrix as three rows.
"""

from __future__ import annotations

from math import sqrt
from typing import TypeAlias

from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array

Vec: TypeAlias = tuple[float, float, float]
Rot: TypeAlias = tuple[Vec, Vec, Vec]

ZERO: Vec = (0.0, 0.0, 0.0)


@njit
def add(a: Vec, b: Vec) -> Vec:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit
def sub(a: Vec, b: Vec) -> Vec:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit
def scale(s: float, a: Vec) -> Vec:
    return (s * a[0], s * a[1], s * a[2])


@njit
def along(a: Vec, s: float, b: Vec) -> Vec:
    """a + s b."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@njit
def dot(a: Vec, b: Vec) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def cross(a: Vec, b: Vec) -> Vec:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit
def norm(a: Vec) -> float:
    return sqrt(dot(a, a))


@njit
def perpendicular(a: Vec) -> Vec:
    """A unit vector at right angles to ``a`` (any one, if a = 0)."""
    x, y, z = abs(a[0]), abs(a[1]), abs(a[2])
    if x <= y and x <= z:
        c = (0.0, -a[2], a[1])
    elif y <= z:
        c = (a[2], 0.0, -a[0])
    else:
        c = (-a[1], a[0], 0.0)
    length = norm(c)
    return scale(1.0 / length, c) if length > 0.0 else (0.0, 0.0, 1.0)


@njit
def rotate(r: Rot, a: Vec) -> Vec:
    """R a."""
    return (dot(r[0], a), dot(r[1], a), dot(r[2], a))


@njit
def rotate_back(r: Rot, a: Vec) -> Vec:
    """Rᵀ a."""
    return (
        r[0][0] * a[0] + r[1][0] * a[1] + r[2][0] * a[2],
        r[0][1] * a[0] + r[1][1] * a[1] + r[2][1] * a[2],
        r[0][2] * a[0] + r[1][2] * a[1] + r[2][2] * a[2],
    )


@njit
def compose(r: Rot, s: Rot) -> Rot:
    """R S."""
    columns = transpose(s)
    return (
        (dot(r[0], columns[0]), dot(r[0], columns[1]), dot(r[0], columns[2])),
        (dot(r[1], columns[0]), dot(r[1], columns[1]), dot(r[1], columns[2])),
        (dot(r[2], columns[0]), dot(r[2], columns[1]), dot(r[2], columns[2])),
    )


@njit
def transpose(r: Rot) -> Rot:
    """Rᵀ."""
    return ((r[0][0], r[1][0], r[2][0]), (r[0][1], r[1][1], r[2][1]), (r[0][2], r[1][2], r[2][2]))


@njit
def vec(array: Array, i: int) -> Vec:
    """Row i of a (k, 3) array, or the first three numbers of a wider one."""
    return (array[i, 0], array[i, 1], array[i, 2])


@njit
def vec3(array: Array) -> Vec:
    """A (3,) array."""
    return (array[0], array[1], array[2])


@njit
def store(array: Array, i: int, a: Vec) -> None:
    """Row i of a (k, 3) array becomes ``a``."""
    array[i, 0], array[i, 1], array[i, 2] = a[0], a[1], a[2]


@njit
def rot(array: Array, i: int) -> Rot:
    """Matrix i of a (k, 3, 3) array."""
    return (
        (array[i, 0, 0], array[i, 0, 1], array[i, 0, 2]),
        (array[i, 1, 0], array[i, 1, 1], array[i, 1, 2]),
        (array[i, 2, 0], array[i, 2, 1], array[i, 2, 2]),
    )


@njit
def store_rot(array: Array, i: int, r: Rot) -> None:
    """Matrix i of a (k, 3, 3) array becomes ``r``."""
    for k in range(3):
        array[i, 0, k], array[i, 1, k], array[i, 2, k] = r[0][k], r[1][k], r[2][k]
