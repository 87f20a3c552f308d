"""What a robot looks like: the visual geometry of its URDF. For pictures only; no distance ever reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element

import numpy as np

from cdfctl.errors import InputError
from cdfctl.robots.robot import Robot, frame_index
from cdfctl.robots.urdf import check_geometry, parse_urdf
from cdfctl.types import Array, Box, Cylinder, Sphere


@dataclass(frozen=True)
class MeshFile:
    """A mesh file, each axis times ``scale`` (3,)."""

    path: Path
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


VisualShape: TypeAlias = MeshFile | Box | Cylinder | Sphere


@dataclass(frozen=True)
class Visual:
    """One visual of a link.

    Attributes:
        link: the link's name.
        joint: the joint that moves it, numbered as ``Robot.chain``; -1 is the world.
        rotation: (3, 3) and
        translation: (3,) m, its placement in the joint's frame.
        shape: what to draw.
        colour: r g b a within 0..1 where the URDF gives one; a mesh file may have colours of its own.
    """

    link: str
    joint: int
    rotation: Array
    translation: Array
    shape: VisualShape
    colour: tuple[float, float, float, float] | None


def read_visuals(robot: Robot) -> tuple[list[Visual], dict[str, str]]:
    """The visuals of ``robot``; and of each link one of whose visuals cannot be read, the reason in one line.

    Such a link has none at all here: half a link would pass for the whole.

    Raises:
        InputError: the URDF itself is no longer there, or no longer a URDF.
    """
    root = parse_urdf(robot.urdf)
    colours = {m.get("name", ""): _colour(m) for m in root.findall("material")}
    visuals: list[Visual] = []
    problems: dict[str, str] = {}
    for link in root.findall("link"):
        name = link.get("name", "")
        try:
            visuals += [_visual(robot, name, item, colours) for item in link.findall("visual")]
        except InputError as error:
            problems[name] = error.message
    return visuals, problems


def _visual(robot: Robot, link: str, element: Element, colours: dict[str, Any]) -> Visual:
    import pinocchio as pin

    check_geometry(robot.urdf, link, element, robot.package_dirs)
    origin = element.find("origin")
    rpy, xyz = (_floats(origin, key) for key in ("rpy", "xyz"))
    frame = robot.model.frames[frame_index(robot.model, link)]
    placement = frame.placement * pin.SE3(pin.rpy.rpyToMatrix(np.array(rpy)), np.array(xyz))
    material = element.find("material")
    colour = None
    if material is not None:
        colour = _colour(material) or colours.get(material.get("name", ""))
    return Visual(
        link, int(frame.parentJoint) - 1, placement.rotation, placement.translation, _shape(robot.urdf, element), colour
    )


def _shape(path: Path, element: Element) -> VisualShape:
    geometry = element.find("geometry")
    assert geometry is not None  # check_geometry has seen it
    shape = next(iter(geometry))
    if shape.tag == "mesh":
        x, y, z = _floats(shape, "scale", 1.0)
        return MeshFile(path.parent / shape.attrib["filename"], (x, y, z))
    if shape.tag == "box":
        x, y, z = _floats(shape, "size")
        return Box((x, y, z))
    if shape.tag == "sphere":
        return Sphere(float(shape.attrib["radius"]))
    return Cylinder(float(shape.attrib["radius"]), float(shape.attrib["length"]))


def _floats(element: Element | None, key: str, default: float = 0.0) -> Sequence[float]:
    text = None if element is None else element.get(key)
    return [default] * 3 if text is None else [float(part) for part in text.split()]


def _colour(material: Element) -> tuple[float, float, float, float] | None:
    """``<color rgba="…"/>`` of a material; None where there is none, or none that makes sense."""
    element = material.find("color")
    try:
        rgba = (
            [min(1.0, max(0.0, float(part))) for part in element.get("rgba", "").split()] if element is not None else []
        )
    except ValueError:
        return None
    return (rgba[0], rgba[1], rgba[2], rgba[3]) if len(rgba) == 4 and np.isfinite(rgba).all() else None
