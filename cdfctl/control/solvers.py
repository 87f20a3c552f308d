"""One quadratic program, solved and audited: no answer leaves here unless it satisfies its own optimality conditions.

    min  1/2 x'P x + q'x      subject to      G x <= h,      lb <= x <= ub

Solvers are reached by name through qpsolvers, but for the two that every installation has, daqp and clarabel: those
are called directly, which takes a third of the time for a program of a control step, and spares the start of a process
the import of all the others. A solver's own claim of success is not taken for an answer: the primal residual, the dual
residual and the duality gap are computed here. Nor is its word taken that there is none: either that is proved here, or
:data:`SECOND_OPINION` is asked, as it is for what the chosen solver misses.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple

import daqp
import numpy as np

from cdfctl.errors import InputError, name_hint
from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array

SECOND_OPINION = "clarabel"

TOLERANCE = 1e-6
"""Greatest residual of an accepted answer: rows in their own unit, dual residual and gap relative to the cost."""

# Solvers whose own default tolerance is looser than ours.
_SETTINGS: dict[str, dict[str, Any]] = {
    "proxqp": {"eps_abs": 1e-9, "eps_rel": 0.0},
    "osqp": {"eps_abs": 1e-9, "eps_rel": 0.0},
    "scs": {"eps_abs": 1e-9, "eps_rel": 0.0},
}


class Problem(NamedTuple):
    """The program above: ``P`` (v, v), ``q`` (v,), ``G`` (k, v), ``h`` (k,), bounds (v,), infinite where there are
    none."""

    P: Array
    q: Array
    G: Array
    h: Array
    lb: Array
    ub: Array


class Answer(NamedTuple):
    """A candidate: ``x`` (v,), the multipliers of the rows ``z`` (k,) and of the bounds ``z_box`` (v,; negative at a
    lower bound)."""

    x: Array
    z: Array
    z_box: Array


class Audit(NamedTuple):
    """How far a candidate is from optimal; all three are zero at an optimum."""

    primal: float
    dual: float
    gap: float

    @property
    def accepted(self) -> bool:
        """All three within :data:`TOLERANCE` (a NaN is not)."""
        return self.primal <= TOLERANCE and self.dual <= TOLERANCE and self.gap <= TOLERANCE


def check_solver(name: str) -> None:
    """Raise :class:`InputError` naming the installed solvers where ``name`` is not one of them."""
    if name in _DIRECT:
        return
    import qpsolvers

    installed = qpsolvers.available_solvers
    if name not in installed:
        raise InputError(f"QP solver '{name}' is not installed", hint=name_hint(name, sorted(installed)))


def solve(problem: Problem, solver: str) -> Array | None:
    """The optimum x (v,) of ``problem``; None where it is proved that there is none, or two solvers miss it."""
    for name in dict.fromkeys((solver, SECOND_OPINION)):
        answer = ask(problem, name)
        if answer is not None and audit(problem, answer).accepted:
            return answer.x
        if answer is None and contradictory(problem):
            return None
    return None


def contradictory(problem: Problem) -> bool:
    """Whether it is proved that no x within the bounds satisfies all rows to :data:`TOLERANCE`.

    Any weights z >= 0 that sum to 1 make one row of all of them, ``z'G x <= z'h``. Where its left side is greater than
    its right by more than the tolerance even at its least within the bounds, at least one row is violated by as much,
    whatever x is (Farkas' lemma: where there is a contradiction, there are such weights). They are looked for as the
    multipliers of ``min 1/2 |s|^2`` under ``G x - s <= h``, in which z = s.
    """
    _, q, G, h, lb, ub = problem
    v, k = len(q), len(h)
    P, free = np.eye(v + k), np.full(k, np.inf)
    P[:v] *= 1e-8  # so that the optimum is a single one
    A = np.hstack((G, -np.eye(k)))
    answer = _ask_daqp(Problem(P, np.zeros(v + k), A, h, np.append(lb, -free), np.append(ub, free)))
    if answer is None or not answer.z.sum() > 0.0:
        return False
    z = np.maximum(answer.z, 0.0)
    z /= z.sum()
    row = z @ G
    some = row != 0.0  # 0 times an infinite bound is 0
    least = row[some] @ np.where(row > 0.0, lb, ub)[some]
    return bool(least - z @ h > TOLERANCE)


def ask(problem: Problem, solver: str) -> Answer | None:
    """One solver's answer, unaudited; None where it reports none."""
    return _DIRECT[solver](problem) if solver in _DIRECT else _ask_by_name(problem, solver)


def _ask_by_name(problem: Problem, solver: str) -> Answer | None:
    """Any solver that qpsolvers knows."""
    import qpsolvers

    P, q, G, h, lb, ub = problem
    rows = G.shape[0] > 0
    if solver not in qpsolvers.dense_solvers:
        from scipy.sparse import csc_matrix  # sparse solvers warn about dense matrices

        P, G = csc_matrix(P), csc_matrix(G)
    stated = qpsolvers.Problem(P, q, G if rows else None, h if rows else None, lb=lb, ub=ub)
    try:
        with warnings.catch_warnings():  # some report "not found" as a warning too
            warnings.simplefilter("ignore", UserWarning)
            solution = qpsolvers.solve_problem(stated, solver, **_SETTINGS.get(solver, {}))
    except qpsolvers.exceptions.QPError:
        return None
    if not solution.found or solution.x is None:
        return None
    z = solution.z if rows and solution.z is not None else np.zeros(len(h))
    z_box = solution.z_box if solution.z_box is not None else np.zeros(len(q))
    return Answer(solution.x, z, z_box)


def _ask_daqp(problem: Problem) -> Answer | None:
    """daqp states bounds and rows as one: lower <= (x, A x) <= upper, infinite from 1e30 on."""
    P, q, G, h, lb, ub = problem
    v, k = len(q), len(h)
    lower = np.full(v + k, -np.inf)
    lower[:v] = lb
    upper = np.concatenate((ub, h))
    x, _, status, info = daqp.solve(P, q, G, upper, lower, np.zeros(v + k, dtype=np.intc))
    if status <= 0:
        return None
    return Answer(x, info["lam"][v:], info["lam"][:v])


def _ask_clarabel(problem: Problem) -> Answer | None:
    """Clarabel without the wrapper, which costs ten times the solve and warns wherever a program is infeasible."""
    import clarabel
    from scipy.sparse import csc_matrix

    P, q, G, h, lb, ub = problem
    upper, lower = np.isfinite(ub).nonzero()[0], np.isfinite(lb).nonzero()[0]
    eye = np.eye(len(q))
    A = np.vstack([G, eye[upper], -eye[lower]])
    b = np.concatenate([h, ub[upper], -lb[lower]])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.NonnegativeConeT(len(b))] if len(b) else []
    result = clarabel.DefaultSolver(csc_matrix(P), q, csc_matrix(A), b, cones, settings).solve()
    if result.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        return None
    k = len(h)
    z = np.array(result.z)
    z_box = np.zeros(len(q))
    z_box[upper] += z[k : k + len(upper)]
    z_box[lower] -= z[k + len(upper) :]
    return Answer(np.array(result.x), z[:k], z_box)


_DIRECT: dict[str, Callable[[Problem], Answer | None]] = {"daqp": _ask_daqp, "clarabel": _ask_clarabel}


def audit(problem: Problem, answer: Answer) -> Audit:
    """The optimality conditions of ``answer``, with z+ = max(z, 0) and z- = min(z, 0):

        primal  max( G x - h, lb - x, x - ub, 0 )
        dual    max( |P x + q + G'z + z_box|, -z ) / (1 + max|q|)
        gap     | x'P x + q'x + h'z + lb'z_box- + ub'z_box+ | / (1 + |x'P x| + |q'x|)

    Source: the residuals of Caron et al., qpsolvers, made relative to the size of the cost.
    """
    return Audit(*_residuals(*problem, *answer))


@njit
def _residuals(
    P: Array, q: Array, G: Array, h: Array, lb: Array, ub: Array, x: Array, z: Array, z_box: Array
) -> tuple[float, float, float]:
    """The three of :func:`audit`. A NaN in x or z always comes out in the gap."""
    v, k = q.shape[0], h.shape[0]
    primal, dual, size = 0.0, 0.0, 0.0
    quadratic, linear, paid = 0.0, 0.0, 0.0
    for i in range(v):
        pull = z_box[i]
        bound = lb[i] if pull < 0.0 else ub[i]
        if not isfinite(bound):  # an infinite bound has no multiplier
            bound, pull = 0.0, 0.0
        curved = 0.0
        for j in range(v):
            curved += P[i, j] * x[j]
        stationary = curved + q[i] + pull
        for row in range(k):
            stationary += G[row, i] * z[row]
        quadratic += x[i] * curved
        linear += q[i] * x[i]
        paid += bound * pull
        size = max(size, abs(q[i]))
        dual = max(dual, abs(stationary))
        primal = max(primal, lb[i] - x[i], x[i] - ub[i])
    for row in range(k):
        value = 0.0
        for i in range(v):
            value += G[row, i] * x[i]
        paid += h[row] * z[row]
        dual = max(dual, -z[row])
        primal = max(primal, value - h[row])
    gap = quadratic + linear + paid
    return primal, dual / (1.0 + size), abs(gap) / (1.0 + abs(quadratic) + abs(linear))
