"""Groups, grids, approaches and mirrored draws, against their definition; and what a file may not say of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.errors import InputError
from cdfctl.scenario import draw, dump, load_scenario
from cdfctl.scenario.draws import sources
from cdfctl.scenario.placing import ApproachConfig, GridConfig
from cdfctl.scenario.wording import validate
from cdfctl.scenario.yaml_loader import read

from .conftest import GOOD

finite = st.floats(-5.0, 5.0)
angle = st.floats(-math.pi, math.pi)


@given(st.tuples(finite, finite, finite), finite, st.floats(0.01, 5.0), angle, st.floats(-1.5, 1.5), finite)
def test_an_approach_is_nearest_when_and_where_it_says(through, time, speed, azimuth, elevation, offset):
    config = ApproachConfig(
        through=through, time=time, speed=speed, azimuth=azimuth, elevation=elevation, offset=offset
    )
    position, velocity = (np.array(x) for x in config.place())
    assert np.linalg.norm(velocity) == pytest.approx(speed)
    times = time + np.array([-2.0, -0.1, 0.0, 0.1, 2.0])
    gaps = np.linalg.norm(position + times[:, None] * velocity - np.array(through), axis=1)
    assert gaps.argmin() == 2 or gaps.min() == pytest.approx(gaps[2])
    assert gaps[2] == pytest.approx(abs(offset), abs=1e-9)
    left = np.cross([0.0, 0.0, 1.0], velocity)  # horizontal, to the left of the motion
    assert (position + time * velocity - np.array(through)) @ left == pytest.approx(
        offset * speed * math.cos(elevation), abs=1e-9
    )


def test_a_grid_has_its_first_copy_in_place():
    offsets = GridConfig(counts=(2, 1, 3), step=(0.5, 9.0, -0.25)).offsets()
    assert offsets[:3] == [(0.0, 0.0, -0.0), (0.5, 0.0, -0.0), (0.0, 0.0, -0.25)]
    assert len(set(offsets)) == 6


GROUP = GOOD.replace(
    "    position: [2.4, -2.4, 0.0]\n    velocity: [0.0, 0.5, 0.0]\n",
    """\
    count: 3
    grid: {counts: [1, 2, 1], step: [0.0, 0.5, 0.0]}
    approach: {time: {uniform: [1, 2]}, speed: 2.0, azimuth: 0.0, offset: {uniform: [3, 4], mirrored: true}}
  - shape: {type: ball, radius: 0.1}
    position: [9.0, 9.0, 0.0]
""",
)


def test_a_group_is_drawn_member_by_member(load):
    scenario = load(text=GROUP).scenario
    drawn = draw(scenario, 4, 2)
    stream = np.random.default_rng(np.random.SeedSequence(4, spawn_key=(2,)))
    expected = []
    for _ in range(3):
        time, size = 1.0 + stream.random(), 3.0 + stream.random()
        offset = -size if stream.random() < 0.5 else size
        expected += [(-2.0 * time, offset, 0.0), (-2.0 * time, offset + 0.5, 0.0)]
    assert np.array([o.position for o in drawn.obstacles[:6]]) == pytest.approx(np.array(expected))
    assert [o.name for o in drawn.obstacles] == [*(f"disc-1-{k}" for k in range(1, 7)), None]
    assert {o.velocity for o in drawn.obstacles[:6]} == {(2.0, 0.0, 0.0)}
    assert sources(scenario) == (0, 0, 0, 0, 0, 0, 1)


def test_mirrored_draws_have_both_signs(load):
    scenario = load(text=GROUP).scenario
    y = [draw(scenario, 0, trial).obstacles[0].position[1] for trial in range(200)]
    assert all(3.0 <= abs(value) <= 4.0 for value in y)
    assert 60 < sum(value < 0.0 for value in y) < 140


@pytest.mark.parametrize("name", ["X1", "X4"])
def test_a_scenario_with_groups_dumps_and_loads(name):
    scenario = load_scenario(name).scenario
    again, complaints = validate(read(dump(scenario)).data)
    assert again == scenario, complaints


def test_rules_need_someone_to_measure():
    with pytest.raises(InputError, match="depend on the robot's distances"):
        draw(load_scenario("X1").scenario, 0, 0)


# the obstacle's lines, field, message
APPROACH = "approach: {time: 1, speed: 1, azimuth: 0}"
MOTION = "position: [3, 0, 0]\n    motion: {type: sinusoid, amplitude: [0, 1, 0], frequency: 1}"
RULE = "redraw_within: {segment: {start: [0, 0, 0], end: [0, 0, 1], distance: 0.1}}"
CASES = [
    (f"position: [3, 0, 0]\n    {APPROACH}", "position", "position and approach exclude each other"),
    (f"velocity: [3, 0, 0]\n    {APPROACH}", "velocity", "velocity and approach exclude each other"),
    ("approach: {time: 1, speed: -1, azimuth: 0}", "approach.speed", "must be at least 0, found -1"),
    ("approach: {time: 1, azimuth: 0}", "approach.speed", "missing key 'speed'"),
    (f"{APPROACH}\n    count: 0", "count", "must be from 1 to 1000, found 0"),
    (f"{APPROACH}\n    count: {{uniform: [1, 2]}}", "count", "expected a whole number, found a mapping with uniform"),
    (f"{APPROACH}\n    grid: {{counts: [2, 2], step: [1, 1, 1]}}", "grid.counts", "expected a list of 3 whole numbers"),
    (f"{APPROACH}\n    grid: {{counts: 3.5, step: [1, 1, 1]}}", "grid.counts", "expected a list of 3 whole numbers"),
    (f"{APPROACH}\n    grid: {{counts: [900, 900, 1], step: [1, 1, 1]}}", "grid", "810000 obstacles are too many"),
    (f"{MOTION}\n    {RULE}", "redraw_within.segment", "segment and motion exclude each other"),
    (f"{APPROACH}\n    redraw_within: {{start: -1}}", "redraw_within.start", "must be at least 0, found -1"),
    (f"{APPROACH}\n    redraw_within: {{strat: 1}}", "redraw_within.strat", "unknown key 'strat'"),
    ("position: [{uniform: [-1, 2], mirrored: true}, 0, 0]", "position[0]", "a mirrored draw needs 0 <= a <= b"),
    ("position: [{uniform: [1, 2], mirrored: yes}, 0, 0]", "position[0]", "mirrored is true or left out"),
]


@pytest.mark.parametrize(("lines", "field", "message"), CASES)
def test_what_a_file_may_not_say(problems, lines, field, message):
    old = "    position: [2.4, -2.4, 0.0]\n    velocity: [0.0, 0.5, 0.0]\n"
    ((line, _, at, said, _),) = problems((old, f"    {lines}\n"))
    assert at == f"obstacles[0].{field}"
    assert said.startswith(message)
    assert line >= 10


def test_rules_that_speak_of_nothing(problems):
    reach = "type: reach\n  target: {shape: {type: ball, radius: 0.1}, position: [2, 2, 0]}"
    tail = "controller:"
    ((*_, field, message, _),) = problems(
        ("type: joint-goal\n  goal: [-2.7, 0.5]", reach), (tail, f"redraw_within: {{goal: 0.1}}\n{tail}")
    )
    assert (field, message) == ("redraw_within.goal", "a reach task has no goal pose")
    ((*_, field, message, _),) = problems(
        ("position: [2.4, -2.4, 0.0]\n    velocity: [0.0, 0.5, 0.0]", MOTION), (tail, f"{RULE}\n{tail}")
    )
    assert (field, message) == ("obstacles[0].motion", "segment and motion exclude each other")


def test_the_name_of_a_member_is_taken(problems):
    second = "  - {name: disc-1-2, shape: {type: ball, radius: 1}, position: [9, 9, 9]}\ncontroller:"
    ((_, _, field, message, _),) = problems(
        ("    position: [2.4", "    count: 2\n    position: [2.4"), ("controller:", second)
    )
    assert (field, message) == ("obstacles[1].name", "the name 'disc-1-2' is taken by obstacles[0]")
