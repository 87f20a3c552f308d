"""Pieces at q, measured as needed, against all of them measured."""

from __future__ import annotations

import numpy as np

from cdfctl.fields.kernel.body import body_of
from cdfctl.fields.kernel.candidates import new_candidates
from cdfctl.fields.kernel.distance import new_work
from cdfctl.fields.kernel.memory import new_memory
from cdfctl.fields.kernel.parts import parts_of, turn_obstacles
from cdfctl.fields.kernel.pieces import NEARER, all_pieces, new_pieces, pieces_at, place_at, promising_piece
from cdfctl.robots.robot import load_robot
from cdfctl.types import Box, PointCloud, Shape, Sphere

SHAPES: tuple[Shape, ...] = (
    Sphere(0.05),
    Box((0.3, 0.1, 0.2)),
    PointCloud(np.random.default_rng(1).uniform(-0.4, 0.4, (40, 3)), 0.01),
)


def test_the_nearest_piece_and_the_promising_one_are_those_of_all() -> None:
    franka = load_robot("franka")
    body, work, random = body_of(franka), new_work(), np.random.default_rng(0)
    k, n, warm = len(body.joint), franka.n, 2
    found, whole = new_candidates(body, k + warm), new_candidates(body, k + warm)
    pieces, every = new_pieces(k), new_pieces(k)
    spared, chosen = 0, 0
    for trial in range(300):
        parts, memory = parts_of((SHAPES[trial % 3],)), new_memory(1, warm, n, k)
        parts.pose[0, :3] = random.uniform([-0.7, -0.7, 0.0], [0.7, 0.7, 1.0])
        turn_obstacles(parts.pose, parts.rotation)
        q = franka.home + random.normal(0.0, 0.5, n)
        for candidates in (found, whole):
            place_at(body, q, np.empty(n), candidates)
        nearest = pieces_at(body, q, parts, 0, found, pieces, work)
        pieces_at(body, q, parts, 0, whole, every, work)
        all_pieces(body, q, parts, 0, memory, whole, every, work)
        assert whole.f[nearest] == whole.f[:k].min() == found.f[nearest]
        assert np.all(pieces.bound <= whole.f[:k] + 1e-12)
        assert np.array_equal(pieces.bound[pieces.measured], whole.f[:k][pieces.measured])
        # Two known contacts; some pieces were tried in vain before.
        memory.known[0], known = warm, random.choice(k, warm, replace=False)
        memory.tried[0] = np.where(random.random(k) < 0.1, np.inf, whole.f[:k] * random.uniform(0.5, 1.5, k))
        tried = memory.tried[0].copy()
        for candidates in (found, whole):
            candidates.piece[k:], candidates.cost[k:] = known, random.uniform(0.5, 3.0)
        found.cost[k:] = whole.cost[k:]
        promising_piece(body, q, parts, 0, memory, found, pieces, work)
        cost = whole.cost[:k].copy()
        cost[known] = np.inf
        cost[~(whole.f[:k] < NEARER * tried)] = np.inf
        best = int(np.argmin(cost))
        expected = np.full(k, np.inf)
        if cost[best] < whole.cost[k:].min():
            expected[best] = cost[best]
            chosen += 1
            assert memory.tried[0, best] == whole.f[best]
        assert np.array_equal(found.cost[:k], expected)
        spared += k - int(pieces.measured.sum())
    assert spared > 300 * k / 4
    assert chosen > 30
