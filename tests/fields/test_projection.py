"""The two small solvers of the contact search against SciPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize

from cdfctl.fields.kernel.projection import project
from cdfctl.fields.kernel.quadratic import new_quadratic, newton_direction


def problem(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    lower, upper = -rng.uniform(0.1, 2.0, n), rng.uniform(0.1, 2.0, n)
    g = rng.normal(size=n) * (rng.random(n) < 0.8)
    return rng, n, lower, upper, rng.uniform(lower, upper), g, float(rng.normal() * rng.choice([0.01, 0.3, 1.0]))


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_projection_is_the_root_of_its_dual(seed) -> None:
    rng, n, lower, upper, x, g, f = problem(seed)
    target, y = rng.normal(0.0, 2.0, n), np.zeros(n)
    project(target, x, f, g, lower, upper, y)
    level = g @ x - f
    least, greatest = np.minimum(g * lower, g * upper).sum(), np.maximum(g * lower, g * upper).sum()
    if least + 1e-9 < level < greatest - 1e-9:

        def excess(multiplier):
            return g @ np.clip(target - multiplier * g, lower, upper) - level

        root = brentq(excess, -1e7, 1e7, xtol=1e-13)
        expected = np.clip(target - root * g, lower, upper)
        assert abs(g @ y - level) < 1e-9
        assert np.linalg.norm(y - target) <= np.linalg.norm(expected - target) + 1e-6
    elif np.any(g != 0.0):
        assert abs(g @ y - np.clip(level, least, greatest)) < 1e-6


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_newton_direction_without_active_limits_is_the_optimum(seed) -> None:
    rng, n, _, _, x, g, f = problem(seed)
    if np.linalg.norm(g) < 0.3 or n < 2:
        return
    root = rng.normal(size=(n, n))
    B = root @ root.T + np.eye(n)
    q, d, far = x + rng.normal(size=n), np.zeros(n), np.full(n, 1e6)
    newton_direction(B.copy(), x, q, f, g, -far, far, d, new_quadratic(n))
    answer = minimize(
        lambda d: 0.5 * d @ B @ d + (x - q) @ d,
        np.zeros(n),
        jac=lambda d: B @ d + x - q,
        constraints=[{"type": "eq", "fun": lambda d: f + g @ d, "jac": lambda d: g}],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 200},
    )
    np.testing.assert_allclose(d, answer.x, atol=1e-4)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_newton_direction_stays_within_limits(seed) -> None:
    rng, n, lower, upper, x, g, f = problem(seed)
    B = rng.normal(size=(n, n))
    d = np.zeros(n)
    newton_direction(B + B.T, x, x + rng.normal(size=n), f, g, lower, upper, d, new_quadratic(n))
    assert np.isfinite(d).all()
