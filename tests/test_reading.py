"""Files read with care: what is no regular file, or too large, or too deep, is an error and not a hang."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from cdfctl.errors import InputError
from cdfctl.reading import parse_json, read_bytes, read_json, read_text
from cdfctl.robots.robot_file import read_robot_file
from cdfctl.robots.xml_file import read_robot_xml
from cdfctl.simulation.shapes import load_points


def test_what_is_there_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b'{"a": [1, "\xc3\xa9"]}')
    (tmp_path / "link").symlink_to(path)
    assert read_bytes(tmp_path / "link") == path.read_bytes()
    assert read_json(path) == {"a": [1, "é"]}
    with pytest.raises(OSError, match="Larger"):
        read_bytes(path, 5)
    path.write_bytes(b"\xff")
    with pytest.raises(ValueError, match="utf-8"):
        read_text(path)
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "none")


def test_a_document_too_deep_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="deeply"):
        parse_json("[" * 100_000)


@pytest.mark.timeout(60)
def test_devices_and_pipes_are_refused(tmp_path: Path) -> None:
    """/dev/zero has no end, and a pipe nobody writes to has no beginning."""
    os.mkfifo(tmp_path / "pipe")
    readers = {
        ".npy": load_points,
        ".csv": load_points,
        ".urdf": lambda path: read_robot_xml(path, "URDF", "a"),
        ".yaml": read_robot_file,
    }
    for source in ("/dev/zero", "pipe"):
        for suffix, reader in readers.items():
            path = tmp_path / f"{source[-4:]}{suffix}"
            path.symlink_to(source)
            with pytest.raises(InputError, match="Not a regular file"):
                reader(path)


def test_points_are_never_unpickled(tmp_path: Path) -> None:
    class Evil:
        def __reduce__(self) -> tuple[object, ...]:
            return Path.touch, (tmp_path / "pwned",)

    np.save(tmp_path / "a.npy", np.array([Evil()], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="not a file of points"):
        load_points(tmp_path / "a.npy")
    assert not (tmp_path / "pwned").exists()
