"""Shapes, collision geometry and mesh files as triangles, for drawing only.

Sizes are true, with one exception: a body without thickness (the planar arm's links) is drawn as thin as can be seen.
"""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdfctl.errors import CdfctlError, MissingError
from cdfctl.report.view.colours import BODY, COLLISION, PLAIN, Rgb, rgb
from cdfctl.robots.convex import convex_hull
from cdfctl.robots.robot import Robot
from cdfctl.robots.visuals import MeshFile, Visual, read_visuals
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, IntArray, Shape, Sphere

INSTALL = "python -m pip install 'cdfctl[view]'"
THIN = 0.011
"""Least radius drawn, as a share of the robot's size."""


def need_packages() -> None:
    """Say that the viewer is not installed, before any work.

    Raises:
        MissingError: viser, or what reads mesh files, is not there.
    """
    try:
        import collada  # noqa: F401
        import trimesh  # noqa: F401
        import viser  # noqa: F401
    except ImportError as error:
        missing = error.name or "viser"
        raise MissingError(f"the 3-D view needs {missing}, which is not installed", hint=INSTALL) from None


@dataclass(frozen=True)
class Triangles:
    """A surface of one colour: ``vertices`` (k, 3) in m, ``faces`` (t, 3); ``smooth`` where it has no edges."""

    vertices: Array
    faces: IntArray
    colour: Rgb
    smooth: bool = False


@dataclass(frozen=True)
class Part:
    """A rigid piece of the robot: which joint moves it (-1: the world), its placement there, and what to draw.

    ``glb`` is a binary glTF with its own colours; without one, ``triangles``.
    """

    name: str
    joint: int
    rotation: Array
    translation: Array
    glb: bytes | None = None
    triangles: Triangles | None = None


def triangles_of(shape: Shape, colour: Rgb, least_radius: float = 0.0, detail: int = 3) -> Triangles:
    """The surface of one solid shape, in its own frame; a point cloud has none. A ball has 20·4^``detail`` faces."""
    import trimesh.creation as make

    match shape:
        case Sphere(radius):
            mesh, smooth = make.icosphere(subdivisions=detail, radius=max(radius, least_radius)), True
        case Box(size):
            mesh, smooth = make.box(size), False
        case Capsule(radius, length):
            mesh, smooth = make.capsule(height=length, radius=max(radius, least_radius), count=[24, 24]), True
            mesh.apply_translation(-mesh.bounds.mean(axis=0))
        case Cylinder(radius, length):
            mesh, smooth = make.cylinder(radius=max(radius, least_radius), height=length, sections=48), False
        case ConvexMesh():
            vertices, faces = convex_hull(shape.vertices)
            return Triangles(vertices, faces, colour)
        case _:
            raise TypeError(f"no surface for {type(shape).__name__}")
    return Triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64), colour, smooth)


def collision_parts(robot: Robot, size: float, colour: str = COLLISION) -> list[Part]:
    """The robot's collision geometry: what every distance is measured to. ``size`` is the robot's, m."""
    parts = []
    for i, item in enumerate(robot.geometry.geometryObjects):
        placement = item.placement
        surface = triangles_of(_shape_of(item.geometry), rgb(colour), THIN * size)
        name = f"{robot.geometry_links[i]}_{i}"
        parts.append(Part(name, item.parentJoint - 1, placement.rotation, placement.translation, triangles=surface))
    return parts


def visual_parts(robot: Robot, size: float) -> tuple[list[Part], list[str]]:
    """What the robot looks like, and a warning for each link that has to show its collision geometry instead.

    A robot whose URDF has no visuals shows its collision geometry without a warning.
    """
    visuals, problems = read_visuals(robot)
    by_link: defaultdict[str, list[Part]] = defaultdict(list)
    for i, visual in enumerate(visuals):
        if visual.link not in problems:
            try:
                by_link[visual.link].append(_part(visual, f"{visual.link}_{i}"))
            except CdfctlError as error:
                problems[visual.link] = error.message
    parts = [part for link, items in by_link.items() if link not in problems for part in items]
    collision = collision_parts(robot, size, BODY)
    if not parts and not problems:
        return collision, []
    warnings = [f"{reason}; drawing the collision geometry of '{link}'" for link, reason in problems.items()]
    return parts + _stand_ins(robot, collision, list(problems)), warnings


def _stand_ins(robot: Robot, collision: Sequence[Part], links: Sequence[str]) -> list[Part]:
    """The collision parts of ``links``; of a link that was merged with others, the merged hull on the same joint."""
    from cdfctl.robots.robot import frame_index

    joints = {robot.model.frames[frame_index(robot.model, link)].parentJoint - 1 for link in links}
    frames = {str(frame.name) for frame in robot.model.frames}
    return [
        part
        for part, link in zip(collision, robot.geometry_links, strict=True)
        if link in links or (link not in frames and part.joint in joints)
    ]


def _part(visual: Visual, name: str) -> Part:
    if not isinstance(visual.shape, MeshFile):
        colour = rgb(PLAIN) if visual.colour is None else _eight_bit(visual.colour)
        surface = triangles_of(visual.shape, colour)
        return Part(name, visual.joint, visual.rotation, visual.translation, triangles=surface)
    return Part(name, visual.joint, visual.rotation, visual.translation, glb=_glb(visual.shape, visual.colour))


def _glb(file: MeshFile, colour: tuple[float, float, float, float] | None) -> bytes:
    """A mesh file as binary glTF. Raises :class:`MissingError` or :class:`CdfctlError` where it cannot be read."""
    import trimesh

    try:
        scene = trimesh.load_scene(file.path)
        own_colours = file.path.suffix.lower() in (".dae", ".obj")
        for mesh in scene.geometry.values():
            if colour is not None and not own_colours:
                mesh.visual = trimesh.visual.ColorVisuals(mesh, face_colors=_eight_bit(colour))
        scene.apply_transform(np.diag([*(np.array(file.scale) * _unit(scene.units)), 1.0]))
        if not scene.geometry or not np.isfinite(scene.bounds).all():
            raise ValueError("no triangles in it")
        buffer = io.BytesIO(scene.export(file_type="glb"))
    except Exception as error:  # a parser of foreign files: whatever it stumbles over, the link has a fallback
        reason = " ".join(str(error).split()) or type(error).__name__
        raise CdfctlError(f"{file.path}: not a readable mesh: {reason}") from None
    return buffer.getvalue()


def _unit(units: str | None) -> float:
    """The length in m of a mesh file's unit; a COLLADA file states one, as ``meters`` or ``0.01 * meters``."""
    try:
        return float(units.split()[0]) if units is not None and "*" in units else 1.0
    except ValueError:
        return 1.0


def _eight_bit(colour: tuple[float, float, float, float]) -> Rgb:
    r, g, b = (round(255 * share) for share in colour[:3])
    return r, g, b


def _shape_of(geometry: Any) -> Shape:
    """coal's primitive or convex solid as a shape."""
    import coal

    if isinstance(geometry, coal.Sphere):
        return Sphere(geometry.radius)
    if isinstance(geometry, coal.Capsule):
        return Capsule(geometry.radius, 2.0 * geometry.halfLength)
    if isinstance(geometry, coal.Cylinder):
        return Cylinder(geometry.radius, 2.0 * geometry.halfLength)
    if isinstance(geometry, coal.Box):
        x, y, z = 2.0 * geometry.halfSide
        return Box((x, y, z))
    return ConvexMesh(np.array(geometry.points()))
