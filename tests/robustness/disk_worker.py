"""Run the commands that write, where the disk takes nothing, and tell, as JSON lines, what became of each.

``python disk_worker.py FOLDER FULL``: FOLDER is on that disk, FULL a folder on one that has a little room. Started in a
folder with room, with ``small.yaml`` in it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from damage_worker import BENCH, BUILD, PLOT, RUN  # beside this file
from watched import one

NAMES = ("run", "live", "bench", "build", "plot", "view")


def commands(folder: Path) -> dict[str, list[str]]:
    """A command for each of :data:`NAMES`, writing into ``folder``."""
    run, plot = [word for word in RUN if not word.startswith("bad/")], PLOT[: PLOT.index("--out")]
    run.remove("--out")
    return {
        "run": [*run, "--out", str(folder / "run")],
        "live": [*run, "--live", "--out", str(folder / "live")],
        "bench": [*BENCH, "--out", str(folder / "store")],
        "build": [*BUILD, "--out", str(folder / "planar.safetensors")],
        "plot": ["plot", "run", "--figure", "time", *plot, "--out", str(folder / "figure.png")],
        "view": ["view", "run", "--html", str(folder / "page.html"), "--quiet"],
    }


def fill(folder: Path) -> None:
    """Leave no room."""
    with (folder / "ballast").open("wb", buffering=0) as file:
        try:
            while file.write(bytes(4096)):
                pass
        except OSError:
            return


def loop(readonly: Path, full: Path) -> None:
    for name, words in commands(Path()).items():  # what it is without a fault, and everything imported
        print(json.dumps({"disk": "good", "name": name, **one(words)}), flush=True)
    for name, words in commands(readonly).items():
        print(json.dumps({"disk": "read-only", "name": name, **one(words)}), flush=True)
    fill(full)
    for name, words in commands(full).items():
        print(json.dumps({"disk": "full", "name": name, **one(words)}), flush=True)
    left = sorted(str(path.relative_to(full)) for path in full.rglob("*") if path.is_file())
    (full / "ballast").unlink()
    for name, words in commands(full).items():  # with room again
        print(json.dumps({"disk": "emptied", "name": name, **one(words)}), flush=True)
    kept = ("store/trials.jsonl", "planar.safetensors")
    same = [(full / place).read_bytes() == Path(place).read_bytes() for place in kept]
    print(json.dumps({"disk": "end", "left": left, "same": same}))


if __name__ == "__main__":
    loop(Path(sys.argv[1]), Path(sys.argv[2]))
