"""Hulls of the bodies of robots, kept in the user cache.

They are the same at every start, and for them alone a start would import SciPy, which takes longer than all of the
geometry. A file is named after a hash of the points, and believed only if it says what was kept for these very points:
its bytes have the checksum they begin with. Whatever else is found there is no error; the hull is found again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cdfctl.cache import cache_dir, keep
from cdfctl.reading import read_bytes
from cdfctl.types import Array, IntArray

VERSION = 1
HASH = 32  # bytes of a sha256
NUMBER = np.dtype("<i4")


class Facets(NamedTuple):
    """A hull of ``points`` (p, 3).

    Attributes:
        corners: (k,) indices into ``points``, ascending.
        faces: (t, 3) indices into ``corners``, triangles counter-clockwise seen from outside.
    """

    corners: IntArray
    faces: IntArray


def kept_facets(points: Array, find: Callable[[Array], Facets]) -> Facets:
    """``find(points)``, from the user cache where it has been found before. Raises what ``find`` raises."""
    key = _key(points)
    path = cache_dir() / "hulls" / key.hex()
    facets = _read(path, key, len(points))
    if facets is None:
        facets = find(points)
        body = key + b"".join(array.astype(NUMBER).tobytes() for array in (np.array(len(facets.corners)), *facets))
        keep(path, hashlib.sha256(body).digest() + body)
    return facets


def _key(points: Array) -> bytes:
    """Of the points, bit for bit, and of what finds their hull: another qhull may split a flat side otherwise."""
    text = f"{VERSION} {_scipy()} {points.shape}"
    return hashlib.sha256(text.encode() + points.astype("<f8").tobytes()).digest()


@cache
def _scipy() -> str:
    try:
        return version("scipy")
    except PackageNotFoundError:
        return "unknown"


def _read(path: Path, key: bytes, count: int) -> Facets | None:
    """What the file keeps for ``count`` points, None where there is none or it is not whole or makes no sense."""
    try:
        data = read_bytes(path)
    except OSError:
        return None
    body = data[HASH:]
    if hashlib.sha256(body).digest() != data[:HASH] or body[:HASH] != key or len(body) % NUMBER.itemsize:
        return None
    k, numbers = 0, np.frombuffer(body, NUMBER, offset=HASH).astype(np.int64)
    if len(numbers):
        k, numbers = int(numbers[0]), numbers[1:]
    if not 4 <= k <= len(numbers) or (len(numbers) - k) % 3:
        return None
    corners, faces = numbers[:k], numbers[k:].reshape(-1, 3)
    fits = np.all(np.diff(corners) > 0) and corners[0] >= 0 and corners[-1] < count
    fits = fits and len(faces) >= 4 and faces.min() >= 0 and faces.max() < k
    return Facets(corners, faces) if fits else None
