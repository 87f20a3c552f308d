"""Arithmetic of configurations: (n,) arrays. Whole-array expressions would allocate."""

from __future__ import annotations

from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array


@njit
def copy(source: Array, target: Array) -> None:
    """``target`` becomes ``source``."""
    for j in range(source.shape[0]):
        target[j] = source[j]


@njit
def inner(a: Array, b: Array) -> float:
    """a·b."""
    value = 0.0
    for j in range(a.shape[0]):
        value += a[j] * b[j]
    return value


@njit
def distance2(a: Array, b: Array) -> float:
    """||a - b||²."""
    value = 0.0
    for j in range(a.shape[0]):
        value += (a[j] - b[j]) ** 2
    return value
