"""Whose turn it is to be searched, and from what."""

from __future__ import annotations

import numpy as np

from cdfctl.fields.kernel.memory import ALL, DRIFT, LEAP, NONE, begin_query, kind_now, new_memory
from cdfctl.fields.kernel.parts import parts_of
from cdfctl.types import Sphere

M, N, KINDS = 4, 2, 3


def kinds_of(speed: float, queries: int, leaps: tuple[int, ...] = ()) -> np.ndarray:
    """The kinds (queries, M) of obstacles, the second of which moves by ``speed`` a query, far at ``leaps``."""
    memory, parts = new_memory(M, 4, N, 2), parts_of((Sphere(0.1),) * M)
    kinds = np.zeros((queries, M), dtype=int)
    for k in range(queries):
        parts.pose[1, 0] += 1.1 * LEAP if k in leaps else speed
        begin_query(memory, np.zeros(N), parts)
        kinds[k] = [kind_now(memory, o, KINDS) for o in range(M)]
        memory.known[:] = 1
    return kinds


def test_at_first_from_all_then_from_one_kind_in_turn() -> None:
    kinds = kinds_of(0.0, 1 + 2 * M * KINDS)
    assert np.all(kinds[0] == ALL)
    for o in range(M):
        turns = np.flatnonzero(kinds[1:, o] != NONE)
        assert np.all(np.diff(turns) == M)
        assert all(set(kinds[1:][turns[i : i + KINDS], o]) == set(range(KINDS)) for i in range(KINDS))
    assert np.all((kinds[1:] != NONE).sum(axis=1) == 1)


def test_from_all_in_its_turn_after_much_motion_and_at_once_after_a_leap() -> None:
    slow, fast = 0.9 * DRIFT / M, 1.1 * DRIFT / M
    assert not np.any(kinds_of(slow, 20)[1:] == ALL)
    assert fast < LEAP
    moved = kinds_of(fast, 30)[1 + M :]
    assert set(moved[:, 1]) == {ALL, NONE}
    assert not np.any(moved[:, [0, 2, 3]] == ALL)
    leapt = kinds_of(0.0, 20, leaps=(10,))
    assert leapt[10, 1] == ALL
    assert not np.any(np.delete(leapt[1:, 1], 9) == ALL)
    assert not np.any(leapt[1:, [0, 2, 3]] == ALL)
