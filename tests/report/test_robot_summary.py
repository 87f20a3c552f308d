"""``check`` says what was made of a URDF: each joint's own unit and limits, and which links count."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from cdfctl.errors import InputError
from cdfctl.report.robot_summary import extent, joint_facts, robot_summary
from cdfctl.robots.robot import Robot, load_robot

URDF = """<robot name="arm">
  <link name="foot"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="spin" type="continuous">
    <parent link="foot"/><child link="post"/><axis xyz="0 0 1"/><limit velocity="1.5" effort="9"/>
  </joint>
  <link name="post"><collision><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>
  <joint name="slide" type="prismatic">
    <parent link="post"/><child link="rod"/><origin xyz="0.3 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-0.05" upper="0.25" velocity="0.5" effort="9"/>
  </joint>
  <link name="rod"/>
</robot>"""


STL = """solid s
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 0.4 0 0
vertex 0 0.2 0
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 0.4 0 0
vertex 0 0 0.3
endloop
endfacet
endsolid s
"""


def printed(robot: Robot) -> str:
    text = io.StringIO()
    Console(file=text, width=80).print(robot_summary(robot))
    return text.getvalue()


def test_it_says_units_limits_links_and_the_tip(tmp_path: Path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    robot = load_robot(str(path), acceleration_limits={"slide": 2.5})
    lines = [" ".join(line.split()) for line in printed(robot).splitlines()]
    assert lines[:3] == [
        "joint position speed acceleration",
        "spin continuous 1.5 rad/s",
        "slide -0.05 to 0.25 m 0.5 m/s 2.5 m/s²",
    ]
    assert "collision geometry: post; fixed: foot" in lines
    assert f"tip: {robot.tip}" in lines
    slide = joint_facts(robot)[1]
    assert (slide["unit"], slide["lower"], slide["upper"], slide["velocity"]) == ("m", -0.05, 0.25, 0.5)


def test_it_says_what_a_file_may_have_meant_otherwise(tmp_path: Path):
    """Hulls of meshes, meshes in millimetres, limits in degrees; and none of it of a plain file."""
    path, folder = tmp_path / "arm.urdf", tmp_path / "parts" / "meshes"
    folder.mkdir(parents=True)
    (folder / "post.stl").write_text(STL)
    mesh = '<mesh filename="package://parts/meshes/post.stl"/>'
    path.write_text(URDF)
    assert "Robot model" not in printed(load_robot(path))
    path.write_text(URDF.replace('<box size="0.1 0.1 0.4"/>', mesh))
    robot = load_robot(path)
    assert "meshes stand for their convex hulls: post" in printed(robot)
    assert 0.4 < extent(robot) < 1.0
    assert "millimetres" not in printed(robot)
    path.write_text(URDF.replace('<box size="0.1 0.1 0.4"/>', mesh.replace("/>", ' scale="1000 1000 1000"/>')))
    assert "millimetres" in printed(load_robot(path))
    turned = URDF.replace('type="continuous"', 'type="revolute"').replace(
        "<limit vel", '<limit lower="-90" upper="90" vel'
    )
    path.write_text(turned)
    assert "limits of spin: a URDF's angles are in radians" in " ".join(printed(load_robot(path)).split())


@pytest.mark.parametrize(
    ("mesh", "hint"), [("parts/post.stl", "it would be "), ("prats/post.stl", "name the folder that holds 'prats'")]
)
def test_a_missing_mesh_is_told_from_a_missing_package(tmp_path: Path, mesh: str, hint: str):
    (tmp_path / "parts").mkdir()
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.replace('<box size="0.1 0.1 0.4"/>', f'<mesh filename="package://{mesh}"/>'))
    with pytest.raises(InputError, match=r"is not there") as caught:
        load_robot(path)
    assert str(caught.value.hint).startswith(hint)
    if mesh.startswith("parts"):
        assert str(caught.value.hint) == f"it would be {tmp_path / 'parts' / 'post.stl'}"
