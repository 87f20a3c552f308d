"""Vertices of mesh files (STL, OBJ, DAE, PLY), read by coal's loader."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdfctl.errors import InputError
from cdfctl.types import Array

MESH_SUFFIXES = (".stl", ".obj", ".dae", ".ply")


def load_vertices(path: Path) -> Array:
    """The vertices (k, 3) of a mesh file, in the file's own unit and frame.

    Raises:
        InputError: no such file, a directory, a suffix that is not known, or no mesh inside.
    """
    check_mesh_file(path)
    import coal

    try:
        mesh = coal.MeshLoader().load(str(path))
    except (RuntimeError, ValueError, IndexError) as error:
        raise InputError(f"{path}: not a readable mesh: {reason_of(error)}") from None
    vertices = np.array(mesh.vertices(), dtype=np.float64).reshape(-1, 3)
    if vertices.shape[0] == 0:
        raise InputError(f"{path}: the mesh has no vertices")
    if not np.all(np.isfinite(vertices)):
        raise InputError(f"{path}: the mesh has vertices that are not finite")
    return vertices


def reason_of(error: Exception) -> str:
    """What coal or Pinocchio say, in one line, without the place in their source."""
    text = " ".join(str(error).split())
    return text.split("message: ")[-1].split(" Hint: ")[0]


def check_mesh_file(path: Path) -> None:
    """Refuse a path that cannot be a mesh file, in one line."""
    if path.is_dir():
        raise InputError(f"{path}: is a directory, not a mesh file")
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file")
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise InputError(f"{path}: unknown mesh format", hint="allowed: " + ", ".join(MESH_SUFFIXES))
