"""A small quadratic program with one equality and a box: the Newton direction of the contact search.

    min 1/2 dᵀ B d + (x - q)ᵀ d   s.t.   f + gᵀ d = 0,   lower <= x + d <= upper

Solved on the joints that are free by Cholesky; a joint that would leave its limits is put on the limit and the rest
solved again. Once fixed a joint stays so within one call: that is a heuristic, good enough for a direction. Where B is
not positive definite on the free joints, multiples of the identity are added until it is.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.structs import Struct
from cdfctl.types import Array, BoolArray, IntArray


class Quadratic(Struct):
    """Workspace: ``L`` (n, n) Cholesky factor, its diagonal inverted; ``v``, ``w`` (n,) B⁻¹ (q - x) and B⁻¹ g; ``free``
    (n,), ``fixed``. Joints that are ``still`` (n,) when the solver is called do not move."""

    L: Array
    v: Array
    w: Array
    free: IntArray
    fixed: BoolArray
    still: BoolArray


def new_quadratic(n: int) -> Quadratic:
    """A workspace for ``n`` joints."""
    return Quadratic(
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n, dtype=np.int64),
        np.zeros(n, dtype=np.bool_),
        np.zeros(n, dtype=np.bool_),
    )


@njit
def newton_direction(
    B: Array, x: Array, q: Array, f: float, g: Array, lower: Array, upper: Array, d: Array, work: Quadratic
) -> None:
    """Write the minimiser into ``d`` (n,). ``B`` (n, n) may be changed on its diagonal."""
    n = x.shape[0]
    for j in range(n):
        work.fixed[j], d[j] = work.still[j], 0.0
    for _ in range(n):
        m, level = 0, -f
        for j in range(n):
            if work.fixed[j]:
                level -= g[j] * d[j]
            else:
                work.free[m] = j
                m += 1
        if m == 0:
            return
        shift = 1.0
        while not _factor(B, work.free, m, work.L):
            for j in range(n):
                B[j, j] += shift
            shift *= 2.0
        for i in range(m):
            j = work.free[i]
            pull = q[j] - x[j]
            for k in range(n):
                if work.fixed[k]:
                    pull -= B[j, k] * d[k]
            work.v[i], work.w[i] = pull, g[j]
        _solve(work.L, m, work.v, work.w)
        gv, gw = 0.0, 0.0
        for i in range(m):
            gv += g[work.free[i]] * work.v[i]
            gw += g[work.free[i]] * work.w[i]
        multiplier = (gv - level) / gw if gw > 1e-12 else 0.0
        inside = True
        for i in range(m):
            j = work.free[i]
            d[j] = work.v[i] - multiplier * work.w[i]
            if x[j] + d[j] < lower[j] or x[j] + d[j] > upper[j]:
                d[j] = (lower[j] if x[j] + d[j] < lower[j] else upper[j]) - x[j]
                work.fixed[j] = True
                inside = False
        if inside:
            return


@njit
def _factor(B: Array, free: IntArray, m: int, L: Array) -> bool:
    """Cholesky factor of B on the ``m`` free joints; False where it is not positive definite there.

    The diagonal of L holds the inverses, since all that follows divides by it.
    """
    for i in range(m):
        row = free[i]
        for j in range(i):
            value = B[row, free[j]]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            L[i, j] = value * L[j, j]
        value = B[row, row]
        for k in range(i):
            value -= L[i, k] * L[i, k]
        if not value > 1e-9:
            return False
        L[i, i] = 1.0 / sqrt(value)
    return True


@njit
def _solve(L: Array, m: int, b: Array, c: Array) -> None:
    """L Lᵀ x = b and L Lᵀ y = c, x in place of b and y in place of c."""
    for i in range(m):
        b_i, c_i = b[i], c[i]
        for k in range(i):
            b_i -= L[i, k] * b[k]
            c_i -= L[i, k] * c[k]
        b[i], c[i] = b_i * L[i, i], c_i * L[i, i]
    for i in range(m - 1, -1, -1):
        b_i, c_i = b[i], c[i]
        for k in range(i + 1, m):
            b_i -= L[k, i] * b[k]
            c_i -= L[k, i] * c[k]
        b[i], c[i] = b_i * L[i, i], c_i * L[i, i]
