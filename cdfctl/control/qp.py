"""The quadratic program of one control step, and what is done when no velocity satisfies its rows.

    min   1/2 (u - u_ref)' R (u - u_ref) + 1/2 (u - u_last)' S (u - u_last) + p delta^2
    s.t.  G u - delta_coefficient delta <= rhs,      low <= u <= high,      delta >= 0

``on_infeasible`` decides the rest, and every step it decides is marked in the answer:

- ``fail``: the answer says so and the trial ends;
- ``least-violation``: the same cost plus ``rho sum s_i``, ``s_i >= 0``, on the soft rows, each first divided by
  ``|G_i|`` so that rows in metres and in radians weigh alike (dropped under 1e-6); the bounds stay hard;
- ``brake``: ``u = 0``, or the nearest to it that the bounds allow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cdfctl.control.solvers import TOLERANCE, Problem, check_solver, solve
from cdfctl.errors import InputError
from cdfctl.types import Array, BoolArray, DecisionStatus, IntArray, Rows

OnInfeasible = Literal["fail", "least-violation", "brake"]

FLAT = 1e-6
"""Least norm of a row that least violation can act on."""


@dataclass(frozen=True)
class Command:
    """The answer of one step: ``u`` (n,), the Lyapunov ``slack`` (NaN without such a row), what was done (``status``),
    whether no u satisfies all rows (``infeasible``), the greatest violation of a row by the returned u, and which rows
    hold it: those that u meets with equality or not at all."""

    u: Array
    slack: float
    status: DecisionStatus
    infeasible: bool
    residual: float
    tight: IntArray


class _Reach(NamedTuple):
    """What the box alone says of each row: ``idle`` holds for every u in it, ``hopeless`` for none."""

    idle: BoolArray
    hopeless: BoolArray


class StepQP:
    """The program above for ``n`` joints; it keeps nothing from step to step."""

    def __init__(
        self,
        n: int,
        *,
        effort_weight: ArrayLike = 1.0,
        smoothness_weight: ArrayLike = 0.0,
        slack_weight: float = 100.0,
        violation_weight: float = 100.0,
        on_infeasible: OnInfeasible = "least-violation",
        solver: str = "daqp",
    ) -> None:
        """``effort_weight`` R and ``smoothness_weight`` S are one number or n (the diagonals), ``slack_weight`` is p,
        ``violation_weight`` rho. Raises :class:`InputError` for a solver that is not installed or R + S not positive.
        """
        check_solver(solver)
        self._R = np.broadcast_to(np.asarray(effort_weight, dtype=np.float64), (n,)).copy()
        self._S = np.broadcast_to(np.asarray(smoothness_weight, dtype=np.float64), (n,)).copy()
        if not np.all(self._R + self._S > 0.0):
            raise InputError("effort_weight + smoothness_weight must be greater than 0 for every joint")
        self._p, self._rho = slack_weight, violation_weight
        self._on_infeasible, self._solver, self._n = on_infeasible, solver, n

    def solve(self, u_ref: Array, u_last: Array, rows: Rows, low: Array, high: Array) -> Command:
        """The velocity for this step; ``low``, ``high`` (n,) are the box, which must not be empty."""
        if not (np.isfinite(rows.G).all() and not np.isnan(rows.rhs).any() and np.isfinite(u_ref).all()):
            raise ArithmeticError("a constraint row or the reference velocity is not a number")
        reach = _reach(rows, low, high)
        x = None
        if not reach.hopeless.any():
            x = self._solve_all(u_ref, u_last, rows, low, high, ~reach.idle)
        if x is not None:
            return self._command(x, rows, low, high, "optimal")
        if self._on_infeasible == "least-violation":
            x = self._solve_least_violation(u_ref, u_last, rows, low, high)
            if x is not None:
                return self._command(x, rows, low, high, "least-violation")
        still = np.zeros(self._n + 1) if rows.delta.any() else np.zeros(self._n)
        return self._command(still, rows, low, high, "infeasible" if self._on_infeasible == "fail" else "brake")

    def _command(self, x: Array, rows: Rows, low: Array, high: Array, status: DecisionStatus) -> Command:
        n = self._n
        u = np.minimum(np.maximum(x[:n], low), high)  # a solver may overstep a bound by its tolerance, a joint may not
        has_slack = bool(rows.delta.any())
        slack = max(0.0, float(x[n])) if has_slack else float("nan")
        excess = rows.G @ u - rows.rhs
        if has_slack:
            excess -= rows.delta * slack
        return Command(
            u=u,
            slack=slack,
            status=status,
            infeasible=status != "optimal",
            residual=max(0.0, float(excess.max())) if excess.shape[0] else 0.0,
            tight=np.flatnonzero(excess >= -TOLERANCE),
        )

    def _cost(self, u_ref: Array, u_last: Array, variables: int, has_slack: bool) -> tuple[Array, Array]:
        """P and q over (u, delta, s): R + S on u, 2p on delta, nothing on s."""
        n = self._n
        P = np.zeros((variables, variables))
        diagonal = np.einsum("ii->i", P)  # a writable view
        diagonal[:n] = self._R + self._S
        if has_slack:
            diagonal[n] = 2.0 * self._p
        q = np.zeros(variables)
        q[:n] = -self._R * u_ref - self._S * u_last
        return P, q

    def _bounds(self, low: Array, high: Array, variables: int) -> tuple[Array, Array]:
        lb, ub = np.zeros(variables), np.full(variables, np.inf)
        lb[: self._n], ub[: self._n] = low, high
        return lb, ub

    def _solve_all(
        self, u_ref: Array, u_last: Array, rows: Rows, low: Array, high: Array, keep: BoolArray
    ) -> Array | None:
        has_slack = bool(rows.delta.any())
        variables = self._n + has_slack
        P, q = self._cost(u_ref, u_last, variables, has_slack)
        lb, ub = self._bounds(low, high, variables)
        G = np.hstack([rows.G[keep], -rows.delta[keep, None]]) if has_slack else rows.G[keep]
        return solve(Problem(P, q, G, rows.rhs[keep], lb, ub), self._solver)

    def _solve_least_violation(self, u_ref: Array, u_last: Array, rows: Rows, low: Array, high: Array) -> Array | None:
        """The relaxed program over (u, delta, s).

        What the box decides needs no variable: an idle row is left out, and a hopeless one has ``s_i = G_i u - rhs_i``
        for every u, so it is a linear cost ``rho G_i u``.
        """
        n, has_slack = self._n, bool(rows.delta.any())
        norm = np.linalg.norm(rows.G, axis=1)
        alive = ~rows.soft | (norm >= FLAT)
        scale = np.where(rows.soft & alive, 1.0 / np.maximum(norm, FLAT), 1.0)[alive]
        G, rhs = rows.G[alive] * scale[:, None], rows.rhs[alive] * scale
        soft, delta = rows.soft[alive], rows.delta[alive] * scale
        idle, hopeless = _reach(Rows(G, rhs, soft, delta, ()), low, high)
        linear = hopeless & soft
        keep = ~(idle | linear)
        relaxed = np.nonzero(soft[keep])[0]

        own = n + has_slack
        variables = own + relaxed.shape[0]
        P, q = self._cost(u_ref, u_last, variables, has_slack)
        q[:n] += self._rho * G[linear].sum(axis=0)
        q[own:] = self._rho
        A = np.zeros((int(keep.sum()), variables))
        A[:, :n] = G[keep]
        if has_slack:
            A[:, n] = -delta[keep]
        A[relaxed, np.arange(own, variables)] = -1.0
        lb, ub = self._bounds(low, high, variables)
        return solve(Problem(P, q, A, rhs[keep], lb, ub), self._solver)


def _reach(rows: Rows, low: Array, high: Array) -> _Reach:
    """Compare each row with its least and greatest value over the box, by interval arithmetic.

    ``hopeless`` is a proof that no u satisfies the row (beyond the solver's tolerance), so no solver need be asked. A
    row with the Lyapunov slack is neither. In an unbounded box only ``rhs = -inf`` is hopeless.
    """
    hard = rows.delta == 0.0
    span = high - low
    if not np.isfinite(span).all():
        return _Reach(rows.rhs == np.inf, (rows.rhs == -np.inf) & hard)
    centre = rows.G @ (0.5 * (low + high))
    radius = np.abs(rows.G) @ (0.5 * span)
    return _Reach((centre + radius <= rows.rhs) & hard, (centre - radius > rows.rhs + TOLERANCE) & hard)
