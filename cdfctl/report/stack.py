"""The state of an installation: versions, solvers, cache, and what is missing with the command that mends it."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from cdfctl import __version__
from cdfctl.cache import cache_dir
from cdfctl.report.tables import facts

NEEDED: Mapping[str, str] = {
    "pin": "pinocchio",
    "coal": "coal",
    "example-robot-data": "",  # data only
    "numpy": "numpy",
    "numba": "numba",
    "scipy": "scipy",
    "qpsolvers": "qpsolvers",
    "daqp": "daqp",
    "clarabel": "clarabel",
    "typer": "typer",
    "rich": "rich",
    "pydantic": "pydantic",
    "pyyaml": "yaml",
    "platformdirs": "platformdirs",
    "safetensors": "safetensors",
    "joblib": "joblib",
}
"""Every package cdfctl needs, and the module whose import shows that it works."""

OPTIONAL: Mapping[str, str] = {
    "torch": "building contact tables",
    "matplotlib": "figures",
    "viser": "the 3-D view",
    "mujoco": "physics as a plant",
    "franky-control": "a Franka as a plant",
}
"""Packages of the extras, and what they add. Their import is slow, so only their presence is looked at."""


@dataclass(frozen=True)
class Missing:
    """Something that is not there: ``what``, the command or step that mends it, and whether runs need it."""

    what: str
    mend: str
    needed: bool


@dataclass(frozen=True)
class Installation:
    """What ``cdfctl doctor`` found.

    Attributes:
        packages: version of each package, None where it is not installed.
        solvers: the QP solvers that can be named in a scenario.
        cache: the cache folder; it may not exist yet.
        cache_writable: whether it can be written, or made.
        tables: contact tables in the cache, by file name.
        missing: what is missing.
    """

    packages: Mapping[str, str | None]
    solvers: tuple[str, ...]
    cache: Path
    cache_writable: bool
    tables: tuple[str, ...]
    missing: tuple[Missing, ...] = field(default=())

    @property
    def healthy(self) -> bool:
        """Nothing a run needs is missing."""
        return not any(item.needed for item in self.missing)

    def document(self) -> dict[str, Any]:
        """The same as one JSON object."""
        return {
            "version": __version__,
            "python": platform.python_version(),
            "platform": platform.platform(),
            "healthy": self.healthy,
            "packages": dict(self.packages),
            "torch": self.packages["torch"] is not None,
            "solvers": list(self.solvers),
            "tables": list(self.tables),
            "cache": {"path": str(self.cache), "writable": self.cache_writable},
            "missing": [{"what": m.what, "mend": m.mend, "needed": m.needed} for m in self.missing],
        }


def examine() -> Installation:
    """Look at the installation; imports every needed package, so it takes a second or two."""
    packages = {name: _version(name) for name in (*NEEDED, *OPTIONAL)}
    missing = []
    for name, module in NEEDED.items():
        trouble = _trouble(packages[name], module)
        if trouble is not None:
            missing.append(Missing(f"{name} {trouble}", _install(name), needed=True))
    for name, use in OPTIONAL.items():
        if packages[name] is None:
            missing.append(Missing(f"{name}, for {use}", _install(name), needed=False))
    cache = cache_dir()
    writable = _can_make(cache)
    if not writable:
        missing.append(
            Missing(f"a cache: {cache} cannot be written", "set CDFCTL_CACHE to a folder of yours", needed=False)
        )
    return Installation(packages, _solvers(), cache, writable, _tables(cache), tuple(missing))


def _version(distribution: str) -> str | None:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def _install(distribution: str) -> str:
    """The command that installs the version range cdfctl asks for."""
    wanted = distribution
    try:
        requirements = importlib.metadata.requires("cdfctl") or []
    except importlib.metadata.PackageNotFoundError:  # run from the source tree without being installed
        requirements = []
    for requirement in requirements:
        spec = requirement.partition(";")[0].strip()
        if spec.startswith(distribution) and not spec[len(distribution) :][:1].isalnum():
            wanted = spec
            break
    return f"python -m pip install '{wanted}'"


def _trouble(version: str | None, module: str) -> str | None:
    """Why a needed package is of no use, or None."""
    if version is None:
        return "is not installed"
    if module:
        try:
            importlib.import_module(module)
        except ImportError as error:
            return f"is installed, but its import fails ({error}): add --force-reinstall"
    return None


def _solvers() -> tuple[str, ...]:
    try:
        import qpsolvers
    except ImportError:
        return ()
    return tuple(sorted(qpsolvers.available_solvers))


def _tables(cache: Path) -> tuple[str, ...]:
    return tuple(sorted(path.name for path in cache.rglob("*.safetensors"))) if cache.is_dir() else ()


def _can_make(folder: Path) -> bool:
    """Whether ``folder`` can be written, or else made in the nearest folder above it; nothing is made here."""
    for place in (folder, *folder.absolute().parents):
        if place.exists():
            return place.is_dir() and os.access(place, os.W_OK | os.X_OK)
    return False


def installation_table(found: Installation) -> RenderableType:
    """The installation, for people."""
    rows: list[tuple[str, str | Text]] = [
        ("cdfctl", __version__),
        ("python", f"{platform.python_version()} on {platform.system()} {platform.machine()}"),
    ]
    rows += [(name, version or Text("not installed", style="yellow")) for name, version in found.packages.items()]
    rows += [
        ("QP solvers", ", ".join(found.solvers) or "none"),
        ("CDF tables", ", ".join(found.tables) or "none built yet"),
        ("cache", str(found.cache) + ("" if found.cache_writable else " (cannot be written)")),
    ]
    parts: list[RenderableType] = [facts(rows), Text()]
    if not found.missing:
        parts.append(Text("Nothing is missing.", style="green"))
    elif found.healthy:
        parts.append(Text("All that a run needs is here.", style="green"))
    for item in found.missing:
        word, style = ("missing", "red") if item.needed else ("optional", "yellow")
        parts += [Text.assemble((word, style), f"  {item.what}"), Text(f"  mend   {item.mend}")]
    return Group(*parts)
