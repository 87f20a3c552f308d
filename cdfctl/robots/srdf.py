"""Which links may touch: the ``disable_collisions`` of an SRDF, and the neighbours of the kinematic tree."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.xml_file import read_robot_xml

LinkPair = tuple[str, str]
"""Two link names in alphabetical order."""


def link_pair(a: str, b: str) -> LinkPair:
    """The pair of two links, whichever comes first."""
    return (a, b) if a <= b else (b, a)


def read_srdf(path: Path, links: Sequence[str]) -> frozenset[LinkPair]:
    """The pairs of ``links`` whose contact an SRDF disables; links the URDF does not have are left out.

    ``disable_collisions``, ``disable_default_collisions`` and ``enable_collisions`` are read, nothing else.

    Raises:
        InputError: the file is no SRDF, or names no link of this robot.
    """
    root = read_robot_xml(path, "SRDF", "an")
    known = frozenset(links)
    named: set[str] = set()
    disabled: set[LinkPair] = set()
    for element in root.findall("disable_default_collisions"):
        link = _attribute(path, element, "link")
        named.add(link)
        disabled.update(link_pair(link, other) for other in links if other != link)
    for tag, change in (("enable_collisions", disabled.discard), ("disable_collisions", disabled.add)):
        for element in root.findall(tag):
            pair = link_pair(_attribute(path, element, "link1"), _attribute(path, element, "link2"))
            named.update(pair)
            change(pair)
    if named and not named & known:
        some = sorted(named)[0]
        raise InputError(f"{path}: names no link of this robot, but '{some}'", hint=name_hint(some, links))
    return frozenset(pair for pair in disabled if known.issuperset(pair))


def allowed_contacts(
    disabled: Iterable[LinkPair],
    parents: Mapping[str, str],
    bodies: Sequence[str],
    merged: Mapping[str, Sequence[str]],
) -> dict[LinkPair, str]:
    """The pairs of ``bodies`` that are not looked at, with the reason: ``neighbours`` or ``SRDF``.

    Args:
        disabled: pairs of an SRDF.
        parents: child link to parent link, of the whole URDF.
        bodies: names of the links that have collision geometry, a merged hull by its new name.
        merged: new name to the links in it. A hull is exempt where all its links are.

    A body's neighbour is the next link with collision geometry up the tree.
    """
    off = frozenset(disabled)
    names = tuple(dict.fromkeys(bodies))
    owner = {member: name for name in names for member in merged.get(name, (name,))}
    neighbours = set()
    for member, name in owner.items():
        link = parents.get(member)
        while link is not None and (link not in owner or owner[link] == name):
            link = parents.get(link)
        if link is not None:
            neighbours.add(link_pair(name, owner[link]))
    allowed = dict.fromkeys(sorted(neighbours), "neighbours")
    for a, b in itertools.combinations(names, 2):
        pairs = itertools.product(merged.get(a, (a,)), merged.get(b, (b,)))
        if all(link_pair(*pair) in off for pair in pairs):
            allowed.setdefault(link_pair(a, b), "SRDF")
    return allowed


def _attribute(path: Path, element: ElementTree.Element, name: str) -> str:
    value = element.get(name)
    if not value:
        raise InputError(f"{path}: <{element.tag}> needs {name}")
    return value
