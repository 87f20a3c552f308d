"""Starts moved near contact in batches by torch, on the processor or a GPU.

Every start is moved by a few of Newton's restoration steps on an approximation of the signed distance: the greatest
distance of the ball's centre from the planes of the piece's hull, or from the segment of a piece that has no faces. It
is exact where a face is nearest and too small at edges and corners; the kernel, which knows the shapes, does the rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cdfctl.errors import MissingError
from cdfctl.fields.kernel.body import Body
from cdfctl.fields.table.grid import sampling_limits
from cdfctl.types import Array

if TYPE_CHECKING:
    from cdfctl.robots.convex import ConvexPiece

STEPS = 3
LONGEST = 1.0  # rad
INSTALL = "python -m pip install 'cdfctl[torch]'"


class Planes(NamedTuple):
    """A piece: unit ``normal`` (t, 3) and ``offset`` (t,) of its faces, or the ``middle`` and ``half`` (3,) of its
    segment; and the radius around either."""

    normal: Any
    offset: Any
    middle: Any
    half: Any
    radius: float


def torch_for(device: str) -> Any:
    """The torch module, once it is known that ``device`` ("cpu" or "cuda") can be used.

    Raises:
        MissingError: torch is not installed, or finds no GPU.
    """
    try:
        import torch
    except ImportError:
        raise MissingError(f"--device {device} needs torch, which is not installed", hint=INSTALL) from None
    if device == "cuda" and not torch.cuda.is_available():
        raise MissingError("--device cuda needs a GPU that torch can use, and finds none", hint="use --device numpy")
    return torch


class Proposer:
    """Moves the starts of whole chunks."""

    def __init__(self, body: Body, pieces: tuple[ConvexPiece, ...], radius: float, device: str) -> None:
        """``pieces`` are those of ``body``, in its order; ``radius`` is the ball's, m."""
        torch = self._torch = torch_for(device)
        self._body, self._radius = body, radius
        self._like = {"device": device, "dtype": torch.float32}
        self._lower, self._upper = (self._tensor(limit) for limit in sampling_limits(body))
        self._planes = [self._planes_of(piece) for piece in pieces]

    def near_contact(self, points: Array, starts: Array) -> Array:
        """``starts`` (p, k, s, n) moved towards contact of piece k with the ball at ``points`` (p, 3)."""
        torch = self._torch
        moved = np.empty_like(starts)
        centre = self._tensor(np.repeat(points, starts.shape[2], axis=0))
        with torch.no_grad():
            for k in range(starts.shape[1]):
                x = self._tensor(starts[:, k].reshape(-1, starts.shape[3]))
                for _ in range(STEPS):
                    x = self._step(k, x, centre)
                moved[:, k] = x.double().cpu().numpy().reshape(starts[:, k].shape)
        lower, upper = sampling_limits(self._body)
        return np.clip(moved, lower, upper)

    def _step(self, k: int, x: Any, centre: Any) -> Any:
        """One step x - f g / ||g||² of piece k, held within the limits and to ``LONGEST``."""
        torch, joint = self._torch, int(self._body.joint[k])
        rotation, translation, axes, origins = self._forward(x, joint)
        f, normal = self._distance(k, rotation, translation, centre)
        # The witness on the piece lies f + radius back along the normal from the ball's centre.
        witness = centre - (f + self._radius)[:, None] * normal
        g = torch.zeros_like(x)
        for j, axis in axes.items():
            slides = self._body.chain.prismatic[j]
            column = axis if slides else torch.linalg.cross(axis, witness - origins[j])
            g[:, j] = -(normal * column).sum(-1)
        step = -(f / g.square().sum(-1).clamp_min(1e-4))[:, None] * g
        step = step * (LONGEST / step.norm(dim=-1).clamp_min(LONGEST))[:, None]
        return torch.minimum(torch.maximum(x + step, self._lower), self._upper)

    def _forward(self, x: Any, joint: int) -> tuple[Any, Any, dict[int, Any], dict[int, Any]]:
        """Placement of ``joint``, and axes and origins of the joints that move it, in the world."""
        torch, chain = self._torch, self._body.chain
        rotation = torch.eye(3, **self._like).expand(len(x), 3, 3)
        translation = torch.zeros(len(x), 3, **self._like)
        axes, origins = {}, {}
        for j in np.flatnonzero(chain.moves[:, joint]):  # from the base outwards
            translation = translation + rotation @ self._tensor(chain.translation[j])
            rotation = rotation @ self._tensor(chain.rotation[j])
            axes[int(j)] = rotation @ self._tensor(chain.axis[j])
            if chain.prismatic[j]:
                translation = translation + x[:, j, None] * axes[int(j)]
            else:
                rotation = rotation @ self._turn(chain.axis[j], x[:, j])
            origins[int(j)] = translation
        return rotation, translation, axes, origins

    def _turn(self, axis: Array, angle: Any) -> Any:
        cross = self._tensor(np.cross(np.eye(3), axis))
        sine, cosine = angle.sin()[:, None, None], angle.cos()[:, None, None]
        return self._torch.eye(3, **self._like) + sine * cross + (1.0 - cosine) * (cross @ cross)

    def _distance(self, k: int, rotation: Any, translation: Any, centre: Any) -> tuple[Any, Any]:
        """The approximation of f of piece k, and its normal towards the ball, in the world."""
        planes = self._planes[k]
        local = ((centre - translation)[:, None, :] @ rotation)[:, 0]
        if planes.normal is not None:
            height, face = (local @ planes.normal.T - planes.offset).max(dim=-1)
            normal = planes.normal[face]
        else:
            along = (local - planes.middle) @ planes.half / planes.half.square().sum().clamp_min(1e-12)
            away = local - planes.middle - along.clamp(-1.0, 1.0)[:, None] * planes.half
            height = away.norm(dim=-1)
            normal = away / height.clamp_min(1e-9)[:, None]
        return height - planes.radius - self._radius, (rotation @ normal[:, :, None])[:, :, 0]

    def _planes_of(self, piece: ConvexPiece) -> Planes:
        vertices = piece.vertices @ piece.rotation.T + piece.translation
        if len(piece.faces):
            a, b, c = (vertices[piece.faces[:, i]] for i in range(3))
            normal = np.cross(b - a, c - a)
            area = np.linalg.norm(normal, axis=1, keepdims=True)
            normal, a = (normal / area)[area[:, 0] > 1e-12], a[area[:, 0] > 1e-12]
            offset = np.einsum("ij,ij->i", normal, a)
            return Planes(self._tensor(normal), self._tensor(offset), None, None, piece.radius)
        middle = vertices.mean(axis=0)
        half = vertices[np.argmax(np.linalg.norm(vertices - middle, axis=1))] - middle
        return Planes(None, None, self._tensor(middle), self._tensor(half), piece.radius + piece.disc)

    def _tensor(self, array: Array) -> Any:
        return self._torch.as_tensor(np.asarray(array), **self._like)
