"""The grid of a table: points in the middle of cubes that fill the box the robot can reach."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from cdfctl.fields.kernel.body import Body, forward, new_frames
from cdfctl.types import Array, IntArray

SAMPLES = 4096  # configurations that tell how far the robot reaches


class Grid(NamedTuple):
    """``shape`` (3,) points along x, y, z, the first at ``origin`` (3,) m, each ``spacing`` m from the next."""

    origin: Array
    spacing: float
    shape: IntArray

    @property
    def size(self) -> int:
        """How many points there are."""
        return int(np.prod(self.shape))

    def points(self) -> Array:
        """(size, 3) m, x slowest."""
        places = np.stack(np.meshgrid(*(np.arange(k) for k in self.shape), indexing="ij"), axis=-1)
        points: Array = self.origin + self.spacing * places.reshape(-1, 3)
        return points


def sampling_limits(body: Body) -> tuple[Array, Array]:
    """(n,), (n,) between which configurations are drawn: the limits, and one turn of a joint that has none."""
    lower, upper = body.chain.lower, body.chain.upper
    return np.where(np.isfinite(lower), lower, -np.pi), np.where(np.isfinite(upper), upper, np.pi)


def workspace_grid(body: Body, resolution: int, radius: float) -> Grid:
    """Cubes, ``resolution`` of them along the longest side of the box in which a ball of ``radius`` can touch.

    Each cube has one point in its middle. A side shorter than a cube has one point, so a planar arm has a flat grid.
    """
    lower, upper = reach_box(body)
    low, high = lower - radius, upper + radius
    spacing = float(np.max(high - low)) / resolution
    shape = np.maximum(1, np.ceil((high - low) / spacing - 1e-6)).astype(np.int64)
    origin = 0.5 * (low + high) - 0.5 * spacing * (shape - 1)
    return Grid(origin, spacing, shape)


def reach_box(body: Body) -> tuple[Array, Array]:
    """Corners (3,), (3,) of a box around the moving pieces at many configurations, m.

    A piece counts with the box of its own frame, which is a little more than the piece.
    """
    corners = _piece_corners(body)
    least, greatest = sampling_limits(body)
    draws = np.random.default_rng(0).uniform(least, greatest, (SAMPLES, len(least)))
    frames = new_frames(body)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for q in draws:
        forward(body, q, frames, 0)
        world = np.einsum("kij,kcj->kci", frames.rotation[0, body.joint], corners)
        world += frames.translation[0, body.joint][:, None, :]
        low, high = np.minimum(low, world.min(axis=(0, 1))), np.maximum(high, world.max(axis=(0, 1)))
    return low, high


def _piece_corners(body: Body) -> Array:
    """(k, 8, 3) corners of the box around each piece, in the frame of its joint."""
    choices = np.array(list(itertools.product((False, True), repeat=3)))
    corners = np.empty((len(body.joint), 8, 3))
    for k, info in enumerate(body.sets.info):
        low, high = info["lower"] - info["radius"], info["upper"] + info["radius"]
        corners[k] = np.where(choices, high, low) @ body.rotation[k].T + body.translation[k]
    return corners
