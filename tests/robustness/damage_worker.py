"""Give every command that reads files of cdfctl damaged ones, and tell, as JSON lines, what became of each.

``python damage_worker.py SEED COUNT``, in an empty folder with CDFCTL_CACHE set to a folder of the test's own.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import random
import resource
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from damage import KINDS, forge, spoil  # beside this file, as a script's own folder is where it looks first
from watched import begin, one

from cdfctl.cli.main import main
from scenarios import DUAL

MEMORY = 6 * 2**30
SDF = "sdf-tvcbf-qp"
BENCH = ["bench", "--scenario", "./small.yaml", "--controller", SDF, "--controller", "sdf-cbf-qp"]
BENCH += ["--trials", "3", "--jobs", "1", "--keep", "all", "--quiet"]
RESUME = [*BENCH, "--out", "bad/store"]
BUILD = ["build-cdf", "planar", "--resolution", "8", "--starts", "6", "--jobs", "1", "--quiet"]
RUN = ["run", "./small.yaml", "--out", "bad/out", "--quiet"]
PLOT = ["--dpi", "50", "--width", "8", "--out", "bad/figures", "--quiet"]
SELF = ["--controller", SDF, "--set", "controller.self_collision=true", "--set", "robot.name=franka"]


def follow(words: list[str]) -> int:
    """What ``cdfctl view --live`` reads of a run that goes on, without the browser."""
    from cdfctl.cli.failures import report_failure
    from cdfctl.errors import CdfctlError
    from cdfctl.report.view.live import Following

    try:
        source = Following(Path(words[1]))
        for _ in range(2):
            source.poll()
    except CdfctlError as error:
        return report_failure(error, debug=False)
    return 0


RERUN = ["run", "./small.yaml", "--set", "simulation.time_limit=0.1", "--out", "bad/run", "--quiet"]
READERS: dict[str, list[tuple[list[str], Callable[[list[str]], int]]]] = {
    "run": [
        (["plot", "bad/run", "--figure", "time", *PLOT], main),
        (["plot", "bad/run", "--figure", "task-space", *PLOT], main),
        (["view", "bad/run", "--html", "bad/page.html", "--quiet"], main),
        (["run", "bad/run/scenario.yaml", "--set", "simulation.time_limit=0.1", "--out", "bad/out", "--quiet"], main),
        (RERUN, main),
        (["check", "bad/run/scenario.yaml"], main),
    ],
    "store": [
        (RESUME, main),
        ([*BENCH, "--out", "bad/store", "--dry-run"], main),
        (["plot", "bad/store", "--figure", "success", *PLOT], main),
    ],
    "table": [([*BUILD, "--out", "bad/table/planar.safetensors"], main)],
    "partial": [([*BUILD, "--out", "bad/partial/planar.safetensors"], main)],
    "cached": [(RUN, main), (["doctor"], main), (BUILD, main)],
    "live": [(["view", "bad/live"], follow)],
}


def make() -> None:
    """The good files, in ``good``, and everything compiled and imported that the commands need."""
    Path("small.yaml").write_text(DUAL)
    for path in ("good", "bad/figures"):
        Path(path).mkdir(parents=True)
    words = [["run", "./small.yaml", "--out", "good/run", "--quiet"], [*BENCH, "--out", "good/store"]]
    words += [[*BUILD, "--out", "good/table/planar.safetensors"], ["plot", "good/store", *PLOT]]
    words += [["plot", "good/run", "--figure", "time", "--figure", "task-space", *PLOT]]
    words += [["view", "good/run", "--html", "page.html"]]
    for command in words:
        answer = one(command)
        assert answer["status"] in (0, 1), answer
    assert "<img src=x" not in Path("page.html").read_text()  # the obstacle's name
    make_partial()
    make_live()


def make_partial() -> None:
    """A build that was stopped before its table was written."""
    from cdfctl.fields.table.build import BuildParameters, build_table
    from cdfctl.robots.robot import load_robot

    robot = load_robot("planar")
    Path("good/partial").mkdir()
    build_table(robot, BuildParameters(resolution=8, starts=6), Path("good/partial/planar.safetensors"), jobs=1)


def make_live() -> None:
    """The journal of a run that goes on."""
    from cdfctl.scenario.library import load_scenario
    from cdfctl.simulation.assemble import assemble
    from cdfctl.simulation.journal import Journal, live_folder

    wired = assemble(load_scenario("./small.yaml"))
    kept = Journal(Path("good/live/run"), wired.scenario, on=True)
    for _ in kept.through(wired.run()):
        pass
    live_folder(Path("good/live/run")).rename("good/live/journal")


def table_of_cache() -> Path:
    from cdfctl.fields.cdf import table_path
    from cdfctl.robots.robot import load_robot

    return table_path(load_robot("planar"))


@contextlib.contextmanager
def laid_out(kind: str) -> Iterator[None]:
    """The damaged copy ``bad/<kind>`` where its readers look for it."""
    if kind == "cached":
        place = table_of_cache()
        place.parent.mkdir(exist_ok=True)
        if os.path.lexists("bad/cached/planar.safetensors"):
            Path("bad/cached/planar.safetensors").rename(place)
        yield
        shutil.rmtree(place) if place.is_dir() and not place.is_symlink() else place.unlink(missing_ok=True)
    elif kind == "live":
        from cdfctl.simulation.journal import live_folder

        place = live_folder(Path("bad/live"))
        Path("bad/live/journal").rename(place)
        with contextlib.suppress(OSError), (place / "steps.bin").open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield
            shutil.rmtree(place)
            return
        yield
        shutil.rmtree(place)
    else:
        yield


def damaged(kind: str, rng: random.Random) -> tuple[str, str]:
    """Copy the good files of ``kind`` and damage one of them; what was done to which."""
    source = Path("good") / ("table" if kind == "cached" else kind)
    for path in Path("bad").glob("*"):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    for path in Path("bad").glob(".*"):
        shutil.rmtree(path)
    Path("bad/figures").mkdir(parents=True)
    shutil.copytree(source, Path("bad") / kind)
    files = sorted(
        path for path in (Path("bad") / kind).rglob("*") if path.is_file() and path.name not in ("lock", ".lock")
    )
    if kind == "store":
        files = [path for path in files if "trajectories" not in path.parts]
    path = rng.choice(files)
    how = rng.choice([*KINDS, "forged", "forged", "forged", "lost", "folder", "link"])
    raw = path.read_bytes()
    path.unlink()
    match how:
        case "lost":
            pass
        case "folder":
            path.mkdir()
        case "link":
            path.symlink_to(rng.choice(["/dev/zero", "/proc/self/mem", path.name, "/nonexistent", "/etc/passwd"]))
        case "forged":
            path.write_bytes(forge(path.name, raw, rng))
        case _:
            path.write_bytes(spoil(how, raw, rng))
    return how, path.name


def loop(seed: int, count: int) -> None:
    make()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))  # what a reader asks for beyond it is an error, not a swap
    begin("bad")
    whole = Path("good/table/planar.safetensors").read_bytes()
    trials = Path("good/store/trials.jsonl").read_bytes()
    rng = random.Random(seed)
    kinds = ["run", "store", "table", "cached", "live"]
    for i in range(count):
        kind = "partial" if i % 12 == 11 else kinds[i % len(kinds)]  # a build takes as long as all the others
        how, name = damaged(kind, rng)
        with laid_out(kind):
            readers = READERS[kind] if kind != "run" else rng.sample(READERS[kind], 2)
            for words, call in sorted(readers, key=lambda reader: reader[0] == RERUN):  # what mends it comes last
                answer: dict[str, Any] = {"case": i, "kind": kind, "how": how, "file": name, "words": words}
                answer |= one(words, call)
                answer["same"] = None
                if answer["status"] == 0 and kind == "partial":
                    answer["same"] = Path("bad/partial/planar.safetensors").read_bytes() == whole
                if answer["status"] == 0 and words == RESUME:
                    answer["same"] = Path("bad/store/trials.jsonl").read_bytes() == trials
                print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    loop(int(sys.argv[1]), int(sys.argv[2]))
