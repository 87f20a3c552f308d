"""Obstacles measured while a run goes on. In the file they stand where the obstacles do:

    obstacles:
      source: udp
      port: 5005
      items:
        - {name: ball, shape: {type: ball, radius: 0.05}, position: [0.5, 0.6, 0.5]}

A :class:`Scenario` keeps the two apart: ``obstacles`` are the items, ``feed`` is the rest. The functions here go from
one form to the other, in plain data and in places.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, model_validator

from cdfctl.scenario.values import Complaint, Label, Place, PlainPositive, Strict, Whole, about, refuse

ITEMS = "items"


class FeedConfig(Strict):
    """Where measurements of the obstacles come from: one JSON object a line, on standard input or a UDP port."""

    source: Annotated[Literal["stdin", "udp"], about("standard input, or a UDP port of this machine")]
    host: Annotated[
        Label, about("address to listen at: who can send there, can steer the arm; the default is this machine only")
    ] = "127.0.0.1"
    port: Annotated[int | None, BeforeValidator(Whole(1, 65535)), about("UDP port to listen at")] = None
    max_age: Annotated[
        PlainPositive, about("the arm brakes while the last measurement of an obstacle is older", "s")
    ] = 0.1
    max_speed: Annotated[
        PlainPositive, about("a measurement that takes an obstacle to be faster is refused", "m/s")
    ] = 3.0

    @model_validator(mode="after")
    def _port(self) -> Self:
        if self.source == "udp" and self.port is None:
            raise refuse("missing key 'port'", "the UDP port to listen at, 1 to 65535", at=("port",))
        if self.source == "stdin" and self.port is not None:
            raise refuse("port goes with source: udp", at=("port",))
        return self


def expand(data: Any) -> tuple[Any, bool, list[Complaint]]:
    """The file's ``data`` with ``obstacles: {source, items, …}`` taken apart, whether it was there, and what is wrong.

    Places of complaints are the file's.
    """
    if not isinstance(data, dict):
        return data, False, []
    wrong: list[Complaint] = []
    if "feed" in data:
        wrong.append(("unknown key 'feed'", "measured obstacles are written obstacles: {source: …}", ("feed",)))
        data = {key: value for key, value in data.items() if key != "feed"}
    obstacles = data.get("obstacles")
    if not isinstance(obstacles, dict):
        return data, False, wrong
    if ITEMS not in obstacles:
        wrong.append(("missing key 'items'", "the measured obstacles: name, shape, position", ("obstacles", ITEMS)))
    feed = {key: value for key, value in obstacles.items() if key != ITEMS}
    return {**data, "obstacles": obstacles.get(ITEMS, []), "feed": feed}, True, wrong


def collapse(data: dict[str, Any]) -> dict[str, Any]:
    """The plain data of a scenario as a file has it: the inverse of :func:`expand`."""
    if data.get("feed") is None:
        return {key: value for key, value in data.items() if key != "feed"}
    obstacles = {**data["feed"], ITEMS: data["obstacles"]}
    return {key: obstacles if key == "obstacles" else value for key, value in data.items() if key != "feed"}


def in_file(place: Place, measured: bool) -> Place:
    """A place of the scenario as one of the file, where the obstacles are ``measured``."""
    if not measured or not place:
        return place
    if place[0] == "feed":
        return ("obstacles", *place[1:])
    return ("obstacles", ITEMS, *place[1:]) if place[0] == "obstacles" and place[1:2] != (ITEMS,) else place


def measured_only(data: dict[str, Any]) -> Iterator[Complaint]:
    """What a measured obstacle must not have: a motion of its own."""
    items = data.get("obstacles")
    if data.get("feed") is None or not isinstance(items, list | tuple):
        return
    for i, item in enumerate(items):
        for key in ("velocity", "angular_velocity", "motion", "approach"):
            value = item.get(key) if isinstance(item, dict) else None
            if value is not None and not (isinstance(value, list | tuple) and not any(value)):
                hint = "its position is where it is before the first measurement"
                yield f"a measured obstacle has no {key} of its own", hint, ("obstacles", i, key)
