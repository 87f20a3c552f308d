"""Every constraint as a pure function: a field's answer and parameters in, rows out.

One sign convention, that of :class:`cdfctl.types.Rows`: ``G u <= rhs``. Symbols as in the documentation: ``d`` the
distance (m or rad), ``h = d - epsilon`` the barrier, ``u`` the joint velocity (rad/s). A field row takes part only
where it is ``valid`` and its distance finite: an obstacle out of reach constrains nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np

from cdfctl.fields.kernel.jit import njit
from cdfctl.types import Array, BoolArray, FieldQuery, Rows, SelfQuery


def usable(query: FieldQuery) -> BoolArray:
    """Mask (r,) of the rows that may constrain the motion: ``valid`` and ``d`` finite."""
    mask: BoolArray = query.valid & np.isfinite(query.d)
    return mask


def tvcbf_rows(query: FieldQuery | Sequence[FieldQuery], alpha: float, margin: float) -> Rows:
    """Time-varying control barrier function: the barrier may fall no faster than ``alpha h``, obstacle motion included.

        grad h . u + dh/dt >= -alpha h      that is      -grad h . u <= alpha h + dh/dt,      h = d - margin

    Args:
        query: rows of a field, in m or rad, or of several fields, whose rows follow each other.
        alpha: class-K gain, 1/s.
        margin: epsilon_cbf, in the unit of the field (of each of several).

    Source: the paper's TVCBF condition for the single integrator.
    """
    return _barrier_rows(query, alpha, margin, 1.0)


def cbf_rows(query: FieldQuery | Sequence[FieldQuery], alpha: float, margin: float) -> Rows:
    """Control barrier function that takes the scene as frozen (no time term), the paper's baseline.

        grad h . u >= -alpha h      that is      -grad h . u <= alpha h,      h = d - margin

    Args as in :func:`tvcbf_rows`.
    """
    return _barrier_rows(query, alpha, margin, 0.0)


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
    mask = usable(query)
    argument = query.d[mask] + offset
    logarithm = np.full(argument.shape, -np.inf)
    np.log(argument, out=logarithm, where=argument > 0.0)
    return _soft_rows(-query.dq[mask] * dt, logarithm)


def self_collision_rows(query: SelfQuery, alpha: float, margin: float) -> Rows:
    """The robot keeps off itself: the barrier of a pair of its own bodies may fall no faster than ``alpha h``.

        grad h . u >= -alpha h      that is      -grad h . u <= alpha h,      h = d - margin

    Nothing but the robot moves in it, so there is no time term, whatever the variant's rows for obstacles are.

    Args:
        query: pairs of the robot's own bodies, m.
        alpha: class-K gain, 1/s.
        margin: least distance asked for, m.
    """
    k = query.valid
    return _soft_rows(-query.dq[k], alpha * (query.d[k] - margin))


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
    low, high = np.empty_like(q), np.empty_like(q)
    _fill_box(q, lower, upper, slowest, fastest, alpha, low, high)
    return low, high


@njit
def _fill_box(
    q: Array, lower: Array, upper: Array, slowest: Array, fastest: Array, alpha: float, low: Array, high: Array
) -> None:
    for j in range(q.shape[0]):
        low[j] = min(max(-alpha * (q[j] - lower[j]), slowest[j]), fastest[j])
        high[j] = max(min(alpha * (upper[j] - q[j]), fastest[j]), slowest[j])


def acceleration_box(
    low: Array, high: Array, room_below: Array, room_above: Array, u_last: Array, limit: Array, dt: float
) -> tuple[Array, Array]:
    """The velocity bounds ``low``, ``high`` (n,) narrowed to what an acceleration limit allows.

        u_last - a Dt <= u <= u_last + a Dt,      -v_stop(q - q_min) <= u <= v_stop(q_max - q)

    with v_stop of :func:`stopping_speed`. A joint that was within the second bound can always keep both: its speed can
    be taken back by a Dt a step until it stands, inside its limits. So the first is never given up, and where it
    leaves less than ``low`` … ``high`` ask for (a joint-limit barrier of a steep ``limit_alpha``), the joint brakes as
    hard as it may. The box is never empty. An infinite limit changes nothing.

    Args:
        low, high: bounds so far (n,), rad/s.
        room_below, room_above: q - q_min and q_max - q (n,), rad, infinite where the joint has no limit.
        u_last: the last command (n,), rad/s.
        limit: a (n,), rad/s².
        dt: Dt, the control period, s.
    """
    step = limit * dt
    floor, ceiling = u_last - step, u_last + step
    high = np.maximum(np.minimum(np.minimum(high, ceiling), stopping_speed(room_above, limit, dt)), floor)
    low = np.minimum(np.maximum(np.maximum(low, floor), -stopping_speed(room_below, limit, dt)), ceiling)
    return np.minimum(low, high), high


def stopping_speed(room: Array, limit: Array, dt: float) -> Array:
    """The greatest velocity v (n,) that still stops within ``room`` (n,), taken back by a Dt each step.

    Held for Dt at a time, v = (m + f) a Dt with m whole and 0 <= f < 1 comes to rest after

        s = v Dt + (v - a Dt) Dt + ... + f a Dt Dt = a Dt^2 ( m (m + 1) / 2 + (m + 1) f ),

    which is piecewise linear in v and inverted here. No room, or a joint past its limit: 0. Infinite where ``limit``
    is, whose joint stops at once.
    """
    finite = np.isfinite(limit) & np.isfinite(room)
    unit = np.where(finite, limit, 1.0) * dt
    s = np.where(finite, np.maximum(room, 0.0), 0.0) / (unit * dt)
    m = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * s) - 1.0))
    speed: Array = np.where(finite, unit * (m + (s - 0.5 * m * (m + 1.0)) / (m + 1.0)), np.inf)
    return speed


def stack(parts: Sequence[Rows], n: int) -> Rows:
    """One block of all ``parts`` over ``n`` joints; without parts, a block of no rows."""
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return Rows(np.zeros((0, n)), np.zeros(0), np.zeros(0, dtype=np.bool_), np.zeros(0))
    return Rows(
        G=np.concatenate([p.G for p in parts]),
        rhs=np.concatenate([p.rhs for p in parts]),
        soft=np.concatenate([p.soft for p in parts]),
        delta=np.concatenate([p.delta for p in parts]),
    )


def _barrier_rows(query: FieldQuery | Sequence[FieldQuery], alpha: float, margin: float, motion: float) -> Rows:
    """Rows -grad h . u <= alpha h + motion dh/dt of those that are :func:`usable`."""
    queries = (query,) if isinstance(query, FieldQuery) else query
    most, k = sum([len(one.d) for one in queries]), 0
    G, rhs = np.empty((most, queries[0].dq.shape[1])), np.empty(most)
    for one in queries:
        k = _fill_barriers(one.d, one.dq, one.dt, one.valid, alpha, margin, motion, G, rhs, k)
    return _soft_rows(G[:k], rhs[:k])


@njit
def _fill_barriers(
    d: Array,
    dq: Array,
    dt: Array,
    valid: BoolArray,
    alpha: float,
    margin: float,
    motion: float,
    G: Array,
    rhs: Array,
    k: int,
) -> int:
    """Rows k and after of ``G`` and ``rhs``; how many are filled then."""
    for row in range(d.shape[0]):
        if valid[row] and isfinite(d[row]):
            rhs[k] = alpha * (d[row] - margin) + motion * dt[row]
            for j in range(dq.shape[1]):
                G[k, j] = -dq[row, j]
            k += 1
    return k


def _soft_rows(G: Array, rhs: Array) -> Rows:
    k = rhs.shape[0]
    return Rows(G=G, rhs=rhs, soft=np.ones(k, dtype=np.bool_), delta=np.zeros(k))
