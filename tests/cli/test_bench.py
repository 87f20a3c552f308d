"""``cdfctl bench`` at the command line: its documents, its statuses, its one-line errors."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

KEYS = {
    "scenario",
    "controller",
    "trials",
    "success_rate",
    "success_ci95",
    "success_rate_sampled",
    "time_to_reach_s",
    "path_length_m",
    "joint_path_rad",
    "errors",
    "collisions",
    "timeouts",
    "infeasible",
    "min_clearance_m",
    "step_ms",
    "paper",
}
ONE = ("--scenario", "./small.yaml", "--jobs", "1", "--trials", "2")


def test_the_document_has_the_keys_of_the_interface(cli, small: Path):
    document = cli("bench", *ONE, "--json").document()
    assert set(document) == {"trials", "seed", "results"}
    (result,) = document["results"]
    assert set(result) == KEYS
    assert (document["trials"], document["seed"], result["trials"]) == (2, 0, 2)
    assert (result["scenario"], result["controller"], result["paper"]) == ("small", "sdf-tvcbf-qp", None)
    assert (result["success_rate"], result["success_rate_sampled"]) == (1.0, 1.0)
    assert set(result["step_ms"]) == {"p50", "p99"}
    for key in ("time_to_reach_s", "path_length_m", "joint_path_rad"):
        assert 0 < result[key]["min"] <= result[key]["mean"] <= result[key]["max"]


def test_the_store_resumes_and_extends_without_a_word_on_standard_output(cli, small: Path):
    first = cli("bench", *ONE, "--quiet")
    assert (first.status, first.out, first.err) == (0, "", "")
    (store,) = (small.parent / "runs").iterdir()
    assert store.name.startswith("small-")
    lines = (store / "trials.jsonl").read_bytes()
    times = (store / "timing.jsonl").read_bytes()
    assert cli("bench", *ONE, "--quiet").status == 0
    assert (store / "timing.jsonl").read_bytes() == times  # nothing was run again
    assert cli("bench", *ONE[:-1], "3", "--quiet").status == 0
    assert (store / "trials.jsonl").read_bytes().startswith(lines)
    summary = json.loads((store / "summary.json").read_text())
    assert summary["results"][0]["trials"] == 3
    assert (store / "summary.md").read_text().startswith("### small")


def test_several_rules_and_a_sweep_say_which_they_are(cli, small: Path):
    more = ("--on-infeasible", "fail", "--on-infeasible", "brake", "--sweep", "controller.alpha=1,2")
    results = cli("bench", *ONE, *more, "--json").document()["results"]
    assert [(r["on_infeasible"], r["sweep"]) for r in results] == [
        ("fail", {"controller.alpha": 1}),
        ("brake", {"controller.alpha": 1}),
        ("fail", {"controller.alpha": 2}),
        ("brake", {"controller.alpha": 2}),
    ]


def test_a_table_beside_the_paper_s_at_80_columns(cli, here: Path):
    arguments = ("--scenario", "S1", "--jobs", "1", "--trials", "1")
    both = ("--controller", "sdf-tvcbf-qp", "--controller", "sdf-sh-qp")
    shown = cli("bench", *arguments, *both)
    assert shown.status == 0
    assert max(map(len, shown.out.splitlines())) <= 80
    assert "3.9 (3.5-4.8)" in shown.out
    assert "0.69" in shown.out
    assert "Assumed" in shown.out
    markdown = cli("bench", *arguments, *both, "--format", "markdown").out
    assert "| *paper* | 1.00 |" in markdown
    latex = cli("bench", *arguments, *both, "--format", "latex").out
    assert latex.count(r"\begin{tabular}") == latex.count(r"\end{tabular}") == 1
    rows = list(csv.DictReader(io.StringIO(cli("bench", *arguments, *both, "--format", "csv").out)))
    assert [row["paper_success"] for row in rows] == ["1.0", "0.69"]
    assert rows[0]["successes"] in "01"


def test_a_dry_run_writes_nothing(cli, small: Path):
    before = set(small.parent.rglob("*"))
    shown = cli("bench", *ONE, "--controller", "sdf-tvcbf-qp", "--controller", "sdf-cbf-qp", "--dry-run")
    assert shown.status == 0
    assert "2 x 2 = 4 trials, 0 of them done" in shown.out
    document = cli("bench", *ONE, "--dry-run", "--json").document()
    assert (document["to_run"], document["done"], len(document["cells"])) == (2, 0, 1)
    assert set(small.parent.rglob("*")) == before


def test_success_below_what_is_asked_is_1(cli, small: Path):
    assert cli("bench", *ONE, "--min-success", "0.9", "--quiet").status == 0
    late = cli("bench", *ONE, "--set", "simulation.time_limit=0.5", "--min-success", "0.9")
    assert late.status == 1
    assert "success 0.000 is below 0.9" in late.err


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("--scenario", "S4"), 2, "unknown scenario 'S4'"),
        (("--scenario", "S1", "--controller", "sdf-tvcbf"), 2, "did you mean sdf-tvcbf-qp?"),
        (("--scenario", "S1", "--trials", "0"), 2, "--trials"),
        (("--scenario", "S1", "--trials", "-3"), 2, "--trials"),
        (("--scenario", "S1", "--jobs", "0"), 2, "--jobs"),
        (("--scenario", "S1", "--on-infeasible", "stop"), 2, "least-violation"),
        (("--scenario", "S1", "--min-success", "1.5"), 2, "--min-success"),
        (("--suite", "papers"), 2, "--suite"),
        (("--scenario", "S1", "--suite", "paper"), 2, "either --scenario or --suite"),
        ((), 2, "either --scenario or --suite"),
        (("--scenario", "S1", "--sweep", "controller.alhpa=1,2"), 2, "did you mean alpha?"),
        (("--scenario", "S1", "--sweep", "controller.alpha"), 2, "expected FIELD=a,b,c"),
        (("--scenario", "S1", "--controller", "sdf-tvcbf-tvclf-qp"), 2, "cannot do task 'joint-goal'"),
        (("--scenario", "S1", "--dask", "localhost"), 2, "not the address of a scheduler"),
        (("--scenario", "S1", "--dask", "tcp://127.0.0.1:1", "--jobs", "2"), 2, "exclude each other"),
    ],
)
def test_bad_input_is_said_before_anything_is_written(cli, here: Path, arguments, status, words):
    result = cli("bench", *arguments)
    assert (result.status, result.out) == (status, "")
    assert words in result.err
    assert "Traceback" not in result.err
    assert list(here.iterdir()) == []


def test_what_can_be_solved_is_asked_once_and_shown(cli, small: Path):
    document = cli("bench", *ONE, "--json", "--solvable").document()
    (result,) = document["results"]
    assert set(result) == KEYS | {"solvable"}
    assert result["solvable"] | {"success_of_solvable": None} == {
        "trials": 2,
        "share": [1.0, 1.0],
        "success_of_solvable": None,
        "yes": [0, 1],
        "no": [],
        "open": [],
        "missed": [],
    }
    (store,) = (small.parent / "runs").iterdir()
    lines = (store / "solvable.jsonl").read_bytes()
    shown = cli("bench", *ONE[:-1], "3", "--solvable")
    assert "of solvable" in shown.out
    assert "small: solvable share 1.00 (3 solved, 0 proved impossible, 0 open)." in shown.out
    assert (store / "solvable.jsonl").read_bytes().startswith(lines)
    assert len((store / "solvable.jsonl").read_text().splitlines()) == 3
    assert max(map(len, shown.out.splitlines())) <= 80


def test_what_cannot_be_bounded(cli, here: Path):
    result = cli("bench", "--scenario", "X3", "--trials", "1", "--solvable")
    assert (result.status, result.out) == (2, "")
    assert "--solvable needs a robot with two joints; that of 'X3' has 7" in result.err
    assert not (here / "runs").exists()
