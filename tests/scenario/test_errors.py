"""Every kind of mistake in a file: where it is placed, what is said, all of them at once."""

from __future__ import annotations

import pickle
import time

import pytest

from cdfctl.scenario import ScenarioErrors, load_scenario
from cdfctl.scenario.library import MAX_BYTES

from .conftest import GOOD

BALL = "{type: ball, radius: 0.3}"
SHAPES = "allowed: ball, box, capsule, cylinder, mesh, point-cloud"

# edit, line, column, field, message, part of the hint
CASES = [
    (("gain: 9.9", "gian: 9.9"), 16, 3, "controller.gian", "unknown key 'gian'", "did you mean gain?"),
    (
        ("    velocity:", "    velocty:"),
        13,
        5,
        "obstacles[0].velocty",
        "unknown key 'velocty'",
        "did you mean velocity?",
    ),
    (("radius: 0.3", "radus: 0.3"), 11, 25, "obstacles[0].shape.radus", "unknown key 'radus'", "did you mean radius?"),
    (("version: 1\n", ""), 1, 1, "version", "missing key 'version'", "version of the format"),
    (("  goal: [-2.7, 0.5]\n", ""), 6, 1, "task.goal", "missing key 'goal'", "rad"),
    (("  type: joint-goal\n", ""), 6, 1, "task.type", "missing key 'type'", "allowed: joint-goal, hold, reach"),
    (("joint-goal", "jointgoal"), 7, 9, "task.type", "unknown type 'jointgoal'", "did you mean joint-goal?"),
    (("type: ball", "type: sphere"), 11, 19, "obstacles[0].shape.type", "unknown type 'sphere'", f"ball? {SHAPES}"),
    (("type: ball, ", ""), 11, 5, "obstacles[0].shape.type", "missing key 'type'", SHAPES),
    ((BALL, "ball"), 11, 12, "obstacles[0].shape", "expected a mapping, found text 'ball'", None),
    (("gain: 9.9", 'gain: "1.0"'), 16, 9, "controller.gain", "expected a number, found text '1.0'", "no quotes"),
    (("gain: 9.9", "gain: 90deg"), 16, 9, "controller.gain", "expected a number, found text '90deg'", "radians"),
    (("gain: 9.9", "gain: '1,5'"), 16, 9, "controller.gain", "expected a number, found text '1,5'", "after a point"),
    (("gain: 9.9", "gain: 1:30"), 16, 9, "controller.gain", "expected a number, found text '1:30'", "written out"),
    (("gain: 9.9", "gain: true"), 16, 9, "controller.gain", "expected a number, found true", None),
    (("gain: 9.9", "gain: [1]"), 16, 9, "controller.gain", "expected a number, found a list of 1", None),
    (("gain: 9.9", "gain: 0"), 16, 9, "controller.gain", "must be greater than 0, found 0", None),
    (("gain: 9.9", "gain: .inf"), 16, 9, "controller.gain", "expected a finite number, found inf", None),
    (("gain: 9.9", "gain: 1" + "0" * 390), 16, 9, "controller.gain", "expected a finite number, found inf", None),
    (("gain: 9.9", "gain: " + "1" * 500), 16, 9, "controller.gain", "a number of 500 characters", None),
    (
        ("gain: 9.9", "gain: 010"),
        16,
        9,
        "controller.gain",
        "'010' is ambiguous: octal for some readers",
        "without the zero",
    ),
    (("gain: 9.9", "gain:"), 16, 8, "controller.gain", "the key 'gain' has no value", "remove the key"),
    (("gain: 9.9", "gain: 9.9\n  gain: 4"), 17, 3, "controller.gain", "duplicate key 'gain'", "first given on line 16"),
    (("gain: 9.9", "gain: {uniform: [1, 2]}"), 16, 9, "controller.gain", "expected one number", "draws are for"),
    (
        ("gain: 9.9", "gain: 1\n  links: yes"),
        17,
        10,
        "controller.links",
        "unknown value 'yes'",
        "allowed: nearest, all",
    ),
    (("gain: 9.9", "sheets: 1.0"), 16, 11, "controller.sheets", "expected a whole number, found 1.0", None),
    (("gain: 9.9", "sheets: 0"), 16, 11, "controller.sheets", "must be from 1 to 16, found 0", None),
    (("gain: 9.9", "effort_weight: [1, 2, 3]"), 16, 18, "controller.effort_weight", "expected 2 numbers", "a joint"),
    (("gain: 9.9", "effort_weight: [1, 0]"), 16, 22, "controller.effort_weight[1]", "must be greater than 0", None),
    (
        ("gain: 9.9", "effort_weight: x"),
        16,
        18,
        "controller.effort_weight",
        "expected a number or a list of numbers",
        "out",
    ),
    (("gain: 9.9", "<<: {alpha: 1}"), 16, 3, "controller.<<", "unknown key '<<'", "merge keys"),
    (("sdf-tvcbf-qp", "sdf-tvcbf"), 15, 12, "controller.variant", "unknown controller 'sdf-tvcbf'", "sdf-cbf-qp"),
    (("sdf-tvcbf-qp", "[a]"), 15, 12, "controller.variant", "expected text, found a list of 1", "sdf-cbf-qp"),
    (("[2.5, 0.5]", "[2.5, .nan]"), 5, 13, "robot.q0[1]", "expected a finite number, found nan", None),
    (("[2.5, 0.5]", "[2.5, 1e999]"), 5, 13, "robot.q0[1]", "expected a finite number, found inf", None),
    (("[2.5, 0.5]", "2.5"), 5, 7, "robot.q0", "expected a list of numbers, found 2.5", None),
    (("[2.5, 0.5]", "[]"), 5, 7, "robot.q0", "expected at least 1 numbers, found an empty list", None),
    (("[-2.7, 0.5]", "[1, 2, 3]"), 8, 9, "task.goal", "expected 2 numbers, as many as robot.q0, found 3", "a joint"),
    (("radius: 0.3", "radius: -0.3"), 11, 33, "obstacles[0].shape.radius", "must be greater than 0, found -0.3", None),
    (("2.4, -2.4, 0.0", "2.4, -2.4"), 12, 15, "obstacles[0].position", "expected a list of 3 numbers", None),
    (("2.4, -2.4", "{uniform: [2, 1]}, 0"), 12, 16, "obstacles[0].position[0]", "uniform needs a <= b", None),
    (("2.4, -2.4", "{uniform: [2]}, 0"), 12, 16, "obstacles[0].position[0]", "uniform needs two numbers", None),
    (("2.4, -2.4", "{uniform: 2}, 0"), 12, 16, "obstacles[0].position[0]", "uniform needs two numbers", None),
    (
        ("2.4, -2.4", "{unifrom: [1, 2]}, 0"),
        12,
        16,
        "obstacles[0].position[0]",
        "expected a number, found a map",
        "draw is",
    ),
    (("2.4, -2.4", "{uniform: [-1e308, 1e308]}, 0"), 12, 16, "obstacles[0].position[0]", "must be within ±1e+12", None),
    (
        ("radius: 0.3", "radius: {uniform: [-1, 1]}"),
        11,
        33,
        "obstacles[0].shape.radius",
        "must be greater than 0",
        None,
    ),
    (("    position: [2.4, -2.4, 0.0]\n", ""), 10, 5, "obstacles[0].position", "missing key 'position'", "origin"),
    (("name: planar", "nmae: planar"), 4, 3, "robot.nmae", "unknown key 'nmae'", "did you mean name?"),
    (("  name: planar\n", ""), 3, 1, "robot.name", "missing key 'name' or 'urdf'", "URDF"),
    (
        ("name: planar", "name: planar\n  lock: {a: x}"),
        5,
        13,
        "robot.lock.a",
        "expected a number, found text 'x'",
        None,
    ),
    (
        ("name: planar", "name: planar\n  package_dirs: [.]"),
        5,
        17,
        "robot.package_dirs",
        "package_dirs goes with urdf",
        None,
    ),
    (("name: planar", "urdf: no/such.urdf"), 4, 9, "robot.urdf", "no such file: no/such.urdf", "looked for"),
    (("name: planar", "name: ./arm.yaml"), 4, 9, "robot.name", "no such file: ./arm.yaml", "looked for"),
    ((BALL, "{type: mesh, file: a.stl}"), 11, 31, "obstacles[0].shape.file", "no such file: a.stl", "looked for"),
    ((BALL, "{type: mesh}"), 11, 5, "obstacles[0].shape.file", "missing key 'file' or 'vertices'", None),
    ((BALL, "{type: point-cloud, points: []}"), 11, 40, "obstacles[0].shape.points", "at least 1 point", None),
    ((BALL, "{type: mesh, vertices: [[0, 0, 0]]}"), 11, 35, "obstacles[0].shape.vertices", "at least 4 vertices", None),
    (("name: mine", "name: true"), 2, 7, "name", "expected text, found true", "quotes"),
    (("name: mine", 'name: "../x"'), 2, 7, "name", "a name is up to 64 letters", "run folder"),
    (("name: mine", "name: mine\nseed: -1"), 3, 7, "seed", "must be from 0 to", None),
    (("name: mine", "name: mine\nassumptions: all"), 3, 14, "assumptions", "expected a list of sentences", None),
    (("name: mine", "name: mine\nsimulation: {dt: 1e-9}"), 3, 18, "simulation.dt", "over 1,000,000 steps", "longer dt"),
    (
        ("name: mine", "name: mine\nsimulation: {dt: 30}"),
        3,
        1,
        "simulation.time_limit",
        "time_limit 20.0 s is shorter than one step",
        None,
    ),
    (("version: 1", "version: 0"), 1, 10, "version", "unknown version 0", "allowed: 1"),
    (("version: 1", 'version: "1"'), 1, 10, "version", "expected a whole number, found text '1'", "version 1"),
    (("version: 1", "version: true"), 1, 10, "version", "expected a whole number, found true", "version 1"),
    (("name: disc-1", "name: ''"), 10, 11, "obstacles[0].name", "expected text, found an empty one", None),
    (("name: disc-1", r'name: "a\e[31m"'), 10, 11, "obstacles[0].name", "must not hold control characters", None),
    (("  - name: disc-1", "  - 1: a\n    name: disc-1"), 10, 5, "obstacles[0]", "a key must be text, found '1'", '"1"'),
]


@pytest.mark.parametrize(("edit", "line", "column", "field", "message", "hint"), CASES, ids=lambda x: str(x)[:40])
def test_each_mistake_is_placed_and_named(problems, edit, line, column, field, message, hint):
    found = problems(edit)
    match = [p for p in found if p[2] == field]
    assert match, found
    assert match[0][:3] == (line, column, field)
    assert message in match[0][3]
    if hint is not None:
        assert hint in (match[0][4] or "")
    others = [p for p in found if p not in match]
    assert not others or field == "obstacles[0]", "one slip is one problem"


def test_time_limit_shorter_than_a_step(problems):
    (problem,) = problems(("name: mine", "name: mine\nsimulation: {dt: 3, time_limit: 2}"))
    assert problem[:3] == (3, 33, "simulation.time_limit")


# text, line, column, message
UNREADABLE = [
    ("", None, None, "the file is empty"),
    ("# nothing\n", None, None, "the file is empty"),
    ("- a\n", 1, 1, "expected a mapping, found a list of 1"),
    ("hello\n", 1, 1, "expected a mapping, found text 'hello'"),
    (GOOD.replace("  gain", "\tgain"), 16, 1, "a tab where YAML allows spaces only"),
    (GOOD.replace("gain: 9.9", "gain: !!python/object/apply:os.system [ls]"), 16, 9, "tags are not accepted"),
    (GOOD.replace("gain: 9.9", "gain: !!float 9"), 16, 9, "tags are not accepted, found 'float'"),
    (GOOD + "---\n" + GOOD, 17, 1, "more than one document"),
    (GOOD.replace("[-2.7, 0.5]", "[-2.7, 0.5"), 9, 10, "not valid YAML: expected ',' or ']'"),
    (GOOD.replace("name: mine", "name: a: b"), 2, 8, "a colon where none can stand"),
    (GOOD.replace("gain: 9.9", "gain: *b"), 16, 9, "found undefined alias 'b'"),
    (GOOD.replace("[-2.7, 0.5]", "&g [*g]"), 8, 9, "an anchor contains itself"),
    (GOOD.replace("[-2.7, 0.5]", "[" * 5000), 8, 39, "nested more than 32 levels deep"),
    (GOOD.replace("mine", "mi\0ne"), 2, 9, "character U+0000 is not allowed"),
    (GOOD.replace("gain: 9.9", "? [a]\n  : 1"), 16, 5, "a key must be text, found a list or a mapping"),
]


@pytest.mark.parametrize(("text", "line", "column", "message"), UNREADABLE, ids=lambda x: str(x)[-30:])
def test_what_is_not_yaml_is_placed_too(problems, text, line, column, message):
    (problem,) = problems(text=text)
    assert problem[:2] == (line, column)
    assert message in problem[3]


def test_all_problems_of_a_file_at_once_in_its_order(problems):
    found = problems(
        ("gain: 9.9", "gian: 9.9"),
        ("[-2.7, 0.5]", "[1, 2, 3]"),
        ("[2.5, 0.5]", '["2.5", .nan]'),
        ("radius: 0.3", "radius: -1"),
    )
    assert [p[0] for p in found] == [5, 5, 8, 11, 16]


def test_several_mistakes_of_one_body(problems):
    motion = "motion: {type: waypoints, times: [0, 1, 1], positions: [[0, 0, 0]]}"
    found = problems(
        ("    velocity: [0.0, 0.5, 0.0]", f"    velocity: [0, 1, 0]\n    {motion}\n    orientation: [0, 0, 0, 0]")
    )
    assert {p[2] for p in found} == {"obstacles[0].motion.positions", "obstacles[0].motion.times[2]"}
    motion = "motion: {type: waypoints, times: [0, 1], positions: [[0, 0, 0], [1, 0, 0]]}"
    found = problems(
        ("    velocity: [0.0, 0.5, 0.0]", f"    velocity: [0, 1, 0]\n    {motion}\n    orientation: [0, 0, 0, 0]")
    )
    assert [p[2] for p in found] == ["obstacles[0].position", "obstacles[0].velocity", "obstacles[0].orientation"]


def test_names_must_differ(problems):
    second = "  - name: disc-1\n    shape: {type: ball, radius: 1}\n    position: [9, 9, 9]\ncontroller:"
    (problem,) = problems(("controller:", second))
    assert problem[:3] == (14, 11, "obstacles[1].name")
    assert "taken by obstacles[0]" in problem[3]


def test_a_name_may_not_be_another_ones_place(problems):
    second = "  - shape: {type: ball, radius: 1}\n    position: [9, 9, 9]\ncontroller:"
    (problem,) = problems(("name: disc-1", "name: '1'"), ("controller:", second))
    assert problem[:3] == (10, 11, "obstacles[0].name")


def test_a_newer_version_is_the_only_thing_said(problems):
    (problem,) = problems(("version: 1", "version: 2"), ("gain: 9.9", "new_key: 9.9"))
    assert problem[:2] == (1, 10)
    assert "version 2 is newer" in problem[3]
    assert "update cdfctl" in problem[4]


def test_the_form_of_a_message(load):
    with pytest.raises(ScenarioErrors) as caught:
        load(("    velocity:", "    velocty:"))
    lines = str(caught.value).splitlines()
    assert lines[0].endswith("mine.yaml:13:5: error: unknown key 'velocty'")
    assert lines[1:3] == ["  field  obstacles[0].velocty", "  hint   did you mean velocity?"]
    assert lines[3] == "    13 |     velocty: [0.0, 0.5, 0.0]"
    assert lines[4].index("^") == lines[3].index("velocty")
    assert lines[5].startswith("1 problem in ")
    assert lines[5].endswith("mine.yaml; nothing was run.")
    assert caught.value.exit_status == 2


def test_a_long_line_is_cut_around_the_caret(load):
    with pytest.raises(ScenarioErrors) as caught:
        load(("name: mine", "name: mine\nassumptions: [" + "text, " * 200 + "7" + ", text" * 200 + "]"))
    excerpt, caret = str(caught.value).splitlines()[-3:-1]
    assert len(excerpt) < 130
    assert excerpt[caret.index("^")] == "7"


def test_many_problems_are_counted_not_listed(load):
    with pytest.raises(ScenarioErrors) as caught:
        load(("name: mine", "name: mine\nassumptions: [" + "7, " * 500 + "]"))
    assert str(caught.value).count("error:") == 50
    assert "... and 450 more" in str(caught.value)
    assert "500 problems in" in str(caught.value)


def test_control_characters_of_a_file_do_not_reach_the_terminal(load):
    with pytest.raises(ScenarioErrors) as caught:
        load(("gain: 9.9", r'"\e[31m": 1'))
    assert "\x1b" not in str(caught.value)


def test_a_bomb_of_aliases_is_refused_fast(problems):
    bomb = "a0: &a0 [x,x,x,x,x,x,x,x,x]\n"
    bomb += "".join(f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 30))
    begun = time.perf_counter()
    (problem,) = problems(text=bomb)
    assert "too large for a scenario" in problem[3]
    assert time.perf_counter() - begun < 5


def test_fifty_megabytes_are_refused_unread(load):
    bomb = "a: &a [" + "x," * 25_000_000 + "]\nb: [*a, *a]\n"
    begun = time.perf_counter()
    with pytest.raises(Exception, match="too large for a scenario"):
        load(text=bomb)
    assert time.perf_counter() - begun < 5


def test_values_without_end_are_refused(problems):
    (problem,) = problems(text="a: [" + "1," * (MAX_BYTES // 2 - 100) + "]\n")
    assert "more than 50,000 values" in problem[3]


def test_text_of_another_encoding(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_bytes(GOOD.replace("mine", "mi\xe9").encode("latin-1"))
    with pytest.raises(ScenarioErrors, match=r"mine\.yaml:2:9: error: not UTF-8 text: byte 0xE9"):
        load_scenario(path)
    path.write_bytes(GOOD.encode("utf-16"))
    with pytest.raises(ScenarioErrors, match=r"mine\.yaml:1:1: error: not UTF-8 text"):
        load_scenario(path)


def test_errors_survive_pickling(load):
    with pytest.raises(ScenarioErrors) as caught:
        load(("gain: 9.9", "gian: 9.9"))
    copy = pickle.loads(pickle.dumps(caught.value))
    assert str(copy) == str(caught.value)
    assert copy.problems == caught.value.problems
