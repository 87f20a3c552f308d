"""The plant section: short and long, and how the command line switches it."""

from __future__ import annotations

from pathlib import Path

import jsonschema
import pytest

from cdfctl.scenario.dump import dump
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.overrides import Override
from cdfctl.scenario.plant import PLANTS, KinematicConfig, MujocoConfig
from cdfctl.scenario.problems import ScenarioErrors
from cdfctl.scenario.reference import json_schema

BODY = """\
version: 1
name: arm
robot: {name: planar, q0: [0.0, 0.0]}
task: {type: joint-goal, goal: [1.0, 0.0]}
"""


def switch(name: str) -> Override:
    return Override(("plant",), name, f"--plant {name}", switch=True)


@pytest.fixture
def write(tmp_path: Path):
    def path(plant: str = "") -> Path:
        (tmp_path / "arm.yaml").write_text(BODY + plant)
        return tmp_path / "arm.yaml"

    return path


def test_short_is_long_and_none_is_the_integrator(write):
    assert load_scenario(write()).scenario.plant == KinematicConfig()
    short = load_scenario(write("plant: mujoco\n")).scenario
    assert short.plant == load_scenario(write("plant: {type: mujoco}\n")).scenario.plant == MujocoConfig(type="mujoco")


def test_a_dumped_plant_is_read_back(write, tmp_path: Path):
    scenario = load_scenario(write("plant: {type: mujoco, timestep: 0.001}\n")).scenario
    (tmp_path / "again.yaml").write_text(dump(scenario))
    assert load_scenario(tmp_path / "again.yaml").scenario == scenario


def test_a_switch_keeps_the_options_of_its_own_type_only(write):
    path = write("plant: {type: mujoco, timestep: 0.001}\n")
    assert load_scenario(path, [switch("mujoco")]).scenario.plant == MujocoConfig(type="mujoco", timestep=0.001)
    assert load_scenario(path, [switch("kinematic")]).scenario.plant == KinematicConfig()
    short = load_scenario(write("plant: mujoco\n"), [switch("mujoco"), "plant.timestep=0.004"]).scenario
    assert short.plant == MujocoConfig(type="mujoco", timestep=0.004)


@pytest.mark.parametrize(
    ("plant", "message"),
    [
        ("plant: mujuco\n", "unknown type 'mujuco'"),
        ("plant: {type: mujoco, timestp: 1}\n", "unknown key 'timestp'"),
        ("plant: {type: kinematic, timestep: 0.1}\n", "unknown key 'timestep'"),
        ("plant: {type: mujoco, timestep: 0}\n", "must be greater than 0"),
        ("plant: 3\n", "expected a mapping, found 3"),
    ],
)
def test_what_is_refused(write, plant, message):
    with pytest.raises(ScenarioErrors) as caught:
        load_scenario(write(plant))
    assert message in str(caught.value)
    assert "plant" in str(caught.value)
    assert ":5:" in str(caught.value)


def test_a_switch_to_nothing_names_what_there_is(write):
    with pytest.raises(ScenarioErrors, match="--plant mujuco") as caught:
        load_scenario(write(), [switch("mujuco")])
    assert all(name in str(caught.value) for name in PLANTS)


def test_editors_take_both_forms():
    schema = json_schema()
    plant = {"$defs": schema["$defs"], **schema["properties"]["plant"]}
    for good in ("mujoco", "kinematic", {"type": "mujoco", "timestep": 0.001}, {"type": "kinematic"}):
        jsonschema.validate(good, plant)
    for bad in ("mujuco", 3, {"type": "mujoco", "timestep": 0}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(bad, plant)
