"""The store: what it holds after all that can happen to it."""

from __future__ import annotations

import dataclasses
import errno
import json
from pathlib import Path

import pytest

from cdfctl.benchmark import lines
from cdfctl.benchmark.plan import Plan, make_plan
from cdfctl.benchmark.reading import read_store
from cdfctl.benchmark.run import Runner
from cdfctl.benchmark.store import default_store, folder_name, open_store, peek
from cdfctl.benchmark.trial import Answer, run_trial
from cdfctl.errors import InputError, MissingError
from cdfctl.simulation.run_folder import read_run


def answers(plan: Plan, keep: str = "none") -> list[Answer]:
    return list(Runner(plan, 1, keep).run(range(len(plan))))


def fill(folder: Path, plan: Plan, given: list[Answer]) -> bytes:
    with open_store(folder, plan) as store:
        for answer in given:
            store.add(answer)
    path = folder / "trials.jsonl"
    return path.read_bytes() if path.exists() else b""


def test_the_order_of_the_file_is_that_of_the_plan(here: Path, plan: Plan) -> None:
    given = answers(plan)
    whole = fill(here / "a", plan, given)
    assert [lines.key_of(json.loads(line)) for line in whole.splitlines()] == list(plan.keys())
    assert fill(here / "b", plan, given[::-1]) == whole
    assert not (here / "b" / "arrived.jsonl").exists()


def test_what_came_early_is_kept_over_a_restart(here: Path, plan: Plan) -> None:
    given = answers(plan)
    whole = fill(here / "a", plan, given)
    assert fill(here / "b", plan, given[3:]) == b""
    assert peek(here / "b", plan) == len(plan) - 3
    with open_store(here / "b", plan) as store:
        assert store.missing() == [0, 1, 2]
    assert fill(here / "b", plan, given[:3]) == whole


def test_torn_last_line_is_dropped(here: Path, plan: Plan) -> None:
    given = answers(plan)
    whole = fill(here / "a", plan, given)
    path = here / "a" / "trials.jsonl"
    path.write_bytes(whole[:-40])
    with open_store(here / "a", plan) as store:
        assert store.missing() == [len(plan) - 1]
        store.add(given[-1])
    assert path.read_bytes() == whole


def test_more_trials_only_add(here: Path, plan: Plan) -> None:
    given = answers(plan)
    whole = fill(here / "a", plan, given)
    fewer = dataclasses.replace(plan, trials=2)
    assert default_store(fewer) == default_store(plan)
    first = fill(here / "b", fewer, given[: len(fewer)])
    assert whole.startswith(first)
    assert fill(here / "b", plan, given[len(fewer) :]) == whole
    with open_store(here / "b", fewer) as store:  # and fewer again: nothing to do, nothing lost
        assert store.missing() == []
    assert (here / "b" / "trials.jsonl").read_bytes() == whole
    assert json.loads((here / "b" / "manifest.json").read_text())["trials"] == 4


def test_a_kept_run_is_the_run(here: Path, plan: Plan) -> None:
    given = answers(plan, "all")
    fill(here / "a", plan, given)
    assert len(list((here / "a" / "trajectories").iterdir())) == len(plan)
    name = folder_name(plan.cells[0].key(2))
    run = read_run(here / "a" / "trajectories" / name)
    assert run.document["outcome"] == given[4].result.verdict.outcome
    failures = [a for a in answers(plan, "failures") if a.run is not None]
    assert failures
    assert not any(a.result.verdict.success for a in failures)


def test_another_configuration_is_another_folder(here: Path, plan: Plan) -> None:
    others = [
        make_plan(["./small.yaml"], ["sdf-tvcbf-qp"], [], [()], trials=4, seed=0),
        make_plan(["./small.yaml"], ["sdf-tvcbf-qp", "sdf-cbf-qp"], ["fail"], [()], trials=4, seed=0),
        make_plan(["./small.yaml"], ["sdf-tvcbf-qp", "sdf-cbf-qp"], [], [()], trials=4, seed=1),
    ]
    assert len({default_store(p) for p in [plan, *others]}) == 4
    fill(here / "a", plan, answers(plan))
    before = sorted((p, p.stat().st_mtime_ns) for p in (here / "a").iterdir())
    for other in others:
        with pytest.raises(InputError, match="another configuration"), open_store(here / "a", other):
            pass
    assert sorted((p, p.stat().st_mtime_ns) for p in (here / "a").iterdir()) == before


def test_a_store_of_other_code_or_another_version(here: Path, plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(here / "a", plan, answers(plan)[:2])
    path = here / "a" / "manifest.json"
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps({**manifest, "version": 2}))
    with pytest.raises(InputError, match="another version"):
        peek(here / "a", plan)
    path.write_text(json.dumps({**manifest, "versions": {**manifest["versions"], "numpy": "1.0"}}))
    with pytest.raises(InputError, match=r"numpy 1\.0 then"):
        peek(here / "a", plan)
    path.write_text("{")
    with pytest.raises(InputError, match="damaged"):
        peek(here / "a", plan)


def test_folders_that_are_not_ours(here: Path, plan: Plan) -> None:
    (here / "file").write_text("")
    (here / "full").mkdir()
    (here / "full" / "thesis.tex").write_text("")
    for name, message in (("file", "is a file"), ("full", "not empty"), ("file/below", "cannot be written")):
        with pytest.raises(InputError, match=message), open_store(here / name, plan):
            pass
    assert [p.name for p in (here / "full").iterdir()] == ["thesis.tex"]


def test_damage_inside_is_named_by_its_line(here: Path, plan: Plan) -> None:
    whole = fill(here / "a", plan, answers(plan)).splitlines(keepends=True)
    path = here / "a" / "trials.jsonl"
    path.write_bytes(b"".join([whole[0], b"{]\n", *whole[2:]]))
    with pytest.raises(InputError, match=r"trials\.jsonl:2: damaged"):
        peek(here / "a", plan)
    path.write_bytes(b"".join(2 * whole))
    with pytest.raises(InputError, match=rf"trials\.jsonl:{len(whole) + 1}: damaged: not the trial"):
        peek(here / "a", plan)
    with pytest.raises(InputError, match="a trial comes twice"):
        read_store(here / "a")
    path.write_bytes(b"".join([whole[1], whole[0]]))
    with pytest.raises(InputError, match=r"trials\.jsonl:1: damaged: not the trial"):
        peek(here / "a", plan)


def test_every_bit_that_turns_over_is_noticed(here: Path, plan: Plan) -> None:
    whole = fill(here / "a", plan, answers(plan)[:2])
    path = here / "a" / "trials.jsonl"
    for place in range(0, len(whole) - 1, 7):  # the last line feed is a torn line's
        data = bytearray(whole)
        data[place] ^= 1 << place % 8
        path.write_bytes(data)
        with pytest.raises(InputError, match=r"trials\.jsonl:[12]: damaged"):
            peek(here / "a", plan)


@pytest.mark.parametrize(
    "change",
    [
        {"trial": [1]},
        {"outcome": None},
        {"steps": 1.5},
        {"time_to_reach_s": "1"},
        {"time_to_reach_s": float("nan")},
        {"infeasible_steps": 10**400},
        {"outcome": "reached", "path_length_m": None},
    ],
)
def test_a_line_that_no_bench_writes_is_refused(here: Path, plan: Plan, change: dict[str, object]) -> None:
    """With a checksum that fits: what follows may rely on types."""
    fill(here / "a", plan, answers(plan)[:1])
    path = here / "a" / "trials.jsonl"
    record = json.loads(path.read_text())
    del record["crc"]
    record |= change
    path.write_text(json.dumps(record | {"crc": lines.checksum(record)}) + "\n")
    with pytest.raises(InputError, match=r"trials\.jsonl:1: damaged: not a trial"):
        peek(here / "a", plan)


@pytest.mark.parametrize("name", ["trials.jsonl", "timing.jsonl", ".lock", "trajectories", ".manifest.json.new"])
def test_a_link_in_a_store_leads_nothing_astray(here: Path, plan: Plan, name: str) -> None:
    """A torn last line is cut off and drafts are written: not those of a file somewhere else."""
    given = answers(plan)[:1]
    fill(here / "a", plan, given)
    theirs = here / "theirs"
    theirs.write_text("no line feed at the end")
    (here / "a" / name).unlink(missing_ok=True)
    (here / "a" / name).symlink_to(theirs)
    if name == ".manifest.json.new":
        fill(here / "a", plan, [])
    else:
        with pytest.raises(InputError, match="Is a symbolic link"):
            fill(here / "a", plan, [])
    assert theirs.read_text() == "no line feed at the end"


def test_one_bench_at_a_time(here: Path, plan: Plan) -> None:
    with (
        open_store(here / "a", plan),
        pytest.raises(InputError, match="another bench is writing"),
        open_store(here / "a", plan),
    ):
        pass
    with open_store(here / "a", plan):  # released
        pass


def test_a_full_disk_loses_nothing(here: Path, plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk takes half of the third line, then nothing."""
    given = answers(plan)
    whole = fill(here / "a", plan, given)
    with open_store(here / "b", plan) as store:
        store.add(given[0])
        store.add(given[1])

        def full(file, data) -> None:
            file.write(data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(lines, "_write_all", full)
        with pytest.raises(InputError, match="No space left on device") as caught:
            store.add(given[2])
        assert "the same command goes on" in str(caught.value)
    monkeypatch.undo()
    monkeypatch.chdir(here)
    with open_store(here / "b", plan) as store:
        assert store.missing() == list(range(2, len(plan)))
    assert fill(here / "b", plan, given[2:]) == whole


def test_a_trial_that_cannot_begin_is_an_error_with_its_reason(here: Path) -> None:
    path = here / "small.yaml"
    path.write_text(
        path.read_text().replace("{uniform: [-3.0, 3.0]}, {uniform: [2.5, 4.0]}", "1.0, {uniform: [-4, 4]}")
    )
    plan = make_plan(["./small.yaml"], [], [], [()], trials=30, seed=0)
    found = [run_trial(plan.cells[0], i, "none").result for i in range(30)]
    errors = [result for result in found if result.verdict.outcome == "error"]
    assert errors
    assert all("in contact" in (result.reason or "") for result in errors)


def test_another_contact_table_is_another_benchmark(here: Path) -> None:
    """The CDF's search starts from a table: one that a worker lacks must not pass unseen."""
    plan = make_plan(["./small.yaml"], ["cdf-tvcbf-qp"], [], [()], trials=1, seed=0)
    other = dataclasses.replace(plan, cells=(dataclasses.replace(plan.cells[0], table="0123456789ab"),))
    assert default_store(other) != default_store(plan)
    assert run_trial(plan.cells[0], 0, "none").result.verdict.outcome != "error"
    with pytest.raises(MissingError, match="contact table of planar is not the one"):
        run_trial(other.cells[0], 0, "none")
    assert make_plan(["./small.yaml"], ["sdf-tvcbf-qp"], [], [()], trials=1, seed=0).cells[0].table is None
