"""Every constraint as a pure function: a field's answer and parameters in, rows out.

One sign convention, that of :class:`cdfctl.types.Rows`: ``G u <= rhs``. Symbols as in the documentation: ``d`` the
distance (m or rad), ``h = d - epsilon`` the barrier, ``u`` the joint velocity (rad/s). A field row takes part only
where it is ``valid`` and its distance finite: an obstacle out of reach constrains nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdfctl.types import Array, BoolArray, FieldQuery, Rows


def usable(query: FieldQuery) -> BoolArray:
    """Mask (r,) of the rows that may constrain the motion: ``valid`` and ``d`` finite."""
    mask: BoolArray = query.valid & np.isfinite(query.d)
    return mask


def tvcbf_rows(query: FieldQuery, alpha: float, margin: float) -> Rows:
    """Time-varying control barrier function: the barrier may fall no faster than ``alpha h``, obstacle motion included.

        grad h . u + dh/dt >= -alpha h      that is      -grad h . u <= alpha h + dh/dt,      h = d - margin

    Args:
        query: r rows of a field, in m or rad.
        alpha: class-K gain, 1/s.
        margin: epsilon_cbf, in the unit of the field.

    Source: the paper's TVCBF condition for the single integrator.
    """
    k = usable(query)
    h = query.d[k] - margin
    return _soft_rows("tvcbf", -query.dq[k], alpha * h + query.dt[k])


def cbf_rows(query: FieldQuery, alpha: float, margin: float) -> Rows:
    """Control barrier function that takes the scene as frozen (no time term), the paper's baseline.

        grad h . u >= -alpha h      that is      -grad h . u <= alpha h,      h = d - margin

    Args as in :func:`tvcbf_rows`.
    """
    k = usable(query)
    h = query.d[k] - margin
    return _soft_rows("cbf", -query.dq[k], alpha * h)


def hyperplane_rows(query: FieldQuery, offset: float, dt: float) -> Rows:
    """Separating hyperplane: the step toward the obstacle is bounded by the logarithm of the distance.

        -grad d . u Dt <= ln(d + b)

    It takes the distance itself, not the barrier. Where ``d + b <= 0`` the logarithm does not exist and no velocity
    satisfies the row: ``rhs`` is -inf there, which the QP counts as infeasible.

    Args:
        query: r rows of a field.
        offset: b, in the unit of the field.
        dt: Dt, the control period, s.

    Source: the paper's separating-hyperplane baseline.
    """
    k = usable(query)
    argument = query.d[k] + offset
    logarithm = np.full(argument.shape, -np.inf)
    np.log(argument, out=logarithm, where=argument > 0.0)
    return _soft_rows("hyperplane", -query.dq[k] * dt, logarithm)


def tvclf_row(now: float, ahead: FieldQuery, gamma: float, dt: float) -> Rows:
    """Time-varying control Lyapunov function: the distance to a moving target falls at the rate ``gamma``, or ``delta``
    pays for it.

        grad V+ . u <= -gamma V - (V+ - V) / Dt + delta,      delta >= 0

    with V the distance to the target where it is, V+ to where it will be one step on. This is the exact discretisation
    of ``grad V . u + dV/dt <= -gamma V + delta``: the time term of the latter looks along the tangent only, and stalls.

    Args:
        now: V, in the unit of the field; +inf where the target cannot be touched now.
        ahead: the field's one row for the target at ``t + dt``: V+ and its gradient.
        gamma: rate, 1/s.
        dt: Dt, the control period, s.

    Returns:
        One hard row with the slack, or none where V+ is out of reach. Where only V is, the target comes within reach
        in this step; V+ then stands for V, without a time term.

    Source: the paper's TVCLF condition, discretised.
    """
    k = usable(ahead)
    V_next = ahead.d[k]
    count = V_next.shape[0]
    V = np.full(count, now) if np.isfinite(now) else V_next
    return Rows(
        G=ahead.dq[k],
        rhs=-gamma * V - (V_next - V) / dt,
        soft=np.zeros(count, dtype=np.bool_),
        delta=np.ones(count),
        names=("tvclf",) * count,
    )


def joint_limit_box(
    q: Array, lower: Array, upper: Array, slowest: Array, fastest: Array, alpha: float
) -> tuple[Array, Array]:
    """Joint limits as barriers inside the velocity box, both as bounds on ``u`` (n,).

        -alpha_lim (q - q_min) <= u <= alpha_lim (q_max - q),      v_min <= u <= v_max

    Outside a limit the barrier asks for a velocity back inside; the clip into the velocity box keeps that bound
    attainable, so the box is never empty. An infinite limit bounds nothing.

    Args:
        q: configuration (n,), rad.
        lower, upper: position limits (n,), rad, infinite where the joint has none.
        slowest, fastest: v_min <= 0 and v_max >= 0 (n,), rad/s: the robot's at this configuration.
        alpha: alpha_lim, 1/s.
    """
    low = np.minimum(np.maximum(-alpha * (q - lower), slowest), fastest)
    high = np.maximum(np.minimum(alpha * (upper - q), fastest), slowest)
    return low, high


def stack(parts: Sequence[Rows], n: int) -> Rows:
    """One block of all ``parts`` over ``n`` joints; without parts, a block of no rows."""
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return Rows(np.zeros((0, n)), np.zeros(0), np.zeros(0, dtype=np.bool_), np.zeros(0), ())
    return Rows(
        G=np.concatenate([p.G for p in parts]),
        rhs=np.concatenate([p.rhs for p in parts]),
        soft=np.concatenate([p.soft for p in parts]),
        delta=np.concatenate([p.delta for p in parts]),
        names=sum((p.names for p in parts), ()),
    )


def _soft_rows(name: str, G: Array, rhs: Array) -> Rows:
    k = rhs.shape[0]
    return Rows(G=G, rhs=rhs, soft=np.ones(k, dtype=np.bool_), delta=np.zeros(k), names=(name,) * k)
