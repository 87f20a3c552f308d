"""Arrays in one ``.npz`` file whose bytes depend on nothing but the arrays: no pickle, no time stamps."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdfctl.reading import check_regular

PLENTY = 256 * 2**20  # bytes that any archive may unpack to
WRONG = (
    zipfile.BadZipFile, zlib.error, EOFError, KeyError, AttributeError, TypeError, MemoryError, OverflowError,
    NotImplementedError, RuntimeError,
)  # fmt: skip
"""What numpy and zipfile raise for archives that are damaged, beside ValueError."""

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the least a zip entry can say


def write_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write ``arrays`` to ``path``, in the order given; ``numpy.load`` reads it. Raises :class:`OSError`."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=_EPOCH)
            with archive.open(entry, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of ``path``.

    Raises:
        ValueError: it is not such a file, or it is damaged.
        OSError: it cannot be read.
    """
    try:
        check_regular(path)
        # Opened here: numpy leaves its own handle open where the archive is damaged.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            _check_size(archive.zip, path.stat().st_size)
            return {name: archive[name] for name in archive.files}
    except WRONG as error:
        raise ValueError(str(error) or type(error).__name__) from None


def _check_size(archive: zipfile.ZipFile, packed: int) -> None:
    """Refuse what unpacks to so much more than it is that it can only be meant to fill the memory."""
    if sum(entry.file_size for entry in archive.infolist()) > max(PLENTY, 20 * packed):
        raise ValueError("it unpacks to more than twenty times its size")
