"""Drawing a trial where the robot is known: the distances by which ``redraw_within`` refuses a draw.

They are the judge's (see :mod:`cdfctl.simulation.clearance`), so a set-up is drawn the same for every controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdfctl.robots.robot import Robot
from cdfctl.scenario.draws import Obstacles, draw, has_rules
from cdfctl.scenario.schema import Scenario
from cdfctl.simulation.clearance import Clearance, nearest
from cdfctl.simulation.motion import SceneMotion
from cdfctl.types import Array


def draw_trial(scenario: Scenario, trial: int, robot: Robot) -> Scenario:
    """The set-up of one trial of ``scenario``, from its own seed, among what ``robot`` allows.

    Raises:
        UndrawableError: every attempt was refused by a rule.
        InputError: ``trial`` is negative, or the file of a shape cannot be read.
    """
    # A start that is not the robot's is complained of once the trial is drawn: there is no distance to it.
    if not has_rules(scenario) or len(scenario.robot.q0) != robot.n:
        drawn = draw(without_rules(scenario), scenario.seed, trial)
    else:
        drawn = draw(scenario, scenario.seed, trial, RobotGeometry(robot))
    measurement = scenario.measurement
    if measurement.exact or measurement.trial is not None:
        return drawn
    # As written out, the scenario must have the same errors whatever trial it is run as.
    return drawn.model_copy(update={"measurement": measurement.model_copy(update={"trial": trial})})


def without_rules(scenario: Scenario) -> Scenario:
    """``scenario`` without the rules by which its draws are refused."""
    if not has_rules(scenario):
        return scenario
    obstacles = tuple(o.model_copy(update={"redraw_within": None}) for o in scenario.obstacles)
    return scenario.model_copy(update={"obstacles": obstacles, "redraw_within": None})


class RobotGeometry:
    """Distances between one robot and drawn obstacles; see :class:`cdfctl.scenario.draws.Geometry`."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    def clearance(self, q: Sequence[float], obstacles: Obstacles) -> float:
        """Least signed distance (m) of the robot at ``q`` (n,) to the obstacles at t = 0."""
        found = nearest(self._robot, np.asarray(q, dtype=np.float64), SceneMotion(obstacles).at(0.0))
        return math.inf if found is None else found.distance

    def path_clearance(self, ends: tuple[Sequence[float], Sequence[float]], obstacles: Obstacles) -> float:
        """Least signed distance (m) of a segment to the balls around the obstacles, over all t >= 0."""
        motion = SceneMotion(obstacles)
        scene = motion.at(0.0)
        radii = Clearance(self._robot, motion.shapes).reach
        a, b = (np.asarray(end, dtype=np.float64) for end in ends)
        distances = [
            ray_to_segment(pose[:3], twist[:3], a, b) - radius
            for pose, twist, radius in zip(scene.poses, scene.twists, radii, strict=True)
        ]
        return min(distances, default=math.inf)


def ray_to_segment(p: Array, v: Array, a: Array, b: Array) -> float:
    """Least distance (m) of the ray p + t v, t >= 0, to the segment from a to b; all (3,).

    |p + t v - a - s (b - a)|^2 is convex in (t, s): the least value is where its gradient vanishes, if that is inside
    t >= 0 and 0 <= s <= 1, else on one of the edges t = 0, s = 0 and s = 1.
    """
    w, e = p - a, b - a
    vv, ve, ee, vw, ew = (float(x @ y) for x, y in ((v, v), (v, e), (e, e), (v, w), (e, w)))

    def gap(t: float, s: float) -> float:
        return float(np.linalg.norm(w + t * v - s * e))

    def along(s: float) -> float:
        """The best t >= 0 for this s."""
        return max(0.0, (s * ve - vw) / vv) if vv > 0.0 else 0.0

    at_start = min(max(ew / ee, 0.0), 1.0) if ee > 0.0 else 0.0
    least = min(gap(0.0, at_start), gap(along(0.0), 0.0), gap(along(1.0), 1.0))
    determinant = vv * ee - ve * ve
    if determinant > 1e-12 * vv * ee:
        t, s = (ve * ew - ee * vw) / determinant, (vv * ew - ve * vw) / determinant
        if t >= 0.0 and 0.0 <= s <= 1.0:
            least = min(least, gap(t, s))
    return least
