"""``check`` says what was made of a URDF: each joint's own unit and limits, and which links count."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from cdfctl.report.robot_summary import joint_facts, robot_summary
from cdfctl.robots.robot import load_robot

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


def test_it_says_units_limits_links_and_the_tip(tmp_path: Path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    robot = load_robot(str(path), acceleration_limits={"slide": 2.5})
    text = io.StringIO()
    Console(file=text, width=80).print(robot_summary(robot))
    lines = [" ".join(line.split()) for line in text.getvalue().splitlines()]
    assert lines[:3] == [
        "joint position speed acceleration",
        "spin continuous 1.5 rad/s",
        "slide -0.05 to 0.25 m 0.5 m/s 2.5 m/s²",
    ]
    assert "collision geometry: post; fixed: foot" in lines
    assert f"tip: {robot.tip}" in lines
    slide = joint_facts(robot)[1]
    assert (slide["unit"], slide["lower"], slide["upper"], slide["velocity"]) == ("m", -0.05, 0.25, 0.5)
