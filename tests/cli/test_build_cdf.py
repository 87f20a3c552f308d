"""``cdfctl build-cdf``: exit statuses, where the table goes, what is refused, and a build that was killed."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .helpers import Cli

SMALL = ("--resolution", 6, "--starts", 12)


@pytest.fixture(autouse=True)
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """A short accuracy report."""
    import functools

    from cdfctl.fields.table import accuracy

    monkeypatch.setattr(accuracy, "measure_accuracy", functools.partial(accuracy.measure_accuracy, points=20))


def test_a_build_reports_and_a_second_one_has_nothing_to_do(cli: Cli, here: Path) -> None:
    first = cli("build-cdf", "planar", "--out", "t.safetensors", *SMALL)
    assert first.status == 0
    for words in ("planar", "6 x 6 x 1", "residual", "coverage", "table alone", "cold, table", "warm, table"):
        assert words in first.out
    assert max(map(len, first.out.splitlines())) <= 80
    content = (here / "t.safetensors").read_bytes()
    second = cli("build-cdf", "planar", "--out", "t.safetensors")
    assert second.status == 0
    assert "up to date" in second.err
    assert "6 x 6 x 1" in second.out
    assert cli("build-cdf", "planar", "--out", "t.safetensors", "--force", *SMALL, "--jobs", 1).status == 0
    assert (here / "t.safetensors").read_bytes() == content
    assert [path.name for path in here.iterdir()] == ["t.safetensors"]


def test_json_is_one_document(cli: Cli, here: Path) -> None:
    found = cli("build-cdf", "planar", "--out", "t.safetensors", "--json", *SMALL).document()
    assert found["built"] is True
    assert found["robot"] == "planar"
    assert found["points"] == 36
    assert found["parameters"] == {"resolution": 6, "starts": 12, "radius": 0.05, "seed": 0, "device": "numpy"}
    assert found["accuracy"]["residual"]["max"] <= 1e-4
    assert cli("build-cdf", "planar", "--out", "t.safetensors", "--json").document()["built"] is False


def test_the_default_place_is_the_cache_and_doctor_sees_it(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path / "cache"))
    assert cli("build-cdf", "planar", *SMALL, "--quiet").out == ""
    (table,) = (tmp_path / "cache" / "tables").iterdir()
    assert table.name.startswith("planar-")
    assert table.name in cli("doctor", "--json").document()["tables"]


def test_a_urdf_by_its_path(cli: Cli, here: Path) -> None:
    import cdfctl.robots

    urdf = Path(cdfctl.robots.__file__).parent / "data" / "planar.urdf"
    assert cli("build-cdf", urdf, "--out", "t.safetensors", *SMALL).status == 0


def test_other_parameters_need_force(cli: Cli, here: Path) -> None:
    cli("build-cdf", "planar", "--out", "t.safetensors", *SMALL)
    other = cli("build-cdf", "planar", "--out", "t.safetensors", "--starts", 13)
    assert other.status == 2
    assert "starts 12, not 13" in other.err
    assert "--force" in other.err


def test_a_table_of_another_robot_is_refused(cli: Cli, here: Path) -> None:
    cli("build-cdf", "planar", "--out", "t.safetensors", *SMALL)
    other = cli("build-cdf", "z1", "--out", "t.safetensors")
    assert other.status == 2
    assert "another robot" in other.err
    assert "cdfctl build-cdf z1 --out t.safetensors --force" in other.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nobody",), "unknown robot"),
        (("planar", "--resolution", 1), "resolution must be"),
        (("planar", "--radius", 0), "radius must be"),
        (("planar", "--out", "t.txt"), ".safetensors"),
        (("planar", "--out", "folder.safetensors"), "is a folder"),
        (("planar", "--device", "tpu"), "tpu"),
        (("planar", "--jobs", 0), "jobs"),
    ],
)
def test_bad_input_is_status_2_and_writes_nothing(
    cli: Cli, here: Path, arguments: tuple[object, ...], words: str
) -> None:
    (here / "folder.safetensors").mkdir()
    result = cli("build-cdf", *arguments)
    assert result.status == 2
    assert words in result.err
    assert [path.name for path in here.iterdir()] == ["folder.safetensors"]


def test_cuda_without_a_gpu_is_status_3(cli: Cli, here: Path) -> None:
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("this machine has a GPU")
    result = cli("build-cdf", "planar", "--out", "t.safetensors", "--device", "cuda", *SMALL)
    assert result.status == 3
    assert "GPU" in result.err
    assert list(here.iterdir()) == []


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_build_that_was_stopped_goes_on_and_ends_in_the_same_bytes(cli: Cli, here: Path, how: signal.Signals) -> None:
    options = ("--resolution", "60", "--starts", "48", "--jobs", "1")
    command = [sys.executable, "-m", "cdfctl", "build-cdf", "planar", "--out", "a.safetensors", *options]
    build = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    partial = here / "a.safetensors.partial"
    until = time.monotonic() + 200.0
    while len(list(partial.glob("*.chunk"))) < 3 and build.poll() is None and time.monotonic() < until:
        time.sleep(0.005)
    build.send_signal(how)
    _, err = build.communicate()
    done = len(list(partial.glob("*.chunk")))
    assert 3 <= done < 57
    if how == signal.SIGINT:
        assert build.returncode == 130
        assert "goes on from there" in err
    assert not (here / "a.safetensors").exists()
    assert cli("build-cdf", "planar", "--out", "a.safetensors", *options).status == 0
    assert cli("build-cdf", "planar", "--out", "b.safetensors", *options).status == 0
    assert (here / "a.safetensors").read_bytes() == (here / "b.safetensors").read_bytes()
