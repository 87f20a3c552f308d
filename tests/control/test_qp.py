"""The step's quadratic program against independent referees: linear programming, duality, hand-solved cases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdfctl.control.qp import StepQP
from cdfctl.control.solvers import Answer, Problem, ask, audit, solve
from cdfctl.errors import InputError
from cdfctl.types import Array, Rows


def soft_rows(G: Array, rhs: Array) -> Rows:
    k = len(rhs)
    return Rows(np.asarray(G, float), np.asarray(rhs, float), np.ones(k, bool), np.zeros(k))


def clf_row(g: Array, rhs: float) -> Rows:
    return Rows(np.asarray(g, float)[None], np.array([rhs]), np.zeros(1, bool), np.ones(1))


def feasible(G: Array, rhs: Array, low: Array, high: Array) -> float:
    """Least t with G u <= rhs + t |G_i|, low <= u <= high: at most 0 exactly where the rows can be met."""
    n = G.shape[1]
    norm = np.linalg.norm(G, axis=1)
    answer = linprog(
        np.r_[np.zeros(n), 1.0],
        A_ub=np.hstack([G, -norm[:, None]]),
        b_ub=rhs,
        bounds=[*zip(low, high, strict=True), (None, None)],
        method="highs",
    )
    return float(answer.x[n])


random_problem = st.tuples(st.integers(0, 2**32 - 1), st.integers(1, 8), st.integers(0, 12), st.floats(-1.5, 1.5))


@settings(max_examples=120, deadline=None)
@given(random_problem)
def test_optimal_exactly_where_linear_programming_says_feasible(case: tuple[int, int, int, float]) -> None:
    seed, n, k, shift = case
    rng = np.random.default_rng(seed)
    G, rhs = rng.normal(size=(k, n)), rng.normal(size=k) + shift
    low, high = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    u_ref = 5.0 * rng.normal(size=n)
    command = StepQP(n, on_infeasible="fail").solve(u_ref, np.zeros(n), soft_rows(G, rhs), low, high)
    margin = feasible(G, rhs, low, high) if k else -1.0
    assume(abs(margin) > 1e-5)
    assert command.infeasible == (margin > 0.0)
    assert np.all(command.u >= low)
    assert np.all(command.u <= high)
    if margin > 0.0:
        assert command.status == "infeasible"
        return
    assert command.residual <= 1e-6
    # No feasible direction improves the cost: minimise its gradient over the feasible set by linear programming.
    gradient = command.u - u_ref
    best = linprog(gradient, A_ub=G if k else None, b_ub=rhs if k else None, bounds=list(zip(low, high, strict=True)))
    assert gradient @ command.u <= best.fun + 1e-5 * (1.0 + abs(best.fun))


@settings(max_examples=150, deadline=None)
@given(random_problem, st.sampled_from([1.0, 100.0]))
def test_least_violation_is_optimal(case: tuple[int, int, int, float], rho: float) -> None:
    """A convex cost is least where zero is a subgradient: linear programming looks for one.

    0 = (u - u_ref) + G'z + w,    z_i = rho where row i is violated, 0 where it is slack, between where it is active;
    w_j <= 0 at a lower bound, >= 0 at an upper one, 0 inside.
    """
    seed, n, k, shift = case
    assume(k > 0)
    rng = np.random.default_rng(seed)
    scale = rng.uniform(0.01, 10.0, k)
    G, rhs = rng.normal(size=(k, n)), rng.normal(size=k) + shift - 2.0
    G /= np.linalg.norm(G, axis=1)[:, None]
    low, high = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    u_ref = 5.0 * rng.normal(size=n)
    qp = StepQP(n, on_infeasible="least-violation", violation_weight=rho)
    # The rows are handed over in arbitrary units; the normalisation must undo that.
    command = qp.solve(u_ref, np.zeros(n), soft_rows(G * scale[:, None], rhs * scale), low, high)
    assume(command.status == "least-violation")
    u, excess, near = command.u, G @ command.u - rhs, 1e-6
    z_bounds = [(0.0 if e < near else rho, 0.0 if e < -near else rho) for e in excess]
    w_bounds = [
        (None if x - lo < near else 0.0, None if hi - x < near else 0.0) for x, lo, hi in zip(u, low, high, strict=True)
    ]
    stationarity = np.hstack([G.T, np.eye(n)])
    # Least t with |u - u_ref + G'z + w| <= t in every component.
    answer = linprog(
        np.r_[np.zeros(k + n), 1.0],
        A_ub=np.vstack([np.c_[stationarity, -np.ones(n)], np.c_[-stationarity, -np.ones(n)]]),
        b_ub=np.r_[u_ref - u, u - u_ref],
        bounds=[*z_bounds, *w_bounds, (0.0, None)],
        method="highs",
    )
    assert answer.success
    assert answer.x[-1] <= 1e-5 * (1.0 + rho)


def test_one_joint_by_hand() -> None:
    """min 1/2 R (u - 3)^2 + 1/2 S (u - 1)^2: (3 R + S)/(R + S) until a row or the box stops it."""
    qp = StepQP(1, effort_weight=2.0, smoothness_weight=6.0)
    one = np.ones(1)
    free = qp.solve(3.0 * one, one, soft_rows(np.zeros((0, 1)), np.zeros(0)), -5.0 * one, 5.0 * one)
    assert free.u == pytest.approx([1.5])
    assert not free.infeasible
    assert free.residual == 0.0
    assert np.isnan(free.slack)
    bound = qp.solve(3.0 * one, one, soft_rows(np.array([[2.0]]), np.array([1.0])), -5.0 * one, 5.0 * one)
    assert bound.u == pytest.approx([0.5])
    boxed = qp.solve(3.0 * one, one, soft_rows(np.array([[2.0]]), np.array([1.0])), -5.0 * one, 0.25 * one)
    assert boxed.u == pytest.approx([0.25])


def test_lyapunov_slack_by_hand() -> None:
    """min 1/2 u^2 + p d^2 with u - d <= -1: stationarity gives u = -z, d = z / 2p, so z = 1 / (1 + 1 / 2p)."""
    p = 50.0
    qp = StepQP(1, slack_weight=p)
    command = qp.solve(np.zeros(1), np.zeros(1), clf_row(np.array([1.0]), -1.0), -5.0 * np.ones(1), 5.0 * np.ones(1))
    z = 1.0 / (1.0 + 0.5 / p)
    assert command.u == pytest.approx([-z])
    assert command.slack == pytest.approx(z / (2 * p))
    assert command.status == "optimal"


def test_lyapunov_row_is_not_relaxed_by_least_violation() -> None:
    """Two contradicting soft rows and a Lyapunov row: its slack keeps its own weight."""
    rows = Rows(
        G=np.array([[1.0], [-1.0], [1.0]]),
        rhs=np.array([-1.0, -1.0, -0.5]),
        soft=np.array([True, True, False]),
        delta=np.array([0.0, 0.0, 1.0]),
    )
    command = StepQP(1, slack_weight=100.0).solve(np.zeros(1), np.zeros(1), rows, -5.0 * np.ones(1), 5.0 * np.ones(1))
    assert command.status == "least-violation"
    # Any u in [-1, 1] violates the pair by 2 in all; the rest of the cost, 1/2 u^2 + p max(0, u + 1/2)^2, decides.
    assert command.u == pytest.approx([-0.5 * 200 / 201], abs=1e-6)
    assert command.slack == pytest.approx(0.5 + command.u[0], abs=1e-6)
    assert command.residual == pytest.approx(1.0 - command.u[0], abs=1e-6)


@pytest.mark.parametrize("rule", ["fail", "brake", "least-violation"])
def test_contradiction_under_each_rule(rule: str) -> None:
    G, rhs = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-1.0, -0.5])
    qp = StepQP(2, on_infeasible=rule)  # type: ignore[arg-type]  # parametrised over the literals
    command = qp.solve(np.array([0.0, 3.0]), np.zeros(2), soft_rows(G, rhs), np.array([-2.0, 0.5]), np.full(2, 2.0))
    assert command.infeasible
    expected = {"fail": ("infeasible", [0.0, 0.5]), "brake": ("brake", [0.0, 0.5])}
    if rule in expected:
        status, u = expected[rule]
        assert command.status == status
        assert command.u.tolist() == u  # as still as the box allows: joint 2 must move at 0.5
        assert command.residual == pytest.approx(1.0)
    else:
        assert command.status == "least-violation"
        # Both rows have weight rho: anything in [-1, 0.5] violates by 1.5 in all, and the cost takes u_1 = 0.
        assert command.u == pytest.approx([0.0, 2.0], abs=1e-6)


def test_row_without_logarithm_is_infeasible_and_still_relaxable() -> None:
    rows = soft_rows(np.array([[1.0, 1.0]]), np.array([-np.inf]))
    low, high = np.full(2, -2.0), np.full(2, 2.0)
    assert StepQP(2, on_infeasible="fail").solve(np.ones(2), np.zeros(2), rows, low, high).status == "infeasible"
    relaxed = StepQP(2).solve(np.ones(2), np.zeros(2), rows, low, high)
    assert relaxed.u == pytest.approx([-2.0, -2.0])  # retreats at full speed
    assert relaxed.residual == np.inf
    unbounded = StepQP(2).solve(np.ones(2), np.zeros(2), rows, np.full(2, -np.inf), np.full(2, np.inf))
    assert unbounded.u == pytest.approx(1.0 - 100.0 / np.sqrt(2.0) * np.ones(2))


def test_flat_row_is_dropped_by_least_violation_only() -> None:
    rows = soft_rows(np.array([[1e-8, 0.0]]), np.array([-1.0]))
    low, high = np.full(2, -2.0), np.full(2, 2.0)
    relaxed = StepQP(2).solve(np.ones(2), np.zeros(2), rows, low, high)
    assert relaxed.infeasible
    assert relaxed.u == pytest.approx([1.0, 1.0])
    braked = StepQP(2, on_infeasible="brake").solve(np.ones(2), np.zeros(2), rows, low, high)
    assert braked.status == "brake"


def test_unknown_solver_names_the_installed_ones() -> None:
    with pytest.raises(InputError, match="not installed") as caught:
        StepQP(2, solver="dapq")
    assert "did you mean daqp?" in str(caught.value)
    assert "clarabel" in str(caught.value)


def test_weights_must_be_positive() -> None:
    with pytest.raises(InputError, match="greater than 0"):
        StepQP(2, effort_weight=0.0)


def test_not_a_number_is_never_solved() -> None:
    rows = soft_rows(np.array([[np.nan, 0.0]]), np.array([1.0]))
    with pytest.raises(ArithmeticError):
        StepQP(2).solve(np.ones(2), np.zeros(2), rows, -np.ones(2), np.ones(2))


@pytest.mark.parametrize("solver", ["daqp", "clarabel"])
def test_audit_accepts_the_optimum_and_refuses_its_neighbours(solver: str) -> None:
    rng = np.random.default_rng(3)
    n, k = 6, 9
    q, G, h = 5.0 * rng.normal(size=n), rng.normal(size=(k, n)), rng.uniform(0.1, 1.0, k)
    problem = Problem(np.eye(n), q, G, h, np.full(n, -2.0), np.full(n, 2.0))
    answer = ask(problem, solver)
    assert answer is not None
    assert audit(problem, answer).accepted
    for step in (1e-3, -1e-3):
        moved = Answer(answer.x + step * rng.normal(size=n), answer.z, answer.z_box)
        assert not audit(problem, moved).accepted
    assert not audit(problem, Answer(answer.x, -answer.z, answer.z_box)).accepted
    assert not audit(problem, Answer(np.full(n, np.nan), answer.z, answer.z_box)).accepted


def test_second_opinion_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first solver that misses, or answers wrongly, does not decide."""
    from cdfctl.control import solvers

    problem = Problem(np.eye(2), -np.ones(2), np.array([[1.0, 1.0]]), np.ones(1), np.full(2, -2.0), np.full(2, 2.0))
    honest = solvers.ask
    asked: list[str] = []

    def fooled(stated: Problem, solver: str) -> Answer | None:
        asked.append(solver)
        wrong = Answer(np.zeros(2), np.zeros(1), np.zeros(2))
        return wrong if solver == "daqp" else honest(stated, solver)

    monkeypatch.setattr(solvers, "ask", fooled)
    x = solve(problem, "daqp")
    assert asked == ["daqp", "clarabel"]
    assert x == pytest.approx([0.5, 0.5], abs=1e-6)
