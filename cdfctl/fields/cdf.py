"""The configuration-space distance field: the least motion of the joints that brings robot and obstacle into contact.

    d_c(p, q) = ± min { ||q - q*|| : q* in Z(p) },      Z(p) = { q* : min_k f_k(p, q*) = 0 }

positive outside contact, negative in penetration, f_k the signed distance of link k. Contacts are solved for on the
exact convex shapes at every query; tables and remembered contacts are only where the search starts. What is true of
d_c, and not hidden here:

- Out of reach Z(p) is empty: d = +inf, and the row is invalid.
- d_c jumps when an obstacle enters reach, so its rows alone prove nothing; signed-distance rows beside them do.
- In penetration there is one row: the nearest configuration at which no link is in penetration. Where several links
  are, all have to be clear there. If none was found, d = -inf and the row is invalid.
- The search is local from many starts: a nearer contact can be missed. The documentation says how often.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from cdfctl.errors import InputError
from cdfctl.fields.kernel.body import body_of
from cdfctl.fields.kernel.cdf_rows import Workspace, contact_rows, new_contact_rows, new_workspace
from cdfctl.fields.kernel.parts import SceneParts
from cdfctl.fields.kernel.search import Memory, new_memory
from cdfctl.fields.kernel.starts import Table, empty_table
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, FieldQuery, Scene, Unit, as_vector

SPARE_MEMORY = 2  # contacts remembered beyond the sheets of the last query
MOST_SHEETS = 16
LEAP = 0.05  # m, or rad of a joint, between two queries, above which every obstacle concerned is searched widely


class CDF:
    """The configuration-space distance field of ``robot``.

    It remembers the contacts it found, as starts of the next query of the same obstacle (by its name), so one instance
    serves one loop; :meth:`reset` forgets them.
    """

    unit: Unit = "rad"

    def __init__(self, robot: Robot, table: Table | None = None) -> None:
        """``table``: contact configurations to start from (see ``cdfctl build-cdf``), or None."""
        self.robot = robot
        self._body = body_of(robot)
        self._table = empty_table(robot.n) if table is None else table
        self._parts = SceneParts()
        self._rows = new_contact_rows(0, 1, robot.n)
        self.reset()

    @cached_property
    def _work(self) -> Workspace:
        """Made at the first query, not before: where the kernels are not compiled yet, that begins here."""
        return new_workspace(self._body, MOST_SHEETS + SPARE_MEMORY)

    def query(self, q: ArrayLike, scene: Scene) -> FieldQuery:
        """The nearest contact of each obstacle, one row an obstacle, in the scene's order.

        Raises:
            InputError: ``q`` has not n numbers, or a number of ``q`` or of the scene is not finite.
        """
        return self._query(q, scene, 1, every_obstacle=True)

    def contacts(self, q: ArrayLike, scene: Scene, *, sheets: int = 1) -> FieldQuery:
        """Up to ``sheets`` distinct contacts of each obstacle, nearest first; no row for an obstacle out of reach.

        Contacts are distinct if they are at least 0.1 rad apart, or 0.01 rad where different pieces of the robot touch.

        Raises:
            InputError: as :meth:`query`, or ``sheets`` is not 1 … 16.
        """
        if not 1 <= sheets <= MOST_SHEETS:
            raise InputError(f"sheets must be 1 to {MOST_SHEETS}, found {sheets}")
        return self._query(q, scene, sheets, every_obstacle=False)

    def reset(self) -> None:
        """Forget the contacts of earlier queries."""
        self._names: tuple[str, ...] = ()
        self._last: tuple[Array, Array] | None = None  # q (n,) and poses (m, 7) of the last query
        self._memory = new_memory(0, MOST_SHEETS + SPARE_MEMORY, self.robot.n)

    def _query(self, q: ArrayLike, scene: Scene, sheets: int, *, every_obstacle: bool) -> FieldQuery:
        point, parts = as_vector(q, self.robot.n, "q"), self._parts.of(scene)
        m = len(scene)
        if self._rows.d.shape != (m, sheets):
            self._rows = new_contact_rows(m, sheets, self.robot.n)
        rows = self._rows
        memory = self._remember(scene.names)
        self._mark_leaps(point, scene)
        contact_rows(self._body, point, parts, memory, self._table, sheets, rows, self._work)
        empty = rows.filled == 0
        rows.d[empty & (rows.f < 0.0), 0] = -np.inf
        filled = np.arange(sheets) < rows.filled[:, None]
        if every_obstacle:
            filled[:, 0] = True
        obstacle, _ = np.nonzero(filled)
        link = np.where(filled & ~empty[:, None], self._body.link[rows.piece], -1)
        return FieldQuery(
            obstacle=obstacle.astype(np.int64),
            link=link[filled],
            d=rows.d[filled],
            dq=rows.dq[filled],
            dt=rows.dt[filled],
            valid=rows.valid[filled],
            contact_q=rows.contact_q[filled],
            unit="rad",
        )

    def _mark_leaps(self, q: Array, scene: Scene) -> None:
        """Mark the obstacles that moved, or all where the robot did, by more than :data:`LEAP` since the last query."""
        if self._last is not None and len(self._last[1]) == len(scene):
            moved = np.abs(scene.poses - self._last[1]).max(axis=1, initial=0.0)
            self._memory.leapt[:] = (moved > LEAP) | (np.abs(q - self._last[0]).max() > LEAP)
        self._last = (q, scene.poses.copy())

    def _remember(self, names: tuple[str, ...]) -> Memory:
        """The memory in the order of ``names``: that of obstacles no longer there is dropped."""
        if names is not self._names and names != self._names:
            old, places = self._memory, {name: i for i, name in enumerate(self._names)}
            self._memory = new_memory(len(names), old.piece.shape[1], self.robot.n)
            for i, name in enumerate(names):
                if name in places:
                    for member in ("known", "piece", "x"):
                        getattr(self._memory, member)[i] = getattr(old, member)[places[name]]
            self._memory.turn[:] = old.turn
        self._names = names
        return self._memory


def table_path(robot: Robot) -> Path:
    """Where the table of ``robot`` is kept in the user cache."""
    from cdfctl.cache import cache_dir

    return cache_dir() / "tables" / f"{robot.name}-{robot.hash[:16]}.safetensors"
