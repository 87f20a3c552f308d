"""Finding scenarios; the shipped ones; what they say against what the paper prints."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys

import jsonschema
import pytest

from cdfctl.errors import InputError
from cdfctl.scenario import (
    VARIANTS,
    ScenarioErrors,
    check_runnable,
    dump,
    has_draws,
    json_schema,
    list_scenarios,
    load_scenario,
    reference,
    resolve,
)
from cdfctl.scenario.variants import defaults_of
from cdfctl.scenario.yaml_loader import read

from .conftest import GOOD

REAL = ["real-fast", "real-slow"]
NAMES = ["C1", "C2", "C3", "S1", "S2", "S3", "X1", "X2", "X3", "X4", "planar-1", "reach-collinear", "reach", *REAL]
POSE = (0.35, -0.32, -1.70, 0.18, 2.05, -0.20)


def test_what_is_shipped():
    assert [entry.name for entry in list_scenarios()] == NAMES
    assert all(entry.description for entry in list_scenarios())


@pytest.mark.parametrize("name", NAMES)
def test_shipped_scenarios(name):
    scenario = load_scenario(name).scenario
    assert scenario.name == name
    assert scenario.source
    assert scenario.assumptions
    assert scenario.controller.variant == ("cdf-tvcbf-tvclf-qp" if name.startswith("reach") else "dual-tvcbf-qp")
    check_runnable(scenario)
    assert has_draws(scenario) == (name[0] in "SCX")
    if name in REAL:
        return
    assert scenario.robot.limits.velocity == (1.0 if name in ("X3", "X4") else 2.0)
    assert (scenario.simulation.dt, scenario.simulation.time_limit) == (0.1, 20.0)
    if not name.startswith("reach"):
        assert scenario.controller.gain == (4.0 if scenario.robot.name == "franka" else 9.9)


def test_the_real_experiments_differ_in_their_speed_only():
    fast, slow = (load_scenario(name).scenario.model_dump() for name in REAL)
    for scenario, speed in ((fast, -0.15), (slow, -0.05)):
        for obstacle in scenario["obstacles"]:
            assert obstacle.pop("velocity") == (0.0, 0.0, speed)
        del scenario["name"], scenario["description"]
    assert fast == slow


@pytest.mark.parametrize("name", NAMES)
def test_json_schema_accepts_the_shipped(name):
    validator = jsonschema.Draft202012Validator(json_schema())
    validator.check_schema(json_schema())
    entry = next(e for e in list_scenarios() if e.name == name)
    validator.validate(read(entry.path.read_text(encoding="utf-8")).data)
    validator.validate(read(dump(resolve(load_scenario(name).scenario))).data)


@pytest.mark.parametrize(
    "edit",
    [
        ("gain: 9.9", "gian: 9.9"), ("gain: 9.9", "gain: '9.9'"), ("gain: 9.9", "gain:"),
        ("gain: 9.9", "gain: {uniform: [1, 2]}"),
        ("radius: 0.3", "radius: -1"), ("type: ball", "type: sphere"), ("2.4, -2.4, 0.0", "2.4, -2.4"),
        ("version: 1", "version: 2"),
        ("2.4, -2.4", "{unifrom: [1, 2]}, 0"), ("sdf-tvcbf-qp", "nope"),
    ],
)  # fmt: skip
def test_json_schema_refuses_what_the_loader_refuses(edit):
    validator = jsonschema.Draft202012Validator(json_schema())
    assert validator.is_valid(read(GOOD).data)
    assert not validator.is_valid(read(GOOD.replace(*edit)).data)


def test_planar_benchmarks_against_the_paper():
    bands = {name: [o.velocity for o in load_scenario(name).scenario.obstacles] for name in ("S1", "S2", "S3")}
    moving = {
        name: [(axis, v.uniform) for o in velocities for axis, v in enumerate(o) if not isinstance(v, float)]
        for name, velocities in bands.items()
    }
    assert moving["S1"] == [(0, (-4.0, -2.0))]
    assert moving["S2"] == [(0, (-5.0, -3.0)), (1, (3.0, 5.0))]
    assert moving["S3"] == [(0, (-3.0, -1.0)), (1, (1.0, 3.0)), (0, (1.0, 3.0))]
    boxes = [[x.uniform for x in o.position[:2]] for o in load_scenario("S3").scenario.obstacles]
    assert boxes == [[(1.5, 3.5)] * 2, [(1.5, 3.0), (-3.0, -1.5)], [(-3.0, -1.5)] * 2]


def test_franka_benchmarks_against_the_paper():
    c1, c2, c3 = (load_scenario(name).scenario for name in ("C1", "C2", "C3"))
    assert (c1.robot.q0, c1.task.goal) == ((-1.09, *POSE), (1.09, *POSE))
    assert (c2.robot.q0, c2.task.pose) == ((0.09, *POSE), (0.09, *POSE))
    assert (c3.robot, c3.task, c3.obstacles) == (c1.robot, c1.task, c2.obstacles)
    assert [o.velocity[1].uniform for o in c1.obstacles] == [(-0.8, -0.5)] * 2
    bands = [(-0.2, -0.1), (-0.4, -0.3), (-0.6, -0.5), (-0.8, -0.7), (-1.0, -0.9), (-0.9, -0.1)]
    assert [o.velocity[1].uniform for o in c2.obstacles] == bands
    for o in (*c1.obstacles, *c2.obstacles):
        assert [x.uniform for x in o.position] == [(0.3, 0.6), (0.6, 0.9), (0.5, 0.7)]
        assert o.shape.radius == 0.05
    beyond = c2.task.until.obstacles_beyond
    assert (beyond.axis, beyond.side, beyond.value) == ("y", "below", -0.3)


def test_resolve_writes_every_default():
    resolved = resolve(load_scenario("C1").scenario).controller
    assert all(getattr(resolved, name) is not None for name in defaults_of(resolved.variant))
    assert resolved.segments is None  # of no use to a controller that does not plan
    assert (resolved.alpha, resolved.margin, resolved.limit_alpha, resolved.slack_weight) == (3.0, 0.05, 3.0, 100.0)
    assert (resolved.on_infeasible, resolved.links, resolved.sheets) == ("least-violation", "all", 4)
    assert resolved.solver == "daqp"


def test_reach_is_valid_but_cannot_run_without_a_controller_for_it(monkeypatch):
    file = load_scenario("reach", ["controller.variant=sdf-tvcbf-qp"])
    others = {name: variant for name, variant in VARIANTS.items() if variant.task != "tvclf"}
    monkeypatch.setattr(sys.modules["cdfctl.scenario.resolve"], "VARIANTS", others)
    with pytest.raises(ScenarioErrors, match="task 'reach' is not available yet") as caught:
        file.check_runnable()
    (problem,) = caught.value.problems
    assert (problem.field, problem.hint) == ("task.type", "allowed: joint-goal, hold")
    with pytest.raises(InputError, match="task 'reach' is not available yet"):
        check_runnable(file.scenario)
    load_scenario("C2").check_runnable()


@pytest.mark.parametrize(
    ("source", "message", "hint"),
    [
        ("S9", "unknown scenario 'S9'", "allowed: C1"),
        ("c1", "unknown scenario 'c1'", "did you mean C1?"),
        ("", "'' is not the name of a scenario", "allowed: C1"),
        ("a\0b.yaml", "is not the name of a scenario", "allowed: C1"),
        ("mine", "unknown scenario 'mine'", "./mine.yaml"),
        ("mine.yml", "mine.yml: no such file", "did you mean mine.yaml?"),
        ("S1.yml", "S1.yml: no such file", "did you mean S1?"),
        ("no/where/other.yaml", "no/where/other.yaml: no such file", "go by name"),
        ("x" * 5000 + ".yaml", "no such file", "go by name"),
        ("./", "./: is a directory, not a scenario file", "scenario files in it: mine.yaml"),
    ],
)
def test_what_cannot_be_found(tmp_path, monkeypatch, source, message, hint):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(GOOD, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_scenario(source)
    assert message in caught.value.message
    assert hint in (caught.value.hint or "")


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unreadable to root")
def test_an_unreadable_file(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD, encoding="utf-8")
    path.chmod(0)
    with pytest.raises(InputError, match="cannot be read: Permission denied"):
        load_scenario(path)


def test_a_file_whose_reading_fails():
    # Reading the memory of our own process at address 0 fails for any user.
    if not os.path.exists("/proc/self/mem"):
        pytest.skip("no such file on this system")
    with pytest.raises(InputError, match="/proc/self/mem: cannot be read: "):
        load_scenario("/proc/self/mem")


def test_files_of_a_scenario_are_found_beside_it(tmp_path, monkeypatch, load):
    (tmp_path / "box.stl").write_text("", encoding="utf-8")
    monkeypatch.chdir("/")
    file = load(("{type: ball, radius: 0.3}", "{type: mesh, file: box.stl}"))
    assert file.scenario.obstacles[0].shape.file == str(tmp_path / "box.stl")


def test_every_field_is_described():
    rows = reference()
    assert len(rows) > 60
    for row in rows:
        assert row.description, row.path
        assert row.source or row.default is None, row.path
    by_path = {row.path: row for row in rows}
    assert by_path["controller.alpha"].default == 1.0
    assert by_path["controller.alpha"].unit == "1/s"
    assert by_path["simulation.dt"].source.startswith("paper")
    assert by_path["obstacles[].shape(ball).radius"].kind == "number or draw"
    assert by_path["robot.q0"].required


def test_a_controller_that_cannot_do_the_task(monkeypatch):
    reaching = dataclasses.replace(VARIANTS["sdf-cbf-qp"], name="reaching", task="tvclf")
    # By sys.modules: the package's function of the same name hides the module.
    monkeypatch.setattr(
        sys.modules["cdfctl.scenario.resolve"],
        "VARIANTS",
        {"reaching": reaching, "sdf-tvcbf-qp": VARIANTS["sdf-tvcbf-qp"]},
    )
    with pytest.raises(ScenarioErrors, match="controller 'sdf-tvcbf-qp' cannot do task 'reach'") as caught:
        load_scenario("reach", ["controller.variant=sdf-tvcbf-qp"]).check_runnable()
    (problem,) = caught.value.problems
    assert problem.field == "controller.variant"
    assert problem.hint == "controllers for it: reaching; tasks of sdf-tvcbf-qp: joint-goal, hold"


def test_the_room_imports_no_numerics_but_the_draws():
    heavy = {"pinocchio", "coal", "scipy", "numba", "cdfctl.robots"}
    code = f"import sys, cdfctl.scenario; print(sorted({heavy} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
