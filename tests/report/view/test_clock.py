"""The clock of a replay."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.report.view.clock import Clock


def test_it_plays_at_its_speed_shows_the_end_and_begins_again():
    clock = Clock(speed=2.0)
    clock.tick(0.4, end=1.0)
    assert clock.t == pytest.approx(0.8)
    clock.tick(0.4, end=1.0)
    assert clock.t == 1.0
    clock.tick(0.4, end=1.0)
    assert (clock.t, clock.playing) == (0.0, True)


def test_without_repeat_it_stands_at_the_end_and_plays_from_the_beginning():
    clock = Clock(t=0.9, loop=False)
    for _ in range(3):
        clock.tick(0.4, end=1.0)
    assert (clock.t, clock.playing) == (1.0, False)
    clock.toggle(1.0)
    assert (clock.t, clock.playing) == (0.0, True)


def test_who_seeks_stops_it():
    clock = Clock()
    clock.go_to(0.3)
    clock.tick(1.0, end=1.0)
    assert (clock.t, clock.playing) == (0.3, False)


def test_a_run_that_goes_on_is_waited_for_at_its_end():
    clock = Clock(following=True)
    for end in (0.5, 0.5, 0.9):
        clock.tick(1.0, end)
        assert (clock.t, clock.playing) == (end, True)


@given(st.lists(st.floats(0.0, 10.0), max_size=30), st.floats(0.0, 5.0), st.booleans(), st.booleans())
def test_it_never_leaves_the_run(ticks, end, loop, following):
    clock = Clock(loop=loop, following=following)
    for elapsed in ticks:
        clock.tick(elapsed, end)
        assert 0.0 <= clock.t <= end
