"""The signed distance field: how far each link is from each obstacle, and how that changes.

    d            signed distance of the surfaces, m, negative in penetration
    ∂d/∂q_j      = -νᵀ J_a,j         a: witness on the robot, ν: unit normal from robot to obstacle
    ∂d/∂t        = νᵀ (v + ω × (b - origin))                         b: witness on the obstacle

The links are those a joint moves; a link's distance is the least over its convex pieces, an obstacle's the least over
its convex parts. In penetration, ν is the direction in which the obstacle leaves the piece soonest.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from cdfctl.fields.kernel.body import body_of, new_frames
from cdfctl.fields.kernel.distance import Work, new_work
from cdfctl.fields.kernel.parts import SceneParts
from cdfctl.fields.kernel.rows import Answer, link_rows, nearest_rows, new_answer
from cdfctl.robots.robot import Robot
from cdfctl.types import Array, FieldQuery, Scene, Unit, as_vector


class SDF:
    """The signed distance field of ``robot``. It keeps workspaces, so one instance a thread, but nothing of a query."""

    unit: Unit = "m"

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._body = body_of(robot)
        self._frames = new_frames(self._body)
        self._parts = SceneParts()
        self._answer, self._nowhere = new_answer(0, robot.n), _nowhere(0, robot.n)

    @cached_property
    def _work(self) -> Work:
        """Made at the first query, not before: where the kernels are not compiled yet, that begins here."""
        return new_work()

    def query(self, q: ArrayLike, scene: Scene) -> FieldQuery:
        """One row an obstacle, in the scene's order: the link nearest to it.

        A row is invalid where no joint can change the distance (the gradient is shorter than 1e-9), and for a robot
        without geometry, whose distance is +inf.

        Raises:
            InputError: ``q`` has not n numbers, or a number of ``q`` or of the scene is not finite.
        """
        point, parts = as_vector(q, self.robot.n, "q"), self._parts.of(scene)
        answer = self.room(len(scene), every_link=False)
        nearest_rows(self._body, point, parts, self._frames, self._work, answer)
        return self.rows(len(scene))

    def per_link(self, q: ArrayLike, scene: Scene) -> FieldQuery:
        """One row for every obstacle and link: all links of the first obstacle, in the robot's order, then the next.

        Raises:
            InputError: as :meth:`query`.
        """
        point, parts = as_vector(q, self.robot.n, "q"), self._parts.of(scene)
        answer = self.room(len(scene), every_link=True)
        link_rows(self._body, point, parts, self._frames, self._work, answer)
        return self.rows(len(scene))

    def contacts(self, q: ArrayLike, scene: Scene, *, sheets: int = 1) -> FieldQuery:
        """The same as :meth:`per_link`: a link's signed distance has one contact, whatever ``sheets`` allows."""
        return self.per_link(q, scene)

    def reset(self) -> None:
        """Nothing to forget: an answer depends on its question only."""

    def room(self, m: int, *, every_link: bool) -> Answer:
        """What the kernel is to fill for m obstacles, one row each or one for each and every link."""
        r = m * len(self.robot.links) if every_link else m
        if len(self._answer.d) != r:
            self._answer, self._nowhere = new_answer(r, self.robot.n), _nowhere(r, self.robot.n)
        return self._answer

    def rows(self, m: int) -> FieldQuery:
        """The rows of m obstacles that the kernel has filled."""
        answer = self._answer
        each = len(answer.d) // max(m, 1)
        return FieldQuery(
            obstacle=np.arange(m * each, dtype=np.int64) // max(each, 1),
            link=answer.link.copy(),
            d=answer.d.copy(),
            dq=answer.dq.copy(),
            dt=answer.dt.copy(),
            valid=answer.valid.copy(),
            contact_q=self._nowhere,
            unit="m",
        )


def _nowhere(r: int, n: int) -> Array:
    """The contact configurations (r, n) of a field that knows none; many answers share them, so none can be written."""
    contact_q = np.full((r, n), np.nan)
    contact_q.flags.writeable = False
    return contact_q
