"""A run that is followed while it goes on, by a reader of its own, and what is left of it: nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cdfctl.errors import InputError
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.overrides import parse_override
from cdfctl.simulation.assemble import assemble
from cdfctl.simulation.journal import NEEDED, STEPS, JournalReader, is_going_on, journal, live_folder

SETTINGS = ("controller.variant=sdf-tvcbf-qp", "simulation.time_limit=1.0")


def new_trial():
    return assemble(load_scenario("planar-1", [parse_override(setting) for setting in SETTINGS]))


@pytest.fixture
def trial():
    return new_trial()


def test_what_is_read_is_what_the_run_becomes(trial, tmp_path):
    folder = tmp_path / "run"
    live = live_folder(folder)
    read = None
    with journal(folder, trial.scenario, on=True) as kept:
        assert not live.exists()  # before the first step there is nothing to follow
        for step in kept.through(trial.run()):
            if step.index == 2:
                assert is_going_on(live)
                read = JournalReader(live)
                first = read.poll()
                assert len(first.t) == 3
                assert len(first.u) == 2
                assert read.poll() is None
        last = read.poll()
        assert read.going_on
    assert not read.going_on
    read.close()
    assert list(tmp_path.iterdir()) == []
    assert read.scenario == trial.scenario
    whole = trial.rollout.trajectory()
    N = len(whole.u)
    assert len(last.t) == N
    for name in ("t", "q", "obstacle_pose", "obstacle_twist"):
        np.testing.assert_array_equal(getattr(last, name), getattr(whole, name)[:N], err_msg=name)
    for name in ("u", "h", "V", "slack", "infeasible"):
        np.testing.assert_array_equal(getattr(last, name), getattr(whole, name)[: N - 1], err_msg=name)


def test_nothing_is_written_unless_asked(trial, tmp_path):
    with journal(tmp_path / "run", trial.scenario, on=False) as kept:
        for _ in kept.through(trial.run()):
            assert list(tmp_path.iterdir()) == []


def test_two_runs_into_one_folder_do_not_mix(trial, tmp_path):
    with journal(tmp_path / "run", trial.scenario, on=True) as kept:
        next(kept.through(trial.run()))
        with pytest.raises(InputError, match="another run into it"), journal(tmp_path / "run", trial.scenario, on=True):
            pass
        assert is_going_on(live_folder(tmp_path / "run"))


def test_what_a_dead_run_left_is_known_as_such_and_replaced(trial, tmp_path):
    live = live_folder(tmp_path / "run")
    with journal(tmp_path / "run", trial.scenario, on=True) as kept:
        steps = kept.through(trial.run())
        next(steps), next(steps)
        text = (live / STEPS).read_bytes(), (live / "scenario.yaml").read_bytes()
    live.mkdir()
    (live / STEPS).write_bytes(text[0][:-5])  # it died while it wrote
    (live / "scenario.yaml").write_bytes(text[1])
    assert not is_going_on(live)
    reader = JournalReader(live)
    assert len(reader.poll().t) == 1
    reader.close()
    with journal(tmp_path / "run", trial.scenario, on=True) as kept:
        next(kept.through(new_trial().run()))
        assert is_going_on(live)


def test_a_disk_that_fails_stops_the_journal_and_not_the_run(trial, tmp_path):
    folder = tmp_path / "a-file" / "run"
    folder.parent.write_text("")
    with journal(folder, trial.scenario, on=True) as kept:
        assert len(list(kept.through(trial.run()))) == 10
    assert "a-file" in kept.problem


def first_line(**changes: object) -> bytes:
    good = {"format": "cdfctl-live", "version": 1, "fields": [[name, [1]] for name in sorted(NEEDED)]}
    return json.dumps(good | changes).encode() + b"\n"


@pytest.mark.parametrize(
    "header",
    [
        b"",
        b"{}\n",
        b"[1]\n",
        b"[" * 50_000 + b"\n",
        first_line(format="x"),
        first_line(version=2),
        first_line(fields=[["t", []]]),
        first_line(fields=[["t", [-1]], *([name, []] for name in NEEDED)]),
        first_line(fields=[["t", [10**9, 10**9]], *([name, []] for name in NEEDED - {"t"})]),
        first_line(fields=[["evil", []], *([name, []] for name in NEEDED)]),
    ],
)
def test_another_file_is_not_taken_for_one(trial, tmp_path, header):
    live = live_folder(tmp_path / "run")
    with journal(tmp_path / "run", trial.scenario, on=True) as kept:
        next(kept.through(trial.run()))
        scenario = (live / "scenario.yaml").read_bytes()
    live.mkdir()
    (live / "scenario.yaml").write_bytes(scenario)
    (live / STEPS).write_bytes(header)
    with pytest.raises(InputError, match="not a run in progress"):
        JournalReader(live)


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="there is no file here that opens and does not read")
def test_a_file_that_opens_but_does_not_read_is_refused(trial, tmp_path):
    folder = tmp_path / "run"
    with journal(folder, trial.scenario, on=True) as kept:
        for step in kept.through(trial.run()):
            if step.index == 1:
                steps = live_folder(folder) / STEPS
                steps.rename(tmp_path / "kept")
                steps.symlink_to("/proc/self/mem")
                with pytest.raises(InputError, match="cannot be read"):
                    JournalReader(live_folder(folder))
                steps.unlink()
                (tmp_path / "kept").rename(steps)
