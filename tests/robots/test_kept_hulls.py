"""Hulls in the cache: those of SciPy bit for bit, found again where a file is not whole, and never an error."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from cdfctl.robots.convex import convex_hull
from cdfctl.robots.robot import load_robot
from cdfctl.types import Array, IntArray

POINTS = np.random.default_rng(3).normal(size=(60, 3)).round(3)
OTHERS = np.random.default_rng(4).normal(size=(60, 3)).round(3)


@pytest.fixture
def hulls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of an empty cache."""
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "hulls"


def without_scipy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)


def same(one: tuple[Array, IntArray], other: tuple[Array, IntArray]) -> bool:
    return all(
        a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
        for a, b in zip(one, other, strict=True)
    )


def test_a_kept_hull_is_that_of_scipy(hulls: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = convex_hull(POINTS, keep=True)
    without_scipy(monkeypatch)
    kept = convex_hull(POINTS[::-1], keep=True)
    with pytest.raises(ImportError):
        convex_hull(POINTS)
    monkeypatch.undo()
    assert same(kept, first)
    assert same(kept, convex_hull(POINTS))
    vertices, faces = kept
    direct = ConvexHull(POINTS)
    assert {tuple(v) for v in vertices} == {tuple(v) for v in POINTS[direct.vertices]}
    own = {frozenset(map(tuple, vertices[face])) for face in faces}
    assert own == {frozenset(map(tuple, POINTS[triangle])) for triangle in direct.simplices}


def test_a_robot_from_the_cache_is_the_same_robot(hulls: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = load_robot("franka")
    assert list(hulls.iterdir())
    without_scipy(monkeypatch)
    kept = load_robot("franka")
    assert kept.hash == found.hash
    for one, other in zip(kept.pieces, found.pieces, strict=True):
        assert same((one.vertices, one.faces), (other.vertices, other.faces))


def checked(body: bytes) -> bytes:
    """A file of ``body`` with the checksum that a damaged one lacks."""
    return hashlib.sha256(body).digest() + body


def numbers(data: bytes, change: Callable[[IntArray], IntArray]) -> bytes:
    """The file with other numbers, and the checksum they should have."""
    held = np.frombuffer(data, "<i4", offset=64).astype(np.int64)
    return checked(data[32:64] + change(held).astype("<i4").tobytes())


def put(index: int, value: int) -> Callable[[IntArray], IntArray]:
    return lambda held: np.concatenate([held[:index], [value], held[index + 1 :]])


DAMAGED: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "a checksum of nothing": lambda _: checked(b""),
    "foreign": lambda _: b"solid part\n" * 100,
    "cut": lambda data: data[:-7],
    "longer": lambda data: data + bytes(4),
    "too large": lambda data: data + bytes(2**26),
    "no numbers": lambda data: numbers(data, lambda held: held[:0]),
    "no faces": lambda data: numbers(data, lambda held: held[: held[0] + 1]),
    "fewer corners than it says": lambda data: numbers(data, put(0, 10**6)),
    "a corner that is no point": lambda data: numbers(data, lambda held: put(int(held[0]), 60)(held)),
    "corners out of order": lambda data: numbers(data, put(2, 0)),
    "a face beyond the corners": lambda data: numbers(data, lambda held: put(len(held) - 1, int(held[0]))(held)),
    "a negative corner": lambda data: numbers(data, put(1, -1)),
}


@pytest.mark.parametrize("damage", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_is_made_again(damage: Callable[[bytes], bytes], hulls: Path) -> None:
    expected = convex_hull(POINTS, keep=True)
    (path,) = hulls.iterdir()
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert same(convex_hull(POINTS, keep=True), expected)
    assert path.read_bytes() == whole
    assert list(hulls.iterdir()) == [path]


def test_a_file_of_other_points_is_not_believed(hulls: Path) -> None:
    convex_hull(OTHERS, keep=True)
    (other,) = hulls.iterdir()
    expected = convex_hull(POINTS, keep=True)
    (path,) = set(hulls.iterdir()) - {other}
    path.write_bytes(other.read_bytes())
    assert same(convex_hull(POINTS, keep=True), expected)


@settings(max_examples=40)
@given(st.data())
def test_any_bit_may_turn(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    place = tmp_path_factory.getbasetemp() / "turned"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CDFCTL_CACHE", str(place))
        expected = convex_hull(POINTS, keep=True)
        (path,) = (place / "hulls").iterdir()
        damaged = bytearray(path.read_bytes())
        damaged[data.draw(st.integers(0, len(damaged) - 1))] ^= 1 << data.draw(st.integers(0, 7))
        path.write_bytes(damaged)
        assert same(convex_hull(POINTS, keep=True), expected)


def test_a_cache_that_cannot_be_written(hulls: Path) -> None:
    hulls.parent.write_text("a file in the place of the folder")
    assert same(convex_hull(POINTS, keep=True), convex_hull(POINTS))


def test_a_folder_in_the_place_of_a_file(hulls: Path) -> None:
    expected = convex_hull(POINTS, keep=True)
    (path,) = hulls.iterdir()
    path.unlink()
    path.mkdir()
    assert same(convex_hull(POINTS, keep=True), expected)
    assert list(hulls.iterdir()) == [path]
