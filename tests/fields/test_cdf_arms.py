"""The configuration-space distance of real arms: brute force, coal, and joints of every kind."""

from __future__ import annotations

import json
import math
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

from cdfctl import Box, Capsule, ConvexMesh, Cylinder, Obstacle, PointCloud, Scene, Sphere, load_robot, make_field
from cdfctl.errors import InputError
from cdfctl.robots.coal_geometry import coal_shape
from cdfctl.types import Shape

TRUTH = json.loads((Path(__file__).parent / "truth" / "franka_cdf.json").read_text())

SLIDER = """
<robot name="slider">
  <link name="base"/>
  <link name="cart"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="tool"><collision><origin xyz="0.5 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="turn" type="continuous"><parent link="cart"/><child link="tool"/><axis xyz="0 0 1"/>
    <limit effort="1" velocity="1"/></joint>
</robot>
"""


def shape_of(data: dict) -> Shape:
    match data["type"]:
        case "ball":
            return Sphere(data["radius"])
        case "box":
            return Box(tuple(data["size"]))
        case "capsule":
            return Capsule(data["radius"], data["length"])
        case _:
            return Cylinder(data["radius"], data["length"])


def obstacle_of(data: dict) -> Obstacle:
    return Obstacle(shape_of(data["shape"]), data["position"], data["orientation"])


def least_by_coal(robot, q, obstacle) -> float:
    """Least signed distance of the moving links, by Pinocchio and coal."""
    data, request = robot.model.createData(), coal.DistanceRequest(True, True)
    request.gjk_tolerance = request.epa_tolerance = 1e-10
    pin.forwardKinematics(robot.model, data, q)
    x, y, z, w = obstacle.orientation
    pose = coal.Transform3s(pin.Quaternion(w, x, y, z).toRotationMatrix(), obstacle.position)
    distances = []
    for g in robot.geometry.geometryObjects:
        if g.parentJoint > 0:
            placement = data.oMi[g.parentJoint] * g.placement
            here, result = coal.Transform3s(placement.rotation, placement.translation), coal.DistanceResult()
            distances.append(coal.distance(g.geometry, here, coal_shape(obstacle.shape), pose, request, result))
    return min(distances)


@pytest.fixture(scope="module")
def franka():
    return load_robot("franka")


def test_franka_against_brute_force(franka) -> None:
    """48 pairs of ball, box, capsule, cylinder; a sixth in penetration. See truth/make_cdf_truth.py."""
    field = make_field("cdf", franka)
    errors = []
    for pair in TRUTH["pairs"]:
        q, obstacle = np.array(pair["q"]), obstacle_of(pair["obstacle"])
        field.reset()
        answer = field.query(q, Scene([obstacle]))
        assert (answer.d[0] < 0.0) == pair["penetrating"]
        assert np.isfinite(answer.d[0])
        assert abs(least_by_coal(franka, answer.contact_q[0], obstacle)) <= 1e-4
        errors.append(answer.d[0] - pair["d"])
    # Cold queries without a table: the hardest case.
    assert np.mean(np.abs(errors)) <= 0.005
    assert np.quantile(np.abs(errors), 0.95) <= 0.02


def test_franka_warm_queries_stay_at_the_truth_along_a_motion(franka) -> None:
    """A ball flies by; every tenth answer is compared with the best of cold queries around it."""
    rng = np.random.default_rng(3)
    field, cold = make_field("cdf", franka), make_field("cdf", franka)
    velocity = np.array([0.0, -0.8, 0.0])
    errors = []
    for step in range(60):
        p = np.array([0.45, 0.6, 0.55]) + velocity * 0.02 * step
        scene = Scene([Obstacle(Sphere(0.05), p, velocity=velocity)])
        answer = field.query(franka.home, scene)
        if step % 10 == 5:
            best = math.inf
            for _ in range(12):
                cold.reset()
                cold.query(franka.home + rng.normal(0.0, 0.3, franka.n), scene)
                best = min(best, cold.query(franka.home, scene).d[0])
            errors.append(answer.d[0] - best)
    assert np.mean(errors) <= 0.02
    assert np.median(errors) <= 1e-3


def random_shape(rng, kind: int) -> Shape:
    points = rng.uniform(-0.12, 0.12, (12, 3))
    return (
        Sphere(0.08),
        Box((0.1, 0.2, 0.15)),
        Capsule(0.05, 0.2),
        Cylinder(0.06, 0.2),
        ConvexMesh(points),
        PointCloud(points, 0.02),
    )[kind]


@pytest.mark.parametrize("name", ["franka", "ur5"])
def test_derivatives_of_every_shape_are_finite_differences(name) -> None:
    """Both derivatives, moving and rotating obstacles, 6 and 7 joints, outside contact and in penetration."""
    robot = load_robot(name)
    field = make_field("cdf", robot)
    rng = np.random.default_rng(4)
    step, compared, agreed = 1e-5, 0, 0
    for trial in range(48):
        q = rng.uniform(np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5))
        direction = rng.normal(size=3)
        p = np.array([0.0, 0.0, 0.4]) + direction / np.linalg.norm(direction) * rng.uniform(0.3, 0.7)
        v, w = rng.normal(size=3), rng.normal(size=3)
        shape, quaternion = random_shape(rng, trial % 6), pin.Quaternion(pin.exp3(rng.normal(size=3)))

        def scene_at(t, p=p, v=v, w=w, shape=shape, quaternion=quaternion):
            turned = pin.Quaternion(pin.exp3(w * t)) * quaternion
            return Scene([Obstacle(shape, p + v * t, turned.coeffs(), velocity=v, angular_velocity=w)])

        field.reset()
        answer = field.query(q, scene_at(0.0))
        if not answer.valid[0] or not 0.02 < abs(answer.d[0]) < math.inf:
            continue

        def numeric(step, q=q, scene_at=scene_at):
            rate = (field.query(q, scene_at(step)).d[0] - field.query(q, scene_at(-step)).d[0]) / (2.0 * step)
            moved = [(field.query(q + e * step, scene_at(0.0)).d[0], field.query(q - e * step, scene_at(0.0)).d[0])
                     for e in np.eye(robot.n)]  # fmt: skip
            return np.array([(plus - minus) / (2.0 * step) for plus, minus in moved] + [rate])

        with np.errstate(invalid="ignore"):
            fine, coarse = numeric(step), numeric(3.0 * step)
        if not np.isfinite(fine + coarse).all() or np.linalg.norm(fine - coarse) > 0.02 * (1.0 + abs(fine[-1])):
            continue  # a kink: two corners of polytopes take turns as nearest points, and d has no derivative
        compared += 1
        right = bool(
            np.linalg.norm(answer.dq[0] - fine[:-1]) < 0.03
            and abs(answer.dt[0] - fine[-1]) < 0.03 * (1.0 + abs(fine[-1]))
        )
        agreed += right
        assert right or trial % 6 != 0, "a ball has no corners"
        assert np.linalg.norm(answer.dq[0]) == pytest.approx(1.0, abs=1e-9)
    assert compared >= 20
    # Between corners of two polytopes the nearest contact may lie on a ridge of f, where the search stops a little off.
    assert agreed >= 0.85 * compared


@pytest.fixture(scope="module")
def slider(tmp_path_factory):
    path = tmp_path_factory.mktemp("slider") / "slider.urdf"
    path.write_text(SLIDER)
    return load_robot(path)


def test_a_slide_and_a_turn_by_hand(slider) -> None:
    """A ball ahead of the cart: either the cart slides into it, or the arm of 0.5 m is already there."""
    field = make_field("cdf", slider)
    ball = Scene([Obstacle(Sphere(0.1), [0.0, 0.6, 0.0], velocity=[0.0, -1.0, 0.0])])
    answer = field.query(np.zeros(2), ball)
    # The tool's ball is at 0.5 (cos, sin); contact where its distance to the obstacle's centre is 0.2.
    s, a = np.meshgrid(np.linspace(-1, 1, 2001), np.linspace(-math.pi, math.pi, 4001), indexing="ij")
    f = np.hypot(s + 0.5 * np.cos(a), 0.5 * np.sin(a) - 0.6) - 0.2
    expected = np.min(np.hypot(s, a)[f <= 0.0])
    assert answer.d[0] == pytest.approx(expected, abs=2e-3)
    assert answer.valid[0]


def test_a_continuous_joint_goes_round_the_short_way(slider) -> None:
    """From q2 = 3 the tool meets a ball at angle -3 by turning on past pi, not back through zero."""
    field = make_field("cdf", slider)
    angle = -3.0
    ball = Scene([Obstacle(Sphere(0.05), [0.5 * math.cos(angle), 0.5 * math.sin(angle), 0.0])])
    answer = field.query(np.array([0.0, 3.0]), ball)
    assert answer.d[0] < 2.0 * math.pi - 6.0
    assert answer.contact_q[0, 1] > 2.9  # past pi, or by the slide: never back through zero


def test_a_contact_no_joint_can_move_is_invalid(slider) -> None:
    """The tool touches the ball exactly along the arm with the slide at its limit: no joint changes the distance."""
    pinned = load_robot("planar", position_limits={"joint1": (0.0, 1e-9), "joint2": (0.0, 1e-9)})
    answer = make_field("cdf", pinned).query(np.zeros(2), Scene([Obstacle(Sphere(0.3), [4.6, 0.0, 0.0])]))
    assert not answer.valid[0]


@pytest.mark.parametrize("q", [[0.0, math.nan], [0.0], [math.inf, 0.0]])
def test_bad_configurations_are_refused(slider, q) -> None:
    with pytest.raises(InputError, match="q must"):
        make_field("cdf", slider).query(q, Scene())


def test_sheets_out_of_range_are_refused(slider) -> None:
    with pytest.raises(InputError, match="sheets must be 1 to 16"):
        make_field("cdf", slider).contacts(np.zeros(2), Scene(), sheets=0)


def test_an_empty_scene_has_no_rows(slider) -> None:
    field = make_field("cdf", slider)
    assert field.query(np.zeros(2), Scene()).d.shape == (0,)
    assert field.contacts(np.zeros(2), Scene(), sheets=4).dq.shape == (0, 2)
