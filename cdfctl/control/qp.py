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

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite, isnan, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from cdfctl.control.solvers import TOLERANCE, Problem, check_solver, solve
from cdfctl.errors import InputError
from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array, BoolArray, DecisionStatus, IntArray, Rows

OnInfeasible = Literal["fail", "least-violation", "brake"]

FLAT = 1e-6
"""Least norm of a row that least violation can act on."""

_NONE: IntArray = np.zeros(0, dtype=np.int64)


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
        self._weight = self._R + self._S
        if not np.all(self._weight > 0.0):
            raise InputError("effort_weight + smoothness_weight must be greater than 0 for every joint")
        self._P = np.diag(self._weight)
        self._p, self._rho = slack_weight, violation_weight
        self._on_infeasible, self._solver, self._n = on_infeasible, solver, n

    def rehearse(self) -> None:
        """Solve small programs of every kind, so that all that a step may need is loaded and compiled: the moment an
        obstacle comes near is none to wait for that."""
        zero, one = np.zeros(self._n), np.ones(self._n)
        G, soft = np.stack([one, -one]), np.ones(2, dtype=np.bool_)
        for least in (0.5, -0.5, 2.0 * self._n):  # rows that can be satisfied, that contradict each other, that cannot
            rhs = np.array([-abs(least), 1.0 if least > 0.0 else least])
            for delta in (np.zeros(2), one[:1].repeat(2)):
                self.solve(zero, zero, Rows(G, rhs, soft, delta), -one, one)

    def solve(self, u_ref: Array, u_last: Array, rows: Rows, low: Array, high: Array) -> Command:
        """The velocity for this step; ``low``, ``high`` (n,) are the box, which must not be empty.

        The cost is a sum over the joints, so within the box alone it is least where each joint's own optimum is
        clipped to its bounds. Where that satisfies every row it is the answer, and no solver is asked.
        """
        if not np.isfinite(u_ref).all():
            raise ArithmeticError("the reference velocity is not a number")
        pull = self._R * u_ref + self._S * u_last
        has_slack = bool(np.count_nonzero(rows.delta))
        free = self._command(pull / self._weight, 0.0 if has_slack else nan, rows, low, high, "optimal")
        if free.residual <= TOLERANCE:
            return free
        start = np.append(free.u, 0.0)
        x = None
        if not _hopeless(rows, low, high).any():
            x = self._solve_all(pull, rows, low, high, start, has_slack)
        status: DecisionStatus = "optimal"
        if x is None and self._on_infeasible == "least-violation":
            x = self._solve_least_violation(pull, rows, low, high, start, has_slack)
            status = "least-violation"
        if x is None:
            x = np.zeros(self._n + 1)
            status = "infeasible" if self._on_infeasible == "fail" else "brake"
        return self._command(x[: self._n], max(0.0, float(x[self._n])) if has_slack else nan, rows, low, high, status)

    def _command(self, u: Array, slack: float, rows: Rows, low: Array, high: Array, status: DecisionStatus) -> Command:
        """``u`` (n,) clipped to the box, and how the rows stand there."""
        u = np.minimum(np.maximum(u, low), high)  # a solver may overstep a bound by its tolerance, a joint may not
        excess = np.empty(len(rows.rhs))
        greatest = _mark_excess(rows.G, rows.rhs, rows.delta, u, slack if slack > 0.0 else 0.0, excess)
        if isnan(greatest):
            raise ArithmeticError("a constraint row is not a number")
        return Command(
            u=u,
            slack=slack,
            status=status,
            infeasible=status != "optimal",
            residual=max(0.0, greatest),
            tight=(excess >= -TOLERANCE).nonzero()[0] if greatest >= -TOLERANCE else _NONE,
        )

    def _cost(self, pull: Array, variables: int, has_slack: bool) -> tuple[Array, Array]:
        """P and q over (u, delta, s): R + S on u, 2p on delta, nothing on s; ``pull`` is R u_ref + S u_last."""
        n = self._n
        P = np.zeros((variables, variables))
        P[:n, :n] = self._P
        if has_slack:
            P[n, n] = 2.0 * self._p
        q = np.zeros(variables)
        q[:n] = -pull
        return P, q

    def _bounds(self, low: Array, high: Array, variables: int) -> tuple[Array, Array]:
        lb, ub = np.zeros(variables), np.full(variables, np.inf)
        lb[: self._n], ub[: self._n] = low, high
        return lb, ub

    def _solve_all(
        self, pull: Array, rows: Rows, low: Array, high: Array, start: Array, has_slack: bool
    ) -> Array | None:
        """The program over (u, delta), or over u alone without a Lyapunov row."""
        P, q, lb, ub = self._P, -pull, low, high
        if has_slack:
            P, q = self._cost(pull, self._n + 1, has_slack)
            lb, ub = self._bounds(low, high, self._n + 1)

        def under(needed: IntArray) -> Array | None:
            G = rows.G[needed]
            if has_slack:
                G = np.column_stack((G, -rows.delta[needed]))
            return solve(Problem(P, q, G, rows.rhs[needed], lb, ub), self._solver)

        return self._under_rows_needed(rows, start, under, has_slack)

    def _solve_least_violation(
        self, pull: Array, rows: Rows, low: Array, high: Array, start: Array, has_slack: bool
    ) -> Array | None:
        """The relaxed program over (u, delta, s).

        A hopeless row needs no variable: it has ``s_i = G_i u - rhs_i`` for every u, a linear cost ``rho G_i u``.
        """
        n = self._n
        norm = np.linalg.norm(rows.G, axis=1)
        alive = ~rows.soft | (norm >= FLAT)
        scale = np.where(rows.soft & alive, 1.0 / np.maximum(norm, FLAT), 1.0)[alive]
        G, rhs = rows.G[alive] * scale[:, None], rows.rhs[alive] * scale
        scaled = Rows(G, rhs, rows.soft[alive], rows.delta[alive] * scale)
        linear = _hopeless(scaled, low, high) & scaled.soft
        rest = Rows(G[~linear], rhs[~linear], scaled.soft[~linear], scaled.delta[~linear])
        towards = pull - self._rho * G[linear].sum(axis=0)

        def under(needed: IntArray) -> Array | None:
            relaxed = rest.soft[needed].nonzero()[0]
            own = n + has_slack
            variables = own + len(relaxed)
            P, q = self._cost(towards, variables, has_slack)
            q[own:] = self._rho
            A = np.zeros((len(needed), variables))
            A[:, :n] = rest.G[needed]
            if has_slack:
                A[:, n] = -rest.delta[needed]
            A[relaxed, np.arange(own, variables)] = -1.0
            lb, ub = self._bounds(low, high, variables)
            return solve(Problem(P, q, A, rest.rhs[needed], lb, ub), self._solver)

        return self._under_rows_needed(rest, start, under, has_slack)

    def _under_rows_needed(
        self, rows: Rows, start: Array, under: Callable[[IntArray], Array | None], has_slack: bool
    ) -> Array | None:
        """The optimum x under all ``rows``, by ``under``, which finds it under those of some indices.

        Fewer rows leave more to choose from: what is best under some of them, and satisfies the others, is best under
        all; and where some have no solution, all have none. So it begins with the rows that ``start`` violates, and
        adds those that the answer violates until there are none, the n worst at a time, as each relaxed one is a
        variable more: after one turn a row at the latest. In the relaxed program a row that is satisfied has
        ``s_i = 0`` and costs nothing: the same holds.
        """
        n, x = self._n, start
        excess, needed = np.empty(len(rows.rhs)), np.zeros(len(rows.rhs), dtype=np.bool_)
        while True:
            _mark_excess(rows.G, rows.rhs, rows.delta, x[:n], float(x[n]) if has_slack else 0.0, excess)
            violated = ((excess > TOLERANCE) & ~needed).nonzero()[0]
            if x is not start and not len(violated):
                return x
            if x is not start and len(violated) > n:
                violated = violated[np.argpartition(-excess[violated], n)[:n]]
            needed[violated] = True
            answer = under(needed.nonzero()[0])
            if answer is None:
                return None
            x = answer


def _hopeless(rows: Rows, low: Array, high: Array) -> BoolArray:
    """Mask (k,) of the rows that no u of the box satisfies, beyond the solver's tolerance: no solver need be asked.

    The least of ``G_i u = sum_j G_ij u_j`` over ``low <= u <= high`` is the sum of each term's least, which is at one
    of its joint's bounds. A row with the Lyapunov slack is never hopeless.
    """
    mask = np.empty(len(rows.rhs), dtype=np.bool_)
    _mark_hopeless(rows.G, rows.rhs, rows.delta, low, high, mask)
    return mask


@njit
def _mark_hopeless(G: Array, rhs: Array, delta: Array, low: Array, high: Array, mask: BoolArray) -> None:
    for row in range(rhs.shape[0]):
        least = 0.0
        for j in range(low.shape[0]):
            if G[row, j] != 0.0:  # 0 times an infinite bound is 0
                least += G[row, j] * (low[j] if G[row, j] > 0.0 else high[j])
        mask[row] = delta[row] == 0.0 and (least > rhs[row] + TOLERANCE or rhs[row] == -inf)


@njit
def _mark_excess(G: Array, rhs: Array, delta: Array, u: Array, slack: float, excess: Array) -> float:
    """Fill ``excess`` (k,) with G u - delta slack - rhs, and return the greatest; NaN where ``G`` is not finite, or
    ``rhs`` not a number."""
    greatest, wrong = -inf, False
    for row in range(rhs.shape[0]):
        value = -delta[row] * slack
        for j in range(u.shape[0]):
            value += G[row, j] * u[j]
            wrong |= not isfinite(G[row, j])
        wrong |= isnan(rhs[row])
        excess[row] = value - rhs[row]
        greatest = max(greatest, excess[row])
    return nan if wrong else greatest
