"""What every distance field answers, and the table of fields.

A field is made for one robot and asked with a configuration and a scene. It answers in rows (:class:`FieldQuery`): a
distance, its derivative with respect to q, and its partial derivative with respect to time, which is the part an
obstacle's motion adds.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

from numpy.typing import ArrayLike

from cdfctl.errors import unknown_name
from cdfctl.robots.robot import Robot
from cdfctl.types import FieldQuery, Scene, Unit

if TYPE_CHECKING:
    from cdfctl.fields.kernel.starts import Table


class Field(Protocol):
    """A distance field of one robot. An instance keeps workspaces: use one a thread."""

    @property
    def unit(self) -> Unit:
        """Of the distances: "m" or "rad"."""

    def query(self, q: ArrayLike, scene: Scene) -> FieldQuery:
        """The nearest contact of each obstacle, one row an obstacle, in the scene's order.

        Raises:
            InputError: ``q`` (n,) has another length or is not finite.
        """

    def contacts(self, q: ArrayLike, scene: Scene, *, sheets: int) -> FieldQuery:
        """All contacts the field tells apart, several rows an obstacle, obstacle by obstacle.

        Args:
            q: (n,) configuration.
            scene: the obstacles.
            sheets: the most contacts of one kind to return for an obstacle.

        Raises:
            InputError: ``q`` (n,) has another length or is not finite.
        """

    def reset(self) -> None:
        """Forget what was remembered from earlier queries (warm starts)."""


def _sdf(robot: Robot) -> Field:
    from cdfctl.fields.sdf import SDF

    return SDF(robot)


def _cdf(robot: Robot) -> Field:
    from cdfctl.fields.cdf import CDF, table_path

    path = table_path(robot)
    stamp = (path.stat().st_mtime_ns, path.stat().st_size) if path.exists() else None
    return CDF(robot, _table(robot, stamp))


@lru_cache(maxsize=4)
def _table(robot: Robot, stamp: tuple[int, int] | None) -> Table | None:
    """The robot's table of the user cache, read and checked once as long as its file keeps its ``stamp``."""
    from cdfctl.fields.table.store import cached_table

    return cached_table(robot)


# A new field is one line here. Values import their module when called: the compiled kernels take a while to load.
FIELDS: dict[str, Callable[[Robot], Field]] = {"sdf": _sdf, "cdf": _cdf}


def make_field(name: str, robot: Robot) -> Field:
    """The field ``name`` of ``robot``.

    Raises:
        InputError: there is no such field; the hint lists those there are.
    """
    if name not in FIELDS:
        raise unknown_name("field", name, FIELDS)
    return FIELDS[name](robot)
