"""Where the nodes of the picture are, against Pinocchio's forward kinematics on the URDF's own frames.

The scene is one that notes down what viser's would be told; a node's place in the world is composed along its path.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from cdfctl.report.view.replay import Replay
from cdfctl.report.view.solids import collision_parts, visual_parts
from cdfctl.report.view.stage import GROUPS, Stage, node_name
from cdfctl.robots.robot import load_robot

from .made import by_hand, first_steps


class Node:
    """A node of :class:`Notes`."""

    def __init__(self, name: str, **given: Any) -> None:
        self.name, self.given = name, given
        self.position, self.wxyz, self.visible = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), True
        self.points, self.text = None, ""
        for key, value in given.items():
            setattr(self, key, value)


class Notes:
    """Stands in for viser's scene."""

    def __init__(self) -> None:
        self.nodes: dict[str, Node] = {}

    def __getattr__(self, call: str) -> Any:
        if not call.startswith("add_"):
            return lambda *_, **__: None

        def note(name: str, *arguments: Any, **given: Any) -> Node:
            if arguments and call == "add_line_segments":
                given["points"] = arguments[0]
            assert name not in self.nodes
            self.nodes[name] = Node(name, **given)
            return self.nodes[name]

        return note

    def world(self, name: str) -> pin.SE3:
        """Where a node is."""
        placement, path = pin.SE3.Identity(), ""
        for step in name.strip("/").split("/"):
            path += f"/{step}"
            node = self.nodes[path]
            w, x, y, z = node.wxyz
            placement = placement * pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(node.position))
        return placement

    def seen(self, name: str) -> bool:
        """Whether a node and all above it are visible."""
        steps = name.strip("/").split("/")
        above = (self.nodes.get("/" + "/".join(steps[: i + 1])) for i in range(len(steps)))
        return all(node is None or node.visible for node in above)  # viser makes what is missing in between

    def below(self, group: str) -> list[str]:
        """The names of a group's nodes."""
        return [name for name in self.nodes if name.startswith(f"/{GROUPS[group]}/")]


@pytest.fixture(scope="module")
def staged(replay):
    notes = Notes()
    return notes, Stage(notes, replay)


@pytest.fixture
def shown(staged, replay):
    def at(t: float):
        staged[1].show(replay.at(t), replay)
        return staged[0], replay.at(t)

    return at


def test_nothing_is_amiss_with_a_shipped_robot(staged):
    assert staged[1].warnings == []
    assert set(staged[1].groups) == set(GROUPS)


@pytest.mark.parametrize("t", [0.0, 0.83, 2.0])
def test_visual_meshes_are_at_the_links_frames(shown, replay, t):
    notes, instant = shown(t)
    model = replay.body.robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, instant.q)
    checked = 0
    for name in notes.below("visual"):
        link = name.rsplit("/", 1)[1].rpartition("_")[0]
        # Of the Panda's visuals the right finger's alone has an offset; tests/robots holds that against Pinocchio.
        if link != "panda_rightfinger" and model.existFrame(link, pin.FrameType.BODY):
            assert notes.world(name).isApprox(data.oMf[model.getFrameId(link, pin.FrameType.BODY)], 1e-9), name
            checked += 1
    assert checked == 10


@pytest.mark.parametrize(("group", "t"), [("collision", 0.83), ("contact", 0.0), ("contact", 1.5)])
def test_collision_geometry_is_where_pinocchio_has_it(shown, replay, group, t):
    notes, instant = shown(t)
    robot = replay.body.robot
    data, placed = robot.model.createData(), pin.GeometryData(robot.geometry)
    q = instant.q if group == "collision" else instant.contact_q
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, placed, q)
    names = [name for name in notes.below(group) if name.count("/") == 3]
    assert len(names) == len(robot.geometry_links)
    for name in names:
        index = int(name.rpartition("_")[2])
        assert notes.world(name).isApprox(placed.oMg[index], 1e-9), name


def test_obstacles_and_the_distance_line(shown, replay):
    notes, instant = shown(0.83)
    for i, name in enumerate(replay.body.names):
        found = notes.world(f"/obstacles/{node_name(name, i)}")
        assert found.isApprox(pin.XYZQUATToSE3(instant.obstacle_pose[i]), 1e-6)
    line = notes.nodes["/distance/line"]
    np.testing.assert_allclose(line.points[0], [instant.closest.on_robot, instant.closest.on_obstacle], atol=1e-6)
    assert notes.nodes["/distance/value"].text == f"{instant.closest.distance:.3f} m"
    np.testing.assert_allclose(notes.nodes["/plan/path of the tip"].points[0], instant.plan, atol=1e-6)


def test_the_trail_is_the_past(shown, replay):
    for t in (0.0, 1.0, 2.0, 0.4):  # back again, too
        notes, _ = shown(t)
        pieces = [name for name in notes.below("trails") if "/tip/" in name]
        drawn = [notes.nodes[name].points for name in pieces if notes.seen(name)]
        ends = np.concatenate(drawn)[-1, 1] if drawn else replay.tip[0]
        np.testing.assert_allclose(ends, replay.tip[round(10 * t)], atol=1e-6)
    whole = np.concatenate([notes.nodes[name].points for name in pieces])
    np.testing.assert_allclose(whole[:, 0], replay.tip[:-1], atol=1e-6)


def test_what_is_hidden_and_what_can_be(staged, shown):
    notes, stage = staged[0], staged[1]
    shown(0.5)
    assert not notes.seen("/collision geometry/base")
    stage.set_visible("collision", True)
    stage.set_visible("visual", False)
    assert notes.seen("/collision geometry/base")
    assert not notes.seen("/robot/base")
    stage.set_visible("collision", False)
    stage.set_visible("visual", True)


def test_a_growing_run_is_drawn_as_it_comes(replay):
    scenario = replay.body.scenario
    whole = by_hand(scenario, 20)
    notes = Notes()
    short = Replay(replay.body, first_steps(whole, 4))
    stage = Stage(notes, short, complete=False)
    for steps in (4, 9, 20):
        grown = Replay(replay.body, first_steps(whole, steps))
        stage.extend(grown, complete=steps == 20)
        stage.show(grown.at(9.0), grown)
    pieces = np.concatenate([notes.nodes[n].points for n in notes.below("trails") if "/tip/" in n])
    np.testing.assert_allclose(pieces[:, 0], replay.tip[:-1], atol=1e-6)
    np.testing.assert_allclose(pieces[:, 1], replay.tip[1:], atol=1e-6)


def test_the_camera_has_the_run_in_the_picture(staged, replay):
    camera = staged[1].camera
    view = camera.look_at - camera.position
    view /= np.linalg.norm(view)
    for q in replay.trajectory.q:
        for point in replay.body.skeleton(q):
            to = point - camera.position
            off = np.arccos(to @ view / np.linalg.norm(to))
            assert off < 0.5 * camera.fov * 1.2  # the picture is wider than high


def test_a_link_whose_mesh_cannot_be_read_shows_its_collision_geometry(tmp_path):
    urdf = """<robot name="r"><link name="base"/><link name="arm">
    <visual><geometry><mesh filename="broken.stl"/></geometry></visual>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
    <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
    (tmp_path / "r.urdf").write_text(urdf)
    (tmp_path / "broken.stl").write_text("solid nothing\nfacet normal here\n")
    parts, warnings = visual_parts(load_robot(tmp_path / "r.urdf"), 1.0)
    assert [part.name for part in parts] == ["arm_0"]
    assert parts[0].triangles is not None
    assert len(warnings) == 1
    assert "broken.stl: not a readable mesh" in warnings[0]
    assert "'arm'" in warnings[0]


def test_a_body_without_thickness_can_be_seen():
    robot = load_robot("planar")
    for part in collision_parts(robot, 4.0):
        assert np.ptp(part.triangles.vertices, axis=0).min() > 0.01
    assert visual_parts(robot, 4.0)[1] == []
