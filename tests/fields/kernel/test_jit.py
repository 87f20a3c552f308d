"""How the kernel is compiled: where its cache is, and what happens without one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ONE_FUNCTION = """
import numba
before = numba.config.CACHE_DIR
from cdfctl.fields.kernel.vec import dot
assert numba.config.CACHE_DIR == before
print(dot((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)))
"""


def run(script: str, **environment: str) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, **environment}
    return subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=False)


def test_the_cache_is_under_the_cache_place_of_cdfctl(tmp_path: Path):
    answer = run(ONE_FUNCTION, CDFCTL_CACHE=str(tmp_path))
    assert answer.stdout.strip() == "32.0", answer.stderr
    assert list(tmp_path.glob("kernels/*/**/vec.dot-*.nbi"))


def test_a_cache_place_that_cannot_be_made_is_no_hindrance(tmp_path: Path):
    occupied = tmp_path / "a-file"
    occupied.write_text("")
    answer = run(ONE_FUNCTION, CDFCTL_CACHE=str(occupied))
    assert answer.stdout.strip() == "32.0", answer.stderr


def test_a_cache_that_cannot_be_read_is_made_anew(tmp_path: Path):
    for suffix, size in ((".nbi", 0), (".nbc", 40), ("", 0)):
        answer = run(ONE_FUNCTION, CDFCTL_CACHE=str(tmp_path))
        assert answer.stdout.strip() == "32.0", answer.stderr
        files = list(tmp_path.glob("kernels/*/**/*.nb*"))
        assert files
        assert all(path.stat().st_size > 40 for path in files)  # from the second time on: made anew
        for path in files:
            if path.suffix == suffix:
                path.write_bytes(path.read_bytes()[:size])


def test_a_cache_without_room_is_no_hindrance(tmp_path: Path):
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))\n"
    answer = run(limit + ONE_FUNCTION, CDFCTL_CACHE=str(tmp_path))
    assert answer.stdout.strip() == "32.0", answer.stderr
    assert not [path for path in tmp_path.rglob("*.nbc") if path.stat().st_size]


def test_the_kernel_runs_as_plain_python_for_a_debugger():
    script = (
        "from cdfctl.fields.sdf import SDF\n"
        "from cdfctl.robots.robot import load_robot\n"
        "from cdfctl.types import Box, Obstacle, Scene\n"
        "scene = Scene([Obstacle(Box((0.2, 0.2, 0.2)), [0.5, 0.0, 0.5])])\n"
        "print(SDF(load_robot('planar')).query([0.1, 0.2], scene).d[0])"
    )
    plain, compiled = run(script, NUMBA_DISABLE_JIT="1"), run(script)
    assert plain.returncode == 0, plain.stderr
    assert float(plain.stdout) == float(compiled.stdout)
