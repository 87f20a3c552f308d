"""The collision bodies of a robot: convex, numbered by link, as Pinocchio geometry and as pieces for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cdfctl.errors import InputError, name_hint
from cdfctl.robots.coal_geometry import coal_convex, convex_form
from cdfctl.robots.convex import ConvexPiece, ConvexSet, convex_hull
from cdfctl.robots.robot_file import RobotFile
from cdfctl.robots.urdf import Urdf
from cdfctl.types import IntArray


class Body(NamedTuple):
    """One convex collision body: its link, Pinocchio's joint (0 is the world) and frame, placement, geometry, set."""

    link: str
    joint: int
    frame: int
    placement: Any
    geometry: Any
    shape: ConvexSet
    faces: IntArray


def read_bodies(urdf: Urdf, model: Any, geometry: Any) -> list[Body]:
    """The collision objects of a parsed URDF, meshes replaced by their hulls."""
    bodies = []
    for item in geometry.geometryObjects:
        link = _link_of(urdf, model, item)
        try:
            solid, shape, faces = convex_form(item.geometry)
        except InputError as error:
            raise InputError(f"{urdf.path}: collision geometry of link '{link}': {error.message}") from None
        bodies.append(Body(link, item.parentJoint, item.parentFrame, item.placement, solid, shape, faces))
    return bodies


def _link_of(urdf: Urdf, model: Any, item: Any) -> str:
    """Pinocchio names a collision object ``<link>_<number>``."""
    name = str(item.name).rpartition("_")[0]
    return name if name in urdf.links else str(model.frames[item.parentFrame].name)


def merge_bodies(file: RobotFile, bodies: list[Body]) -> list[Body]:
    """Bodies of the links named in ``merge`` become one hull, where the first of them stood."""
    for name, links in file.merge.items():
        found = tuple(dict.fromkeys(body.link for body in bodies))
        where = f"robot '{file.name}': merge '{name}'"
        if not links:
            raise InputError(f"{where}: names no link")
        for link in links:
            if link not in found:
                raise InputError(f"{where}: unknown link '{link}'", hint=name_hint(link, found))
        if name in found and name not in links:
            raise InputError(f"{where}: there is a link of that name already")
        members = [body for body in bodies if body.link in links]
        if len({body.joint for body in members}) > 1 or any(b.shape.disc or b.shape.radius for b in members):
            raise InputError(f"{where}: only boxes and meshes that move together can be merged")
        points = [b.shape.vertices @ b.placement.rotation.T + b.placement.translation for b in members]
        vertices, faces = convex_hull(np.concatenate(points), keep=True)
        first = members[0]
        hull = Body(
            name, first.joint, first.frame, _identity(), coal_convex(vertices, faces), ConvexSet(vertices), faces
        )
        bodies = [hull if body is first else body for body in bodies if body is first or body.link not in links]
    return bodies


def _identity() -> Any:
    import pinocchio as pin

    return pin.SE3.Identity()


def geometry_model(bodies: Sequence[Body]) -> Any:
    """The bodies as a ``pinocchio.GeometryModel``."""
    import pinocchio as pin

    geometry = pin.GeometryModel()
    for name, body in zip(body_names(bodies), bodies, strict=True):
        geometry.addGeometryObject(pin.GeometryObject(name, body.joint, body.frame, body.placement, body.geometry))
    return geometry


def body_names(bodies: Sequence[Body]) -> list[str]:
    """The link's name, numbered from the second body of a link on."""
    seen: dict[str, int] = {}
    names = []
    for body in bodies:
        count = seen[body.link] = seen.get(body.link, 0) + 1
        names.append(body.link if count == 1 else f"{body.link}/{count}")
    return names


def convex_pieces(bodies: Sequence[Body], links: Sequence[str]) -> tuple[ConvexPiece, ...]:
    """The bodies that a joint moves, as pieces; ``links`` are the names that ``ConvexPiece.link`` counts."""
    return tuple(
        ConvexPiece(
            name=name,
            link=links.index(body.link),
            joint=body.joint - 1,
            rotation=np.array(body.placement.rotation),
            translation=np.array(body.placement.translation),
            vertices=body.shape.vertices,
            disc=body.shape.disc,
            radius=body.shape.radius,
            faces=body.faces,
        )
        for name, body in zip(body_names(bodies), bodies, strict=True)
        if body.joint > 0
    )
