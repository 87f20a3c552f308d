"""Where drawn obstacles come from: a closest approach, copies on a grid, and the rules by which a draw is refused.

None of it is left in a drawn scenario: an approach has become a position and a velocity, a count and a grid have become
obstacles of their own, and the rules have been kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import BeforeValidator

from cdfctl.scenario.values import (
    ListOf,
    NonNegative,
    Number,
    Plain,
    PlainNonNegative,
    Strict,
    Vector3,
    Whole,
    about,
    floats,
    number,
)

MOST_COPIES = 1000
"""Most draws of an obstacle, and most copies along an axis of a grid."""

MOST_OBSTACLES = 10_000
"""Most obstacles that one item of the list may become."""


class ApproachConfig(Strict):
    """A straight path by its closest approach to a point: with azimuth a and elevation e of the direction of motion,

    d = (cos a cos e, sin a cos e, sin e),      n = (-sin a, cos a, 0),
    velocity = speed d,                         position = through + offset n - speed time d.

    At ``time`` the origin is nearest to ``through``, ``offset`` away from it.
    """

    through: Annotated[Vector3, about("the point that is approached", "m")] = (0.0, 0.0, 0.0)
    time: Annotated[Number, about("when the origin is nearest to it", "s")]
    speed: Annotated[NonNegative, about("speed of the origin", "m/s")]
    azimuth: Annotated[Number, about("direction of motion: angle from world x towards y", "rad")]
    elevation: Annotated[Number, about("direction of motion: angle above the x-y plane", "rad")] = 0.0
    offset: Annotated[Number, about("how far the path passes the point, horizontally, to its left", "m")] = 0.0

    def place(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Position at t = 0 (m) and velocity (m/s), once every number is drawn."""
        azimuth, elevation = number(self.azimuth), number(self.elevation)
        speed, time, offset = number(self.speed), number(self.time), number(self.offset)
        level = math.cos(elevation)
        d = (math.cos(azimuth) * level, math.sin(azimuth) * level, math.sin(elevation))
        n = (-math.sin(azimuth), math.cos(azimuth), 0.0)
        position = (p + offset * b - speed * time * a for p, a, b in zip(floats(self.through), d, n, strict=True))
        return tuple(position), tuple(speed * a for a in d)


class GridConfig(Strict):
    """Copies of one draw, side by side along the world axes; the first is where the obstacle is."""

    counts: Annotated[
        tuple[
            Annotated[int, BeforeValidator(Whole(1, MOST_COPIES))],
            Annotated[int, BeforeValidator(Whole(1, MOST_COPIES))],
            Annotated[int, BeforeValidator(Whole(1, MOST_COPIES))],
        ],
        BeforeValidator(ListOf(exact=3, noun="whole numbers")),
        about("how many along world x, y, z"),
    ]
    step: Annotated[Vector3, about("from each to the next along world x, y, z", "m")]

    def offsets(self) -> list[tuple[float, float, float]]:
        """Where each copy is from the first, x changing fastest, m."""
        (i, j, k), (x, y, z) = self.counts, floats(self.step)
        return [(a * x, b * y, c * z) for c in range(k) for b in range(j) for a in range(i)]


class SegmentConfig(Strict):
    """A segment that no path may come near."""

    start: Annotated[tuple[Plain, Plain, Plain], BeforeValidator(ListOf(exact=3)), about("one end, world frame", "m")]
    end: Annotated[
        tuple[Plain, Plain, Plain], BeforeValidator(ListOf(exact=3)), about("the other end, world frame", "m")
    ]
    distance: Annotated[PlainNonNegative, about("drawn again where a surface comes nearer than this", "m")]

    @property
    def ends(self) -> tuple[Sequence[float], Sequence[float]]:
        """Both ends, m."""
        return self.start, self.end


class RedrawConfig(Strict):
    """What makes a draw be thrown away and taken again. Distances are signed, between surfaces."""

    start: Annotated[
        PlainNonNegative | None, about("drawn again where at t = 0 it is nearer than this to the robot at q0", "m")
    ] = None
    goal: Annotated[
        PlainNonNegative | None,
        about("drawn again where at t = 0 it is nearer than this to the robot at the goal or the pose to hold", "m"),
    ] = None
    segment: Annotated[
        SegmentConfig | None,
        about("drawn again where, from t = 0 on, the ball around it passes a segment too near; constant velocity only"),
    ] = None
