"""Which pairs of a robot's own bodies can collide: against closed forms, dense grids and coal."""

from __future__ import annotations

import itertools
import json

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdfctl.robots.robot import load_robot
from cdfctl.robots.self_pairs import APART, candidate_pairs, find_pairs, self_pairs
from cdfctl.robots.stay_apart import reaches, stays_apart

MOST = 30_000


@pytest.fixture(scope="module")
def franka():
    return load_robot("franka")


def three_link_urdf(xml, length: float, limit: float, last: str = "revolute") -> tuple[str, ...]:
    """A ball of 0.1 m at the base, and one at the end of two links that fold in a plane."""
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    bounds = f'<limit lower="{-limit}" upper="{limit}" velocity="1" effort="1"/>'

    def joint(name, parent, child, x, kind):
        return (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{x} 0 0"/><axis xyz="0 0 1"/>{bounds}</joint>'
        )

    return (
        xml.link("base", ball),
        xml.link("arm", ""),
        xml.link("elbow", ball),
        xml.link("fore", ""),
        xml.link("hand", ball),
        joint("j1", "base", "arm", 0.0, "revolute"),
        joint("j2", "arm", "elbow", length, "revolute"),
        joint("j3", "elbow", "fore", 0.0, last),
        f'<joint name="j4" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="{length} 0 0"/></joint>',
    )


@pytest.mark.parametrize("limit", [0.5, 1.0, 1.2, 1.6])
def test_a_proof_agrees_with_the_closed_form(write_urdf, xml, limit):
    """Base and hand of two links of 1 m, folded by j2 + j3, are 2 cos((j2 + j3) / 2) apart, less both radii."""
    robot = load_robot(write_urdf(*three_link_urdf(xml, 1.0, limit)))
    least = 2.0 * np.cos(min(limit, np.pi / 2)) - 0.2
    pair = (0, 2)
    assert candidate_pairs(robot) == (pair,)
    assert reaches(robot, pair)[0].tolist() == [0, 1, 2]
    for distance in (least - 0.02, least + 0.02):
        assert stays_apart(robot, pair, distance, MOST)[0] == (distance < least)
    found = find_pairs(robot, (pair,))
    assert (found.apart == (pair,)) == (least > APART)


def test_a_sliding_joint_counts_its_travel(write_urdf, xml):
    """j3 slides along z: the ball beyond it can come no nearer than in the plane."""
    robot = load_robot(write_urdf(*three_link_urdf(xml, 1.0, 0.5, "prismatic")))
    joints, reach = reaches(robot, (0, 2))
    assert reach[joints == 2] == 1.0
    least = 2.0 * np.cos(0.25) - 0.2
    assert stays_apart(robot, (0, 2), least - 0.02, MOST)[0]
    assert not stays_apart(robot, (0, 2), least + 0.02, MOST)[0]
    assert stays_apart(robot, (0, 2), least - 0.02, 5) == (False, 5)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_a_body_moves_no_faster_than_the_reach_says(franka, seed):
    rng = np.random.default_rng(seed)
    q, step = rng.uniform(franka.lower, franka.upper), rng.uniform(-0.3, 0.3, franka.n)
    i, j = candidate_pairs(franka)[rng.integers(16)]
    joints, reach = reaches(franka, (i, j))
    a, b = (distance(franka, i, j, configuration) for configuration in (q, q + step))
    assert abs(a - b) <= reach @ np.abs(step[joints]) + 1e-6


def distance(robot, i: int, j: int, q) -> float:
    """coal, asked for one pair by hand."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, np.asarray(q))
    bodies = [robot.geometry.geometryObjects[k] for k in (i, j)]
    frames = [data.oMi[body.parentJoint] * body.placement for body in bodies]
    placed = [coal.Transform3s(frame.rotation, frame.translation) for frame in frames]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return coal.distance(bodies[0].geometry, placed[0], bodies[1].geometry, placed[1], request, result)


def test_proved_pairs_are_apart_at_the_nodes_of_a_dense_grid():
    robot = load_robot("ur10")
    known = self_pairs(robot)
    assert known.apart
    for i, j in known.apart:
        joints, _ = reaches(robot, (i, j))
        q = robot.home.copy()
        for values in itertools.product(*(np.linspace(robot.lower[k], robot.upper[k], 25) for k in joints)):
            q[joints] = values
            assert distance(robot, i, j, q) >= APART


def test_the_franka_s_pairs_are_all_but_neighbours_and_srdf(franka):
    known = self_pairs(franka)
    links = franka.geometry_links
    named = {frozenset((links[i], links[j])) for i, j in (*known.checked, *known.apart)}
    assert frozenset(("panda_link0", "panda_hand")) in named
    assert frozenset(("panda_link5", "panda_link7")) not in named
    assert frozenset(("panda_hand", "fingers")) not in named
    assert len(named) == 16
    assert known.within(0.02) == known.checked
    assert set(known.within(2 * APART)) == {*known.checked, *known.apart}


def test_bodies_that_overlap_nearly_everywhere_are_left_out(write_urdf, xml):
    big = '<collision><geometry><sphere radius="0.45"/></geometry></collision>'
    robot = load_robot(
        write_urdf(
            xml.link("base", big),
            xml.link("l1"),
            xml.link("l2", big),
            xml.joint("j1", "base", "l1"),
            xml.joint("j2", "l1", "l2"),
        )
    )
    pairs = candidate_pairs(robot)
    assert [(robot.geometry_links[i], robot.geometry_links[j]) for i, j in pairs] == [("base", "l2")]
    # two balls 1 m apart at most, folded by at most a radian and two fixed tilts: they meet in none of the samples
    assert find_pairs(robot, pairs).always == ()
    bigger = load_robot(
        write_urdf(
            *(xml.link(name, big.replace("0.45", "0.6")) for name in ("base", "l1", "l2")),
            xml.joint("j1", "base", "l1"),
            xml.joint("j2", "l1", "l2"),
        )
    )
    assert find_pairs(bigger, candidate_pairs(bigger)).always == candidate_pairs(bigger)


def test_the_answer_is_kept_and_a_damaged_file_is_not_believed(tmp_path, monkeypatch, write_urdf, xml):
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path / "cache"))
    path = write_urdf(*three_link_urdf(xml, 1.0, 1.2))
    first = self_pairs(load_robot(path))
    (file,) = (tmp_path / "cache" / "self-collision").iterdir()
    document = json.loads(file.read_text())
    assert document["apart"] == [[0, 2]]
    for text in ("", "{}", '{"key": 1}', json.dumps({**document, "apart": []}), json.dumps({**document, "checked": 3})):
        file.write_text(text)
        assert self_pairs(load_robot(path)) == first
    assert json.loads(file.read_text()) == document


def test_a_cache_that_cannot_be_written_changes_nothing(tmp_path, monkeypatch, write_urdf, xml):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path / "file"))
    assert self_pairs(load_robot(write_urdf(*three_link_urdf(xml, 1.0, 1.2)))).apart == ((0, 2),)
