"""Feed hostile scenario files to ``cdfctl`` in this process and tell, as JSON lines, what became of each.

``python fuzz_worker.py SCENARIOS SEED COUNT``, in an empty folder with CDFCTL_CACHE set.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
from pathlib import Path

from mutants import mutants  # beside this file, as a script's own folder is where it looks first
from watched import begin, one

from cdfctl.cli.main import main


def loop(folder: str, seed: int, count: int) -> None:
    schema = io.StringIO()
    with contextlib.redirect_stdout(schema):
        main(["schema"])
    main(["run", "planar-1", "--set", "simulation.time_limit=0.2", "--out", "out", "--quiet"])  # compiles and imports
    begin("out", ".out.")
    path = Path("mutant.yaml")
    for i, raw in zip(range(count), mutants(Path(folder), json.loads(schema.getvalue()), seed), strict=False):
        path.write_bytes(raw)
        answers = [one(["check", "./mutant.yaml"])]
        if answers[0]["status"] == 0 and i % 10 == 0:
            shorten = ["--set", "simulation.time_limit=0.02", "--set", "simulation.dt=0.01"]
            answers.append(one(["run", "./mutant.yaml", *shorten, "--out", "out", "--quiet"]))
        for answer in answers:
            print(json.dumps({"file": i, **answer}), flush=True)


if __name__ == "__main__":
    loop(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
