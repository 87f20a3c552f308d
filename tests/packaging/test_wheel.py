"""The package as others get it: built, installed outside the source tree, and tried from another folder.

The wheel is built from the sdist, so that both are complete. With hatchling at hand nothing is fetched; without, the
build fetches it.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist and the wheel."""
    pytest.importorskip("build")
    folder = tmp_path_factory.mktemp("dist")
    isolation = ["--no-isolation"] if importlib.util.find_spec("hatchling") else []
    subprocess.run([sys.executable, "-m", "build", *isolation, "--outdir", folder, ROOT], check=True)
    return folder


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel installed into a folder of its own; what it depends on comes from this environment."""
    folder = tmp_path_factory.mktemp("site")
    (wheel,) = built.glob("*.whl")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    subprocess.run([*pip, "--no-deps", "--no-index", "--target", folder, wheel], check=True)
    return folder


@pytest.fixture
def run(installed: Path, tmp_path: Path) -> Callable[..., str]:
    """Run a command of the installed package in an empty folder, and give its standard output."""

    def call(*words: str | Path) -> str:
        # Machine code is kept by the path of its source: elsewhere, compiling anew would take minutes.
        environment = {**os.environ, "PYTHONPATH": str(installed), "COLUMNS": "80", "NUMBA_DISABLE_JIT": "1"}
        result = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
        return result.stdout

    return call


def names_in(built: Path) -> tuple[set[str], set[str]]:
    """What the sdist and the wheel hold, the sdist without its top folder."""
    (sdist,), (wheel,) = built.glob("*.tar.gz"), built.glob("*.whl")
    with tarfile.open(sdist) as archive:
        source = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    with zipfile.ZipFile(wheel) as archive:
        return source, set(archive.namelist())


def test_sdist_and_wheel_hold_what_they_must(built: Path) -> None:
    source, wheel = names_in(built)
    here = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "cdfctl").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    scenarios = {path.name for path in (ROOT / "scenarios").glob("*.yaml")}
    assert here <= wheel
    assert {f"cdfctl/_scenarios/{name}" for name in scenarios} <= wheel
    assert "cdfctl/py.typed" in wheel
    assert {f"scenarios/{name}" for name in scenarios} | here <= source
    assert {"README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff", "pyproject.toml"} <= source
    assert any(name.startswith("tests/packaging/") for name in source)
    # nothing but the package and its metadata
    assert {name.partition("/")[0].partition("-")[0] for name in wheel} == {"cdfctl"}
    for name in source | wheel:
        assert not {"__pycache__", "runs", "_build", ".git"} & set(name.split("/")), name


def test_it_is_imported_from_where_it_was_installed(run: Callable[..., str], installed: Path) -> None:
    code = "import cdfctl, importlib.metadata as m; print(cdfctl.__file__); print(m.version('cdfctl'))"
    path, version = run(sys.executable, "-c", code).split()
    assert Path(path) == installed / "cdfctl" / "__init__.py"
    assert f'__version__ = "{version}"' in (ROOT / "cdfctl" / "__init__.py").read_text()


def test_the_command_finds_scenarios_and_robots(run: Callable[..., str], installed: Path) -> None:
    command = installed / "bin" / "cdfctl"
    scenarios = {path.stem for path in (ROOT / "scenarios").glob("*.yaml")}
    assert set(run(command, "scenarios", "--quiet").split()) == scenarios
    robots = {path.stem for path in (ROOT / "cdfctl" / "robots" / "data").glob("*.yaml")}
    assert set(run(command, "robots", "--quiet").split()) == robots
    assert json.loads(run(command, "check", "C1", "--json"))["valid"] is True


def test_the_library_filters_a_velocity(run: Callable[..., str]) -> None:
    code = (
        "import cdfctl\n"
        "robot = cdfctl.load_robot('franka')\n"
        "safe = cdfctl.SafetyFilter(robot, 'sdf-tvcbf-qp', self_collision=6)\n"
        "decision = safe.step(robot.home, cdfctl.Scene(), [0.1] * 7)\n"
        "print(decision.status, decision.u.round(6).tolist())"
    )
    assert run(sys.executable, "-W", "error", "-c", code) == f"optimal {[0.1] * 7}\n"
