"""What code made a benchmark's numbers: versions of the packages that decide them, and a hash of our own sources."""

from __future__ import annotations

import hashlib
import sys
from functools import cache
from pathlib import Path

from cdfctl.simulation.run_folder import STACK, stack_versions

ROOMS = ("types.py", "scenario", "robots", "fields", "control", "simulation")
"""The parts of the package that decide a trial; reports and commands may change between two sessions of one store."""


@cache
def versions() -> dict[str, str]:
    """Version of Python and of each package, and ``source``: a hash of our own files."""
    stack = stack_versions()
    return {"python": "{}.{}".format(*sys.version_info), **{name: stack[name] for name in STACK}, "source": _source()}


def _source() -> str:
    package = Path(__file__).resolve().parent.parent
    found = hashlib.sha256()
    for room in ROOMS:
        place = package / room
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            found.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()[:12]
