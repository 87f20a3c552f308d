"""Which pairs of a robot's own bodies can collide: found once, kept in the user cache.

Of all pairs of collision objects these are left out:

- **still**: both hang on one joint, so nothing changes their distance;
- **allowed**: neighbours in the tree, or disabled by the SRDF (:attr:`Robot.allowed_contacts`);
- **always**: in contact at ``home`` and in at least half of the sampled configurations: an artefact of the hulls;
- **apart**: proved to stay :data:`APART` apart at every configuration within the joint limits.

The first three are no collision, whatever the distance. The last is a proof, by
:func:`cdfctl.robots.stay_apart.stays_apart`; samples only choose what to try it on. A pair that no proof was found for
stays in.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdfctl.cache import cache_dir, keep
from cdfctl.reading import read_json
from cdfctl.robots.coal_geometry import exact_request
from cdfctl.robots.robot import Robot
from cdfctl.robots.srdf import link_pair
from cdfctl.robots.stay_apart import reaches, stays_apart
from cdfctl.types import Array

APART = 0.03
"""m; pairs proved to keep this distance need no row with a margin up to it."""

SAMPLES = 1000
ALWAYS = 0.5
MOST_BOXES = 150_000  # about two seconds, pairs with the fewest joints between them first
MOST_BOXES_A_PAIR = 30_000
VERSION = 2

Pair = tuple[int, int]
"""Two indices into ``robot.geometry.geometryObjects``, ascending."""


class SelfPairs(NamedTuple):
    """The pairs of a robot's collision objects that are not allowed to touch, by what is known of them.

    Attributes:
        checked: can come within :data:`APART` of each other, or are not known not to.
        apart: proved not to.
        always: left out, since in contact nearly everywhere.
    """

    checked: tuple[Pair, ...]
    apart: tuple[Pair, ...]
    always: tuple[Pair, ...]

    def within(self, margin: float) -> tuple[Pair, ...]:
        """The pairs that can come within ``margin`` (m) of each other."""
        return self.checked if margin <= APART else (*self.checked, *self.apart)


@lru_cache(maxsize=8)
def self_pairs(robot: Robot) -> SelfPairs:
    """The pairs of ``robot``, from the user cache where they are known; the first time takes up to some seconds."""
    candidates = candidate_pairs(robot)
    key = _key(robot, candidates)
    path = cache_dir() / "self-collision" / f"{robot.name}-{key[:16]}.json"
    known = _read(path, key, candidates)
    if known is None:
        known = find_pairs(robot, candidates)
        keep(path, json.dumps({"key": key, **known._asdict()}).encode())
    return known


def candidate_pairs(robot: Robot) -> tuple[Pair, ...]:
    """All pairs but those that are still or allowed."""
    objects, links = list(robot.geometry.geometryObjects), robot.geometry_links
    return tuple(
        (i, j)
        for i, j in itertools.combinations(range(len(objects)), 2)
        if objects[i].parentJoint != objects[j].parentJoint
        and links[i] != links[j]
        and link_pair(links[i], links[j]) not in robot.allowed_contacts
    )


def find_pairs(robot: Robot, candidates: tuple[Pair, ...]) -> SelfPairs:
    """Sample, then prove. Seeded: the same answer every time."""
    if not candidates:
        return SelfPairs((), (), ())
    at_home, *sampled = (self_distances(robot, candidates, q) for q in (robot.home, *_samples(robot)))
    distances = np.array(sampled)
    always = (at_home <= 0.0) & ((distances <= 0.0).mean(axis=0) >= ALWAYS)
    near = np.minimum(distances.min(axis=0), at_home) < APART
    touching = tuple(itertools.compress(candidates, always))
    apart, left = set(), MOST_BOXES
    for pair in sorted(itertools.compress(candidates, ~near), key=lambda pair: len(reaches(robot, pair)[0])):
        proved, boxes = stays_apart(robot, pair, APART, min(left, MOST_BOXES_A_PAIR))
        left -= boxes
        if proved:
            apart.add(pair)
    checked = tuple(pair for pair in candidates if pair not in apart and pair not in touching)
    return SelfPairs(checked, tuple(sorted(apart)), touching)


def pair_geometry(robot: Robot, pairs: tuple[Pair, ...]) -> tuple[Any, Any]:
    """The robot's ``pinocchio.GeometryModel`` with these collision pairs, and data for exact signed distances."""
    import pinocchio as pin

    geometry = pin.GeometryModel(robot.geometry)
    for i, j in pairs:
        geometry.addCollisionPair(pin.CollisionPair(i, j))
    placed = pin.GeometryData(geometry)
    for request in placed.distanceRequests:
        exact_request(request)
    return geometry, placed


def self_distances(robot: Robot, pairs: tuple[Pair, ...], q: Array) -> Array:
    """Signed distances (p,) of ``pairs`` at the configuration ``q`` (n,), m."""
    import pinocchio as pin

    geometry, data, placed = _prepared(robot, pairs)
    pin.updateGeometryPlacements(robot.model, data, geometry, placed, q)
    pin.computeDistances(geometry, placed)
    return np.array([result.min_distance for result in placed.distanceResults])


@lru_cache(maxsize=1)
def _prepared(robot: Robot, pairs: tuple[Pair, ...]) -> tuple[Any, Any, Any]:
    geometry, placed = pair_geometry(robot, pairs)
    return geometry, robot.model.createData(), placed


def _samples(robot: Robot) -> Array:
    low = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
    high = np.where(np.isfinite(robot.upper), robot.upper, math.pi)
    return np.random.default_rng(0).uniform(low, high, (SAMPLES, robot.n))


def _key(robot: Robot, candidates: tuple[Pair, ...]) -> str:
    text = json.dumps([VERSION, robot.hash, robot.home.tolist(), candidates])
    return hashlib.sha256(text.encode()).hexdigest()


def _read(path: Path, key: str, candidates: tuple[Pair, ...]) -> SelfPairs | None:
    """What a cache file says, None where there is none for this robot or it makes no sense."""
    try:
        document = read_json(path)
        if document["key"] != key:
            return None
        found = SelfPairs(*(tuple((int(i), int(j)) for i, j in document[name]) for name in SelfPairs._fields))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return found if sorted(itertools.chain(*found)) == sorted(candidates) else None
