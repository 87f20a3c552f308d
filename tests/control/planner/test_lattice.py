"""The lattice: its way is a motion that coal finds free, it says when there is none, and what it learns lasts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdfctl.control.planner.arm import arm_of
from cdfctl.control.planner.guide import Guide
from cdfctl.control.planner.march import STEP, new_space
from cdfctl.control.planner.plan import Aim
from cdfctl.control.planner.tree import new_tree
from cdfctl.control.prediction import Prediction, Predictor
from cdfctl.robots.robot import load_robot
from cdfctl.simulation.clearance import Clearance
from cdfctl.types import Obstacle, Scene, Sphere

pytestmark = pytest.mark.xdist_group("planner")  # one worker compiles it, not two at once

MARGIN = 0.03
GOAL = np.array([-2.7, 0.5])
Q0 = np.array([2.5, 0.5])
DT = 0.1


@pytest.fixture(scope="module")
def robot():
    return load_robot("planar", velocity_limits=2.0)


class Search:
    """The guide of one robot and what it is called with."""

    def __init__(self, robot):
        self.guide, self.predictor = Guide(robot, 6.0, DT), Predictor(Prediction(MARGIN))
        self.arm, self.tree = arm_of(robot), new_tree(8, 32, 2)
        self.aim = Aim(
            GOAL, np.zeros(2), robot.velocity_limit, robot.lower, robot.upper, robot.velocity_limit, 0.0, 6.0
        )

    def __call__(self, scene, effort=math.inf):
        """The work it takes until there is a way, or none, in portions of ``effort``."""
        course, work = self.predictor.course(scene), 0.0
        space = new_space(self.arm, len(course.block))
        self.guide.begin(course, self.aim)
        done = False
        while not done:
            done = self.guide.find(self.arm, course, self.aim, Q0, effort, self.tree, space)
            work += float(space.looks[0])
        return work


def discs(t=0.0):
    """Two that cross the straight way, and one that stands in it."""
    moving = [([2.2, -3.0, 0.0], [0.0, 1.5, 0.0]), ([5.0, 3.0, 0.0], [0.3, -1.0, 0.0]), ([0.0, 3.6, 0.0], [0.0] * 3)]
    shape = Sphere(0.3)
    return Scene([Obstacle(shape, list(np.add(p, np.multiply(t, v))), velocity=v, name=str(p)) for p, v in moving])


def test_its_way_is_free_to_coal_keeps_the_speeds_and_ends_at_the_goal(robot):
    search = Search(robot)
    search(discs())
    count = search.guide.found
    assert count > 1
    u, tau = search.tree.move[:count], search.tree.tau[:count]
    assert np.abs(u).max() <= 2.0 + 1e-9
    np.testing.assert_allclose(tau / DT, np.round(tau / DT), atol=1e-9)  # it turns at control steps
    q, t = np.vstack([Q0, Q0 + np.cumsum(u * tau[:, None], axis=0)]), np.append(0.0, np.cumsum(tau))
    ahead = np.abs(GOAL - q[-1]).max() / 2.0
    q, t = np.vstack([q, GOAL]), np.append(t, t[-1] + ahead)
    clearance = Clearance(robot, discs().shapes)
    for now in np.linspace(0.0, t[-1], 400):
        at = np.array([np.interp(now, t, q[:, j]) for j in range(2)])
        clearance.place(at, discs(now).poses)
        assert clearance.distances().min() >= MARGIN - 2.0 * STEP - 1e-6


def test_it_says_when_there_is_no_way_and_remembers(robot):
    """A disc comes onto the base. What is dead needs no look at the next step."""
    scene = Scene([Obstacle(Sphere(0.5), [2.0, -1.0, 0.0], velocity=[-2.0, 1.0, 0.0])])
    search = Search(robot)
    work = search(scene)
    assert search.guide.found == -1
    assert search(scene) < 0.05 * work
    search.guide.reset()
    assert search(scene) == work


def test_a_search_goes_on_where_it_was(robot):
    """In small portions it finds what it finds at once."""
    whole, parts = Search(robot), Search(robot)
    whole(discs())
    parts(discs(), effort=200.0)
    count = parts.guide.found
    assert count == whole.guide.found > 0
    np.testing.assert_array_equal(parts.tree.move[:count], whole.tree.move[:count])
    np.testing.assert_array_equal(parts.tree.tau[:count], whole.tree.tau[:count])
