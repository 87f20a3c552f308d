"""Draws: the same for a seed and trial, whatever the controller; and the text that a scenario dumps to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.errors import InputError
from cdfctl.scenario import Scenario, Uniform, draw, dump, floats, has_draws, load_scenario, number, resolve
from cdfctl.scenario.values import MOST
from cdfctl.scenario.wording import validate
from cdfctl.scenario.yaml_loader import read


def leaves(value: Any) -> list[float]:
    if isinstance(value, dict):
        return [x for item in value.values() for x in leaves(item)]
    if isinstance(value, list | tuple):
        return [x for item in value for x in leaves(item)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("name", ["S3", "C2"])
def test_draws_are_the_stream_of_the_trial_in_order(name):
    scenario = load_scenario(name).scenario
    drawn = draw(scenario, seed=5, trial=17)
    stream = np.random.default_rng(np.random.SeedSequence(5, spawn_key=(17,)))
    for before, after in zip(scenario.obstacles, drawn.obstacles, strict=True):
        for field in ("position", "velocity"):
            for x, y in zip(getattr(before, field), getattr(after, field), strict=True):
                if isinstance(x, Uniform):
                    low, high = x.uniform
                    assert y == low + (high - low) * stream.random()
                    assert low <= y <= high
                else:
                    assert y == x
    assert not has_draws(drawn)
    assert drawn.seed == 5


def test_a_known_draw():
    drawn = draw(load_scenario("S1").scenario, seed=0, trial=0)
    expected = [1.5 + 2 * u for u in np.random.default_rng(np.random.SeedSequence(0, spawn_key=(0,))).random(2)]
    assert drawn.obstacles[0].position == (*expected, 0.0)


def test_trials_and_seeds_differ_and_repeat():
    scenario = load_scenario("C1").scenario
    set_ups = {(s, t): draw(scenario, s, t).obstacles for s in range(3) for t in range(20)}
    assert len(set(set_ups.values())) == 60
    assert draw(scenario, 2, 19).obstacles == set_ups[2, 19]


def test_the_controller_changes_nothing():
    one = load_scenario("C2").scenario
    other = load_scenario("C2", ["controller={variant: sdf-cbf-qp, alpha: 3, effort_weight: 2}"]).scenario
    for trial in range(5):
        a, b = draw(one, 1, trial), draw(resolve(other), 1, trial)
        assert (a.robot, a.task, a.obstacles) == (b.robot, b.task, b.obstacles)


def test_the_order_of_keys_changes_nothing(load):
    forward = load(("[2.4, -2.4, 0.0]", "[{uniform: [0, 1]}, 0, 0]"), ("[0.0, 0.5, 0.0]", "[{uniform: [0, 1]}, 0, 0]"))
    backward = load(
        ("    position: [2.4, -2.4, 0.0]\n", ""),
        (
            "    velocity: [0.0, 0.5, 0.0]",
            "    velocity: [{uniform: [0, 1]}, 0, 0]\n    position: [{uniform: [0, 1]}, 0, 0]",
        ),
    )
    assert draw(forward.scenario, 0, 0) == draw(backward.scenario, 0, 0)


def test_what_still_holds_draws_says_so():
    scenario = load_scenario("S1").scenario
    with pytest.raises(InputError, match="still holds a draw"):
        floats(scenario.obstacles[0].position)
    assert number(0.5) == 0.5
    with pytest.raises(InputError, match="trial must be at least 0"):
        draw(scenario, 0, -1)


reals = st.floats(-MOST, MOST)
ends = st.floats(-1e6, 1e6)
numbers = (
    reals
    | st.tuples(ends, ends).map(lambda ab: {"uniform": sorted(ab)})
    | st.tuples(ends, ends).map(lambda ab: {"uniform": sorted(map(abs, ab)), "mirrored": True})
)
positives = st.floats(0, MOST, exclude_min=True)
three = st.lists(numbers, min_size=3, max_size=3)
texts = st.text(st.characters(exclude_categories=["C", "Z"]) | st.just(" "), max_size=30) | st.sampled_from(
    [
        "no",
        "010",
        "1:30",
        "1e3",
        "0o7",
        "~",
        "null",
        "- a",
        "a: b",
        "#x",
        "'",
        '"',
        "\n",
        " a",
        "{",
        "*a",
        "&a",
        "1_0",
        "é",
    ]
)
shapes = st.one_of(
    st.fixed_dictionaries({"type": st.just("ball"), "radius": positives}),
    st.fixed_dictionaries({"type": st.just("box"), "size": st.lists(positives, min_size=3, max_size=3)}),
    st.fixed_dictionaries({"type": st.just("capsule"), "radius": positives, "length": positives}),
    st.fixed_dictionaries({"type": st.just("mesh"), "vertices": st.lists(three, min_size=4, max_size=5)}),
    st.fixed_dictionaries({"type": st.just("point-cloud"), "points": st.lists(three, min_size=1, max_size=3)}),
)
still = {"shape": shapes, "position": three}
bodies = st.one_of(
    st.fixed_dictionaries(still | {"velocity": three, "angular_velocity": three}),
    st.fixed_dictionaries(
        still
        | {"motion": st.fixed_dictionaries({"type": st.just("sinusoid"), "amplitude": three, "frequency": positives})}
    ),
    st.fixed_dictionaries(
        {
            "shape": shapes,
            "motion": st.fixed_dictionaries(
                {
                    "type": st.just("waypoints"),
                    "times": st.just([0.0, 1e-7]),
                    "positions": st.lists(three, min_size=2, max_size=2),
                }
            ),
        }
    ),
)


@st.composite
def scenarios(draw_: st.DrawFn) -> Scenario:
    n = draw_(st.integers(1, 4))
    vectors = st.lists(numbers, min_size=n, max_size=n)
    data = {
        "version": 1,
        "name": draw_(st.sampled_from(["a", "no", "010", "1e3", "S1", "true", "12"])),
        "description": draw_(texts),
        "robot": {
            "name": "planar",
            "q0": draw_(vectors),
            "lock": draw_(st.dictionaries(st.sampled_from("ab1"), reals)),
        },
        "task": draw_(
            st.fixed_dictionaries({"type": st.just("joint-goal"), "goal": vectors})
            | st.fixed_dictionaries({"type": st.just("hold"), "pose": vectors})
            | st.fixed_dictionaries({"type": st.just("reach"), "target": bodies})
        ),
        "obstacles": draw_(st.lists(bodies, max_size=3)),
        "controller": draw_(st.fixed_dictionaries({}, optional={"alpha": positives, "effort_weight": positives})),
        "assumptions": draw_(st.lists(texts, max_size=3)),
        "seed": draw_(st.integers(0, 2**53 - 1)),
    }
    scenario, complaints = validate(data)
    assert scenario is not None, complaints
    return scenario


@settings(max_examples=40)  # three documents each, read twice by a slow reader
@given(scenarios(), st.integers(0, 2**32), st.integers(0, 10**6))
def test_dump_loads_back_to_an_equal_scenario(scenario, seed, trial):
    for version in (scenario, resolve(scenario), draw(resolve(scenario), seed, trial)):
        text = dump(version)
        document = read(text)
        assert not document.problems
        again, complaints = validate(document.data)
        assert again == version, complaints
        # A plain YAML 1.1 reader sees the same numbers and texts.
        assert leaves(yaml.safe_load(text)) == leaves(version.model_dump(mode="json", exclude_none=True))


@given(scenarios(), st.integers(0, 2**32), st.integers(0, 10**6))
def test_draws_stay_within_bounds(scenario, seed, trial):
    drawn = draw(scenario, seed, trial)
    assert not has_draws(drawn)
    assert drawn == draw(scenario, seed, trial)
    for before, after in zip(scenario.robot.q0, drawn.robot.q0, strict=True):
        if isinstance(before, Uniform):
            assert before.uniform[0] <= (abs(after) if before.mirrored else after) <= before.uniform[1]
        else:
            assert before == after
