"""A distance field over the plane of two joints: sampled, and drawn with its level sets and gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, isfinite, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from cdfctl.fields.field import Field
from cdfctl.report.figures.style import BLACK, FIELD_MAP, VERMILION
from cdfctl.types import Array, Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FLAT = 1e-6  # m/rad: the norm of a gradient that says nothing
ARROWS = 15  # along each joint
NAMES = {"cdf": "configuration-space distance [rad]", "sdf": "signed distance [m]"}


@dataclass(frozen=True)
class FieldMap:
    """A field over the plane of two joints: of the nearest obstacle, at every point.

    Attributes:
        unit: of ``d``.
        x, y: (k,), (l,) values of the first and of the second joint, rad.
        d: (l, k) the distance; +inf out of reach, -inf where no way out of a penetration was found.
        dq: (l, k, 2) its gradient.
    """

    unit: str
    x: Array
    y: Array
    d: Array
    dq: Array

    @property
    def top(self) -> float:
        """The greatest distance that is finite, 0 where there is none."""
        return float(np.max(self.d, initial=0.0, where=np.isfinite(self.d)))


def sample(field: Field, scene: Scene, x: Array, y: Array) -> FieldMap:
    """``field`` of the obstacles of ``scene`` at all pairs of ``x`` (k,) and ``y`` (l,), rad.

    Every point is asked twice: on a walk to and fro, where a query starts from the contacts of the neighbour, and on
    its own. Every contact found is a contact, so the nearer one is the better answer.
    """
    m, shape = len(scene), (len(y), len(x))
    d, dq = np.full((*shape, m), np.inf), np.zeros((*shape, m, 2))
    for alone in (False, True):
        field.reset()
        for i in range(shape[0]):
            for j in range(shape[1])[:: 1 if i % 2 == 0 else -1]:
                if alone:
                    field.reset()
                answer = field.query((x[j], y[i]), scene)
                nearer = (np.abs(answer.d) < np.abs(d[i, j])) | np.isposinf(d[i, j])
                d[i, j, nearer], dq[i, j, nearer] = answer.d[nearer], answer.dq[nearer]
    field.reset()
    return _nearest(field.unit, x, y, d, dq)


def both_maps(field: Field, scene: Scene, x: Array, y: Array) -> dict[str, FieldMap]:
    """The maps ``sdf``, of the signed distance ``field``, and ``cdf``, of the configuration-space distance.

    The second is that of the definition, not of a search: the distance to the nearest point of the curves on which the
    signed distance of one obstacle is zero. It is as good as the grid: 0.02 rad on the coarsest of :mod:`.joint_space`.
    """
    from contourpy import contour_generator
    from scipy.spatial import KDTree

    shape, m = (len(y), len(x)), len(scene)
    d, dq = np.full((*shape, m), np.inf), np.zeros((*shape, m, 2))
    if m:
        for i in range(shape[0]):
            for j in range(shape[1]):
                answer = field.query((x[j], y[i]), scene)
                d[i, j], dq[i, j] = answer.d, answer.dq
    signed = _nearest(field.unit, x, y, d, dq)
    curves = [line for i in range(m) for line in contour_generator(x, y, d[:, :, i]).lines(0.0)]
    if not curves:
        return {"sdf": signed, "cdf": FieldMap("rad", x, y, np.full(shape, np.inf), np.zeros((*shape, 2)))}
    contacts = np.concatenate([_finer(np.asarray(line)) for line in curves])
    at = np.stack(np.meshgrid(x, y), axis=-1)
    distance, place = KDTree(contacts).query(at)
    away = np.divide(at - contacts[place], distance[..., None], out=np.zeros_like(at), where=distance[..., None] > 1e-9)
    sign = np.where(signed.d < 0.0, -1.0, 1.0)
    return {"sdf": signed, "cdf": FieldMap("rad", x, y, sign * distance, sign[..., None] * away)}


def _finer(line: Array, spacing: float = 0.01) -> Array:
    """Points along a line (k, 2), at most ``spacing`` apart."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0.0, length[-1], int(np.ceil(length[-1] / spacing)) + 1)
    return np.stack([np.interp(at, length, line[:, joint]) for joint in (0, 1)], axis=1)


def _nearest(unit: str, x: Array, y: Array, d: Array, dq: Array) -> FieldMap:
    """The map of the least of the distances ``d`` (l, k, m) of m obstacles."""
    if d.shape[2] == 0:
        return FieldMap(unit, x, y, np.full(d.shape[:2], np.inf), np.zeros((*d.shape[:2], 2)))
    least = d.argmin(axis=2)[..., None]
    gradient = np.take_along_axis(dq, least[..., None], axis=2)[..., 0, :]
    return FieldMap(unit, x, y, np.take_along_axis(d, least, axis=2)[..., 0], gradient)


def level_steps(top: float, most: int = 10) -> Array:
    """Levels 0, s, 2 s, … up to at least ``top``, at most ``most`` of them, s one of 1, 2, 2.5, 5 times a power of
    ten."""
    if not isfinite(top) or top <= 0.0:
        return np.array([0.0, 1.0])
    power = 10.0 ** floor(np.log10(top / most))
    step = next(power * factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if top / (power * factor) <= most)
    steps: Array = step * np.arange(ceil(round(top / step, 9)) + 1)
    return steps


def draw_map(axes: Axes, found: FieldMap, steps: Array, *, arrows: int = ARROWS) -> tuple[Any, bool]:
    """Level sets at ``steps``, the gradient's arrows, and a hatch where the gradient is zero.

    Returns:
        The filled contours, for a colour bar, and whether there was something to hatch.
    """
    x, y, d = found.x, found.y, np.ma.masked_invalid(found.d)
    filled = axes.contourf(x, y, np.ma.clip(d, 0.0, steps[-1]), steps, cmap=FIELD_MAP)
    if d.count():
        axes.contour(x, y, d, steps[1:], colors=BLACK, linewidths=0.35)
    norm = np.linalg.norm(found.dq, axis=2)
    flat = np.isfinite(found.d) & (norm < FLAT)
    if flat.any():
        axes.contourf(x, y, flat.astype(float), [0.5, 1.5], colors="none", hatches=["////"])
    across, up = (np.unique(np.linspace(0, k - 1, arrows + 2).round().astype(int)[1:-1]) for k in (len(x), len(y)))
    pick = np.ix_(up, across)
    seen = np.isfinite(found.d[pick]) & (found.d[pick] > 0.0) & (norm[pick] >= FLAT)
    if seen.any():
        at_x, at_y = np.meshgrid(x[across], y[up])
        arrow = found.dq[pick][seen] / norm.max()
        spacing = float(x[-1] - x[0]) / (arrows + 1)
        quiver = axes.quiver(
            at_x[seen], at_y[seen], *arrow.T, color="white", edgecolor=BLACK, linewidth=0.25, angles="xy",
            scale_units="xy", scale=1.25 / spacing, width=0.008, headwidth=4.0, pivot="mid",
        )  # fmt: skip
        quiver.set_zorder(2.5)
    return filled, bool(flat.any())


def draw_region(
    axes: Axes, found: FieldMap, *, face: str | None = VERMILION, edge: str = "white", hatch: str | None = None
) -> None:
    """The configurations in contact: where ``found``, a signed distance, is not positive."""
    d = np.where(np.isnan(found.d), np.inf, found.d)
    if not (d <= 0.0).any():
        return
    d = np.clip(d, -1e3, 1e3)
    if face is not None or hatch is not None:
        axes.contourf(
            found.x, found.y, d, [-2e3, 0.0], colors=[face] if face else "none", hatches=[hatch], zorder=2.6
        )  # fmt: skip
    if (d > 0.0).any():
        axes.contour(found.x, found.y, d, [0.0], colors=edge, linewidths=1.2, zorder=2.7)


def joint_axes(axes: Axes, names: Sequence[str], x: Array, y: Array) -> None:
    """Labels, limits and, where the range is about a turn, ticks at parts of π."""
    axes.set(xlabel=f"{names[0]} [rad]", ylabel=f"{names[1]} [rad]", aspect="equal")
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    ticks, labels = [-pi, -pi / 2, 0.0, pi / 2, pi], ["−π", "−π/2", "0", "π/2", "π"]
    for values, axis in ((x, axes.xaxis), (y, axes.yaxis)):
        if 2.0 < values[-1] - values[0] < 7.0:
            inside = [i for i, tick in enumerate(ticks) if values[0] - 1e-9 <= tick <= values[-1] + 1e-9]
            axis.set_ticks([ticks[i] for i in inside], labels=[labels[i] for i in inside])
