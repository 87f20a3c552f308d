"""The shortcuts of a control step against the whole program, which clarabel solves through qpsolvers."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest
import qpsolvers
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.sparse import csc_matrix

from cdfctl.control import qp as step
from cdfctl.control.qp import StepQP
from cdfctl.control.solvers import Answer, Problem, ask, audit, contradictory
from cdfctl.types import Array, Rows

SEEDS = st.integers(0, 2**32 - 1)


def rows_of(rng: np.random.Generator, k: int, n: int, lyapunov: bool) -> Rows:
    """Soft rows of two units, and, last, one with the Lyapunov slack. Most are easy to hold, some never bind."""
    G = rng.normal(size=(k, n)) * rng.choice([0.01, 1.0], (k, 1)) * (rng.random((k, n)) < 0.8)
    rhs = np.abs(G).sum(axis=1) * rng.uniform(-0.1, 1.5, k)
    delta = np.zeros(k)
    delta[k - lyapunov :] = 1.0
    return Rows(G, rhs, delta == 0.0, delta)


def optimum(P: Array, q: Array, G: Array, h: Array, lb: Array, ub: Array) -> Array | None:
    """By clarabel through qpsolvers, an interior-point method where daqp is one of active sets."""
    rows = (csc_matrix(G), h) if len(h) else (None, None)
    sharp = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-11)
    with warnings.catch_warnings():  # it warns where there is no answer
        warnings.simplefilter("ignore", UserWarning)
        return qpsolvers.solve_qp(csc_matrix(P), q, *rows, lb=lb, ub=ub, solver="clarabel", **sharp)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(1, 14), st.integers(0, 40), st.booleans())
def test_a_step_is_the_optimum_of_all_rows(seed: int, n: int, k: int, lyapunov: bool) -> None:
    rng = np.random.default_rng(seed)
    lyapunov = lyapunov and k > 0
    rows = rows_of(rng, k, n, lyapunov)
    R, S, p = rng.uniform(0.5, 2.0, n), rng.choice([0.0, 1.0]) * rng.uniform(0.0, 2.0, n), 50.0
    low, high = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    u_ref, u_last = rng.normal(size=n), rng.uniform(-1.0, 1.0, n)
    program = StepQP(n, effort_weight=R, smoothness_weight=S, slack_weight=p, on_infeasible="fail")
    command = program.solve(u_ref, u_last, rows, low, high)
    whole = optimum(
        np.diag(np.append(R + S, 2.0 * p)),
        np.append(-R * u_ref - S * u_last, 0.0),
        np.column_stack([rows.G, -rows.delta]),
        rows.rhs,
        np.append(low, 0.0),
        np.append(high, np.inf),
    )
    if command.infeasible:
        assert whole is None
        return
    assert whole is not None
    assert command.u == pytest.approx(whole[:n], abs=1e-5)
    assert np.isnan(command.slack) if not lyapunov else command.slack == pytest.approx(whole[n], abs=1e-5)
    excess = rows.G @ command.u - rows.rhs - rows.delta * (command.slack if lyapunov else 0.0)
    assert command.residual == pytest.approx(max(0.0, *excess, 0.0), abs=1e-12)
    assert command.tight.tolist() == np.flatnonzero(excess >= -1e-6).tolist()


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.integers(1, 8), st.integers(2, 40))
def test_least_violation_is_the_optimum_of_all_rows(seed: int, n: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rows_of(rng, k, n, lyapunov=False)
    rows.rhs[:] -= rng.uniform(0.0, 2.0) * np.linalg.norm(rows.G, axis=1)
    low, high = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    u_ref, rho = rng.normal(size=n), 100.0
    command = StepQP(n, violation_weight=rho).solve(u_ref, np.zeros(n), rows, low, high)
    assume(command.status == "least-violation")
    norm = np.linalg.norm(rows.G, axis=1)
    assume((norm > 1e-6).all())
    whole = optimum(
        np.diag(np.append(np.ones(n), np.zeros(k))),
        np.append(-u_ref, np.full(k, rho)),
        np.hstack([rows.G / norm[:, None], -np.eye(k)]),
        rows.rhs / norm,
        np.append(low, np.zeros(k)),
        np.append(high, np.full(k, np.inf)),
    )
    assert whole is not None
    assert command.u == pytest.approx(whole[:n], abs=1e-5)


def test_no_solver_is_asked_where_the_box_alone_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    """u_ref within the rows, or clipped to them: the answer is the clipped reference, to the last bit."""
    monkeypatch.setattr(step, "solve", None)
    rows = Rows(np.ones((1, 2)), np.array([0.5]), np.ones(1, bool), np.zeros(1))
    command = StepQP(2).solve(np.array([5.0, -0.25]), np.zeros(2), rows, np.full(2, -0.5), np.full(2, 0.5))
    assert command.u.tolist() == [0.5, -0.25]
    assert (command.status, command.residual, command.tight.tolist()) == ("optimal", 0.0, [])


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.integers(1, 6), st.integers(1, 12), st.booleans())
def test_hopeless_is_what_the_corners_of_the_box_say(seed: int, n: int, k: int, unbounded: bool) -> None:
    """A linear function over a box is least at a corner: all of them are looked at."""
    rng = np.random.default_rng(seed)
    rows = rows_of(rng, k, n, lyapunov=True)
    low, high = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    rows.rhs[:] *= rng.choice([-1.0, 1.0], k)
    high[0] = 1e9 if unbounded else high[0]  # nearly without end, for the corners
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(-1, n)
    least = (corners @ rows.G.T - rows.rhs).min(axis=0)
    high[0] = np.inf if unbounded else high[0]
    assert step._hopeless(rows, low, high).tolist() == ((least > 1e-6) & (rows.delta == 0.0)).tolist()


@settings(max_examples=80, deadline=None)
@given(SEEDS, st.integers(1, 8), st.integers(1, 12), st.booleans())
def test_a_contradiction_is_one_to_linear_programming(seed: int, n: int, k: int, unbounded: bool) -> None:
    """Least t with G x <= h + t within the bounds: a proof where it is positive, and none anywhere else. Without a
    bound the proof may be missed."""
    rng = np.random.default_rng(seed)
    G, h = rng.normal(size=(k, n)), rng.normal(size=k) - rng.choice([0.0, 2.0])
    lb, ub = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    ub[0] = np.inf if unbounded else ub[0]
    bounds = [*zip(lb, ub, strict=True), (None, None)]
    t = linprog(np.eye(n + 1)[n], np.column_stack([G, -np.ones(k)]), h, bounds=bounds).fun
    assume(t is None or abs(t) > 1e-4)  # None: no bound below, so any t will do
    proved, true = contradictory(Problem(np.eye(n), np.zeros(n), G, h, lb, ub)), t is not None and t > 0.0
    assert proved <= true if unbounded else proved == true


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.integers(1, 14), st.integers(0, 30))
def test_daqp_directly_is_daqp_through_qpsolvers(seed: int, n: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    G, h = rng.normal(size=(k, n)), rng.normal(size=k) + 0.5
    lb, ub = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    lb[0], ub[-1] = -np.inf, np.inf
    P, q = np.diag(rng.uniform(0.5, 2.0, n)), 3.0 * rng.normal(size=n)
    answer = ask(Problem(P, q, G, h, lb, ub), "daqp")
    stated = qpsolvers.Problem(P, q, G if k else None, h if k else None, lb=lb, ub=ub)
    solution = qpsolvers.solve_problem(stated, "daqp")
    assert (answer is not None) == solution.found
    if answer is not None:
        assert answer.x.tolist() == solution.x.tolist()
        assert answer.z.tolist() == (solution.z.tolist() if k else [])
        assert answer.z_box.tolist() == solution.z_box.tolist()


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.integers(1, 14), st.integers(0, 30))
def test_audit_is_its_formula(seed: int, n: int, k: int) -> None:
    """Any candidate: the three residuals, written in matrices."""
    rng = np.random.default_rng(seed)
    G, h = rng.normal(size=(k, n)), rng.normal(size=k)
    P, q = rng.normal(size=(n, n)), rng.normal(size=n)
    lb, ub = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    x, z, z_box = rng.normal(size=n), rng.normal(size=k), rng.normal(size=n)
    ub[0] = np.inf
    found = audit(Problem(P, q, G, h, lb, ub), Answer(x, z, z_box))
    z_box[0] = min(z_box[0], 0.0)
    ub[0] = 0.0  # times a multiplier of 0
    gap = x @ P @ x + q @ x + h @ z + lb @ np.minimum(z_box, 0.0) + ub @ np.maximum(z_box, 0.0)
    ub[0] = np.inf
    assert found.primal == pytest.approx(max(0.0, *(G @ x - h), *(lb - x), *(x - ub)))
    assert found.dual == pytest.approx(max(*np.abs(P @ x + q + G.T @ z + z_box), *-z, 0.0) / (1.0 + np.abs(q).max()))
    assert found.gap == pytest.approx(abs(gap) / (1.0 + abs(x @ P @ x) + abs(q @ x)))


def test_the_usual_solver_spares_the_import_of_the_others() -> None:
    code = "import sys, cdfctl.control.qp as qp; qp.StepQP(2); sys.exit('qpsolvers' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
