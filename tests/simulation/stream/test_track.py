"""One obstacle's measurements: what is believed, what it comes to, and how old it is."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdfctl.simulation.stream.message import Measurement, parse
from cdfctl.simulation.stream.track import FORGET, Track

POSE = np.array([9.0, 9.0, 9.0, 0.0, 0.0, 0.0, 1.0])
V = np.array([0.3, -0.2, 0.1])


def measured(t: float, position: Any, **more: Any) -> Measurement:
    line = json.dumps({"name": "ball", "t": t, "position": list(position), **more}).encode()
    found = parse(line)
    assert found is not None
    return found


def track() -> Track:
    return Track(POSE, max_speed=3.0)


def test_nothing_is_known_before_two_measurements() -> None:
    """One position has no velocity; one with a velocity is enough."""
    known = track()
    assert known.age(0.0) == np.inf
    np.testing.assert_array_equal(known.pose(5.0), POSE)
    assert known.offer(measured(100.0, [0, 0, 0]), 0.0) is None
    assert known.age(0.0) == np.inf
    assert known.offer(measured(100.02, 0.02 * V), 0.02) is None
    assert known.age(0.02) == pytest.approx(0.0, abs=1e-9)
    given_one = track()
    given_one.offer(measured(7.0, [0, 0, 0], velocity=V.tolist()), 1.0)
    assert given_one.age(1.05) == pytest.approx(0.05)


@given(st.floats(-1e6, 1e6), st.lists(st.floats(0.003, 0.04), min_size=4, max_size=30), st.floats(0.0, 0.3), st.data())
def test_velocity_and_place_of_straight_motion(epoch: float, steps: list[float], ahead: float, data: Any) -> None:
    """By differences, whatever the sender's clock says the time is; then it is moved on."""
    known, t = track(), 0.0
    for step in [0.0, *steps]:
        t += step
        assert known.offer(measured(epoch + t, V * t), t) is None
    np.testing.assert_allclose(known.twist()[:3], V, atol=1e-5)
    np.testing.assert_allclose(known.pose(t + ahead)[:3], V * (t + ahead), atol=1e-5)


def test_a_turn_is_estimated_and_kept_up() -> None:
    w = np.array([0.0, 0.0, 2.0])
    known = track()
    for k in range(10):
        t = 0.01 * k
        quaternion = [0.0, 0.0, float(np.sin(t)), float(np.cos(t))]  # a turn by 2 t about z
        known.offer(measured(t, [0, 0, 0], orientation=quaternion), t)
    np.testing.assert_allclose(known.twist()[3:], w, atol=1e-9)
    np.testing.assert_allclose(known.pose(0.5)[3:], [0, 0, np.sin(0.5), np.cos(0.5)], atol=1e-9)


def test_noise_of_a_millimetre_is_not_a_metre_a_second() -> None:
    rng, known = np.random.default_rng(0), track()
    worst = 0.0
    for k in range(300):
        t = 0.002 * k
        known.offer(measured(t, V * t + rng.normal(0.0, 1e-3, 3)), t)
        if t > 0.1:
            worst = max(worst, float(np.abs(known.twist()[:3] - V).max()))
    assert worst < 0.15  # difference of two neighbours: up to 2 m/s


def test_a_delayed_message_is_as_old_as_it_is() -> None:
    """The least delay sets the clocks against each other; a message that takes 80 ms more is 80 ms old on arrival."""
    known = track()
    for k in range(10):
        known.offer(measured(50.0 + 0.01 * k, V * 0.01 * k, velocity=[0, 0, 0]), 0.01 * k)
    assert known.offer(measured(50.10, V * 0.1, velocity=[0, 0, 0]), 0.18) is None
    assert known.age(0.18) == pytest.approx(0.08, abs=1e-3)


def test_lies() -> None:
    known = track()
    for k in range(6):
        assert known.offer(measured(0.01 * k, V * 0.01 * k), 0.01 * k) is None
    pose = known.pose(0.05)
    assert known.offer(measured(0.06, [1.0, 0.0, 0.0]), 0.06) == "jump"  # a metre in 10 ms
    assert known.offer(measured(0.06, [0, 0, 0], velocity=[4.0, 0.0, 0.0]), 0.06) == "jump"  # or so it says
    assert known.offer(measured(0.05, [0, 0, 0]), 0.06) == "backward"
    assert known.offer(measured(0.02, [0, 0, 0]), 0.06) == "backward"
    assert known.offer(measured(30.0, [0, 0, 0]), 0.06) == "backward"  # from the future
    np.testing.assert_array_equal(known.pose(0.05), pose)  # none of it left a trace
    assert known.age(0.06) == pytest.approx(0.01, abs=1e-4)
    assert known.offer(measured(0.06, V * 0.06), 0.06) is None


def test_a_track_begins_anew_after_a_second() -> None:
    """A sensor that was started again, or found its object elsewhere, is believed again; till then the arm stood."""
    known = track()
    for k in range(6):
        known.offer(measured(100.0 + 0.01 * k, V * 0.01 * k), 0.01 * k)
    assert known.offer(measured(1.0, [2.0, 0, 0]), 0.5) == "backward"
    later = 0.05 + FORGET + 0.01
    assert known.offer(measured(1.5, [2.0, 0, 0]), later) is None
    assert known.age(later) == np.inf  # no velocity yet
    assert known.offer(measured(1.52, [2.0, 0, 0]), later + 0.02) is None
    np.testing.assert_allclose(known.pose(later + 0.02)[:3], [2.0, 0, 0])


GARBAGE = [
    b"",
    b"{",
    b"[]",
    b"3",
    b"null",
    b'"ball"',
    b"\xff\xfe",
    b"[" * 100_000,
    b'{"name": "ball", "t": 0}',
    b'{"name": "ball", "position": [0, 0, 0]}',
    b'{"t": 0, "position": [0, 0, 0]}',
    b'{"name": 3, "t": 0, "position": [0, 0, 0]}',
    b'{"name": "ball", "t": "0", "position": [0, 0, 0]}',
    b'{"name": "ball", "t": true, "position": [0, 0, 0]}',
    b'{"name": "ball", "t": NaN, "position": [0, 0, 0]}',
    b'{"name": "ball", "t": 1e999, "position": [0, 0, 0]}',
    b'{"name": "ball", "t": 0, "position": [0, 0]}',
    b'{"name": "ball", "t": 0, "position": [0, 0, NaN]}',
    b'{"name": "ball", "t": 0, "position": [0, 0, -Infinity]}',
    b'{"name": "ball", "t": 0, "position": [0, 0, "1"]}',
    b'{"name": "ball", "t": 0, "position": {"x": 1}}',
    b'{"name": "ball", "t": 0, "position": [0, 0, 0], "velocty": [0, 0, 0]}',
    b'{"name": "ball", "t": 0, "position": [0, 0, 0], "velocity": null}',
    b'{"name": "ball", "t": 0, "position": [0, 0, 0], "orientation": [0, 0, 0, 0]}',
    b'{"name": "ball", "t": 0, "position": [0, 0, 1' + b"0" * 400 + b"]}",
]


@pytest.mark.parametrize("line", GARBAGE, ids=range(len(GARBAGE)))
def test_garbage_is_no_measurement(line: bytes) -> None:
    assert parse(line) is None


@given(st.binary(max_size=200))
def test_no_bytes_do_harm(line: bytes) -> None:
    assert parse(line) is None
