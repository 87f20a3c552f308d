"""The picture itself: nodes of a viser scene, built once from a replay and then moved from instant to instant.

It knows nothing of clocks, buttons or files. Each kind of thing hangs under a node of its own (:data:`GROUPS`), so that
it can be hidden there; within a group, what does not exist at an instant is hidden one level below.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from cdfctl.report.view.camera import Camera, size_of
from cdfctl.report.view.colours import CONTACT, DISTANCE, PLAN, TARGET, obstacle_colour, rgb
from cdfctl.report.view.replay import Instant, Replay
from cdfctl.report.view.solids import Part, Triangles, collision_parts, triangles_of, visual_parts
from cdfctl.report.view.trails import Trails
from cdfctl.types import Array, PointCloud, Shape, Sphere

GROUPS = {
    "visual": "robot",
    "collision": "collision geometry",
    "contact": "nearest contact q*",
    "distance": "distance",
    "trails": "trails",
    "plan": "plan",
    "goal": "goal",
    "obstacles": "obstacles",
}
"""What can be shown and hidden, and the name of its node."""

HIDDEN = ("collision",)
"""The groups that are hidden to begin with."""

CLOUD_BALLS = 1000
"""A cloud of more points than this is drawn as points, not as balls."""


class Stage:
    """A replay in a viser scene.

    Attributes:
        camera: from where the whole run can be seen.
        warnings: what could not be drawn as it should, one line each.
        groups: those of :data:`GROUPS` in which this replay has anything.
    """

    def __init__(self, scene: Any, replay: Replay, *, complete: bool = True) -> None:
        """Build every node; ``scene`` is viser's scene interface; ``complete`` unless the run still goes on."""
        self._scene, body = scene, replay.body
        self.camera = Camera.of(replay)
        self.size = size = size_of(body)
        scene.set_up_direction("+z")
        scene.configure_default_lights(cast_shadow=True)
        self._ground()
        self._nodes = {name: self._frame(f"/{title}", name not in HIDDEN) for name, title in GROUPS.items()}
        visual, self.warnings = visual_parts(body.robot, size)
        self._arms = [
            self._arm("visual", visual),
            self._arm("collision", collision_parts(body.robot, size), opacity=0.7),
        ]
        self._ghost = self._arm("contact", collision_parts(body.robot, size, CONTACT), opacity=0.35)
        self._obstacles = [
            self._body(f"obstacles/{node_name(name, i)}", shape, obstacle_colour(i), None)
            for i, (name, shape) in enumerate(zip(body.names, body.shapes, strict=True))
        ]
        self._target = None if body.target is None else self._body("goal/target", body.target, TARGET, 0.6)
        if body.goal is not None:
            mark = self._body("goal/tip at the goal", Sphere(0.012 * size), TARGET, 0.8)
            mark.position = body.robot.tip_position(body.goal)
        self._line = self._segments("distance/line", np.zeros((1, 2, 3)), DISTANCE)
        dot = Sphere(0.006 * size)
        self._ends = [self._body(f"distance/{end}", dot, DISTANCE, None) for end in ("robot", "obstacle")]
        self._label = scene.add_label(self._path("distance/value"), "", anchor="bottom-left", font_screen_scale=0.9)
        self._plan = self._segments("plan/path of the tip", np.zeros((1, 2, 3)), PLAN)
        self._trails = Trails(scene, self._path("trails/")[:-1], replay, size)
        self.extend(replay, complete=complete)
        self.groups = [name for name in GROUPS if self._has(name, replay)]

    def extend(self, replay: Replay, *, complete: bool) -> None:
        """Draw the trails of a replay that has become longer; ``complete`` where no more is to come."""
        self._trails.extend(replay, complete=complete)

    def show(self, instant: Instant, replay: Replay) -> None:
        """Move everything to where it is at an instant of the replay."""
        for arm in self._arms:
            self._pose(arm, replay, instant.q)
        for node, pose in zip(self._obstacles, instant.obstacle_pose, strict=True):
            _place(node, pose)
        if self._target is not None and instant.target_pose is not None:
            _place(self._target, instant.target_pose)
        self._show_contact(instant, replay)
        self._show_distance(instant)
        self._show_plan(instant)
        self._trails.show(instant.t)

    def set_visible(self, group: str, visible: bool) -> None:
        """Show or hide one of :data:`GROUPS`."""
        self._nodes[group].visible = visible

    def _has(self, group: str, replay: Replay) -> bool:
        run, body = replay.trajectory, replay.body
        match group:
            case "contact":
                return run.contact_q is not None and bool(len(body.shapes))
            case "distance" | "obstacles":
                return bool(len(body.shapes))
            case "plan":
                return replay.plan_q is not None
            case "goal":
                return body.target is not None or body.goal is not None
            case _:
                return True

    def _show_contact(self, instant: Instant, replay: Replay) -> None:
        shown = instant.contact_q is not None
        if instant.contact_q is not None:
            self._pose(self._ghost, replay, instant.contact_q)
        for frame in self._ghost.values():
            frame.visible = shown

    def _show_distance(self, instant: Instant) -> None:
        nodes, closest = (self._line, *self._ends, self._label), instant.closest
        for node in nodes:
            node.visible = closest is not None
        if closest is None:
            return
        self._line.points = np.array([[closest.on_robot, closest.on_obstacle]], dtype=np.float32)
        self._ends[0].position, self._ends[1].position = closest.on_robot, closest.on_obstacle
        self._label.position = 0.5 * (closest.on_robot + closest.on_obstacle)
        text = f"{closest.distance:.3f} m"
        if self._label.text != text:
            self._label.text = text

    def _show_plan(self, instant: Instant) -> None:
        self._plan.visible = instant.plan is not None
        if instant.plan is not None:
            self._plan.points = np.stack([instant.plan[:-1], instant.plan[1:]], axis=1).astype(np.float32)

    def _pose(self, arm: dict[int, Any], replay: Replay, q: Array) -> None:
        placements = replay.body.joint_placements(q)
        for joint, frame in arm.items():
            frame.position = placements[joint].translation
            frame.wxyz = wxyz_of(placements[joint].rotation)

    def _path(self, name: str) -> str:
        group, _, rest = name.partition("/")
        return f"/{GROUPS[group]}/{rest}"

    def _frame(self, name: str, visible: bool = True) -> Any:
        return self._scene.add_frame(name, show_axes=False, visible=visible)

    def _arm(self, group: str, parts: Sequence[Part], opacity: float | None = None) -> dict[int, Any]:
        """A frame for each joint that moves a part, -1 being the world, with the parts in it."""
        frames: dict[int, Any] = {}
        for part in parts:
            name = self._path(f"{group}/{'base' if part.joint < 0 else f'joint {part.joint + 1}'}")
            if part.joint not in frames:
                frames[part.joint] = self._frame(name)
            place = {"position": part.translation, "wxyz": wxyz_of(part.rotation)}
            if part.glb is not None:
                self._scene.add_glb(f"{name}/{part.name}", part.glb, **place)
            elif part.triangles is not None:
                self._surface(f"{name}/{part.name}", part.triangles, opacity, **place)
        return frames

    def _body(self, name: str, shape: Shape, colour: str, opacity: float | None) -> Any:
        if isinstance(shape, PointCloud):
            return self._cloud(self._path(name), shape, colour)
        return self._surface(self._path(name), triangles_of(shape, rgb(colour)), opacity)

    def _cloud(self, path: str, cloud: PointCloud, colour: str) -> Any:
        if cloud.radius > 0.0 and len(cloud.points) <= CLOUD_BALLS:
            ball = triangles_of(Sphere(cloud.radius), rgb(colour), detail=1)
            vertices = (cloud.points[:, None] + ball.vertices).reshape(-1, 3)
            first = len(ball.vertices) * np.arange(len(cloud.points))
            faces = (first[:, None, None] + ball.faces).reshape(-1, 3)
            return self._surface(path, Triangles(vertices, faces, ball.colour, smooth=True), None)
        return self._scene.add_point_cloud(
            path,
            cloud.points,
            rgb(colour),
            point_size=max(2.0 * cloud.radius, 0.006 * self.size),
            point_shape="circle",
            precision="float32",
        )

    def _surface(self, path: str, surface: Triangles, opacity: float | None, **place: Any) -> Any:
        return self._scene.add_mesh_simple(
            path,
            surface.vertices,
            surface.faces,
            color=surface.colour,
            flat_shading=not surface.smooth,
            opacity=opacity,
            cast_shadow=opacity is None,
            receive_shadow=False,  # flat faces would show stripes
            **place,
        )

    def _segments(self, name: str, points: Array, colour: str) -> Any:
        return self._scene.add_line_segments(
            self._path(name), points, rgb(colour), thickness=0.005 * self.size, visible=False
        )

    def _ground(self) -> None:
        low = self.camera.floor
        self._scene.add_grid(
            "/ground",
            width=4.0 * self.size,
            height=4.0 * self.size,
            cell_size=0.25 * self.camera.grid,
            section_size=self.camera.grid,
            cell_color=(232, 235, 239),
            section_color=(208, 213, 219),
            position=(0.0, 0.0, low),
        )


def node_name(name: str, index: int) -> str:
    """The name of obstacle ``index`` as one step of a node's path, in which a slash means something."""
    return name if "/" not in name else f"{index}: {name.replace('/', ' ')}"


def _place(node: Any, pose: Array) -> None:
    x, y, z, w = pose[3:]
    node.position, node.wxyz = pose[:3], (w, x, y, z)


def wxyz_of(rotation: Array) -> Array:
    """The quaternion w x y z of a rotation matrix (3, 3)."""
    x, y, z, w = pin.Quaternion(rotation).coeffs()
    return np.array([w, x, y, z])
