"""The nearest contact configuration of one piece of the robot and one obstacle, from a given start.

    min 1/2 ||x - q||²   s.t.   f(x) = 0,   lower <= x <= upper                                    (contact)

with f the signed distance of the piece at configuration x. Far from the surface f = 0, a step is a projection on the
linearised constraint: Newton's restoration. Near it, a step of sequential quadratic programming: with the gradient g of
f and the multiplier λ (least squares on the free joints)

    min 1/2 dᵀ B d + (x - q)ᵀ d   s.t.   f + gᵀ d = 0,    B = 1 + λ H

where H is the second derivative of f (:mod:`.curvature`). It is exact, and jumps where the nearest points pass from one
corner, edge or face to the next; between, the iteration converges quadratically: a contact that is followed from one
query to the next takes one step or two. Where a step went too far, from a face over its edge, it is taken back to where
the slope along it is zero. Far from convergence H is that of two corners, which bends most: steps are shorter, and do
not run along a face past the nearest contact.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body, forward, forward_to, gradient, piece_pose
from cdfctl.fields.kernel.candidates import Candidates
from cdfctl.fields.kernel.curvature import curvature
from cdfctl.fields.kernel.distance import NO_CONTACT, Carrier, Work, block_bound, relative_pose
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.joints import copy, inner
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.projection import project
from cdfctl.fields.kernel.quadratic import Quadratic, new_quadratic, newton_direction
from cdfctl.fields.kernel.rows import nearest_in_block, nearest_pair
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import ZERO, along, cross, dot, store, sub, vec
from cdfctl.types import Array

FAR = 0.12  # rad of linearised distance to the surface, above which a step only restores
LONGEST_RESTORATION = 1.0  # rad
LONGEST_STEP = 0.35  # rad
ACROSS = 10.0  # added to B along g, where the constraint leaves no choice: B need be positive along the surface only
SLOWLY = 0.5  # share of the residual left by a step that is looked at again
OVERSHOT = 0.5  # share of the first slope along a step that its end shows, with the other sign, if it went too far
SHORT = 1e-5  # rad, of a projection that is believed
LOCAL = 0.02  # rad: the residual above which a step takes the greatest curvature there can be
AT_LIMIT = 1e-6  # rad: a joint nearer than this to a limit is at it
STILL = 1e-9  # m/rad: no joint moves the contact


class Scratch(Struct):
    """Workspace of a step: ``B`` (n, n), ``stiff`` (1,), ``y``, ``z`` (n,), and ``u``, ``slide`` (n, 2), which are u_j
    and y_j of :mod:`.curvature`."""

    B: Array
    stiff: Array
    u: Array
    slide: Array
    y: Array
    z: Array
    quadratic: Quadratic


def new_scratch(n: int) -> Scratch:
    """A workspace for ``n`` joints."""
    return Scratch(
        B=np.zeros((n, n)),
        stiff=np.zeros(1),
        u=np.zeros((n, 2)),
        slide=np.zeros((n, 2)),
        y=np.zeros(n),
        z=np.zeros(n),
        quadratic=new_quadratic(n),
    )


@njit
def evaluate(body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, work: Work) -> None:
    """Everything about candidate c at its ``x``, but for ``x`` and ``piece`` themselves."""
    found.place[c] = c
    forward_to(body, found.x[c], body.joint[found.piece[c]], found.frames, c)
    evaluate_placed(body, q, parts, o, found, c, work)


@njit
def evaluate_placed(body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, work: Work) -> None:
    """The same where the joints have been placed already."""
    k, place = found.piece[c], found.place[c]
    _, contact = nearest_pair(body, found.frames, place, k, k + 1, parts, o, work)
    found.f[c] = contact.d
    store(found.a, c, contact.a)
    store(found.b, c, contact.b)
    store(found.normal, c, contact.normal)
    _keep_corners(found, c, work.carrier)
    gradient(body, found.frames, place, body.joint[k], contact.a, contact.normal, found.g[c])
    measure(body, q, found, c)


@njit
def _keep_corners(found: Candidates, c: int, carrier: Carrier) -> None:
    found.part[c], found.corners[c] = carrier.part[0], carrier.size[0]
    for i in range(carrier.size[0]):
        for j in range(3):
            found.corner_a[c, i, j], found.corner_b[c, i, j] = carrier.a[i, j], carrier.b[i, j]


@njit
def measure(body: Body, q: Array, found: Candidates, c: int) -> None:
    """Multiplier, residual, slope and cost of candidate c from its x, f and g."""
    x, g = found.x[c], found.g[c]
    lower, upper = body.chain.lower, body.chain.upper
    gg, gx, distance2 = 0.0, 0.0, 0.0
    for j in range(x.shape[0]):
        distance2 += (x[j] - q[j]) ** 2
        if lower[j] + AT_LIMIT < x[j] < upper[j] - AT_LIMIT:
            gg += g[j] * g[j]
            gx += g[j] * (x[j] - q[j])
    slope = sqrt(gg)
    multiplier = -gx / gg if slope > STILL else 0.0
    residual2 = 0.0
    for j in range(x.shape[0]):
        z = x[j] - q[j] + multiplier * g[j]
        if x[j] <= lower[j] + AT_LIMIT:
            z = min(z, 0.0)  # at a limit only a pull back inside counts
        elif x[j] >= upper[j] - AT_LIMIT:
            z = max(z, 0.0)
        found.z[c, j] = z
        residual2 += z * z
    found.slope[c], found.multiplier[c], found.residual[c] = slope, multiplier, sqrt(residual2)
    found.cost[c] = sqrt(distance2) + abs(found.f[c]) / slope if slope > STILL else np.inf


@njit
def is_near(found: Candidates, c: int) -> bool:
    """Whether candidate c is near enough to the surface for a step of more than restoration."""
    return bool(abs(found.f[c]) <= FAR * found.slope[c])


@njit
def advance(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, scratch: Scratch, work: Work
) -> None:
    """One step of candidate c, as described above; it must have been evaluated, and is again."""
    lower, upper = body.chain.lower, body.chain.upper
    x, g, y = found.x[c], found.g[c], scratch.y
    near = is_near(found, c)
    if not near:
        project(x, x, found.f[c], g, lower, upper, y)
        for j in range(y.shape[0]):
            y[j] -= x[j]
        longest = LONGEST_RESTORATION
    else:
        hessian(body, parts, found, c, scratch)
        newton_direction(scratch.B, x, q, found.f[c], g, lower, upper, y, scratch.quadratic)
        longest = LONGEST_STEP
    length2 = inner(y, y)
    share = min(1.0, longest / sqrt(length2)) if length2 > 0.0 else 0.0
    for j in range(y.shape[0]):
        moved = x[j] + share * y[j]
        if moved < lower[j] + AT_LIMIT:
            moved = lower[j]
        elif moved > upper[j] - AT_LIMIT:
            moved = upper[j]
        y[j] = moved - x[j]
        x[j] = moved
    residual, before = found.residual[c], inner(y, found.z[c])
    evaluate(body, q, parts, o, found, c, work)
    if near and found.residual[c] > SLOWLY * residual:
        _turn_back(body, q, parts, o, found, c, before, scratch, work)


@njit
def _turn_back(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, before: float, scratch: Scratch, work: Work
) -> None:
    """Where the last step of candidate c, ``scratch.y``, went past the least distance along it: back to that place.

    The slope along the step was ``before`` where it began. The least is where the slope is zero, on the secant of the
    two slopes, or, after a step from a flat face past an edge, on the tangent here, which is steeper.
    """
    x, y, g = found.x[c], scratch.y, found.g[c]
    after = inner(y, found.z[c])
    if not (before < 0.0 and after > -OVERSHOT * before):
        return
    hessian(body, parts, found, c, scratch)
    bend = -scratch.stiff[0] * inner(g, y) ** 2
    for j in range(y.shape[0]):
        bend += y[j] * inner(scratch.B[j], y)
    back = after / max(bend, after - before)
    for j in range(y.shape[0]):
        x[j] -= back * y[j]
    evaluate(body, q, parts, o, found, c, work)


@njit
def hessian(body: Body, parts: Parts, found: Candidates, c: int, scratch: Scratch) -> None:
    """B of the module's text, for candidate c, plus ``scratch.stiff`` g gᵀ, and which joints are still."""
    chain = body.chain
    k = found.piece[c]
    joint = body.joint[k]
    axis, origin = found.frames.axis[found.place[c]], found.frames.translation[found.place[c]]
    normal = vec(found.normal, c)
    a = along(vec(found.a, c), -body.sets.info[k].radius, normal)
    multiplier = max(0.0, found.multiplier[c])
    bend = curvature(body, parts, found, c, found.residual[c] > LOCAL)
    W, N = bend.W, bend.N
    share = multiplier / bend.D
    g = found.g[c]
    stiff = ACROSS / inner(g, g)
    scratch.stiff[0] = stiff
    B, u, y = scratch.B, scratch.u, scratch.slide
    for j in range(B.shape[0]):
        scratch.quadratic.still[j] = not chain.moves[j, joint]
        if scratch.quadratic.still[j]:
            J_j, v_s, v_t = ZERO, 0.0, 0.0
        elif chain.prismatic[j]:
            J_j, v_s, v_t = vec(axis, j), 0.0, 0.0
        else:
            z = vec(axis, j)
            turned = cross(z, normal)
            J_j, v_s, v_t = cross(z, sub(a, vec(origin, j))), bend.D * dot(turned, bend.s), bend.D * dot(turned, bend.t)
        across = cross(J_j, normal)  # ν·(z_i × J_j) = z_i·(J_j × ν)
        u_s, u_t = dot(J_j, bend.s), dot(J_j, bend.t)
        w_s, w_t = W[0] * u_s + W[1] * u_t, W[1] * u_s + W[2] * u_t
        y_s, y_t = w_s + v_s, w_t + v_t
        n_s, n_t = N[0] * y_s + N[1] * y_t, N[1] * y_s + N[2] * y_t
        u[j, 0], u[j, 1], y[j, 0], y[j, 1] = u_s, u_t, y_s, y_t
        for i in range(j + 1):
            value = stiff * g[i] * g[j] + share * (u[i, 0] * w_s + u[i, 1] * w_t - y[i, 0] * n_s - y[i, 1] * n_t)
            if chain.moves[i, j] and not chain.prismatic[i]:
                value -= multiplier * dot(vec(axis, i), across)
            B[i, j] = value
            B[j, i] = value
        B[j, j] += 1.0


@njit
def restore(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, scratch: Scratch, work: Work
) -> None:
    """Bring candidate c onto the surface: up to four projections, until |f| is under 1e-9 m. Joints at limits stay.

    What a projection of less than :data:`SHORT` leaves is not measured: it is the square of that, times the curvature.
    """
    lower, upper = body.chain.lower, body.chain.upper
    x, y, g = found.x[c], scratch.y, scratch.z
    for _ in range(4):
        if abs(found.f[c]) < 1e-9 or not found.slope[c] > STILL:
            return
        for j in range(g.shape[0]):
            free = lower[j] + AT_LIMIT < x[j] < upper[j] - AT_LIMIT
            g[j] = found.g[c, j] if free else 0.0
        project(x, x, found.f[c], g, lower, upper, y)
        short = abs(found.f[c]) < SHORT * found.slope[c]
        copy(y, x)
        if short:
            found.f[c] = 0.0
            return
        evaluate(body, q, parts, o, found, c, work)


@njit
def penetrating_piece(
    body: Body, parts: Parts, o: int, found: Candidates, c: int, tolerance: float, upstream: bool, work: Work
) -> int:
    """A piece other than that of candidate c that is deeper than ``tolerance`` (m) in obstacle o at its x, -1 for none.

    If ``upstream``, only pieces count whose place follows from the joints that move the candidate's.
    """
    own = found.piece[c]
    forward(body, found.x[c], found.frames, c)
    for k in range(body.joint.shape[0]):
        if k == own or (upstream and not body.chain.moves[body.joint[k], body.joint[own]]):
            continue
        r_a, t_a = piece_pose(body, found.frames, c, k)
        r, t = relative_pose(r_a, t_a, parts, parts.first[o])
        for block in range(parts.first_block[o], parts.first_block[o + 1]):
            if block_bound(body, k, parts, block, r, t) < -tolerance:
                _, contact = nearest_in_block(body, found.frames, c, k, parts, block, -1, NO_CONTACT, work)
                if contact.d < -tolerance:
                    return k
    return -1
