"""Along one straight joint motion among moving obstacles: does it keep its margin, and how near does it come?

Conservative advancement. Piece k moves no faster than V_k, block i no faster than w_i (which counts the growth of its
margin), so if they are d apart now, they keep the margin for the next

    (d - margin + STEP) / (V_k + w_i)

but for STEP: the distance never falls below the margin less STEP without a check that finds it below the margin. Each
block has its own time until which it needs no look, so far ones cost nothing. Distances are lower bounds, made tighter
only where the bound at hand allows no more than a short advance: first the ball around a piece, then its cover, then
the exact distance.
"""

from __future__ import annotations

from math import cos, inf, sin, sqrt

import numpy as np

from cdfctl.control.planner.arm import Arm
from cdfctl.control.planner.course import Course, pose_at
from cdfctl.control.planner.jit import njit, njit_inline
from cdfctl.fields.kernel.gjk import Simplex, core_distance, new_simplex
from cdfctl.fields.kernel.structs import Struct
from cdfctl.fields.kernel.vec import Rot, Vec, add, compose, dot, rot, rotate, rotate_back, sub, transpose, vec, vec3
from cdfctl.types import Array

STEP = 0.01  # m: how far a distance may fall below the margin unseen, if that is not more than half the margin
FULL, KEPT, NARROW, NARROW_KEPT = 0, 1, 2, 3
"""How much of a margin is asked for: all; all but ``STEP`` of a plan that had all; a third where no plan keeps more;
and half of that of a plan that had a third."""
LEAST_STEP = 1e-4  # m: but never less than this, or no motion would end
SHORT = 0.06  # s: a bound that allows a longer advance is not made tighter
SHORTER = 0.012  # s: nor is the exact distance computed where the cover allows this and ``ROOM``
ROOM = 0.01  # m
LONG = 0.25  # s: no advance is longer; bounds on speed hold that long


class Space(Struct):
    """Workspace of the marches of one robot among b blocks.

    Attributes:
        q: (n,) configuration.
        rotation, origin, axis: (n, 3, 3), (n, 3), (n, 3) of the joints, world.
        piece: (k, 11) centre of the ball around the piece, its radius, bound on its speed; ends of a slender piece.
        until: (b,) time until which a block needs no look.
        looks: (1,) distances evaluated so far.
        simplex: of GJK.
    """

    q: Array
    rotation: Array
    origin: Array
    axis: Array
    piece: Array
    until: Array
    looks: Array
    simplex: Simplex


def new_space(arm: Arm, blocks: int) -> Space:
    """An empty workspace."""
    n, k = arm.reach.shape
    piece = np.zeros((k, 11))
    piece[:, 3] = arm.radius
    return Space(
        np.zeros(n),
        np.zeros((n, 3, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        piece,
        np.zeros(blocks),
        np.zeros(1),
        new_simplex(),
    )


@njit_inline
def place(arm: Arm, q: Array, u: Array, s: float, space: Space) -> None:
    """The robot s into the motion, and bounds on the speeds of its pieces for the next ``LONG``."""
    chain, joints = arm.body.chain, arm.body.joint
    R, P, Z, piece = space.rotation, space.origin, space.axis, space.piece
    for j in range(q.shape[0]):
        value = q[j] + u[j] * s
        r, t = rot(chain.rotation, j), vec(chain.translation, j)
        parent = chain.parent[j]
        if parent >= 0:
            base = rot(R, parent)
            moved = rotate(base, t)
            t = (P[parent, 0] + moved[0], P[parent, 1] + moved[1], P[parent, 2] + moved[2])
            r = compose(base, r)
        x, y, z = chain.axis[j, 0], chain.axis[j, 1], chain.axis[j, 2]
        Z[j, 0] = r[0][0] * x + r[0][1] * y + r[0][2] * z
        Z[j, 1] = r[1][0] * x + r[1][1] * y + r[1][2] * z
        Z[j, 2] = r[2][0] * x + r[2][1] * y + r[2][2] * z
        if chain.prismatic[j]:
            t = (t[0] + value * Z[j, 0], t[1] + value * Z[j, 1], t[2] + value * Z[j, 2])
        else:
            a, c = sin(value), 1.0 - cos(value)
            turn = (
                (1.0 - c * (y * y + z * z), c * x * y - a * z, c * x * z + a * y),
                (c * x * y + a * z, 1.0 - c * (x * x + z * z), c * y * z - a * x),
                (c * x * z - a * y, c * y * z + a * x, 1.0 - c * (x * x + y * y)),
            )
            r = compose(r, turn)
        for i in range(3):
            R[j, 0, i], R[j, 1, i], R[j, 2, i] = r[0][i], r[1][i], r[2][i]
        P[j, 0], P[j, 1], P[j, 2] = t
    for k in range(piece.shape[0]):
        joint = joints[k]
        r = rot(R, joint)
        ox, oy, oz = P[joint, 0], P[joint, 1], P[joint, 2]
        c3 = rotate(r, vec(arm.centre, k))
        cx, cy, cz = ox + c3[0], oy + c3[1], oz + c3[2]
        piece[k, 0], piece[k, 1], piece[k, 2] = cx, cy, cz
        if arm.slender[k]:
            e = rotate(r, vec(arm.end[k], 0))
            piece[k, 5], piece[k, 6], piece[k, 7] = ox + e[0], oy + e[1], oz + e[2]
            e = rotate(r, vec(arm.end[k], 1))
            piece[k, 8], piece[k, 9], piece[k, 10] = ox + e[0], oy + e[1], oz + e[2]
        speed = 0.0
        j = joint
        while j >= 0:
            if u[j] != 0.0:
                reach = arm.reach[j, k]
                if not chain.prismatic[j]:
                    dx, dy, dz = cx - P[j, 0], cy - P[j, 1], cz - P[j, 2]
                    zx, zy, zz = Z[j, 0], Z[j, 1], Z[j, 2]
                    x, y, z = zy * dz - zz * dy, zz * dx - zx * dz, zx * dy - zy * dx
                    reach = min(reach, sqrt(x * x + y * y + z * z) + arm.radius[k] + LONG * speed)
                speed += abs(u[j]) * reach
            j = chain.parent[j]
        piece[k, 4] = speed


@njit_inline
def ease(margin: float, grade: int) -> float:
    """How much of a margin is waived."""
    if grade == FULL:
        return 0.0
    if grade == KEPT:
        return min(STEP, margin / 3.0)
    return margin * (2.0 / 3.0 if grade == NARROW else 5.0 / 6.0)


@njit
def march(
    arm: Arm, course: Course, q: Array, u: Array, start: float, end: float, near: float, grade: int, space: Space
) -> tuple[float, float]:
    """Follow q + u (t - start) from ``start`` to ``end`` (s from now), every margin eased by ``grade``.

    Returns the time at which a margin is found broken, inf for none, and the least distance seen, at most ``near`` (m),
    less the widening of the margin.
    """
    t, least, looks = start, near, 0
    # The whole robot as one ball about its first piece, and a bound on its speed that holds however far it moves.
    fastest, price = 0.0, 8 * u.shape[0] + 2 * arm.radius.shape[0]
    for k in range(arm.radius.shape[0]):
        speed = 0.0
        for j in range(u.shape[0]):
            speed += abs(u[j]) * arm.reach[j, k]
        fastest = max(fastest, speed)
    piece, until, line = space.piece, space.until, course.line
    for i in range(until.shape[0]):
        until[i] = start
    place(arm, q, u, 0.0, space)
    still = True
    for j in range(u.shape[0]):
        still = still and u[j] == 0.0
    while True:
        whole = 0.0
        for k in range(piece.shape[0]):
            dx, dy, dz = piece[k, 0] - piece[0, 0], piece[k, 1] - piece[0, 1], piece[k, 2] - piece[0, 2]
            whole = max(whole, sqrt(dx * dx + dy * dy + dz * dz) + piece[k, 3])
        looks += price
        soon = inf
        for i in range(until.shape[0]):
            if until[i] > t:
                soon = min(soon, until[i])
                continue
            o = course.obstacle[i]
            if course.straight[i]:
                x, y, z = line[i, 0] + t * line[i, 3], line[i, 1] + t * line[i, 4], line[i, 2] + t * line[i, 5]
            else:
                r, p = pose_at(course.knot, course.rotation, course.position, course.twist, o, t)
                c = rotate(r, vec(course.block, i))
                x, y, z = p[0] + c[0], p[1] + c[1], p[2] + c[2]
            margin = min(course.margin[o, 0] + t * course.margin[o, 1], course.margin[o, 2])
            eased = ease(margin, grade)
            margin -= eased
            step = min(STEP, max(LEAST_STEP, 0.5 * margin))
            widened = margin + eased - course.margin[o, 0]
            ball, pace_i = course.block[i, 3], course.pace[i]
            ahead = LONG
            if piece.shape[0] > 0:
                dx, dy, dz = x - piece[0, 0], y - piece[0, 1], z - piece[0, 2]
                gap = sqrt(dx * dx + dy * dy + dz * dz) - whole - ball - margin
                looks += 1
                if gap >= near and gap >= LONG * (fastest + pace_i):
                    until[i] = t + gap / (fastest + pace_i) if fastest + pace_i > 0.0 else inf
                    soon = min(soon, until[i])
                    continue
            for k in range(piece.shape[0]):
                pace = piece[k, 4] + pace_i
                need = margin + pace * min(ahead, SHORT)
                want = max(need, least + widened)
                dx, dy, dz = x - piece[k, 0], y - piece[k, 1], z - piece[k, 2]
                far = want + piece[k, 3] + ball
                looks += 1
                square = dx * dx + dy * dy + dz * dz
                if square >= far * far:
                    # Its bound allows SHORT, or more than another piece does: the root is not worth it then.
                    if pace * ahead > want - margin:
                        ahead = min(ahead, (sqrt(square) - piece[k, 3] - ball - margin + step) / pace)
                    continue
                if arm.slender[k] and course.point[i]:
                    looks += 1
                    ax, ay, az = piece[k, 5], piece[k, 6], piece[k, 7]
                    ex, ey, ez = piece[k, 8] - ax, piece[k, 9] - ay, piece[k, 10] - az
                    dx, dy, dz = x - ax, y - ay, z - az
                    length2 = ex * ex + ey * ey + ez * ez
                    along = min(1.0, max(0.0, (ex * dx + ey * dy + ez * dz) / length2)) if length2 > 0.0 else 0.0
                    dx, dy, dz = dx - along * ex, dy - along * ey, dz - along * ez
                    d = sqrt(dx * dx + dy * dy + dz * dz) - arm.thin[k] - ball
                else:
                    looks += 3
                    d = inf
                    if course.point[i]:
                        joint = arm.body.joint[k]
                        r = rot(space.rotation, joint)
                        c = rotate_back(
                            r, (x - space.origin[joint, 0], y - space.origin[joint, 1], z - space.origin[joint, 2])
                        )
                        for n in range(arm.first_ball[k], arm.first_ball[k + 1]):
                            dx, dy, dz = c[0] - arm.ball[n, 0], c[1] - arm.ball[n, 1], c[2] - arm.ball[n, 2]
                            d = min(d, sqrt(dx * dx + dy * dy + dz * dz) - arm.ball[n, 3])
                        d -= ball
                    exact_below = margin + ROOM + pace * SHORTER
                    if d < exact_below or not course.point[i]:
                        looks += 20
                        d = nearer(arm, course, i, k, t, exact_below, space)
                if d < margin:
                    space.looks[0] += looks
                    return t, min(least, d - widened)
                least = min(least, d - widened)
                if pace > 0.0:
                    ahead = min(ahead, (d - margin + step) / pace)
            until[i] = t + ahead
            soon = min(soon, until[i])
        if soon >= end:
            space.looks[0] += looks
            return inf, least
        t = soon
        if not still:
            place(arm, q, u, t - start, space)


@njit
def nearer(arm: Arm, course: Course, i: int, k: int, t: float, need: float, space: Space) -> float:
    """A lower bound of the distance of piece k as placed to block i at time t: exact where it is below ``need``."""
    r, p = pose_at(course.knot, course.rotation, course.position, course.twist, course.obstacle[i], t)
    joint = arm.body.joint[k]
    joint_r, joint_p = rot(space.rotation, joint), vec(space.origin, joint)
    best = inf
    for part in range(course.part[i], course.part[i + 1]):
        info = course.sets.info[part]
        lower, upper = vec3(info.lower), vec3(info.upper)
        bound = inf
        for n in range(arm.first_ball[k], arm.first_ball[k + 1]):
            c = rotate_back(r, sub(add(joint_p, rotate(joint_r, vec(arm.ball, n))), p))
            x = max(lower[0] - c[0], 0.0, c[0] - upper[0])
            y = max(lower[1] - c[1], 0.0, c[1] - upper[1])
            z = max(lower[2] - c[2], 0.0, c[2] - upper[2])
            bound = min(bound, sqrt(x * x + y * y + z * z) - arm.ball[n, 3])
        bound -= info.radius
        if bound < need and bound < best:
            bound = max(bound, exact(arm, course, k, part, r, p, need, space))
        best = min(best, bound)
    return best


@njit
def exact(arm: Arm, course: Course, k: int, part: int, r: Rot, p: Vec, cutoff: float, space: Space) -> float:
    """The distance of piece k and a part, whose frame is (r, p), by GJK; minus the radii where the cores meet."""
    joint = arm.body.joint[k]
    joint_r, joint_p = rot(space.rotation, joint), vec(space.origin, joint)
    r_a = compose(joint_r, rot(arm.body.rotation, k))
    t_a = add(joint_p, rotate(joint_r, vec(arm.body.translation, k)))
    r_b, t_b = compose(transpose(r_a), r), rotate_back(r_a, sub(p, t_a))
    mine, theirs = arm.body.sets.info[k], course.sets.info[part]
    radii = mine.radius + theirs.radius
    guess = sub(add(rotate(r_b, vec3(theirs.centre)), t_b), vec3(mine.centre))
    if not dot(guess, guess) > 0.0:
        guess = (0.0, 0.0, 1.0)
    core = core_distance(arm.body.sets, k, course.sets, part, r_b, t_b, guess, cutoff + radii, space.simplex)
    return float(core.distance - radii)
