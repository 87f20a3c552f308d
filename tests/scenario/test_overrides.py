"""Overrides by path, and what is said of those that are wrong."""

from __future__ import annotations

import pytest

from cdfctl.errors import InputError
from cdfctl.scenario import Override, ScenarioErrors, Uniform, load_scenario, parse_override, set_fields
from cdfctl.scenario.problems import parse_path, path_text


@pytest.mark.parametrize(
    ("override", "read", "value"),
    [
        ("robot.q0=[0,0]", lambda s: s.robot.q0, (0.0, 0.0)),
        ("obstacles[0].velocity=[0,1,0]", lambda s: s.obstacles[0].velocity, (0.0, 1.0, 0.0)),
        ("obstacles[0].velocity[0]=1e-3", lambda s: s.obstacles[0].velocity, (1e-3, 0.5, 0.0)),
        ("controller.alpha=3", lambda s: s.controller.alpha, 3.0),
        ("simulation.dt=0.05", lambda s: s.simulation.dt, 0.05),
        ("robot.limits.velocity.joint_1=1", lambda s: s.robot.limits.velocity, {"joint_1": 1.0}),
        ("obstacles=[]", lambda s: s.obstacles, ()),
        ("obstacles[0].shape={type: box, size: [1, 2, 3]}", lambda s: s.obstacles[0].shape.size, (1.0, 2.0, 3.0)),
        ("robot.q0[1]={uniform: [0, 1]}", lambda s: s.robot.q0[1], Uniform(uniform=(0.0, 1.0))),
        ("description=a = b", lambda s: s.description, "a = b"),
        ("controller.on_infeasible=fail", lambda s: s.controller.on_infeasible, "fail"),
    ],
)
def test_overrides(load, override, read, value):
    assert read(load(overrides=[override]).scenario) == value


def test_the_last_override_counts(load):
    assert load(overrides=["controller.alpha=3", "controller.alpha=4"]).scenario.controller.alpha == 4.0


def test_an_override_can_mend_a_file(load):
    assert load(("gain: 9.9", "gain: x"), overrides=["controller.gain=4"]).scenario.controller.gain == 4.0


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("controller.alhpa=3", "unknown key 'alhpa'"),
        ('controller.alpha="1"', "expected a number, found text '1'"),
        ("obstacles[3].velocity=[0,1,0]", "there is no obstacles[3]: the list has 1, counted from 0"),
        ("obstacles.velocity=1", "obstacles is a list"),
        ("robot.name.x=1", "robot.name is a single value, without fields"),
        ("robot.lock[0]=1", "robot.lock is not a list in the file"),
        ("obstacles[0].shape.size=[1]", "unknown key 'size'"),
        ("controller.alpha.b=3", "expected one number, found a mapping with b"),
        ("version=2", "version 2 is newer than this cdfctl reads"),
    ],
)
def test_what_is_wrong_is_said_under_the_overrides_name(load, override, message):
    with pytest.raises(ScenarioErrors) as caught:
        load(overrides=[override])
    (problem,) = caught.value.problems
    assert problem.origin == f"--set {override}"
    assert message in problem.message
    assert str(caught.value).startswith(f"--set {override}: error: ")
    assert str(caught.value).endswith("1 problem in the command line; nothing was run.")


def test_a_field_without_its_section_is_found(load):
    with pytest.raises(ScenarioErrors) as caught:
        load(overrides=["margin=0.1"])
    assert caught.value.problems[0].hint == "did you mean controller.margin?"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("controller.alpha", "expected FIELD=VALUE"),
        ("controller.alpha=", "the value is missing"),
        ("=3", "is not the path of a field"),
        ("a b=3", "is not the path of a field"),
        ("[0]=3", "is not the path of a field"),
        (".a=3", "is not the path of a field"),
        ("a..b=3", "is not the path of a field"),
        ("a[-1]=3", "is not the path of a field"),
        ("a[x]=3", "is not the path of a field"),
        (".".join("a" * 100) + "=3", "is not the path of a field"),
        ("robot.q0=[0,0", "not valid YAML"),
        ("simulation.dt=010", "ambiguous"),
        ("a=!!str 3", "tags are not accepted"),
        ("a=[" + "[" * 3000, "levels deep"),
    ],
)
def test_malformed_overrides(text, message):
    with pytest.raises(InputError) as caught:
        parse_override(text)
    assert caught.value.message.startswith(f"--set {text}: ")
    assert message in caught.value.message


def test_another_flag_is_named(load):
    with pytest.raises(ScenarioErrors, match="--controller nope: error: unknown controller 'nope'"):
        load(overrides=[Override(("controller", "variant"), "nope", "--controller nope")])


def test_paths_round_trip():
    for text in ("robot.q0", "obstacles[0].velocity[2]", "robot.limits.position.a_b-c/d[1]"):
        assert path_text(parse_path(text)) == text


def test_set_fields_validates_and_leaves_the_original():
    scenario = load_scenario("S1").scenario
    changed = set_fields(scenario, {"controller.alpha": 3, "obstacles[0].shape.radius": 0.5})
    assert (changed.controller.alpha, changed.obstacles[0].shape.radius) == (3.0, 0.5)
    assert scenario.controller.alpha is None
    with pytest.raises(ScenarioErrors, match=r"--sweep controller.alhpa=3: error: unknown key 'alhpa'"):
        set_fields(scenario, {"controller.alhpa": 3}, "--sweep")


def test_later_problems_name_the_override(load):
    file = load(overrides=["robot.q0=[9, 9]"])
    assert file.located("robot.q0[1]", "beyond its limit").origin == "--set robot.q0=[9, 9]"
    assert file.located("task.goal[1]", "beyond its limit").line == 8
    assert file.located("simulation.dt", "too long").line == 1
