"""The summary of a run says the right thing for every outcome, in 80 columns and without colour."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from cdfctl.report.run_summary import run_summary
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.resolve import resolve
from cdfctl.simulation.result import RunResult
from cdfctl.types import Contact, Trajectory, Verdict


def trajectory(steps: int, infeasible: int = 0) -> Trajectory:
    flags = np.zeros(steps, dtype=bool)
    flags[:infeasible] = True
    return Trajectory(
        t=0.1 * np.arange(steps + 1),
        q=np.zeros((steps + 1, 7)),
        u=np.zeros((steps, 7)),
        obstacle_pose=np.zeros((steps + 1, 2, 7)),
        obstacle_twist=np.zeros((steps + 1, 2, 6)),
        h=np.zeros((steps, 2)),
        V=np.full(steps, np.nan),
        slack=np.full(steps, np.nan),
        infeasible=flags,
        step_time=np.full(steps, 2.5e-4),
    )


REACHED = Verdict(
    outcome="reached",
    outcome_sampled="reached",
    time_to_reach=3.1,
    path_length=1.2345,
    joint_path=2.5,
    min_clearance=0.0423,
    min_clearance_time=1.37,
    contact=None,
)


def rendered(result: RunResult, width: int = 80, **terminal: object) -> str:
    text = io.StringIO()
    console = Console(file=text, width=width, **terminal)
    console.print(run_summary(result, "runs/C1-sdf-tvcbf-qp-0-0", "panda_hand_tcp", ["fingers locked at 0 m"]))
    return text.getvalue()


@pytest.fixture
def result() -> RunResult:
    scenario = resolve(load_scenario("C1").scenario)
    return RunResult(
        scenario=scenario, robot="franka", trial=0, trajectory=trajectory(31), verdict=REACHED, stop="reached"
    )


def test_everything_a_reader_wants_is_there(result):
    text = rendered(result)
    for words in (
        "C1: dual-tvcbf-qp on franka",
        "REACHED in 3.10 s, without contact",
        "1.234 m (panda_hand_tcp)",
        "2.500 rad",
        "0.0423 m at 1.37 s",
        "0 of 31",
        "0.25 ms median, 0.25 ms p99",
        "seed 0, trial 0",
        "runs/C1-sdf-tvcbf-qp-0-0",
        "fingers locked at 0 m",
    ):
        assert words in text
    words = " ".join(text.split())
    for assumption in result.scenario.assumptions:
        assert assumption.split(";")[0] in words


@pytest.mark.parametrize(
    ("changes", "steps", "headline"),
    [
        (
            {"outcome": "collision", "contact": Contact(1.234, "panda_link5", "ball-2"), "time_to_reach": None},
            31,
            "COLLISION at 1.23 s: panda_link5 touches ball-2",
        ),
        ({"outcome": "timeout", "time_to_reach": None}, 200, "TIMEOUT: not reached within 20 s, without contact"),
        ({"outcome": "infeasible", "time_to_reach": None}, 12, "INFEASIBLE at 1.20 s: no velocity satisfies all"),
        ({"outcome": "error", "time_to_reach": None}, 12, "ERROR at 1.20 s: the cable came loose"),
    ],
)
def test_every_outcome_has_its_headline(result, changes, steps, headline):
    verdict = replace(REACHED, **changes)
    result = replace(result, verdict=verdict, trajectory=trajectory(steps, 3), reason="the cable came loose")
    text = rendered(result)
    assert headline in text
    assert f"{result.infeasible_steps} of {steps} (on_infeasible: least-violation)" in text


def test_a_target_out_of_reach_is_told_from_one_that_was_missed(result):
    late = replace(result, verdict=replace(REACHED, outcome="timeout", time_to_reach=None))
    far = replace(late, trajectory=replace(late.trajectory, V=np.full(31, np.inf)))
    assert "the target was never within reach" in " ".join(rendered(far).replace("│", "").split())
    missed = replace(late, trajectory=replace(late.trajectory, V=np.append(np.full(30, np.inf), 0.4)))
    assert "never within reach" not in rendered(missed)
    assert "never within reach" not in rendered(late)


def test_it_fits_80_columns_and_has_no_colour_where_none_is_wanted(result):
    text = rendered(result, no_color=True)
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= 80


def test_it_can_be_written_in_ascii(result):
    raw = io.TextIOWrapper(io.BytesIO(), encoding="ascii", errors="strict")
    Console(file=raw, width=80).print(run_summary(result, "runs/x", "tip"))
    raw.flush()


def test_no_obstacle_and_no_step_are_said_in_words(result):
    verdict = replace(REACHED, min_clearance=float("inf"), min_clearance_time=None, time_to_reach=0.0)
    text = rendered(replace(result, verdict=verdict, trajectory=trajectory(0)))
    assert "no obstacle" in text
    assert "- median, - p99" in text
    assert "nan" not in text
    assert "inf " not in text


def test_markup_in_names_is_shown_as_it_is(result):
    scenario = result.scenario.model_copy(update={"description": "a [bold]name[/bold]", "assumptions": ("[red]x",)})
    text = rendered(replace(result, scenario=scenario))
    assert "a [bold]name[/bold]" in text
    assert "[red]x" in text


def test_what_the_plant_reports_has_units(result):
    report = {"type": "mujoco", "velocity_error_max_rad_s": 0.012345, "servo_gain": 1333.27, "contact_time_s": None}
    lines = {line.strip("│ ") for line in rendered(replace(result, plant=report)).splitlines()}
    assert {" ".join(line.split()) for line in lines} >= {
        "plant mujoco",
        "velocity error max 0.0123 rad/s",
        "servo gain 1333 N m s/rad",
    }
    assert not any("contact time" in line for line in lines)


def test_a_contact_that_only_the_plant_felt_is_told(result):
    verdict = replace(REACHED, outcome="collision", time_to_reach=None)
    text = rendered(replace(result, verdict=verdict, stop="contact", reason="MuJoCo finds link7 in contact with ball"))
    assert "COLLISION: MuJoCo finds link7 in contact with ball" in text
