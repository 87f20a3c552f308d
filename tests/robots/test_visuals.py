"""What a robot looks like, against Pinocchio's own reading of the whole URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio as pin
import pytest

from cdfctl.robots.robot import load_robot
from cdfctl.robots.visuals import MeshFile, read_visuals
from cdfctl.types import Box, Cylinder, Sphere

OWN = """\
<robot name="own">
  <material name="blue"><color rgba="0 0 1 0.5"/></material>
  <link name="base"><visual><geometry><box size="0.1 0.2 0.3"/></geometry><material name="blue"/></visual></link>
  <joint name="j1" type="revolute">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/>
  </joint>
  <link name="arm">
    <visual>
      <origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>
      <geometry><cylinder radius="0.05" length="0.4"/></geometry>
      <material name=""><color rgba="1 0 2 1"/></material>
    </visual>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="j2" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="0 0 1" rpy="0 0 1"/></joint>
  <link name="hand"><visual><geometry><sphere radius="0.02"/></geometry></visual></link>
</robot>
"""


@pytest.mark.parametrize("name", ["franka", "kinova", "ur5"])
def test_visuals_stand_where_pinocchio_puts_them(name):
    robot = load_robot(name)
    visuals, problems = read_visuals(robot)
    assert not problems
    # Pinocchio parses the URDF as it is, gripper free; the robot's locked joints are set by hand.
    dirs = [str(entry) for entry in robot.package_dirs]
    model = pin.buildModelFromUrdf(str(robot.urdf))
    geometry = pin.buildGeomFromUrdf(model, str(robot.urdf), pin.GeometryType.VISUAL, package_dirs=dirs)
    rng = np.random.default_rng(3)
    q = rng.uniform(np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0))
    full = pin.neutral(model)
    for value, joint in zip(q, robot.joint_names, strict=True):
        index = model.joints[model.getJointId(joint)]
        full[index.idx_q : index.idx_q + index.nq] = [value] if index.nq == 1 else [np.cos(value), np.sin(value)]
    data, placed = model.createData(), pin.GeometryData(geometry)
    pin.updateGeometryPlacements(model, data, geometry, placed, full)
    expected = {
        (item.meshPath.split("/")[-1], str(model.frames[item.parentFrame].name)): placement
        for item, placement in zip(geometry.geometryObjects, placed.oMg, strict=True)
    }
    own = robot.model.createData()
    pin.forwardKinematics(robot.model, own, q)
    assert len(visuals) == len(geometry.geometryObjects)
    for visual in visuals:
        assert isinstance(visual.shape, MeshFile)
        found = own.oMi[visual.joint + 1] * pin.SE3(visual.rotation, visual.translation)
        assert found.isApprox(expected[visual.shape.path.name, visual.link], 1e-9), visual.link


def test_primitives_and_colours(tmp_path):
    (tmp_path / "own.urdf").write_text(OWN)
    robot = load_robot(tmp_path / "own.urdf")
    visuals, problems = read_visuals(robot)
    assert not problems
    base, arm, hand = visuals
    assert (base.joint, base.shape, base.colour) == (-1, Box((0.1, 0.2, 0.3)), (0.0, 0.0, 1.0, 0.5))
    assert (arm.joint, arm.shape, arm.colour) == (0, Cylinder(0.05, 0.4), (1.0, 0.0, 1.0, 1.0))  # 2 is no share
    assert (hand.joint, hand.shape, hand.colour) == (0, Sphere(0.02), None)
    np.testing.assert_allclose(arm.translation, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(arm.rotation, pin.rpy.rpyToMatrix(0.4, 0.5, 0.6), atol=1e-12)
    np.testing.assert_allclose(hand.translation, [0.0, 0.0, 1.0])


def test_a_visual_that_cannot_be_read_takes_its_link_out(tmp_path):
    root = ElementTree.fromstring(OWN)
    arm = root.findall("link")[1]
    ElementTree.SubElement(ElementTree.SubElement(ElementTree.SubElement(arm, "visual"), "geometry"), "mesh").set(
        "filename", "gone.stl"
    )
    path = tmp_path / "own.urdf"
    path.write_text(ElementTree.tostring(root, encoding="unicode"))
    visuals, problems = read_visuals(load_robot(path))
    assert [visual.link for visual in visuals] == ["base", "hand"]
    assert list(problems) == ["arm"]
    assert "gone.stl" in problems["arm"]
    assert "\n" not in problems["arm"]
