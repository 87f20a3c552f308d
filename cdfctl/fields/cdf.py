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
from cdfctl.fields.kernel.memory import UNKNOWN, Memory, new_memory
from cdfctl.fields.kernel.parts import SceneParts
from cdfctl.fields.kernel.rows import Answer, new_answer
from cdfctl.fields.kernel.starts import Table, empty_table
from cdfctl.fields.sdf import SDF
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, FieldQuery, Scene, Shape, Unit, as_vector

SPARE_MEMORY = 2  # contacts remembered beyond the sheets of the last query
MOST_SHEETS = 16


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
        self._room, self._rows = (0, 1), new_contact_rows(0, 1, robot.n)
        self._no_distances = new_answer(0, robot.n)
        self._names: tuple[str, ...] = ()
        self._shapes: tuple[Shape | None, ...] = ()
        self._memory = new_memory(0, MOST_SHEETS + SPARE_MEMORY, robot.n, len(self._body.joint))

    @cached_property
    def _work(self) -> Workspace:
        """Made at the first query, not before: where the kernels are not compiled yet, that begins here."""
        return new_workspace(self._body, MOST_SHEETS + SPARE_MEMORY)

    def query(self, q: ArrayLike, scene: Scene) -> FieldQuery:
        """The nearest contact of each obstacle, one row an obstacle, in the scene's order.

        Raises:
            InputError: ``q`` has not n numbers, or a number of ``q`` or of the scene is not finite.
        """
        return self._query(as_vector(q, self.robot.n, "q"), scene, 1, True, self._no_distances)[0]

    def contacts(self, q: ArrayLike, scene: Scene, *, sheets: int = 1) -> FieldQuery:
        """Up to ``sheets`` distinct contacts of each obstacle, nearest first; no row for an obstacle out of reach.

        Contacts are distinct if they are at least 0.1 rad apart, or 0.01 rad where different pieces of the robot touch.

        Raises:
            InputError: as :meth:`query`, or ``sheets`` is not 1 … 16.
        """
        return self._query(as_vector(q, self.robot.n, "q"), scene, sheets, False, self._no_distances)[0]

    def beside(
        self, sdf: SDF, q: ArrayLike, scene: Scene, *, sheets: int, every_link: bool
    ) -> tuple[FieldQuery, FieldQuery]:
        """The answers of both fields in one pass: signed distances at q are where the search for contacts begins.

        Of this field as :meth:`contacts`, or, where ``sheets`` is 1, as :meth:`query`; of ``sdf``, which must be of the
        same robot, as its ``per_link`` or ``query``.

        Raises:
            InputError: as those.
        """
        point = as_vector(q, self.robot.n, "q")
        distances = sdf.room(len(scene), every_link=every_link)
        rows, inside = self._query(point, scene, sheets, sheets == 1, distances)
        if inside:
            return rows, sdf.rows(len(scene))
        return rows, sdf.per_link(point, scene) if every_link else sdf.query(point, scene)

    def reset(self) -> None:
        """Forget the contacts of earlier queries."""
        self._memory.known[:], self._memory.turn[:] = UNKNOWN, 0

    def _query(
        self, q: Array, scene: Scene, sheets: int, every_obstacle: bool, distances: Answer
    ) -> tuple[FieldQuery, bool]:
        """The rows, and whether ``distances`` are filled."""
        if not 1 <= sheets <= MOST_SHEETS:
            raise InputError(f"sheets must be 1 to {MOST_SHEETS}, found {sheets}")
        parts, room = self._parts.of(scene), (len(scene), sheets)
        if self._room != room:
            self._rows, self._room = new_contact_rows(*room, self.robot.n), room
        rows, memory = self._rows, self._remember(scene)
        inside = contact_rows(
            self._body, q, parts, memory, self._table, sheets, every_obstacle, rows, distances, self._work
        )
        count = rows.count[0]
        answer = FieldQuery(
            obstacle=rows.obstacle[:count].copy(),
            link=rows.link[:count].copy(),
            d=rows.d[:count].copy(),
            dq=rows.dq[:count].copy(),
            dt=rows.dt[:count].copy(),
            valid=rows.valid[:count].copy(),
            contact_q=rows.contact_q[:count].copy(),
            unit="rad",
        )
        return answer, inside

    def _remember(self, scene: Scene) -> Memory:
        """The memory in the order of ``scene``: that of obstacles no longer there is dropped, and one of another shape
        is taken for one that leapt."""
        names, shapes = scene.names, scene.shapes
        if names is not self._names and names != self._names:
            old, places = self._memory, {name: i for i, name in enumerate(self._names)}
            self._memory = new_memory(len(names), old.piece.shape[1], self.robot.n, old.tried.shape[1])
            for i, name in enumerate(names):
                if name in places:
                    for member in ("known", "piece", "x", "motion", "steady", "tried", "drift", "pose"):
                        getattr(self._memory, member)[i] = getattr(old, member)[places[name]]
            self._memory.turn[:], self._memory.q[:] = old.turn, old.q
            self._shapes = tuple(self._shapes[places[name]] if name in places else None for name in names)
        if shapes is not self._shapes:
            for i, (shape, before) in enumerate(zip(shapes, self._shapes, strict=True)):
                if shape is not before:
                    self._memory.pose[i] = np.inf  # far from here
        self._names, self._shapes = names, shapes
        return self._memory


def table_path(robot: Robot) -> Path:
    """Where the table of ``robot`` is kept in the user cache."""
    from cdfctl.cache import cache_dir

    return cache_dir() / "tables" / f"{robot.name}-{robot.hash[:16]}.safetensors"
