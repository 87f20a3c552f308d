"""The one place on disk where cdfctl keeps what it can make again: compiled kernels, contact tables."""

from __future__ import annotations

import os
from pathlib import Path

from cdfctl.errors import InputError


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
