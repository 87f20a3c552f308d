"""Files that others may have written, read and replaced with care.

A pipe or a device in the place of a file would hang a command or fill the memory: only regular files are read, and no
more of them than the reader has use for. A link in the place of a draft would lead what is written to another file.
"""

from __future__ import annotations

import errno
import json
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

MIB = 2**20
MOST = 64 * MIB
"""What a file may have where nothing else is said."""


def check_regular(path: Path) -> None:
    """Raise :class:`OSError` where ``path`` is no regular file; symbolic links are followed."""
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "Is a directory", str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "Not a regular file", str(path))


def read_bytes(path: Path, most: int = MOST) -> bytes:
    """The content of the regular file ``path``. Raises :class:`OSError`, also where it has more than ``most`` bytes."""
    check_regular(path)
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"Larger than {most // MIB} MiB", str(path))
    return data


def read_text(path: Path, most: int = MOST) -> str:
    """The same as text in UTF-8. Raises :class:`ValueError` as well, where it is none."""
    return read_bytes(path, most).decode("utf-8")


def read_json(path: Path, most: int = MOST) -> Any:
    """The JSON document in ``path``. Raises :class:`OSError` and :class:`ValueError`."""
    return parse_json(read_text(path, most))


def parse_json(text: str) -> Any:
    """``text`` as JSON. Raises :class:`ValueError`, also where it is nested deeper than Python can follow."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def make_way(draft: Path) -> Path:
    """``draft``, a name about to be written to, with whatever stood there removed. Raises :class:`OSError`."""
    if draft.is_symlink() or draft.exists():
        draft.unlink()
    return draft


@contextmanager
def drafted(path: Path, draft: Path) -> Iterator[Path]:
    """Write ``path`` whole or not at all: to ``draft`` beside it first, which takes its name in the end.

    Whatever stood in the place of the draft is removed before, and a draft that did not come to its end after. Raises
    :class:`OSError`.
    """
    try:
        yield make_way(draft)
        draft.replace(path)
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def refuse_link(path: Path) -> None:
    """Raise :class:`OSError` where ``path`` is a symbolic link: for files that are ours to change in place."""
    if path.is_symlink():
        raise OSError(errno.ELOOP, "Is a symbolic link", str(path))
