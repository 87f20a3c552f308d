"""What a URDF may hold, and how it is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdfctl.errors import InputError
from cdfctl.robots.robot import load_robot

OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_a_prismatic_and_a_continuous_joint(write_urdf, xml):
    path = write_urdf(
        xml.link("base"),
        xml.link("slide"),
        xml.link("wheel"),
        xml.joint("j1", "base", "slide", "prismatic", axis="1 2 2"),
        xml.joint("j2", "slide", "wheel", "continuous", inner='<limit velocity="3" effort="1"/>'),
    )
    robot = load_robot(path)
    assert robot.model.nq == robot.model.nv == robot.n == 2
    assert robot.prismatic.tolist() == [True, False]
    assert robot.continuous.tolist() == [False, True]
    assert robot.lower.tolist() == [-1.0, -math.inf]
    assert robot.upper.tolist() == [1.0, math.inf]
    assert robot.velocity_limit.tolist() == [2.0, 3.0]
    assert robot.home.tolist() == [0.0, 0.0]
    np.testing.assert_allclose(robot.chain.axis[0], np.array([1.0, 2.0, 2.0]) / 3.0, atol=1e-12)
    step = robot.tip_position(np.array([0.3, 0.0])) - robot.tip_position(np.zeros(2))
    assert np.linalg.norm(step) == pytest.approx(0.3)
    turn = robot.tip_position(np.array([0.3, 2.0 * math.pi])) - robot.tip_position(np.array([0.3, 0.0]))
    np.testing.assert_allclose(turn, 0.0, atol=1e-12)


def test_a_continuous_joint_with_limits_given_is_revolute(write_urdf, xml):
    inner = '<limit velocity="3" effort="1"/>'
    path = write_urdf(xml.link("base"), xml.link("l1"), xml.joint("j1", "base", "l1", "continuous", inner=inner))
    robot = load_robot(path, position_limits={"j1": (-2.0, 3.0)})
    assert robot.continuous.tolist() == [False]
    assert (robot.lower[0], robot.upper[0], robot.home[0]) == (-2.0, 3.0, 0.5)


def test_a_tree_has_its_ancestors(write_urdf, xml):
    path = write_urdf(
        *(xml.link(name) for name in ("base", "trunk", "left", "right")),
        xml.joint("a", "base", "trunk"),
        xml.joint("b", "trunk", "left"),
        xml.joint("c", "trunk", "right"),
    )
    chain = load_robot(path).chain
    assert chain.parent.tolist() == [-1, 0, 0]
    assert chain.moves.astype(int).tolist() == [[1, 1, 1], [0, 1, 0], [0, 0, 1]]


@pytest.mark.parametrize(
    "name", ["package://my_robot/meshes/m.obj", "my_robot/meshes/m.obj", "file://{root}/my_robot/meshes/m.obj"]
)
def test_meshes_by_package_by_relative_path_and_by_absolute_path(tmp_path, write_urdf, xml, name):
    (tmp_path / "my_robot" / "meshes").mkdir(parents=True)
    (tmp_path / "my_robot" / "meshes" / "m.obj").write_text(OBJ)
    shape = xml.mesh(name.format(root=tmp_path), 'scale="0.5 1 2"')
    path = write_urdf(xml.link("base"), xml.link("l1", shape), xml.joint("j1", "base", "l1"))
    (piece,) = load_robot(path).pieces
    assert {tuple(v) for v in piece.vertices} == {(0, 0, 0), (0.5, 0, 0), (0, 2, 0), (0, 0, 6)}


@pytest.mark.parametrize("place", ["packages", "packages/my_robot"])
def test_package_directories(tmp_path, write_urdf, xml, place):
    (tmp_path / "packages" / "my_robot").mkdir(parents=True)
    (tmp_path / "packages" / "my_robot" / "m.obj").write_text(OBJ)
    shape = xml.mesh("package://my_robot/m.obj")
    path = write_urdf(xml.link("base"), xml.link("l1", shape), xml.joint("j1", "base", "l1"))
    assert load_robot(path, package_dirs=[tmp_path / place]).n == 1
    with pytest.raises(InputError, match="of link 'l1' is not there") as caught:
        load_robot(path)
    assert caught.value.hint == "name the folder that holds 'my_robot' in package_dirs"


def test_a_package_is_not_left(tmp_path, write_urdf, xml):
    (tmp_path / "my_robot").mkdir()
    (tmp_path / "m.obj").write_text(OBJ)
    shape = xml.mesh("package://my_robot/../m.obj")
    path = write_urdf(xml.link("base"), xml.link("l1", shape), xml.joint("j1", "base", "l1"))
    with pytest.raises(InputError, match="leaves its package"):
        load_robot(path, package_dirs=[tmp_path])


def test_visual_meshes_are_not_needed(write_urdf, xml):
    visual = '<visual><geometry><mesh filename="package://none/none.dae"/></geometry></visual>'
    assert (
        load_robot(write_urdf(xml.link("base"), xml.link("l1", xml.BOX + visual), xml.joint("j", "base", "l1"))).n == 1
    )


def test_a_joint_that_mimics_a_locked_one_is_locked_with_it(write_urdf, xml):
    path = write_urdf(
        *(xml.link(name) for name in ("base", "arm", "left", "right")),
        xml.joint("j", "base", "arm"),
        xml.joint("l", "arm", "left", "prismatic"),
        xml.joint(
            "r", "arm", "right", "prismatic", inner=xml.LIMIT + '<mimic joint="l" multiplier="-1" offset="0.1"/>'
        ),
    )
    robot = load_robot(path, lock={"l": 0.3})
    assert robot.joint_names == ("j",)
    assert set(robot.notes) == {"l locked at 0.3 m", "r locked at -0.2 m"}
    with pytest.raises(InputError, match="joint 'r' mimics 'l', which is not supported"):
        load_robot(path)


def refused(path, **options) -> str:
    with pytest.raises(InputError) as caught:
        load_robot(path, **options)
    assert "\n" not in caught.value.message
    return str(caught.value)


@pytest.mark.parametrize(
    ("inner", "kind", "message"),
    [
        ("", "revolute", "a revolute joint needs a <limit>"),
        ('<limit lower="nan" upper="1" velocity="1"/>', "revolute", "lower must be 1 finite number, found 'nan'"),
        ('<limit lower="0" upper="inf" velocity="1"/>', "revolute", "upper must be 1 finite number, found 'inf'"),
        ('<limit lower="2" upper="1" velocity="1"/>', "revolute", "lower limit 2.0 is above upper limit 1.0"),
        ('<limit velocity="1"/>', "prismatic", "cannot move: its limits are both 0.0"),
        ('<limit lower="0" upper="1"/>', "revolute", "needs a velocity limit greater than 0, found none"),
        ('<limit lower="0" upper="1" velocity="0"/>', "revolute", "needs a velocity limit greater than 0, found 0.0"),
        ("", "continuous", "needs a velocity limit greater than 0, found none"),
        ("", "floating", "type 'floating' is not supported"),
        ("", "planar", "type 'planar' is not supported"),
        ("", "fixed", "no joint that moves"),
    ],
)
def test_joints_that_are_refused(write_urdf, xml, inner, kind, message):
    path = write_urdf(xml.link("base"), xml.link("l1"), xml.joint("j1", "base", "l1", kind, inner))
    assert message in refused(path)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (lambda x: [x.link("base")], "has no joint"),
        (lambda x: [], "has no link"),
        (
            lambda x: [x.link("base"), x.link("l"), x.link("l"), x.joint("j", "base", "l")],
            "link name 'l' is used twice",
        ),
        (lambda x: [x.link("base"), x.link("l1"), x.joint("j", "base", "l2")], "its child link 'l2' does not exist"),
        (lambda x: [x.link("a"), x.joint("j", "a", "a")], "its roots are a loop"),
        (lambda x: [x.link("a"), x.link("b"), x.link("c"), x.joint("j", "b", "c"), x.joint("k", "c", "b")], "loop"),
        (lambda x: [x.link("a"), x.link("b"), x.joint("j", "a", "b"), x.joint("k", "a", "b")], "child of two joints"),
        (lambda x: [x.link("a"), x.link("b"), x.link("c"), x.joint("j", "a", "b")], "its roots are a, c"),
        (lambda x: [x.link("a"), x.link("b"), x.joint("j", "a", "b", axis="0 0 0")], "its axis has no direction"),
        (lambda x: [x.link("a"), x.link("b", ""), x.joint("j", "a", "b")], "no moving link has collision geometry"),
        (
            lambda x: [x.link("a"), x.link("b", x.mesh("none.stl")), x.joint("j", "a", "b")],
            "'none.stl' of link 'b' is not",
        ),
        (lambda x: [x.link("a"), x.link("b", x.mesh("arm.urdf")), x.joint("j", "a", "b")], "unknown mesh format"),
        (lambda x: [x.link("a"), x.link("b", "<collision/>"), x.joint("j", "a", "b")], "link 'b': found nothing"),
    ],
)
def test_trees_that_are_refused(write_urdf, xml, parts, message):
    assert message in refused(write_urdf(*parts(xml)))


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ('<sphere radius="-1"/>', "radius must be greater than 0, found -1"),
        ('<sphere radius="a"/>', "radius must be 1 finite number, found 'a'"),
        ("<sphere/>", "<sphere> needs radius"),
        ('<cylinder radius="1"/>', "<cylinder> needs length"),
        ('<box size="1 nan 1"/>', "size must be 3 finite numbers"),
        ('<box size="1 1"/>', "size must be 3 finite numbers"),
        ('<cone radius="1"/>', "found <cone>"),
        ('<mesh filename="arm.urdf" scale="1 0 1"/>', "scale must be greater than 0"),
    ],
)
def test_shapes_that_are_refused(write_urdf, xml, shape, message):
    collision = f"<collision><geometry>{shape}</geometry></collision>"
    path = write_urdf(xml.link("a"), xml.link("b", collision), xml.joint("j", "a", "b"))
    assert message in refused(path)


def test_a_broken_mesh_is_named_without_our_stack(tmp_path, write_urdf, xml):
    (tmp_path / "m.stl").write_text("garbage")
    message = refused(write_urdf(xml.link("a"), xml.link("b", xml.mesh("m.stl")), xml.joint("j", "a", "b")))
    assert "m.stl" in message
    assert "/src/" not in message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"<robot><a></robot>", "file.urdf:1:13: not well-formed XML: mismatched tag"),
        (b"", "not well-formed XML: no element found"),
        (bytes(range(256)), "not well-formed XML"),
        (b'<?xml version="1.0" encoding="foo"?><robot/>', "not readable as XML"),
        (b"<sdf/>", "the root element is <sdf>, a URDF has <robot>"),
        (b'<!DOCTYPE a [<!ENTITY a "b">]><robot/>', "XML entities"),
        ('<!DOCTYPE a [<!ENTITY a "b">]><robot/>'.encode("utf-16"), "XML entities"),
        (b'<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>', "contains xacro elements"),
    ],
)
def test_files_that_are_no_urdf(tmp_path, content, message):
    (tmp_path / "file.urdf").write_bytes(content)
    assert message in refused(tmp_path / "file.urdf")


def test_no_file_and_a_directory(tmp_path):
    (tmp_path / "d.urdf").mkdir()
    assert "no such URDF file" in refused(tmp_path / "none.urdf")
    assert "is a directory, not a URDF file" in refused(tmp_path / "d.urdf")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lock": {"j3": 0.0}}, "robot 'arm': lock: unknown joint 'j3'"),
        ({"lock": {"j1": 0.0, "j2": 0.0}}, "every joint is locked"),
        ({"lock": {"j1": 5.0}}, "cannot be locked at 5.0: its limits are [-1.0, 1.0]"),
        ({"lock": {"j1": math.nan}}, "cannot be locked at nan"),
        ({"position_limits": {"j1": (1.0, 0.0)}}, "position limits of joint 'j1' must be finite and ascend"),
        ({"position_limits": {"j1": (-math.inf, 0.0)}}, "must be finite and ascend"),
        ({"position_limits": {"k": (0.0, 1.0)}}, "position limit: unknown joint 'k'"),
        ({"velocity_limits": {"j1": 0.0}}, "velocity limit of joint 'j1' must be greater than 0"),
        ({"velocity_limits": math.nan}, "velocity limit must be greater than 0, found nan"),
        ({"velocity_limits": {"k": 1.0}}, "velocity limit: unknown joint 'k'"),
        ({"tip": "hand"}, "unknown tip frame 'hand'"),
    ],
)
def test_options_that_are_refused(write_urdf, xml, options, message):
    links = [xml.link(name) for name in ("base", "l1", "l2")]
    path = write_urdf(*links, xml.joint("j1", "base", "l1"), xml.joint("j2", "l1", "l2"))
    assert message in refused(path, **options)


def test_the_nearest_joint_is_suggested(write_urdf, xml):
    path = write_urdf(xml.link("base"), xml.link("l1"), xml.joint("shoulder", "base", "l1"))
    assert "did you mean shoulder?" in refused(path, lock={"sholder": 0.0})
