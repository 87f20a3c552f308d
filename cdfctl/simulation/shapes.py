"""A scenario's shapes as geometry; mesh and point files are read here."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from cdfctl.errors import InputError
from cdfctl.reading import read_bytes
from cdfctl.scenario.shapes import (
    BallShape,
    BoxShape,
    CapsuleShape,
    CloudShape,
    CylinderShape,
    MeshShape,
)
from cdfctl.scenario.shapes import Shape as ShapeConfig
from cdfctl.scenario.values import Uniform
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, PointCloud, Shape, Sphere

POINT_FILES = (".npy", ".csv", ".txt")

MAX_POINTS = 100_000
"""Most points a cloud may have: each one is a body to the field."""


def shape_of(config: ShapeConfig) -> Shape:
    """The geometry of ``config``, whose numbers are drawn and whose paths the loader has made absolute.

    Raises:
        InputError: a file cannot be read, or holds no shape.
    """
    match config:
        case BallShape():
            return Sphere(_drawn(config.radius))
        case BoxShape():
            x, y, z = (_drawn(side) for side in config.size)
            return Box((x, y, z))
        case CapsuleShape():
            return Capsule(_drawn(config.radius), _drawn(config.length))
        case CylinderShape():
            return Cylinder(_drawn(config.radius), _drawn(config.length))
        case MeshShape():
            if config.file is not None:
                return ConvexMesh(Path(config.file))
            return ConvexMesh(np.array(config.vertices, dtype=np.float64))
        case CloudShape():
            radius = _drawn(config.radius)
            if config.file is not None:
                return PointCloud(load_points(Path(config.file)), radius)
            return PointCloud(np.array(config.points, dtype=np.float64), radius)


def load_points(path: Path) -> Array:
    """The points (k, 3) of a file: a NumPy array (.npy), or three columns of numbers separated by commas (.csv) or
    blanks (.txt), ``#`` beginning a comment.

    Raises:
        InputError: not such a file, more than :data:`MAX_POINTS` points, or a number that is not finite.
    """
    suffix = path.suffix.lower()
    if suffix not in POINT_FILES:
        raise InputError(f"{path}: a file of points ends in {', '.join(POINT_FILES)}, found '{path.suffix}'")
    try:
        data = read_bytes(path)
        if suffix == ".npy":
            points = np.asarray(np.load(io.BytesIO(data), allow_pickle=False), dtype=np.float64)
        else:
            text = data.decode("utf-8")
            rows = [line.split("#", 1)[0].strip() for line in text.splitlines()]
            split = "," if suffix == ".csv" else None
            points = np.array([[float(x) for x in row.split(split)] for row in rows if row])
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, TypeError, EOFError, MemoryError, OverflowError, RecursionError) as error:
        raise InputError(f"{path}: not a file of points: {error}", hint="three numbers a line: x y z, in m") from None
    if points.ndim != 2 or points.shape[1] != 3 or not 1 <= points.shape[0] <= MAX_POINTS:
        raise InputError(f"{path}: expected 1 to {MAX_POINTS} points of three coordinates, found shape {points.shape}")
    if not np.isfinite(points).all():
        raise InputError(f"{path}: every coordinate must be finite")
    return points


def vector_of(values: Iterable[float | Uniform]) -> Array:
    """A scenario's numbers, drawn by now, as an array."""
    return np.array([_drawn(value) for value in values], dtype=np.float64)


def _drawn(value: float | Uniform) -> float:
    if isinstance(value, Uniform):
        raise TypeError(f"a number still to be drawn: {value}")  # our bug: draw() comes before assemble()
    return float(value)
