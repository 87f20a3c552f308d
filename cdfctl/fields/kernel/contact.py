"""The nearest contact configuration of one piece of the robot and one obstacle, from a given start.

    min 1/2 ||x - q||²   s.t.   f(x) = 0,   lower <= x <= upper                                    (contact)

with f the signed distance of the piece at configuration x. Far from the surface f = 0, a step is a projection on the
linearised constraint: Newton's restoration. Near it, a step of sequential quadratic programming: with the gradient g of
f and the multiplier λ (least squares on the free joints)

    min 1/2 dᵀ B d + (x - q)ᵀ d   s.t.   f + gᵀ d = 0,    B = 1 + λ (H + σ Tᵀ T)

where H_ij = -ν·(z_i × J_j), i <= j, is the exact second derivative of f for a contact point fixed to the link, T the
Jacobian of that point within the tangent plane, and σ stands for the curvature of the two surfaces. The kernel does not
compute that one: σ begins with a constant and, near the end, follows from how the residual changed over the last step.
B decides only how fast the iteration converges, never to what: an identity in its place needs twice the steps and fails
four times as often.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.body import Body, Frames, forward_to, gradient
from cdfctl.fields.kernel.distance import Work
from cdfctl.fields.kernel.jit import njit
from cdfctl.fields.kernel.parts import Parts
from cdfctl.fields.kernel.projection import copy, project
from cdfctl.fields.kernel.quadratic import Quadratic, new_quadratic, newton_direction
from cdfctl.fields.kernel.rows import nearest_pair
from cdfctl.fields.kernel.vec import cross, dot, store, sub, vec
from cdfctl.types import Array, IntArray

FAR = 0.12  # rad of linearised distance to the surface, above which a step only restores
LONGEST_RESTORATION = 1.0  # rad
LONGEST_STEP = 0.35  # rad
CURVATURE = 20.0  # σ to begin with, 1/m: of a surface of 5 cm radius; half and twice as much cost a fifth more steps
GREATEST_CURVATURE = 60.0  # 1/m
LOCAL = 0.2  # rad: the residual below which a secant says something of the curvature at the contact
AT_LIMIT = 1e-6  # rad: a joint nearer than this to a limit is at it
STILL = 1e-9  # m/rad: no joint moves the contact


class Candidates(NamedTuple):
    """c candidate contacts between one obstacle and pieces of the robot, each with all that is known where it stands.

    Attributes:
        piece: (c,) the piece of the robot.
        x: (c, n) configuration.
        f: (c,) signed distance there, m; ``g`` (c, n) its gradient.
        a, b, normal: (c, 3) witness points and normal in the world.
        slope: (c,) norm of g over the joints not at a limit.
        multiplier: (c,) λ, and ``residual`` (c,) the norm of z (c, n) = x - q + λ g over the joints free to move.
        curvature: (c,) σ.
        cost: (c,) rad: the distance from q, and the linearised distance still to go to the surface.
        rotation, translation, axis: (c, n, 3, 3), (c, n, 3), (c, n, 3) the joints at x.
    """

    piece: IntArray
    x: Array
    f: Array
    g: Array
    a: Array
    b: Array
    normal: Array
    slope: Array
    multiplier: Array
    residual: Array
    z: Array
    curvature: Array
    cost: Array
    rotation: Array
    translation: Array
    axis: Array


class Scratch(NamedTuple):
    """Workspace of a step: ``B`` (n, n), ``J`` (n, 3) columns of the contact point, ``y``, ``z`` (n,), ``normal``."""

    B: Array
    J: Array
    y: Array
    z: Array
    normal: Array
    quadratic: Quadratic


def new_candidates(c: int, n: int) -> Candidates:
    """Places for ``c`` candidates of ``n`` joints."""
    return Candidates(
        piece=np.zeros(c, dtype=np.int64),
        x=np.zeros((c, n)),
        f=np.zeros(c),
        g=np.zeros((c, n)),
        a=np.zeros((c, 3)),
        b=np.zeros((c, 3)),
        normal=np.zeros((c, 3)),
        slope=np.zeros(c),
        multiplier=np.zeros(c),
        residual=np.zeros(c),
        z=np.zeros((c, n)),
        curvature=np.zeros(c),
        cost=np.zeros(c),
        rotation=np.zeros((c, n, 3, 3)),
        translation=np.zeros((c, n, 3)),
        axis=np.zeros((c, n, 3)),
    )


def new_scratch(n: int) -> Scratch:
    """A workspace for ``n`` joints."""
    return Scratch(np.zeros((n, n)), np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(3), new_quadratic(n))


@njit
def frames_of(found: Candidates, c: int) -> Frames:
    """The joints' placements kept with candidate c."""
    return Frames(found.rotation[c], found.translation[c], found.axis[c])


@njit
def evaluate(body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, work: Work) -> None:
    """Everything about candidate c at its ``x``, but for ``x`` and ``piece`` themselves."""
    k = found.piece[c]
    joint = body.joint[k]
    frames = frames_of(found, c)
    forward_to(body, found.x[c], joint, frames)
    _, contact = nearest_pair(body, frames, k, k + 1, parts, o, work)
    found.f[c] = contact.d
    store(found.a, c, contact.a)
    store(found.b, c, contact.b)
    store(found.normal, c, contact.normal)
    gradient(body, frames, joint, contact.a, contact.normal, found.g[c])
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
def advance(
    body: Body, q: Array, parts: Parts, o: int, found: Candidates, c: int, scratch: Scratch, work: Work
) -> None:
    """One step of candidate c, as described above; it must have been evaluated, and is again."""
    lower, upper = body.chain.lower, body.chain.upper
    x, g, y = found.x[c], found.g[c], scratch.y
    near = abs(found.f[c]) <= FAR * found.slope[c]
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
        if residual < LOCAL and found.residual[c] < residual:
            learn_curvature(found, c, multiplier, scratch)
        else:
            found.curvature[c] = CURVATURE


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
    """B of the module's text, for candidate c."""
    chain = body.chain
    joint = body.joint[found.piece[c]]
    normal, a = vec(found.normal, c), vec(found.a, c)
    multiplier = max(0.0, found.multiplier[c])
    B, J = scratch.B, scratch.J
    for i in range(3):
        scratch.normal[i] = normal[i]
    for j in range(B.shape[0]):
        if not chain.moves[j, joint]:
            store(J, j, (0.0, 0.0, 0.0))
        elif chain.prismatic[j]:
            store(J, j, vec(found.axis[c], j))
        else:
            store(J, j, cross(vec(found.axis[c], j), sub(a, vec(found.translation[c], j))))
        J_j = vec(J, j)
        along = dot(normal, J_j)
        for i in range(j + 1):
            J_i = vec(J, i)
            tangential = dot(J_i, J_j) - dot(normal, J_i) * along
            bend = 0.0
            if chain.moves[i, j] and chain.moves[j, joint] and not chain.prismatic[i]:
                bend = -dot(normal, cross(vec(found.axis[c], i), J_j))
            B[i, j] = multiplier * (bend + found.curvature[c] * tangential)
            B[j, i] = B[i, j]
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
