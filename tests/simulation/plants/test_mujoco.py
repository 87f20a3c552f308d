"""MuJoCo as a plant: its geometry against coal, a servo by hand, gravity, torque limits, and the end at a contact."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from cdfctl.errors import InputError, MissingError, PlantError
from cdfctl.robots.robot import Robot, load_robot
from cdfctl.robots.robot_file import shipped_names
from cdfctl.scenario.library import load_scenario
from cdfctl.scenario.plant import MujocoConfig
from cdfctl.simulation.assemble import Trial, assemble
from cdfctl.simulation.clearance import Clearance
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.plants.mujoco import MujocoPlant
from cdfctl.simulation.run_folder import read_run, write_run
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, PointCloud, Shape, Sphere, State

mujoco = pytest.importorskip("mujoco")

from cdfctl.simulation.plants.mujoco_model import ROTOR, build_model  # noqa: E402  (needs mujoco)

STILL = SceneMotion(())


def config(**options: float) -> MujocoConfig:
    return MujocoConfig(type="mujoco", **options)


def shapes() -> tuple[Shape, ...]:
    rng = np.random.default_rng(7)
    corners = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.2, 0.2, 0.0]])
    return (
        Sphere(0.05),
        Box((0.1, 0.2, 0.3)),
        Capsule(0.03, 0.4),
        Cylinder(0.06, 0.3),
        ConvexMesh(rng.normal(0.0, 0.08, (20, 3))),
        ConvexMesh(corners),  # flat
        PointCloud(rng.normal(0.0, 0.1, (5, 3)), 0.01),
    )


@pytest.fixture(scope="module", params=shipped_names())
def arm(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def test_mujocos_distances_are_coals(arm: Robot) -> None:
    """Every shipped arm, every shape: what MuJoCo would collide is what the judge measures, to 2e-7 m."""
    robot, obstacles, rng = arm, shapes(), np.random.default_rng(1)
    built, coal = build_model(robot, obstacles, config()), Clearance(robot, obstacles)
    model, data = built.model, mujoco.MjData(built.model)
    owner = np.array(built.geoms)
    assert model.nq == model.nu == robot.n
    for _ in range(2):
        q = rng.uniform(np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0))
        turn = rng.normal(size=(len(obstacles), 4))
        turn /= np.linalg.norm(turn, axis=1)[:, None]
        place = rng.uniform(-0.8, 0.8, (len(obstacles), 3))
        coal.place(q, np.hstack([place, turn]))
        data.qpos[:], data.mocap_pos[:], data.mocap_quat[:] = q, place, turn[:, [3, 0, 1, 2]]
        mujoco.mj_kinematics(model, data)
        found = np.full((coal.objects, len(obstacles)), np.inf)
        for a in np.flatnonzero(owner >= 0):
            for b in np.flatnonzero(owner < 0):
                pair = owner[a], -1 - owner[b]
                found[pair] = min(found[pair], mujoco.mj_geomDistance(model, data, int(a), int(b), 9.0, None))
        expected = coal.distances().reshape(found.shape)
        apart = expected > 1e-4
        assert apart.any()
        np.testing.assert_allclose(found[apart], expected[apart], atol=2e-7)
        np.testing.assert_array_equal(found[~apart & (expected < -1e-4)] < 0.0, True)


@pytest.fixture(scope="module")
def one_joint() -> Robot:
    """Two rods of 1 kg and 2 m as one: I = 4/3 + (1/3 + 3^2) = 32/3 kg m² about the joint, which turns about z."""
    return load_robot("planar", lock={"joint2": 0.0})


@pytest.mark.parametrize("timestep", [0.001, 0.01])
def test_a_servo_by_hand(one_joint: Robot, timestep: float) -> None:
    """I dv/dt = kv (u - v), implicitly: v_{k+1} = (I v_k + h kv u) / (I + h kv), q_{k+1} = q_k + h v_{k+1}."""
    inertia = (1.0 + ROTOR) * 32.0 / 3.0
    kv = min(32.0 / 3.0 / 0.1, inertia / timestep)
    plant = MujocoPlant(one_joint, STILL, config(timestep=timestep, servo_time=0.1), dt=0.2)
    state = plant.step(plant.start(np.array([0.3])), np.array([0.5]), 0.2)
    v, q, expected = 0.0, 0.3, []
    for _ in range(round(0.2 / timestep)):
        v = (inertia * v + timestep * kv * 0.5) / (inertia + timestep * kv)
        q += timestep * v
        expected.append(q)
    assert state.t == 0.2
    np.testing.assert_allclose([*plant.between().q[:, 0], state.q[0]], expected, atol=1e-9)
    report = plant.report()
    assert report["velocity_error_max_rad_s"] == pytest.approx(0.5 - v, abs=1e-9)
    assert report["position_error_max_rad"] == pytest.approx(0.3 + 0.1 - q, abs=1e-9)
    # and the law it integrates, to the order of the step
    assert v == pytest.approx(0.5 * (1.0 - math.exp(-kv / inertia * 0.2)), abs=timestep)


def drive(plant: MujocoPlant, q0: Array, u: Array, seconds: float, dt: float = 0.01) -> State:
    state = plant.start(q0)
    for _ in range(round(seconds / dt)):
        state = plant.step(state, u, dt)
    return state


def test_without_gravity_compensation_the_arm_sags() -> None:
    """A servo told to stand still gives way at g(q) / kv; with the weight compensated it does not move at all."""
    robot = load_robot("franka")
    still = np.zeros(robot.n)
    held = MujocoPlant(robot, STILL, config(), 0.01)
    np.testing.assert_allclose(drive(held, robot.home, still, 0.5).q, robot.home, atol=1e-9)
    sagging = MujocoPlant(robot, STILL, config(gravity_compensation=0.0), 0.01)
    gains = build_model(robot, (), config()).gains
    weight = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.home)
    drive(sagging, robot.home, still, 0.1)
    rates = sagging._data.qvel
    np.testing.assert_allclose(rates, -weight / gains, atol=0.02 * np.abs(weight / gains).max())
    assert np.abs(rates).max() > 0.04
    half = MujocoPlant(robot, STILL, config(gravity_compensation=0.5), 0.01)
    drive(half, robot.home, still, 0.1)
    np.testing.assert_allclose(half._data.qvel, 0.5 * rates, atol=1e-3)


def test_torques_and_joints_end_at_their_limits() -> None:
    robot = load_robot("franka")
    plant = MujocoPlant(robot, STILL, config(), 0.002)
    u = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    state, worst = plant.start(robot.home), 0.0
    for _ in range(20):
        state = plant.step(state, u, 0.002)
        worst = max(worst, float(np.abs(plant._data.qfrc_actuator / robot.model.effortLimit).max()))
    assert worst == pytest.approx(1.0, abs=1e-9)  # 87 Nm, gravity's compensation included, and no more
    pushed = MujocoPlant(robot, STILL, config(), 0.01)
    end = drive(pushed, robot.upper - 0.05, np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.5)
    assert end.q[0] == pytest.approx(robot.upper[0], abs=0.01)


def test_every_arm_follows_its_servos(arm: Robot) -> None:
    """A fifth of its greatest speed, after it has settled: within 0.02 rad/s (0.006 for the Panda and the FR3)."""
    robot, rng = arm, np.random.default_rng(3)
    plant = MujocoPlant(robot, STILL, config(), 0.01)
    u = 0.2 * rng.uniform(-1.0, 1.0, robot.n) * np.minimum(robot.velocity_limit, 3.0)
    drive(plant, robot.home, u, 0.4)
    assert np.abs(plant._data.qvel - u).max() < (0.006 if arm.name in ("franka", "fr3") else 0.02)


def test_physics_that_run_away_are_a_failure_of_the_plant(one_joint: Robot) -> None:
    plant = MujocoPlant(one_joint, STILL, config(), 0.01)
    state = plant.start(np.zeros(1))
    plant._data.qvel[:] = math.nan
    with pytest.raises(PlantError, match="became unstable at 0 s"):
        plant.step(state, np.zeros(1), 0.01)


RAM = """\
version: 1
name: ram
robot: {{name: planar, lock: {{joint2: 0.0}}, limits: {{velocity: 2.0}}, q0: [0.0]}}
task: {{type: joint-goal, goal: [1.0]}}
obstacles:
  - name: disc
    shape: {{type: ball, radius: 0.3}}
    position: {position}
    velocity: {velocity}
controller: {{variant: sdf-tvcbf-qp, on_infeasible: brake}}
plant: {plant}
simulation: {{dt: 0.1, time_limit: 3.0, tolerance: 0.05}}
"""


@pytest.fixture
def make(tmp_path: Path) -> Callable[..., Trial]:
    def trial(
        position: str = "[2.0, 3.0, 0.0]", velocity: str = "[0.0, -12.0, 0.0]", plant: str = "mujoco", text: str = RAM
    ) -> Trial:
        path = tmp_path / "ram.yaml"
        path.write_text(text.format(position=position, velocity=velocity, plant=plant))
        return assemble(load_scenario(path))

    return trial


def test_the_run_ends_at_the_first_contact(make: Callable[..., Trial], tmp_path: Path) -> None:
    trial = make()
    for _ in trial.run():
        pass
    result = trial.result()
    contact = result.verdict.contact
    assert (result.stop, result.verdict.outcome) == ("contact", "collision")
    assert contact is not None
    assert contact.obstacle == "disc"
    assert result.reason is not None
    assert "in contact with disc" in result.reason
    # MuJoCo sees it at the first step of the physics after the judge's instant, and there the run ends.
    felt = result.plant["contact_time_s"]
    assert isinstance(felt, float)
    assert contact.time <= felt <= contact.time + 0.002 + 1e-9
    trajectory = result.trajectory
    assert trajectory.t[-1] == felt
    assert trajectory.plant_t is not None
    assert np.all(np.diff(trajectory.plant_t) > 0.0)
    assert set(trajectory.t) <= set(trajectory.plant_t)
    # the run folder holds all of it
    document = write_run(tmp_path / "run", result)
    again = read_run(tmp_path / "run")
    assert again.document["plant"] == document["plant"]
    np.testing.assert_array_equal(again.trajectory.plant_q, trajectory.plant_q)


def test_what_stays_clear_reaches(make: Callable[..., Trial]) -> None:
    trial = make(position="[-3.0, -3.0, 0.0]", velocity="[0.0, 0.0, 0.0]")
    for _ in trial.run():
        pass
    result = trial.result()
    assert result.verdict.outcome == "reached"
    assert result.plant["contact"] == "none"
    assert result.reason is None


def test_the_base_can_be_hit_too() -> None:
    """MuJoCo by itself leaves out a fixed geom and a mocap body."""
    robot = load_robot("franka")
    at_base = np.array([[0.0, 0.0, 0.05]])
    built = build_model(robot, (Sphere(0.05),), config())
    data = mujoco.MjData(built.model)
    data.qpos[:], data.mocap_pos[:] = robot.home, at_base
    mujoco.mj_forward(built.model, data)
    touched = {robot.geometry_links[max(built.geoms[g] for g in data.contact[k].geom)] for k in range(data.ncon)}
    assert touched == {"panda_link0"}


URDF = """\
<robot name="bare">
  <link name="base"/><link name="a">{inertial}{geometry}</link><link name="b">{geometry}</link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="2" effort="0"/></joint>
  <joint name="j2" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="0"/></joint>
</robot>
"""
BOX = '<collision><origin xyz="0.5 0 0"/><geometry><box size="1.0 0.1 0.1"/></geometry></collision>'


def bare(tmp_path: Path, inertial: str = "") -> Robot:
    (tmp_path / "bare.urdf").write_text(URDF.format(inertial=inertial, geometry=BOX))
    return load_robot(tmp_path / "bare.urdf")


def test_a_link_without_inertia_is_made_of_water(tmp_path: Path) -> None:
    robot = bare(tmp_path)
    built = build_model(robot, (), config())
    assert built.assumed == ("j1", "j2")
    assert built.model.body_mass[1:].tolist() == pytest.approx([10.0, 10.0])  # 1000 kg/m³ x 0.01 m³
    plant = MujocoPlant(robot, STILL, config(), 0.01)
    drive(plant, np.array([0.2, 0.1]), np.array([0.5, -0.3]), 0.3)
    assert plant.report()["links_without_inertia"] == 2
    assert plant._data.qvel == pytest.approx([0.5, -0.3], abs=0.02)


@pytest.mark.parametrize(
    "inertial",
    [
        '<inertial><mass value="-1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>',
        '<inertial><mass value="1"/><inertia ixx="-1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>',
    ],
)
def test_an_inertia_that_is_none_is_refused(tmp_path: Path, inertial: str) -> None:
    robot = bare(tmp_path, inertial)
    with pytest.raises(InputError, match="the body of joint 'j1' has an inertia that is none"):
        MujocoPlant(robot, STILL, config(), 0.01)


def test_without_mujoco_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch, one_joint: Robot) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingError, match="needs MuJoCo") as caught:
        MujocoPlant(one_joint, STILL, config(), 0.01)
    assert caught.value.exit_status == 3
    assert "cdfctl[mujoco]" in str(caught.value)


@pytest.mark.parametrize(
    ("plant", "message", "hint"),
    [
        ("{type: mujoco, timestep: 0.2}", "is longer than the control step, 0.1 s", "plant.timestep=0.1"),
        ("{type: mujoco, timestep: 0.03}", "does not divide the control step, 0.1 s", "plant.timestep=0.025"),
    ],
)
def test_a_control_step_is_a_whole_number_of_physics_steps(
    make: Callable[..., Trial], plant: str, message: str, hint: str
) -> None:
    with pytest.raises(InputError) as caught:
        make(plant=plant)
    assert message in str(caught.value)
    assert hint in str(caught.value)
