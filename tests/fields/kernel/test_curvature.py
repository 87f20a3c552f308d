"""The second derivative of the distance against differences of its gradient, for every pair of shapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdfctl.fields.kernel.body import Body, body_of
from cdfctl.fields.kernel.candidates import Candidates, new_candidates
from cdfctl.fields.kernel.contact import ACROSS, evaluate, hessian, new_scratch
from cdfctl.fields.kernel.curvature import SHARP
from cdfctl.fields.kernel.distance import Work, new_work
from cdfctl.fields.kernel.parts import Parts, parts_of, turn_obstacles
from cdfctl.robots.robot import load_robot
from cdfctl.types import Array, Box, Capsule, ConvexMesh, Cylinder, Shape, Sphere

LINK = """
  <link name="l{i}"><collision><origin xyz="0.02 0.01 0.1" rpy="0.3 0.2 0.1"/><geometry>{shape}</geometry></collision>
  </link>
  <joint name="j{i}" type="{kind}"><parent link="l{before}"/><child link="l{i}"/><origin xyz="0.05 0.1 0.2"
    rpy="0.4 {i}.3 0.2"/><axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>"""
SHAPES = (
    '<box size="0.1 0.2 0.3"/>',
    '<cylinder radius="0.06" length="0.25"/>',
    '<sphere radius="0.05"/>',
    '<box size="0.15 0.05 0.1"/>',
)
OBSTACLES: tuple[Shape, ...] = (
    Sphere(0.08),
    Box((0.2, 0.15, 0.1)),
    Capsule(0.05, 0.3),
    Cylinder(0.09, 0.2),
    ConvexMesh(np.random.default_rng(3).normal(size=(30, 3)) * 0.08),
)
STEP = 1e-5


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Body:
    """Four joints, one of them sliding, axes of all kinds, a link of every shape."""
    text = '<robot name="r"><link name="l0"/>'
    for i, shape in enumerate(SHAPES, start=1):
        kind, axis = ("prismatic", "0 0.6 0.8") if i == 2 else ("revolute", "0 0 1" if i % 2 else "1 0 0")
        text += LINK.format(i=i, before=i - 1, shape=shape, kind=kind, axis=axis)
    path: Path = tmp_path_factory.mktemp("robot") / "r.urdf"
    path.write_text(text + "</robot>")
    return body_of(load_robot(path))


def test_against_differences_of_the_gradient(body: Body) -> None:
    """Wherever the differences to both sides agree, which they do but where an edge or a corner takes over."""
    random, work, scratch, found = np.random.default_rng(0), new_work(), new_scratch(4), new_candidates(body, 2)
    compared = dict.fromkeys(range(len(OBSTACLES) * len(SHAPES)), 0)
    sizes = set()
    for trial in range(800):
        pair = trial % len(compared)
        found.piece[:], parts = pair % len(SHAPES), parts_of((OBSTACLES[pair // len(SHAPES)],))
        q, pose = random.uniform(-1.5, 1.5, 4), random.normal(size=7)
        pose[3:] /= np.linalg.norm(pose[3:])
        parts.pose[0] = pose
        turn_obstacles(parts.pose, parts.rotation)
        gradient_at(body, q, parts, found, work)
        radii = body.sets.info[found.piece[0]].radius + parts.sets.info[0].radius
        if found.f[0] + radii < SHARP:
            continue
        found.multiplier[0], found.residual[0] = 1.0, 0.0
        hessian(body, parts, found, 0, scratch)
        g = found.g[0].copy()
        H = scratch.B - np.eye(4) - ACROSS * np.outer(g, g) / (g @ g)
        sizes.add(int(found.corners[0]))
        ahead, behind = np.empty((4, 4)), np.empty((4, 4))
        for j in range(4):
            ahead[j] = gradient_at(body, q + STEP * np.eye(4)[j], parts, found, work) - g
            behind[j] = g - gradient_at(body, q - STEP * np.eye(4)[j], parts, found, work)
        if np.abs(ahead - behind).max() > 1e-3 * STEP * max(1.0, np.abs(H).max()):
            continue
        compared[pair] += 1
        error = np.abs(H - (ahead + behind) / (2.0 * STEP)).max()
        # Of cylinders GJK knows the normal to 1e-8 only.
        rim = body.sets.info[found.piece[0]].disc + parts.sets.info[0].disc > 0.0
        assert error <= (1e-3 if rim else 1e-6) * max(1.0, np.abs(H).max())
    assert min(compared.values()) >= 30
    assert sizes == {1, 2, 3}


def gradient_at(body: Body, q: Array, parts: Parts, found: Candidates, work: Work) -> Array:
    """Candidate 0 at q; its gradient."""
    found.x[0] = q
    evaluate(body, q, parts, 0, found, 0, work)
    gradient: Array = found.g[0].copy()
    return gradient
