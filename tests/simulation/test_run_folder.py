"""The run folder: what is written is what is read, bytes depend on content only, and nothing foreign is touched."""

from __future__ import annotations

import json
import os
import time
import zipfile
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from cdfctl.errors import InputError
from cdfctl.scenario.draws import draw
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.resolve import resolve
from cdfctl.simulation.npz import read_npz, write_npz
from cdfctl.simulation.result import RunResult
from cdfctl.simulation.run_folder import check_target, default_folder, read_run, write_run
from cdfctl.types import Contact, Trajectory, Verdict

N, DOF, M = 5, 2, 1

KEYS = [
    "scenario",
    "controller",
    "robot",
    "seed",
    "outcome",
    "success",
    "time_to_reach_s",
    "steps",
    "path_length_m",
    "joint_path_rad",
    "min_clearance_m",
    "collision_time_s",
    "infeasible_steps",
    "step_ms",
    "run_dir",
    "plant",
    "min_self_clearance_m",
    "self_contact_time_s",
]


def a_trajectory(steps: int = N) -> Trajectory:
    rng = np.random.default_rng(1)
    return Trajectory(
        t=0.1 * np.arange(steps + 1),
        q=rng.normal(size=(steps + 1, DOF)),
        u=rng.normal(size=(steps, DOF)),
        obstacle_pose=rng.normal(size=(steps + 1, M, 7)),
        obstacle_twist=rng.normal(size=(steps + 1, M, 6)),
        h=np.full((steps, M), np.inf),
        V=np.full(steps, np.nan),
        slack=np.full(steps, np.nan),
        infeasible=np.arange(steps) % 2 == 1,
        step_time=1e-4 * (1.0 + np.arange(steps)),
    )


def a_result(**changes: object) -> RunResult:
    verdict = Verdict("collision", "reached", None, 1.5, 2.5, -0.01, 0.3, Contact(0.25, "link2", "disc-1"))
    scenario = resolve(draw(load_scenario("S1").scenario, 3, 7))
    result = RunResult(scenario, "planar", 7, a_trajectory(), verdict, "reached")
    return replace(result, **changes)  # type: ignore[arg-type]  # whatever the test changes


def test_round_trip(tmp_path: Path) -> None:
    folder, result = tmp_path / "a" / "run", a_result()
    document = write_run(folder, result)
    run = read_run(folder)
    assert run.scenario == result.scenario
    assert {key: run.document[key] for key in KEYS} == document
    for f in fields(Trajectory):
        before, after = getattr(result.trajectory, f.name), getattr(run.trajectory, f.name)
        if before is None:
            assert after is None
        else:
            assert np.array_equal(before, after, equal_nan=before.dtype != np.bool_)
            assert before.dtype == after.dtype
    assert run.document["trial"] == 7
    assert run.document["stack"]["numpy"] == np.__version__
    assert sorted(p.name for p in folder.iterdir()) == ["result.json", "scenario.yaml", "trajectory.npz"]
    assert [p.name for p in folder.parent.iterdir()] == ["run"]


def test_document_keys_and_values() -> None:
    document = a_result().document("runs/x")
    assert list(document) == KEYS
    assert document["seed"] == 3
    assert document["outcome"] == "collision"
    assert document["success"] is False
    assert document["time_to_reach_s"] is None
    assert document["collision_time_s"] == 0.25
    assert document["steps"] == N
    assert document["infeasible_steps"] == 2
    assert document["step_ms"] == pytest.approx({"p50": 0.3, "p99": 0.496, "max": 0.5})


def test_infeasible_step_that_ended_the_run_is_counted() -> None:
    assert a_result(stop="infeasible").infeasible_steps == 3


def test_non_finite_numbers_are_null(tmp_path: Path) -> None:
    free = Verdict("timeout", "timeout", None, 0.0, 0.0, np.inf, None, None)
    document = write_run(tmp_path / "run", a_result(verdict=free, trajectory=a_trajectory(0)))
    assert document["min_clearance_m"] is None
    assert document["step_ms"] == {"p50": None, "p99": None, "max": None}
    text = (tmp_path / "run" / "result.json").read_text()
    assert "NaN" not in text
    assert "Infinity" not in text
    assert read_run(tmp_path / "run").trajectory.u.shape == (0, DOF)


def test_bytes_do_not_depend_on_when(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_run(tmp_path / "a", a_result())
    now = time.time
    monkeypatch.setattr(time, "time", lambda: now() + 1e8)
    write_run(tmp_path / "b", a_result())
    for name in ("trajectory.npz", "scenario.yaml"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_rerun_replaces_its_own_folder_and_keeps_what_others_put_there(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    write_run(folder, a_result())
    (folder / "notes.txt").write_text("mine")
    write_run(folder, a_result(trial=8))
    assert read_run(folder).document["trial"] == 8
    assert (folder / "notes.txt").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_empty_folder_is_used(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    write_run(tmp_path / "run", a_result())
    assert read_run(tmp_path / "run").document["trial"] == 7


@pytest.mark.parametrize("name", ["notes.txt", "result.json", "scenario.yaml"])
def test_foreign_folder_is_refused_and_untouched(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text('{"format": "other"}')
    for attempt in (lambda: check_target(tmp_path), lambda: write_run(tmp_path, a_result())):
        with pytest.raises(InputError, match="not a run folder"):
            attempt()
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_file_in_the_way_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("x")
    with pytest.raises(InputError, match="is a file"):
        check_target(tmp_path / "run")
    with pytest.raises(InputError, match="cannot be written"):
        check_target(tmp_path / "run" / "below")


def test_unwritable_place_is_an_input_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o555)
    try:
        if os.geteuid() != 0:  # root may write anywhere
            with pytest.raises(InputError, match="cannot be written"):
                check_target(tmp_path / "run")
    finally:
        tmp_path.chmod(0o755)

    def full(*args: object, **kwargs: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cdfctl.simulation.run_folder.write_npz", full)
    with pytest.raises(InputError, match="No space left"):
        write_run(tmp_path / "run", a_result())
    assert list(tmp_path.iterdir()) == []


def test_failed_rerun_leaves_the_old_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_run(tmp_path / "run", a_result())

    def full(*args: object, **kwargs: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cdfctl.simulation.run_folder.write_npz", full)
    with pytest.raises(InputError):
        write_run(tmp_path / "run", a_result(trial=8))
    assert read_run(tmp_path / "run").document["trial"] == 7


def damage(folder: Path, how: str) -> None:
    record = json.loads((folder / "result.json").read_text())
    arrays = read_npz(folder / "trajectory.npz")
    match how:
        case "no json":
            (folder / "result.json").write_text("{")
        case "foreign":
            (folder / "result.json").write_text("[]")
        case "newer":
            (folder / "result.json").write_text(json.dumps({**record, "version": 99}))
        case "no version":
            del record["version"]
            (folder / "result.json").write_text(json.dumps(record))
        case "torn":
            raw = (folder / "trajectory.npz").read_bytes()
            (folder / "trajectory.npz").write_bytes(raw[: len(raw) // 2])
        case "not npz":
            (folder / "trajectory.npz").write_text("hello")
        case "bit":
            raw = bytearray((folder / "trajectory.npz").read_bytes())
            raw[300] ^= 255
            (folder / "trajectory.npz").write_bytes(raw)
        case "pickled":
            np.savez(folder / "trajectory.npz", t=np.array([{}], dtype=object))
        case "array gone":
            del arrays["u"]
            write_npz(folder / "trajectory.npz", arrays)
        case "array short":
            write_npz(folder / "trajectory.npz", {**arrays, "q": arrays["q"][:-1]})
        case "array flat":
            write_npz(folder / "trajectory.npz", {**arrays, "u": arrays["u"].ravel()})
        case name:
            (folder / name.removeprefix("no ")).unlink()


@pytest.mark.parametrize(
    "how",
    [
        "no json",
        "foreign",
        "newer",
        "no version",
        "torn",
        "not npz",
        "bit",
        "pickled",
        "array gone",
        "array short",
        "array flat",
        "no result.json",
        "no trajectory.npz",
        "no scenario.yaml",
    ],
)
def test_damaged_foreign_or_newer_folder_is_one_clear_line(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "run"
    write_run(folder, a_result())
    damage(folder, how)
    with pytest.raises(InputError) as caught:
        read_run(folder)
    assert "\n" not in caught.value.message
    assert str(folder) in caught.value.message or "run/" in caught.value.message


def test_default_name() -> None:
    result = a_result()
    assert default_folder(result.scenario, 7) == Path("runs/S1-dual-tvcbf-qp-3-7")


@pytest.mark.parametrize(
    ("name", "value"),
    [("min_clearance_m", "0.1"), ("collision_time_s", 10**400), ("trial", [1]), ("outcome", "x" * 9), ("robot", 1)],
)
def test_a_document_of_wrong_types_is_refused(tmp_path: Path, name: str, value: object) -> None:
    """Figures and pages print these."""
    write_run(tmp_path / "run", a_result())
    path = tmp_path / "run" / "result.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {name: value}))
    with pytest.raises(InputError, match=name):
        read_run(tmp_path / "run")


def npy(shape: str, data: bytes) -> bytes:
    """A ``.npy`` file whose header says ``shape``, whatever ``data`` there are."""
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}"
    text += " " * (-(len(text) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\0" + len(text).to_bytes(2, "little") + text.encode() + data


@pytest.mark.parametrize("shape", ["(1000000000000000,)", "(10000000000000000000000,)", "(-1,)"])
def test_an_array_that_says_it_is_larger_than_memory(tmp_path: Path, shape: str) -> None:
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("t.npy", npy(shape, bytes(80)))
    with pytest.raises(ValueError, match=r"."):
        read_npz(tmp_path / "a.npz")


def test_an_archive_that_unpacks_to_gigabytes(tmp_path: Path) -> None:
    count = 40_000_000
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("t.npy", npy(f"({count},)", bytes(8 * count)))
    assert (tmp_path / "a.npz").stat().st_size < 2e6
    with pytest.raises(ValueError, match="twenty times"):
        read_npz(tmp_path / "a.npz")
