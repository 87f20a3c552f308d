"""Tables on disk: what is read is what was written, and anything else is refused with the reason."""

from __future__ import annotations

import json
import logging
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import save_file

from cdfctl import load_robot, make_field
from cdfctl.errors import CdfctlError, InputError, MissingError
from cdfctl.fields.cdf import table_path
from cdfctl.fields.table.file import read_file, write_file
from cdfctl.fields.table.store import load_table, run_hint, table_status
from cdfctl.robots.robot import Robot
from cdfctl.types import Obstacle, Scene, Sphere

from .table_helpers import small_table, write_small

Change = Callable[[Any], Any]


@pytest.fixture(scope="module")
def planar() -> Robot:
    return load_robot("planar")


@pytest.fixture(scope="module")
def content(planar: Robot, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("table")
    path = folder / "t.safetensors"
    write_small(planar, path, small_table(planar, folder))
    return path.read_bytes()


@pytest.fixture
def path(content: bytes, tmp_path: Path) -> Path:
    path = tmp_path / "t.safetensors"
    path.write_bytes(content)
    return path


def test_the_library_reads_what_we_write(planar: Robot, path: Path) -> None:
    stored = load_table(path, planar)
    with safe_open(path, framework="np") as file:
        metadata = file.metadata()
        for name in file.keys():  # noqa: SIM118 (not a mapping)
            np.testing.assert_array_equal(file.get_tensor(name), getattr(stored.table, name))
    assert metadata["robot_hash"] == planar.hash
    assert metadata["format"] == "1"
    assert json.loads(metadata["parameters"])["resolution"] == 6
    assert json.loads(metadata["accuracy"]) == json.loads(json.dumps(stored.accuracy.document()))


def test_writing_it_again_gives_the_same_bytes(planar: Robot, content: bytes, tmp_path: Path) -> None:
    folder = tmp_path / "again"
    write_small(planar, folder / "t.safetensors", small_table(planar, folder))
    assert (folder / "t.safetensors").read_bytes() == content


def test_arrays_are_mapped_aligned_and_a_write_stays_private(planar: Robot, path: Path, content: bytes) -> None:
    table = load_table(path, planar).table
    for array in (table.origin, table.shape, table.first, table.piece, table.q):
        assert array.flags.aligned
        assert array.flags.writeable
    table.q[0] = 7.0
    assert path.read_bytes() == content


def test_every_flipped_bit_is_noticed(planar: Robot, path: Path, content: bytes) -> None:
    for place in np.random.default_rng(0).choice(len(content), 150, replace=False):
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(place % 8)
        path.write_bytes(damaged)
        with pytest.raises(CdfctlError):
            load_table(path, planar)


@pytest.mark.parametrize("length", [0, 5, 8, 500, -1])
def test_a_truncated_file_is_refused(planar: Robot, path: Path, content: bytes, length: int) -> None:
    path.write_bytes(content[:length])
    with pytest.raises(InputError, match=r"t\.safetensors") as caught:
        load_table(path, planar)
    assert "cdfctl build-cdf planar --out" in str(caught.value)


def test_files_of_others_are_refused(planar: Robot, path: Path) -> None:
    save_file({"q": np.zeros((3, 2), dtype=np.float32)}, path)
    with pytest.raises(InputError, match="not a table of cdfctl"):
        load_table(path, planar)
    path.write_text("resolution: 20\n")
    with pytest.raises(InputError, match="not a safetensors file"):
        load_table(path, planar)


@pytest.mark.parametrize(("found", "words"), [("2", "newer cdfctl"), ("0", "older format"), ("x", "format version")])
def test_other_formats_are_refused(planar: Robot, path: Path, found: str, words: str) -> None:
    arrays, metadata = read_file(path)
    write_file(path, arrays, {**metadata, "format": found})
    with pytest.raises(InputError, match=words) as caught:
        load_table(path, planar)
    assert "build-cdf planar" in str(caught.value)


@pytest.mark.parametrize("text", ["[" * 100_000, "[1]", "{}", '{"radius": "x"}', ""])
def test_metadata_that_make_no_sense_are_refused(planar: Robot, path: Path, text: str) -> None:
    arrays, metadata = read_file(path)
    for name in ("parameters", "accuracy"):
        write_file(path, arrays, {**metadata, name: text})
        if (name, text) != ("parameters", "{}"):  # the defaults
            with pytest.raises(InputError):
                load_table(path, planar)


def test_a_table_of_another_robot_is_refused_with_the_command(planar: Robot, path: Path) -> None:
    with pytest.raises(InputError, match="another robot") as caught:
        load_table(path, load_robot("z1"))
    assert "cdfctl build-cdf z1 --out" in str(caught.value)
    longer = load_robot("planar", position_limits={"joint1": (-1.0, 1.0)})
    with pytest.raises(InputError, match="another version of this robot"):
        load_table(path, longer)


def test_no_table_is_a_missing_thing(planar: Robot, tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="no table here") as caught:
        load_table(tmp_path / "none.safetensors", planar)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("piece", lambda piece: piece + np.int16(9)),
        ("piece", lambda piece: piece[:, None]),
        ("piece", lambda piece: piece[:0].reshape(0, 1)),
        ("first", lambda first: first[::-1].copy()),
        ("first", lambda first: first[None]),
        ("q", lambda q: q[1:]),
        ("origin", lambda origin: origin[:, None]),
        ("shape", lambda shape: shape[None]),
        ("spacing", lambda spacing: -spacing),
        ("spacing", lambda spacing: spacing[:0]),
        ("spacing", lambda spacing: np.repeat(spacing, 3)),
    ],
)
def test_arrays_that_do_not_fit_never_reach_compiled_code(planar: Robot, path: Path, name: str, change: Change) -> None:
    arrays, metadata = read_file(path)
    write_file(path, {**arrays, name: change(arrays[name])}, metadata)
    with pytest.raises(InputError, match=r"do not fit together|not a table of cdfctl"):
        load_table(path, planar)


def test_a_number_of_points_that_runs_over_is_refused(planar: Robot, path: Path) -> None:
    arrays, metadata = read_file(path)
    points = len(arrays["first"]) - 1
    sides = [(points * pow(odd, -1, 2**64) % 2**64, odd) for odd in range(3, 999, 2)]
    side, other = next(pair for pair in sides if 2**32 < pair[0] < 2**63)
    with np.errstate(over="ignore"):
        assert int(np.prod(np.array([other, side, 1]))) == points  # as 64 bits have it
    write_file(path, {**arrays, "shape": np.array([other, side, 1])}, metadata)
    with pytest.raises(InputError, match="do not fit together"):
        load_table(path, planar)


def test_a_shape_in_the_header_that_lies_is_refused(planar: Robot, path: Path, content: bytes) -> None:
    size = struct.unpack("<Q", content[:8])[0]
    header = json.loads(content[8 : 8 + size])
    header["q"]["shape"][0] += 1
    text = json.dumps(header, separators=(",", ":")).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + content[8 + size :])
    with pytest.raises(InputError):
        load_table(path, planar)


def test_a_field_takes_the_table_of_the_cache_or_says_why_not(
    planar: Robot, content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path))
    ball = Scene([Obstacle(Sphere(0.05), [1.0, 2.5, 0.0])])
    assert table_status(planar).state == "missing"
    assert str(run_hint(planar, "planar")).endswith("hint   cdfctl build-cdf planar")
    without = make_field("cdf", planar).query([0.3, 0.3], ball)
    target = table_path(planar)
    target.parent.mkdir(parents=True)
    target.write_bytes(content)
    assert table_status(planar).state == "ready"
    assert run_hint(planar, "planar") is None
    with caplog.at_level(logging.WARNING):
        with_table = make_field("cdf", planar).query([0.3, 0.3], ball)
        assert caplog.text == ""
        np.testing.assert_allclose(with_table.d, without.d, atol=1e-3)
        target.write_bytes(content[:-1])
        assert table_status(planar).state == "refused"
        make_field("cdf", planar)
    assert "contact table ignored" in caplog.text
    assert "cdfctl build-cdf planar --force" in caplog.text


def test_the_hint_of_a_run_is_a_command_that_can_be_typed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, planar: Robot
) -> None:
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "my arms" / "mine.urdf"
    path.parent.mkdir()
    path.write_text(planar.urdf.read_text())
    mine = load_robot(path)
    hint = str(run_hint(mine, str(path)))
    assert hint.endswith("  hint   cdfctl build-cdf 'my arms/mine.urdf'")
    assert max(map(len, hint.splitlines())) <= 80
    assert table_status(mine).command == "cdfctl build-cdf 'my arms/mine.urdf'"
    # A table of the file is of another robot than the one with the scenario's locks.
    assert "build it of a robot file" in str(run_hint(mine, str(path), changed=True))


def test_a_table_that_cannot_be_written_is_one_message(planar: Robot, path: Path, tmp_path: Path) -> None:
    stored = load_table(path, planar)
    with pytest.raises(InputError, match="cannot be written"):
        write_file(path / "below" / "t.safetensors", {"q": stored.table.q}, {})
    assert sorted(tmp_path.iterdir()) == [path]
