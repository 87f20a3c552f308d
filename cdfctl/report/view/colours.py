"""The colours of the replay: those of the figures, and no meaning hangs on a colour alone.

Of the palette of Okabe and Ito, which people with any kind of colour vision can tell apart.
"""

from __future__ import annotations

from typing import TypeAlias

Rgb: TypeAlias = tuple[int, int, int]


def rgb(text: str) -> Rgb:
    """``#rrggbb`` as three numbers of 0..255."""
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


OBSTACLES = ("#D55E00", "#0072B2", "#CC79A7", "#56B4E9", "#F0E442", "#7F5200")
"""One an obstacle, round and round."""

TARGET = "#009E73"
CONTACT = "#E69F00"
TIP = "#0072B2"
DISTANCE = "#000000"
PLAN = "#009E73"
COLLISION = "#8FA8BF"
PLAIN = "#E8EAED"
"""A visual whose files give it no colour."""
BODY = "#5B6B7C"
"""A robot, or a link, that has no visuals."""


def obstacle_colour(index: int) -> str:
    """The colour of obstacle ``index``, in the scene and in the charts."""
    return OBSTACLES[index % len(OBSTACLES)]
