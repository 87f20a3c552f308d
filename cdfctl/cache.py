"""The one place on disk where cdfctl keeps what it can make again: compiled kernels, hulls, contact tables."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from cdfctl.errors import InputError
from cdfctl.reading import drafted

KEPT = 4  # folders of one kind
DAY = 86400.0  # s


def cache_dir() -> Path:
    """The user's cache folder for cdfctl, or the one named by ``CDFCTL_CACHE``. It may not exist yet.

    Raises:
        InputError: ``CDFCTL_CACHE`` begins with the home of a user there is not.
    """
    override = os.environ.get("CDFCTL_CACHE")
    if override:
        try:
            return Path(override).expanduser()
        except RuntimeError:
            raise InputError(f"CDFCTL_CACHE={override}: there is no such home", "give the whole path") from None
    import platformdirs

    return Path(platformdirs.user_cache_dir("cdfctl"))


def writable_dir(path: Path) -> Path | None:
    """``path``, made if need be, or None where this user cannot write there."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return path if os.access(path, os.W_OK | os.X_OK) else None


def dir_of_this_version(path: Path, alike: str) -> Path | None:
    """``path``, marked as used now, as :func:`writable_dir`. Those of other versions go, but for the last few used.

    ``alike`` is the pattern of all their names. One used within a day may be in use still, and stays.
    """
    folder = writable_dir(path)
    if folder is not None:
        with suppress(OSError):
            os.utime(folder)
            used = sorted(((other.stat().st_mtime, other) for other in folder.parent.glob(alike)), reverse=True)
            for when, other in used[KEPT:]:
                if time.time() - when > DAY:
                    shutil.rmtree(other, ignore_errors=True)
    return folder


def keep(path: Path, data: bytes) -> None:
    """Write ``data`` to ``path`` in the cache, whole or not at all; where that fails, nothing is kept."""
    if writable_dir(path.parent) is None:
        return
    with suppress(OSError):
        handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")  # a name of its own for every writer
        os.close(handle)
        with drafted(path, Path(name)) as draft:
            draft.write_bytes(data)
