"""Structs that compiled code takes by address: what it reads there is what Python put there."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.structs import Struct, compiled
from cdfctl.types import Array, BoolArray, IntArray


class Inner(Struct):
    flags: BoolArray
    cube: Array


class Outer(Struct):
    scale: float
    index: IntArray
    inner: Inner
    small: np.ndarray
    twice: Callable[[float], float]


@njit
def twice(x: float) -> float:
    return 2.0 * x


@njit
def read(s: Outer, i: int) -> float:
    """Every kind of member, and a view of an array."""
    row = s.inner.cube[i, 1]
    total: float = s.twice(s.scale) + s.index[-1] + row[row.shape[0] - 1] + s.small[i]
    return total if s.inner.flags[i] else -total


@njit
def fill(s: Inner, value: float) -> None:
    s.cube[0, 0, 0] = value
    s.flags[:] = True


def outer() -> Outer:
    inner = Inner(np.array([True, False]), np.arange(12.0).reshape(2, 2, 3))
    return Outer(0.5, np.array([3, 4]), inner, np.array([1, 2], dtype=np.float32), compiled(twice, 0.0))


def test_members_are_read():
    assert read(outer(), 0) == 1.0 + 4 + 5.0 + 1.0
    assert read(outer(), 1) == -(1.0 + 4 + 11.0 + 2.0)


def test_arrays_are_shared_not_copied():
    s = outer()
    fill(s.inner, 7.0)
    assert s.inner.cube[0, 0, 0] == 7.0
    assert s.inner.flags.all()
    s.index[-1] = 40
    assert read(s, 0) == 1.0 + 40 + 5.0 + 1.0


@pytest.mark.parametrize("again", [copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))])
def test_a_copy_has_arrays_and_a_header_of_its_own(again):
    first = outer().inner
    second = again(first)
    fill(second, -1.0)
    assert second.cube[0, 0, 0] == -1.0
    assert first.cube[0, 0, 0] == 0.0


def test_what_compiled_code_could_not_read_is_refused():
    with pytest.raises(ValueError, match="cube: an array in a struct must be contiguous"):
        Inner(np.array([True]), np.zeros((2, 3, 4)).transpose())
    with pytest.raises(TypeError, match=r"flags: a struct holds .*, not list"):
        Inner([True], np.zeros((1, 1, 1)))
