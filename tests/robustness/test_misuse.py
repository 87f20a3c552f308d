"""The Python interface as it is misused: every call gives an answer that can be relied on, or a message."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import cdfctl
from cdfctl.errors import InputError

Q, U = (0.5, 0.5), (1.0, 1.0)
POSES, TWISTS = np.array([[1.0, 1.5, 0.0, 0.0, 0.0, 0.0, 1.0]]), np.array([[0.0, -1.0, 0.0, 0.0, 0.0, 0.0]])
BALL = cdfctl.Sphere(0.3)


@pytest.fixture(scope="module")
def planar() -> cdfctl.Robot:
    return cdfctl.load_robot("planar")


def ball(position: Any = (1.0, 1.5, 0.0), **more: Any) -> cdfctl.Obstacle:
    return cdfctl.Obstacle(BALL, position, **more)


def scene_of(poses: Any = POSES, twists: Any = TWISTS, names: Any = ("a",), shapes: Any = (BALL,)) -> cdfctl.Scene:
    return cdfctl.Scene.from_arrays(shapes, names, poses, twists)


@pytest.mark.parametrize(
    "parts",
    [
        {"names": ()},  # each of these led compiled code outside its arrays, or one pose to all obstacles
        {"shapes": (BALL, BALL)},
        {"poses": POSES[0]},
        {"poses": POSES[:, :6]},
        {"poses": POSES.repeat(2, axis=0)},
        {"twists": np.float64(1.0)},
    ],
)
def test_arrays_of_a_scene_that_do_not_fit_are_refused(parts: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="need as many names, poses"):
        scene_of(**parts)


@pytest.mark.parametrize("factor", [0.0, 1e-170, 0.4, 2.5, 1e200])
def test_an_orientation_that_is_none_does_not_hide_its_obstacle(planar: cdfctl.Robot, factor: float) -> None:
    """Of a zero quaternion no rotation can be made: every distance was NaN, and no row held."""
    scene = scene_of(POSES * [1, 1, 1, *[factor] * 4])
    with pytest.raises(InputError, match="orientation of obstacle 'a' is no unit quaternion"):
        cdfctl.SafetyFilter(planar).step(Q, scene, U)
    braking = cdfctl.SafetyFilter(planar, on_bad_input="brake")
    assert braking.step(Q, scene, U).status == "brake"
    assert braking.counts["bad-input"] == 1


def test_a_long_quaternion_is_normalised() -> None:
    np.testing.assert_allclose(ball(orientation=[0, 0, 1e300, 1e300]).orientation, [0, 0, 0.5**0.5, 0.5**0.5])


def test_numbers_without_bounds_are_refused_or_braked_for(planar: cdfctl.Robot) -> None:
    """Velocities whose products are no numbers any more."""
    fast = [1e300, -1e300, 0.0]
    scene = cdfctl.Scene([ball([1e150, 1.0, 0.0], velocity=fast, angular_velocity=fast)])
    with pytest.raises(InputError, match="too large"):
        cdfctl.SafetyFilter(planar).step(Q, scene, U)
    assert cdfctl.SafetyFilter(planar, on_bad_input="brake").step(Q, scene, U).status == "brake"


@pytest.mark.parametrize(
    "q",
    [
        np.array(Q),
        np.array(Q, dtype=object),
        np.array([0.5, 0.0, 0.5, 0.0])[::2],
        np.asfortranarray([Q, Q])[0],
        np.float32(Q),
        list(Q),
    ],
)
def test_any_array_of_the_right_numbers_is_taken_as_it_is(planar: cdfctl.Robot, q: Any) -> None:
    if isinstance(q, np.ndarray):
        q.flags.writeable = False
    expected = cdfctl.SafetyFilter(planar).step(Q, scene_of(), U).u
    assert np.array_equal(cdfctl.SafetyFilter(planar).step(q, scene_of(), U).u, expected)


REFUSED: list[Callable[[cdfctl.Robot], object]] = [
    lambda robot: cdfctl.SafetyFilter(robot).step([10**400, 0.5], scene_of(), U),
    lambda robot: cdfctl.SafetyFilter(robot).step(np.ma.array(Q, mask=[True, False]), scene_of(), U),
    lambda robot: cdfctl.SafetyFilter(robot, dt="x"),  # type: ignore[arg-type]
    lambda robot: cdfctl.SafetyFilter(robot, dt=None),  # type: ignore[arg-type]
    lambda robot: cdfctl.SafetyFilter(robot, None),  # type: ignore[arg-type]
    lambda robot: cdfctl.SafetyFilter("planar"),  # type: ignore[arg-type]
    lambda robot: cdfctl.SafetyFilter(robot, alpha=1e300),
    lambda robot: cdfctl.Scene([1]),  # type: ignore[list-item]
    lambda robot: cdfctl.Obstacle(0.3, (0, 0, 0)),  # type: ignore[arg-type]
    lambda robot: ball(name=3),
    lambda robot: cdfctl.Sphere("wide"),  # type: ignore[arg-type]
    lambda robot: cdfctl.Sphere(10**400),
    lambda robot: cdfctl.Capsule(None, 1.0),  # type: ignore[arg-type]
    lambda robot: cdfctl.ConvexMesh([[1, 2, 3], [1, 2]]),
    lambda robot: cdfctl.PointCloud([["x"]]),
    lambda robot: cdfctl.load_robot(None),  # type: ignore[arg-type]
    lambda robot: cdfctl.load_robot("a\0b.urdf"),
]


@pytest.mark.parametrize("call", REFUSED)
def test_what_makes_no_sense_is_said(planar: cdfctl.Robot, call: Callable[[cdfctl.Robot], object]) -> None:
    with pytest.raises(InputError):
        call(planar)


def test_numbers_of_numpy_are_parameters(planar: cdfctl.Robot) -> None:
    assert cdfctl.SafetyFilter(planar, alpha=np.float32(3), sheets=np.int64(2)).parameters.sheets == 2


def test_a_step_while_another_thread_is_in_one_is_refused(planar: cdfctl.Robot) -> None:
    """A scene that does not come back until the other thread has tried: no race decides this test."""
    safe, said, inside, go_on = cdfctl.SafetyFilter(planar), [], threading.Event(), threading.Event()

    class Slow:
        def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
            inside.set()
            assert go_on.wait(60)
            return np.array(Q)

    def step() -> None:
        said.append(safe.step(Slow(), scene_of(), U).status)  # type: ignore[arg-type]

    other = threading.Thread(target=step)
    other.start()
    assert inside.wait(60)
    with pytest.raises(InputError, match="another thread"):
        safe.step(Q, scene_of(), U)
    go_on.set()
    other.join()
    assert said == ["optimal"]
    assert safe.step(Q, scene_of(), U).status == "optimal"


def test_a_filter_a_thread_gives_the_answers_of_one_alone() -> None:
    robot, rng = cdfctl.load_robot("franka"), np.random.default_rng(0)
    scenes = [
        cdfctl.Scene([cdfctl.Obstacle(cdfctl.Box((0.2, 0.1, 0.3)), p, o, v) for p, o, v in parts])
        for parts in zip(*(rng.normal(size=(12, 3, k)) * 0.5 for k in (3, 4, 3)), strict=True)
        for parts in [zip(*parts, strict=True)]
    ]

    def loop(order: int) -> list[bytes]:
        safe = cdfctl.SafetyFilter(robot, self_collision=4)
        return [safe.step(robot.home, scene, np.ones(7)).u.tobytes() for scene in scenes[::order]]

    alone, together = {order: loop(order) for order in (1, -1)}, {}
    threads = [threading.Thread(target=lambda k=k: together.update({k: loop(k)})) for k in alone]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == alone
