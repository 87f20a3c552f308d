"""Sweeps: how their values are read, and what is refused."""

from __future__ import annotations

import pytest

from cdfctl.benchmark.sweep import combinations, label, parse_sweep
from cdfctl.errors import InputError


def test_values_are_yaml_and_lists_keep_their_commas() -> None:
    settings = parse_sweep("robot.q0=[0, 1],[2.5, {uniform: [0, 1]}]")
    assert [s.override.value for s in settings] == [[0, 1], [2.5, {"uniform": [0, 1]}]]
    assert [s.override.path for s in settings] == [("robot", "q0")] * 2
    assert [s.override.value for s in parse_sweep("controller.alpha=1, 2.5,1e-3")] == [1, 2.5, 1e-3]


def test_several_make_a_grid_the_last_changing_fastest() -> None:
    grid = combinations(["controller.alpha=1,2", "simulation.dt=0.1,0.05"])
    assert [label(c) for c in grid] == ["alpha=1,dt=0.1", "alpha=1,dt=0.05", "alpha=2,dt=0.1", "alpha=2,dt=0.05"]
    assert combinations([]) == ((),)
    (both,) = combinations(["obstacles[0].shape.radius=1", "obstacles[1].shape.radius=1"])
    assert label(both) == "obstacles[0].shape.radius=1,obstacles[1].shape.radius=1"


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["controller.alpha"], "expected FIELD=a,b,c"),
        (["controller.alpha=1,,2"], "the value is missing"),
        (["controller.alpha="], "the value is missing"),
        (["controller.alpha=,"], "the value is missing"),
        (["controller.alpha=1,1"], "the same value twice"),
        (["..=1"], "not the path of a field"),
        (["controller.alpha=1", "controller.alpha=2"], "given twice"),
        (["seed=1,2"], "an option of its own"),
        (["controller.variant=a"], "an option of its own"),
    ],
)
def test_malformed(texts: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        combinations(texts)
