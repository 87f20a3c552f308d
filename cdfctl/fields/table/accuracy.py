"""What a table is worth, measured on points that are not on its grid, and stored with it.

- Residual: the distance between piece and ball at entries of the table, by coal on Pinocchio's placements, which share
  no code with the search that found them.
- Coverage: of the points where some contact exists, the share whose cell has entries.
- Comparison: for a ball at such a point and a random q clear of it, the distance by the table alone (its nearest
  entry, not refined), by a cold query and by the last query of a short loop, with and without the table. The truth is
  the least of 40 cold queries, each with another share of some hundred fresh contacts of that very ball as its table,
  and of the answers compared (not of the table alone, whose distance may be too short). So it is an upper bound of the
  least distance, if a tight one.
"""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from cdfctl.fields.kernel.body import Body, body_of
from cdfctl.fields.kernel.cdf_rows import contact_rows, new_contact_rows, new_workspace
from cdfctl.fields.kernel.memory import Memory, new_memory
from cdfctl.fields.kernel.parts import parts_of, turn_obstacles
from cdfctl.fields.kernel.rows import new_answer
from cdfctl.fields.kernel.starts import Table, empty_table, new_starts, table_starts
from cdfctl.fields.table.build import Progress
from cdfctl.fields.table.contacts import new_tools, point_contacts
from cdfctl.fields.table.grid import sampling_limits
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, Sphere

POINTS = 300  # held-out points
ENTRIES = 500  # entries whose distance coal measures
FRESH = 160  # starts a piece of the contacts the truth is made of
SHARES = 40  # cold queries for one truth
LOOP, PERIOD = 10, 0.1  # steps, and s of a step, before a warm query
SPEED, BALL_SPEED = 0.5, 0.5  # meanwhile: rad/s at most of a joint, m/s of the ball
NEAR = 1.0  # rad: pairs nearer than this are also counted apart, since a controller acts on them
WAYS = ("table alone", "cold, no table", "cold, table", "warm, no table", "warm, table")


@dataclass(frozen=True)
class Residual:
    """Absolute distances at ``entries`` entries by coal, m."""

    entries: int
    mean: float
    max: float


@dataclass(frozen=True)
class Coverage:
    """Of ``points`` held-out points ``reachable`` have a contact; ``covered`` of these have entries."""

    points: int
    reachable: int
    covered: int


@dataclass(frozen=True)
class WayError:
    """Errors of one way to answer over all pairs, rad: ``missed`` pairs had no answer and count in neither figure."""

    way: str
    pairs: int
    missed: int
    mean: float | None
    p95: float | None
    within: float
    """Share of the pairs answered within 0.01 rad."""


@dataclass(frozen=True)
class Accuracy:
    """The report: ``comparison`` over all pairs, ``near`` over those whose true distance is below ``NEAR``."""

    residual: Residual
    coverage: Coverage
    comparison: tuple[WayError, ...]
    near: tuple[WayError, ...]

    def document(self) -> dict[str, Any]:
        """The report as one JSON object."""
        return asdict(self)

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> Accuracy:
        """The report back from :meth:`document`; TypeError or KeyError for what is none."""
        return cls(
            Residual(**document["residual"]),
            Coverage(**document["coverage"]),
            tuple(WayError(**way) for way in document["comparison"]),
            tuple(WayError(**way) for way in document["near"]),
        )


class Answers(NamedTuple):
    """At one ``point`` (3,) and ``q`` (n,): whether the point's cell has entries, the true distance, and that of each
    of ``WAYS``; inf for none."""

    point: Array
    q: Array
    covered: bool
    truth: float
    ways: tuple[float, ...]


def measure_accuracy(
    robot: Robot,
    table: Table,
    radius: float,
    seed: int,
    *,
    points: int = POINTS,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Accuracy:
    """The report of ``table`` for a ball of ``radius`` m; the same for the same ``seed``, whatever ``jobs`` is.

    Args:
        robot: the table's robot.
        table: the table.
        radius: of the ball it was built with, m.
        seed: of the held-out points and configurations.
        points: how many of them.
        jobs: threads, every core without it.
        progress: called with the points done and ``points``.

    Raises:
        KeyboardInterrupt: passed on once the points under way are done.
    """
    body = body_of(robot)
    workspace = threading.local()

    def ask(index: int) -> Answers | None:
        if not hasattr(workspace, "judge"):
            workspace.judge = HeldOut(body, table, radius, seed)
        judge: HeldOut = workspace.judge
        return judge.answers(index)

    found: list[Answers] = []
    pool = ThreadPoolExecutor(jobs or os.cpu_count() or 1)
    try:
        for i, answers in enumerate(pool.map(ask, range(points))):
            if answers is not None:
                found.append(answers)
            if progress is not None:
                progress(i + 1, points)
    finally:
        pool.shutdown(cancel_futures=True)
    pairs = [answers for answers in found if answers.truth < np.inf]
    errors = np.array([[abs(way - answers.truth) for way in answers.ways] for answers in pairs]).reshape(-1, len(WAYS))
    near = np.array([answers.truth < NEAR for answers in pairs], dtype=np.bool_)
    return Accuracy(
        residual=_residual(robot, table, radius, seed),
        coverage=Coverage(points, len(found), sum(answers.covered for answers in found)),
        comparison=tuple(_way_error(way, errors[:, i]) for i, way in enumerate(WAYS)),
        near=tuple(_way_error(way, errors[near, i]) for i, way in enumerate(WAYS)),
    )


def _way_error(way: str, errors: Array) -> WayError:
    answered = errors[np.isfinite(errors)]
    return WayError(
        way=way,
        pairs=len(errors),
        missed=len(errors) - len(answered),
        mean=float(np.mean(answered)) if len(answered) else None,
        p95=float(np.percentile(answered, 95)) if len(answered) else None,
        within=float(np.sum(answered <= 0.01) / max(1, len(errors))),
    )


def _residual(robot: Robot, table: Table, radius: float, seed: int) -> Residual:
    """Distances at some entries, by coal: the piece that is said to touch, and the ball on the grid point."""
    import coal
    import pinocchio as pin

    count = len(table.piece)
    if count == 0:
        return Residual(0, 0.0, 0.0)
    chosen = np.random.default_rng([seed, 2]).choice(count, min(count, ENTRIES), replace=False)
    pieces = sorted(range(len(robot.pieces)), key=lambda i: robot.pieces[i].link)  # the order of the kernel
    moving = [g for g in robot.geometry.geometryObjects if g.parentJoint > 0]
    ball, data = coal.Sphere(radius), robot.model.createData()
    request, distances = coal.DistanceRequest(True, True), np.empty(len(chosen))
    request.gjk_tolerance = request.epa_tolerance = 1e-9
    for i, e in enumerate(chosen):
        pin.forwardKinematics(robot.model, data, table.q[e].astype(np.float64))
        geometry = moving[pieces[table.piece[e]]]
        placement = data.oMi[geometry.parentJoint] * geometry.placement
        point = int(np.searchsorted(table.first, e, side="right")) - 1
        centre = table.origin + table.spacing * np.array(np.unravel_index(point, tuple(table.shape)))
        pose, place = coal.Transform3s(placement.rotation, placement.translation), coal.Transform3s(np.eye(3), centre)
        distances[i] = coal.distance(geometry.geometry, pose, ball, place, request, coal.DistanceResult())
    return Residual(len(chosen), float(np.mean(np.abs(distances))), float(np.max(np.abs(distances))))


class HeldOut:
    """Asks all ways at held-out points; one a thread."""

    def __init__(self, body: Body, table: Table, radius: float, seed: int) -> None:
        self._body, self._table, self._seed = body, table, seed
        self._n = len(body.chain.parent)
        self._nothing = empty_table(self._n)
        self._tools = new_tools(body, radius, FRESH)
        self._work = new_workspace(body, 3)
        self._parts = parts_of((Sphere(radius),))
        turn_obstacles(self._parts.pose, self._parts.rotation)
        self._nearest = new_starts(1, self._n)

    def answers(self, index: int) -> Answers | None:
        """At the point and q that ``index`` draws; None where the point is out of reach."""
        random = np.random.default_rng([self._seed, index, 1])
        table, (lower, upper) = self._table, sampling_limits(self._body)
        point = table.origin + table.spacing * random.uniform(-0.5, table.shape - 0.5)
        fresh = self._fresh_contacts(point, random)
        if len(fresh.piece) == 0:
            return None
        for _ in range(100):
            q = random.uniform(lower, upper)
            cold, clear = self._query(q, point, self._nothing, self._memory())
            if clear:
                break
        else:
            return None  # no room for the ball: the robot never leaves this point
        towards, drift = random.uniform(-SPEED, SPEED, self._n), random.normal(size=3)
        drift *= BALL_SPEED / float(np.linalg.norm(drift))
        warm = []
        for of in (self._nothing, table):
            memory = self._memory()
            for step in range(LOOP, -1, -1):
                back = np.clip(q - step * PERIOD * towards, lower, upper)
                last, _ = self._query(back, point - step * PERIOD * drift, of, memory)
            warm.append(last)
        ways = (
            self._table_alone(q, point),
            cold,
            self._query(q, point, table, self._memory())[0],
            *warm,
        )
        truth = min(*ways[1:], self._truth(q, point, fresh))
        return Answers(point, q, self._table_alone(q, point) < np.inf, truth, ways)

    def _query(self, q: Array, point: Array, table: Table, memory: Memory) -> tuple[float, bool]:
        """The distance to the ball at ``point``, inf for none, and whether q is clear of it."""
        rows = new_contact_rows(1, 1, self._n)
        self._parts.pose[0, :3] = point
        distances = new_answer(0, self._n)
        contact_rows(self._body, q, self._parts, memory, table, 1, False, rows, distances, self._work)
        return (float(rows.d[0]) if rows.count[0] else np.inf), bool(rows.f[0] > 0.0)

    def _memory(self) -> Memory:
        return new_memory(1, 3, self._n, len(self._body.joint))

    def _table_alone(self, q: Array, point: Array) -> float:
        count = table_starts(self._body, q, self._table, tuple(point), self._nearest)
        return float(self._nearest.cost[0]) if count else np.inf

    def _fresh_contacts(self, point: Array, random: np.random.Generator) -> Table:
        """Contacts of the ball at ``point`` from new starts, as a table of this one point, in random order."""
        pieces = len(self._body.joint)
        lower, upper = sampling_limits(self._body)
        starts = random.uniform(lower, upper, (pieces, FRESH, self._n))
        count, contacts = np.zeros(pieces, dtype=np.int64), np.zeros((pieces, FRESH, self._n))
        point_contacts(self._body, point, starts, True, self._tools, count, contacts)
        piece = np.repeat(np.arange(pieces, dtype=np.int16), count)
        q = contacts[np.arange(FRESH) < count[:, None]].astype(np.float32)
        order = random.permutation(len(piece))
        return _one_point(point, piece[order], q[order])

    def _truth(self, q: Array, point: Array, fresh: Table) -> float:
        best = np.inf
        for share in range(SHARES):
            some = _one_point(point, fresh.piece[share::SHARES].copy(), fresh.q[share::SHARES].copy())
            best = min(best, self._query(q, point, some, self._memory())[0])
        return best


def _one_point(point: Array, piece: Any, q: Any) -> Table:
    first = np.array([0, len(piece)], dtype=np.int64)
    return Table(point.copy(), 1.0, np.ones(3, dtype=np.int64), first, piece, q)
