"""Worker processes: the same bytes however many there are, and what is left when one is killed."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cdfctl.benchmark import run as runs
from cdfctl.benchmark.plan import Plan, make_plan
from cdfctl.benchmark.run import DIED, Runner
from cdfctl.benchmark.store import open_store

from .helpers import TWO, bench, command


def trials(folder: Path) -> bytes:
    return (folder / "trials.jsonl").read_bytes()


@pytest.fixture(scope="module")
def one_job(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """What twelve trials come to in a single process."""
    from .helpers import SMALL

    folder = tmp_path_factory.mktemp("one")
    (folder / "small.yaml").write_text(SMALL)
    done = bench(folder, *TWO, "--trials", 6, "--jobs", 1, "--out", "store")
    assert done.returncode == 0, done.stderr
    return trials(folder / "store")


def test_two_jobs_write_the_same_bytes_and_run_replays_them(here: Path, one_job: bytes, capfd) -> None:
    done = bench(here, *TWO, "--trials", 6, "--jobs", 2, "--out", "store", "--json")
    assert done.returncode == 0, done.stderr
    assert trials(here / "store") == one_job
    assert json.loads(done.stdout)["trials"] == 6
    from cdfctl.cli.main import main

    for line in map(json.loads, one_job.splitlines()[6:8]):
        capfd.readouterr()
        which = ["--controller", line["controller"], "--seed", "0", "--trial", str(line["trial"])]
        main(["run", "./small.yaml", *which, "--json"])
        replayed = json.loads(capfd.readouterr().out)
        for column in ("outcome", "time_to_reach_s", "joint_path_rad", "path_length_m", "min_clearance_m", "steps"):
            assert replayed[column] == line[column], column


def children(pid: int) -> list[int]:
    """The worker processes below a process, but for helpers (resource trackers)."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                words = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            if parent == pid and b"popen_loky" in words:
                found.append(int(entry.name))
    return found


def started(here: Path, store: Path, *arguments: object, lines: int = 3) -> subprocess.Popen[str]:
    """A bench that has written some trials and is at work on more."""
    process = subprocess.Popen(
        command(here, *TWO, *arguments, "--out", store), cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
    )  # fmt: skip
    end = time.monotonic() + 120
    path = store / "timing.jsonl"
    while time.monotonic() < end and not (path.exists() and path.read_bytes().count(b"\n") >= lines):
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.005)
    return process


def finished(process: subprocess.Popen[str]) -> tuple[int, str]:
    _, err = process.communicate(timeout=200)
    return process.returncode, err


LONG = ("--trials", 80, "--jobs", 2, "--keep", "none", "--quiet")


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for the workers in /proc")
def test_killed_and_interrupted_it_goes_on_where_it_was(here: Path) -> None:
    """One store: a worker is killed, then the bench is interrupted, then killed, then it is let finish."""
    store = here / "store"
    process = started(here, store, *LONG)
    workers = children(process.pid)
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGKILL)
    done = len((store / "timing.jsonl").read_bytes().splitlines())
    end = time.monotonic() + 120
    while process.poll() is None and (store / "timing.jsonl").read_bytes().count(b"\n") < done + 10:
        assert time.monotonic() < end
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    status, err = finished(process)
    assert status == 130, err
    assert "the same command goes on" in err
    assert "Traceback" not in err

    kept = trials(store)
    process = started(here, store, *LONG, lines=len((store / "timing.jsonl").read_bytes().splitlines()) + 5)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert trials(store).startswith(kept)
    kept = trials(store)

    last = bench(here, *TWO, *LONG, "--out", store)
    assert (last.returncode, last.stderr) == (0, "")
    assert trials(store).startswith(kept)
    plan = make_plan(["./small.yaml"], TWO[1::2], [], [()], trials=80, seed=0)
    with open_store(here / "fresh", plan) as fresh:
        for answer in Runner(plan, 1, "none").run(range(len(plan))):
            fresh.add(answer)
    assert trials(store) == trials(here / "fresh")


def test_a_trial_that_kills_its_worker_twice_is_an_error(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    normal = runs._placed

    def deadly(place: int, *arguments: object) -> object:  # local, so that workers get it by value
        if place == 3:
            os._exit(1)
        return normal(place, *arguments)

    monkeypatch.setattr(runs, "_placed", deadly)
    found = {answer.result.key: answer.result for answer in Runner(plan, 2, "none").run(range(len(plan)))}
    assert len(found) == len(plan)
    cell, trial = plan[3]
    assert found[cell.key(trial)].reason == DIED
    assert [r.verdict.outcome == "error" for r in found.values()].count(True) == 1


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    """A Dask scheduler and two workers on loopback."""
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    dask = [sys.executable, "-m", "dask"]
    port = address.rpartition(":")[2]
    quiet = {"cwd": tmp_path, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    worker = [*dask, "worker", address, "--nthreads", "1", "--nworkers", "1", "--no-nanny", *local]
    processes = [subprocess.Popen([*dask, "scheduler", "--port", port, *local], **quiet)]
    processes += [subprocess.Popen(worker, **quiet) for _ in range(2)]
    try:
        yield address
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def test_a_dask_cluster_writes_the_same_bytes(here: Path, scheduler: str, one_job: bytes) -> None:
    done = bench(here, *TWO, "--trials", 6, "--dask", scheduler, "--out", "store", "--quiet")
    assert done.returncode == 0, done.stderr
    assert trials(here / "store") == one_job


def test_nobody_listens_there(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    done = bench(here, "--trials", 1, "--dask", f"tcp://127.0.0.1:{port}", "--out", "store")
    assert done.returncode == 3
    assert f"no Dask scheduler answers at tcp://127.0.0.1:{port}" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (here / "store").exists()
