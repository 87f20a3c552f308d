"""The cache folder: what is written is whole, and what old versions left goes."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from cdfctl.cache import dir_of_this_version, keep

HOUR = 3600.0


def used(folder: Path, hours: float) -> Path:
    """A folder with a file in it, last used so long ago."""
    folder.mkdir()
    (folder / "code").write_bytes(b"x")
    then = time.time() - hours * HOUR
    os.utime(folder, (then, then))
    return folder


def test_old_versions_go_but_for_the_last_few(tmp_path: Path) -> None:
    ages = {"v-a": 3, "v-b": 30, "v-c": 40, "v-d": 50, "v-e": 60, "v-f": 700, "other": 9000}
    for name, hours in ages.items():
        used(tmp_path / name, hours)
    assert dir_of_this_version(tmp_path / "v-new", "v-*") == tmp_path / "v-new"
    assert {path.name for path in tmp_path.iterdir()} == {"v-new", "v-a", "v-b", "v-c", "other"}


def test_what_was_used_within_a_day_stays(tmp_path: Path) -> None:
    names = {used(tmp_path / f"v-{hours}", hours).name for hours in range(2, 12)}
    dir_of_this_version(tmp_path / "v-2", "v-*")
    assert {path.name for path in tmp_path.iterdir()} == names


def test_a_version_that_is_used_again_is_the_newest(tmp_path: Path) -> None:
    for day in range(2, 8):
        used(tmp_path / f"v-{day}", 24.0 * day)
    dir_of_this_version(tmp_path / "v-7", "v-*")
    assert {path.name for path in tmp_path.iterdir()} == {"v-7", "v-2", "v-3", "v-4"}


def test_nothing_is_kept_where_nothing_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert dir_of_this_version(tmp_path / "file" / "v-1", "v-*") is None
    keep(tmp_path / "file" / "hull", b"data")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("there", [None, b"something longer than what comes"])
def test_a_file_is_written_whole_and_alone(tmp_path: Path, there: bytes | None) -> None:
    path = tmp_path / "new" / "hull"
    if there is not None:
        keep(path, there)
    keep(path, b"data")
    assert path.read_bytes() == b"data"
    assert list(path.parent.iterdir()) == [path]
