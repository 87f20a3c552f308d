"""Reading a URDF: checked here, in one line a problem, before Pinocchio's parser sees it.

The text handed on differs from the file in three ways: visual geometry is left out, mesh file names are absolute paths,
and a ``continuous`` joint has become a revolute one without limits (so that every joint has one coordinate).
"""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.meshes import check_mesh_file
from cdfctl.robots.xml_file import read_robot_xml

MOVING_TYPES = ("revolute", "prismatic", "continuous")
# Stands for "no limit" between here and the model; far beyond any angle, and still exact in radians.
NO_LIMIT = 1.0e9


@dataclass(frozen=True)
class UrdfJoint:
    """A joint that moves: ``lower`` and ``upper`` (rad or m, ±inf if continuous), ``velocity`` (nan if not given),
    ``acceleration`` (rad/s² or m/s²; a URDF has none: inf)."""

    name: str
    type: str
    lower: float
    upper: float
    velocity: float
    mimic: tuple[str, float, float] | None  # (joint, multiplier, offset)
    acceleration: float = math.inf


@dataclass(frozen=True)
class Urdf:
    """A checked URDF: its ``text`` for Pinocchio, the moving ``joints`` by name, the names of ``links``, and the
    parent link of every link but the root, by any joint."""

    path: Path
    text: str
    joints: Mapping[str, UrdfJoint]
    links: tuple[str, ...]
    parents: Mapping[str, str]


def read_urdf(path: Path, package_dirs: Sequence[Path] = ()) -> Urdf:
    """Read and check a URDF.

    ``package://name/rest`` is looked for in every directory of ``package_dirs`` (as ``dir/name/rest``, and as
    ``dir/rest`` where the directory itself is called ``name``), then in the directories above the URDF and in
    ROS_PACKAGE_PATH.

    Raises:
        InputError: anything that keeps the file from being a robot, in one line.
    """
    root = parse_urdf(path)
    links = _names(path, root, "link")
    _names(path, root, "joint")
    joints = {}
    for element in root.findall("joint"):
        joint = _joint(path, element, links)
        if joint is not None:
            joints[joint.name] = joint
    if not joints:
        raise InputError(f"{path}: no joint that moves", hint=f"a moving joint is {' or '.join(MOVING_TYPES)}")
    parents = _tree(path, root, links)
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        for collision in link.findall("collision"):
            check_geometry(path, link.attrib["name"], collision, package_dirs)
    return Urdf(path, ElementTree.tostring(root, encoding="unicode"), joints, links, parents)


def parse_urdf(path: Path) -> Element:
    """The root of a URDF's XML. Raises :class:`InputError` where the file is none, in one line."""
    if path.is_dir():
        raise InputError(f"{path}: is a directory, not a URDF file")
    root = read_robot_xml(path, "URDF", "a")
    root.attrib.setdefault("name", path.stem)
    if any("xacro" in str(element.tag) for element in root.iter()):
        raise InputError(f"{path}: contains xacro elements", hint="expand it first: xacro model.xacro > model.urdf")
    return root


def _names(path: Path, root: Element, tag: str) -> tuple[str, ...]:
    names = [element.get("name", "") for element in root.findall(tag)]
    for name in names:
        if not name:
            raise InputError(f"{path}: a {tag} has no name")
        if not name.isprintable():
            raise InputError(f"{path}: the name of a {tag} holds control characters: {name!r}")
        if names.count(name) > 1:
            raise InputError(f"{path}: the {tag} name '{name}' is used twice")
    if not names:
        raise InputError(f"{path}: has no {tag}")
    return tuple(names)


def _joint(path: Path, element: Element, links: Sequence[str]) -> UrdfJoint | None:
    """The joint if it moves; a continuous one is rewritten in place."""
    name, kind = element.attrib["name"], element.get("type", "")
    where = f"{path}: joint '{name}'"
    for end in ("parent", "child"):
        child = element.find(end)
        link = "" if child is None else child.get("link", "")
        if link not in links:
            raise InputError(f"{where}: its {end} link '{link}' does not exist", hint=name_hint(link, links))
    _numbers(where, element.find("origin"), "xyz", 3)
    _numbers(where, element.find("origin"), "rpy", 3)
    if kind == "fixed":
        return None
    if kind not in MOVING_TYPES:
        raise InputError(f"{where}: type '{kind}' is not supported", hint="allowed: fixed, " + ", ".join(MOVING_TYPES))
    axis = _numbers(where, element.find("axis"), "xyz", 3)
    if axis is not None and math.hypot(*axis) < 1e-9:
        raise InputError(f"{where}: its axis has no direction")
    limit = element.find("limit")
    if kind == "continuous":
        lower, upper = -math.inf, math.inf
        element.set("type", "revolute")
        if limit is None:
            limit = ElementTree.SubElement(element, "limit")
        limit.set("lower", str(-NO_LIMIT))
        limit.set("upper", str(NO_LIMIT))
    else:
        if limit is None:
            raise InputError(f"{where}: a {kind} joint needs a <limit>", hint="or make it continuous")
        lower, upper = _number(where, limit, "lower", 0.0), _number(where, limit, "upper", 0.0)
        if not lower <= upper:
            raise InputError(f"{where}: lower limit {lower} is above upper limit {upper}")
    velocity = _number(where, limit, "velocity", math.nan)
    for attribute in ("velocity", "effort"):
        if attribute not in limit.attrib:
            limit.set(attribute, "0")
    return UrdfJoint(name, kind, lower, upper, velocity, _mimic(where, element))


def _mimic(where: str, element: Element) -> tuple[str, float, float] | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    element.remove(mimic)
    multiplier, offset = _number(where, mimic, "multiplier", 1.0), _number(where, mimic, "offset", 0.0)
    return mimic.get("joint", ""), multiplier, offset


def _tree(path: Path, root: Element, links: Sequence[str]) -> dict[str, str]:
    """Each link's parent; refused unless exactly one link has none, no link has two, and there is no loop."""
    parent: dict[str, str] = {}
    for element in root.findall("joint"):
        up, down = (next(element.iter(end)).attrib["link"] for end in ("parent", "child"))
        if down in parent:
            raise InputError(f"{path}: link '{down}' is the child of two joints")
        parent[down] = up
    roots = [link for link in links if link not in parent]
    if len(roots) != 1:
        found = ", ".join(roots) if roots else "a loop"
        raise InputError(f"{path}: the links do not form one tree: its roots are {found}")
    for link in links:
        steps = 0
        while link in parent:
            link, steps = parent[link], steps + 1
            if steps > len(links):
                raise InputError(f"{path}: link '{link}' is in a loop of joints")
    return parent


def check_geometry(path: Path, link: str, element: Element, package_dirs: Sequence[Path]) -> None:
    """Refuse a ``<collision>`` or ``<visual>`` of ``link`` that cannot be read; a mesh gets its absolute file name.

    Raises:
        InputError: what is wrong with it, in one line.
    """
    where = f"{path}: {element.tag} geometry of link '{link}'"
    _numbers(where, element.find("origin"), "xyz", 3)
    _numbers(where, element.find("origin"), "rpy", 3)
    geometry = element.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None or shape.tag not in ("mesh", "box", "sphere", "cylinder"):
        found = "nothing" if shape is None else f"<{shape.tag}>"
        raise InputError(f"{where}: found {found}", hint="allowed: mesh, box, sphere, cylinder")
    for attribute, size in (("size", 3), ("scale", 3), ("radius", 1), ("length", 1)):
        numbers = _numbers(where, shape, attribute, size)
        if numbers is not None and (0.0 in numbers if attribute == "scale" else min(numbers) <= 0.0):
            raise InputError(f"{where}: {attribute} must be greater than 0, found {shape.get(attribute)}")
    needed = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "mesh": ("filename",)}
    for attribute in needed[shape.tag]:
        if attribute not in shape.attrib:
            raise InputError(f"{where}: <{shape.tag}> needs {attribute}")
    if shape.tag == "mesh":
        shape.set("filename", str(_resolve_mesh(path, link, shape.attrib["filename"], package_dirs)))


def _resolve_mesh(path: Path, link: str, name: str, package_dirs: Sequence[Path]) -> Path:
    """The absolute path of a mesh, or an error that names where it was looked for."""
    if name.startswith("package://"):
        if ".." in Path(name).parts:
            raise InputError(f"{path}: mesh '{name}' of link '{link}' leaves its package", "name it without '..'")
        candidates = list(_in_packages(path, name.removeprefix("package://"), package_dirs))
    else:
        candidates = [path.parent / name.removeprefix("file://")]
    for candidate in candidates:
        if candidate.exists():
            check_mesh_file(candidate)
            return candidate.resolve()
    hint = None
    if name.startswith("package://"):
        # Where the package is known, it is the file that is missing.
        package, *rest = Path(name.removeprefix("package://")).parts or ("",)
        roots = [(c, c.parents[len(rest) - 1]) for c in candidates if rest]
        known = next((c for c, root in roots if root.name == package and root.is_dir()), None)
        hint = f"it would be {known}" if known else f"name the folder that holds '{package}' in package_dirs"
    raise InputError(f"{path}: mesh '{name}' of link '{link}' is not there", hint=hint)


def _in_packages(path: Path, rest: str, package_dirs: Iterable[Path]) -> Iterator[Path]:
    package, _, inner = rest.partition("/")
    ros = [Path(entry) for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if entry]
    for directory in (*package_dirs, *path.resolve().parents, *ros):
        yield directory / rest
        if directory.name == package:
            yield directory / inner


def _numbers(where: str, element: Element | None, attribute: str, size: int) -> list[float] | None:
    """The ``size`` finite numbers of an attribute, None where the element or the attribute is not there."""
    if element is None or attribute not in element.attrib:
        return None
    text = element.attrib[attribute]
    try:
        numbers = [float(part) for part in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != size or not all(math.isfinite(number) for number in numbers):
        raise InputError(f"{where}: {attribute} must be {size} finite number{'s' * (size > 1)}, found '{text}'")
    return numbers


def _number(where: str, element: Element, attribute: str, default: float) -> float:
    numbers = _numbers(where, element, attribute, 1)
    return default if numbers is None else numbers[0]
