"""The nearest contact configuration of one piece of the robot and one obstacle, from a given start.

    min 1/2 ||x - q||²   s.t.   f(x) = 0,   lower <= x <= upper                                    (contact)

with f the signed distance of the piece at configuration x. Far from the surface f = 0, a step is a projection on the
linearised constraint: Newton's restoration. Near it, a step of sequential quadratic programming: with the gradient g of
f and the multiplier λ (least squares on the free joints)

    min 1/2 dᵀ B d + (x - q)ᵀ d   s.t.   f + gᵀ d = 0,    B = 1 + λ (H + σ Tᵀ T)

where H_ij = -ν·(z_i × J_j), i <= j, is the exact second derivative of f for a contact point fixed to the link, T the
Jacobian of that point within the tangent plane, and σ stands for the curvature of the two surfaces. The kernel does not
compute that one: σ begins with the curvature of a ball of the two radii, and where a step gained little it follows from
how the residual changed.
B decides only how fast the iteration converges, never to what: an identity in its place needs twice the steps and fails
four times as often.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cdfctl.fields.kernel.body import Body, forward, forward_to, gradient, piece_pose
from cdfctl.fields.kernel.candidates import Candidates
from cdfctl.fields.kernel.distance import NO_CONTACT, Work, block_bound, relative_pose
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.projection import copy, project
from cdfctl.fields.kernel.quadratic import Quadratic, new_quadratic, newton_direction
from cdfctl.fields.kernel.rows import nearest_in_block, nearest_pair
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import ZERO, cross, dot, store, sub, vec
from cdfctl.types import Array

FAR = 0.12  # rad of linearised distance to the surface, above which a step only restores
LONGEST_RESTORATION = 1.0  # rad
LONGEST_STEP = 0.35  # rad
CURVATURE = 20.0  # σ to begin with where the shapes do not tell, 1/m: of a surface of 5 cm radius
GREATEST_CURVATURE = 60.0  # 1/m
SLOWLY = 0.2  # share of the residual left by a step that calls for another σ
LOCAL = 0.2  # rad: the residual below which a secant says something of the curvature at the contact
AT_LIMIT = 1e-6  # rad: a joint nearer than this to a limit is at it
STILL = 1e-9  # m/rad: no joint moves the contact


class Scratch(Struct):
    """Workspace of a step: ``B`` (n, n), ``J`` (n, 3) columns of the contact point, ``y``, ``z`` (n,), ``normal``."""

    B: Array
    J: Array
    y: Array
    z: Array
    normal: Array
    quadratic: Quadratic


def new_scratch(n: int) -> Scratch:
    """A workspace for ``n`` joints."""
    return Scratch(np.zeros((n, n)), np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(3), new_quadratic(n))


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
    gradient(body, found.frames, place, body.joint[k], contact.a, contact.normal, found.g[c])
    measure(body, q, found, c)


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
        hessian(body, found, c, scratch)
        newton_direction(scratch.B, x, q, found.f[c], g, lower, upper, y, scratch.quadratic)
        longest = LONGEST_STEP
    length2 = 0.0
    for j in range(y.shape[0]):
        length2 += y[j] * y[j]
    share = min(1.0, longest / sqrt(length2)) if length2 > 0.0 else 0.0
    for j in range(y.shape[0]):
        moved = x[j] + share * y[j]
        if moved < lower[j] + AT_LIMIT:
            moved = lower[j]
        elif moved > upper[j] - AT_LIMIT:
            moved = upper[j]
        y[j] = moved - x[j]
        x[j] = moved
    multiplier, residual = found.multiplier[c], found.residual[c]
    copy(found.z[c], scratch.z)
    evaluate(body, q, parts, o, found, c, work)
    if near and multiplier > 0.0:
        if not found.residual[c] < residual:
            found.curvature[c] = curvature_at(body, parts, o, found.piece[c])
        elif residual < LOCAL and found.residual[c] > SLOWLY * residual:
            learn_curvature(found, c, multiplier, scratch)


@njit
def curvature_at(body: Body, parts: Parts, o: int, k: int) -> float:
    """σ to begin with, 1/m, for piece k and obstacle o.

    Where a corner of one core touches, the surface around it is a ball of the two radii together, and σ is exactly its
    curvature. Most contacts are of that kind. Without radii there is nothing to go by.
    """
    radii: float = body.sets.info[k].radius + parts.sets.info[parts.first[o]].radius
    return 1.0 / radii if radii * GREATEST_CURVATURE > 1.0 else CURVATURE


@njit
def learn_curvature(found: Candidates, c: int, multiplier: float, scratch: Scratch) -> None:
    """σ from the last step d, ``scratch.y``, by the secant condition dᵀ(1 + λ (H + σ TᵀT)) d = dᵀ(z - z_before)."""
    d, B, J = scratch.y, scratch.B, scratch.J
    n = d.shape[0]
    curved, observed, length2 = 0.0, 0.0, 0.0
    w0, w1, w2 = 0.0, 0.0, 0.0
    for i in range(n):
        length2 += d[i] * d[i]
        observed += d[i] * (found.z[c, i] - scratch.z[i])
        w0, w1, w2 = w0 + d[i] * J[i, 0], w1 + d[i] * J[i, 1], w2 + d[i] * J[i, 2]
        for j in range(n):
            curved += d[i] * B[i, j] * d[j]
    normal = scratch.normal
    along = normal[0] * w0 + normal[1] * w1 + normal[2] * w2
    tangential = multiplier * (w0 * w0 + w1 * w1 + w2 * w2 - along * along)
    if tangential > 1e-3 * length2:
        sigma = found.curvature[c] + (observed - curved) / tangential
        found.curvature[c] = min(max(sigma, 0.0), GREATEST_CURVATURE)


@njit
def hessian(body: Body, found: Candidates, c: int, scratch: Scratch) -> None:
    """B of the module's text, for candidate c, and which joints are still."""
    chain = body.chain
    joint = body.joint[found.piece[c]]
    axis, origin = found.frames.axis[found.place[c]], found.frames.translation[found.place[c]]
    normal, a, g = vec(found.normal, c), vec(found.a, c), found.g[c]
    multiplier = max(0.0, found.multiplier[c])
    sigma = multiplier * found.curvature[c]
    B, J = scratch.B, scratch.J
    for i in range(3):
        scratch.normal[i] = normal[i]
    for j in range(B.shape[0]):
        scratch.quadratic.still[j] = not chain.moves[j, joint]
        if scratch.quadratic.still[j]:
            J_j = ZERO
        elif chain.prismatic[j]:
            J_j = vec(axis, j)
        else:
            J_j = cross(vec(axis, j), sub(a, vec(origin, j)))
        store(J, j, J_j)
        across = cross(J_j, normal)  # ν·(z_i × J_j) = z_i·(J_j × ν)
        for i in range(j + 1):
            value = sigma * (dot(vec(J, i), J_j) - g[i] * g[j])  # g = -νᵀJ
            if chain.moves[i, j] and not chain.prismatic[i]:
                value -= multiplier * dot(vec(axis, i), across)
            B[i, j] = value
            B[j, i] = value
        B[j, j] += 1.0


@njit
def restore(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, scratch: Scratch, work: Work
) -> None:
    """Bring candidate c onto the surface: up to four projections, until |f| is under 1e-9 m. Joints at limits stay."""
    lower, upper = body.chain.lower, body.chain.upper
    x, y, g = found.x[c], scratch.y, scratch.z
    for _ in range(4):
        if abs(found.f[c]) < 1e-9 or not found.slope[c] > STILL:
            return
        for j in range(g.shape[0]):
            free = lower[j] + AT_LIMIT < x[j] < upper[j] - AT_LIMIT
            g[j] = found.g[c, j] if free else 0.0
        project(x, x, found.f[c], g, lower, upper, y)
        copy(y, x)
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
