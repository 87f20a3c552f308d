"""A build in progress: a folder beside the table with one file for each chunk that is done.

A chunk is written whole or not at all, and holds what its points give whatever was done before, so a build that was
interrupted goes on with the chunks that are missing and ends in the same bytes. A folder of other parameters, or of
another robot, is emptied first.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from numpy.typing import NDArray

from cdfctl.errors import CdfctlError, InputError
from cdfctl.fields.table.file import read_file, write_file
from cdfctl.reading import make_way, read_bytes


class PartialBuild:
    """The folder of a build, locked for this process while it is entered."""

    def __init__(self, target: Path, key: Mapping[str, Any]) -> None:
        """``target``: the table; ``key``: all that its content depends on."""
        self.folder = target.with_name(f"{target.name}.partial")
        self._key = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()
        self._lock = -1

    def __enter__(self) -> PartialBuild:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(self.folder / "lock", os.O_CREAT | os.O_RDWR, 0o644)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written: {error.strerror}") from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise InputError(
                f"{self.folder}: another build of this table is running", hint="wait for it, or use another --out"
            ) from None
        try:
            self._tidy()
        except OSError as error:
            os.close(self._lock)
            raise InputError(
                f"{error.filename or self.folder}: {error.strerror}", hint=f"remove {self.folder}, or use another --out"
            ) from None
        return self

    def _tidy(self) -> None:
        key_file = self.folder / "key"
        if not key_file.exists() or read_bytes(key_file) != self._key.encode():
            for path in self.folder.glob("*.chunk"):
                path.unlink()
            make_way(key_file).write_text(self._key)
        for path in self.folder.glob(".*.tmp"):  # of a build that was killed
            path.unlink()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._lock)

    def read(self, index: int) -> dict[str, NDArray[Any]] | None:
        """The arrays of a chunk that is done; None for one that is not, or was damaged."""
        try:
            return read_file(self._path(index))[0]
        except CdfctlError:
            return None

    def write(self, index: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep the arrays of a chunk."""
        write_file(self._path(index), arrays, {})

    def remove(self) -> None:
        """The table is written: the chunks are no longer needed."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _path(self, index: int) -> Path:
        return self.folder / f"{index:05d}.chunk"
