"""The paper's table, as printed: time to reach (s), path (rad) and success of five methods on six scenarios.

Four cells cannot be as printed, and are flagged wherever they are shown. As in the paper, a failure counts as 20 s in
the mean time; the printed path fits the joint-space length, not that of the end effector.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

SCENARIOS = ("S1", "S2", "S3", "C1", "C2", "C3")
METHODS = ("cdf-tvcbf-qp", "sdf-tvcbf-qp", "sdf-cbf-qp", "sdf-sh-qp", "cdf-sh-qp")
"""The scenarios and the methods of the table, in its order: ``--suite paper``."""

Triple = tuple[float, float, float]

NOT_COMPARABLE = "the paper ends C2 by another rule: its least time, 3.5 s, is before the slowest ball can have passed"


@dataclass(frozen=True)
class Printed:
    """A cell of the paper's table: (least, greatest, mean) of time and path, None where it prints a dash.

    Attributes:
        time: s.
        path: rad.
        success: a rate.
        impossible: what in it cannot be, by quantity.
        time_comparable: whether its times mean what ours do.
    """

    time: Triple | None
    path: Triple | None
    success: float
    impossible: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    time_comparable: bool = True

    def document(self) -> dict[str, Any]:
        """For JSON: the same keys as ours beside it."""
        return {
            "success_rate": self.success,
            "time_to_reach_s": _spread(self.time),
            "joint_path_rad": _spread(self.path),
            "impossible": dict(self.impossible),
            "time_comparable": self.time_comparable,
        }


def _spread(triple: Triple | None) -> dict[str, float] | None:
    return None if triple is None else dict(zip(("min", "max", "mean"), triple, strict=True))


_TIME: dict[str, tuple[Triple | None, ...]] = {
    "cdf-tvcbf-qp": (
        (2.9, 3.8, 3.2), (3.2, 4.5, 3.8), (3.0, 6.4, 4.4), (2.8, 4.0, 3.1), (3.5, 15.8, 12.3), (3.3, 10.3, 7.1),
    ),
    "sdf-tvcbf-qp": (
        (3.5, 4.8, 3.9), (3.4, 4.5, 3.9), (3.1, 6.4, 4.8), (2.8, 4.3, 3.3), (3.4, 10.5, 14.0), (3.7, 13.0, 9.6),
    ),
    "sdf-cbf-qp": ((2.9, 2.9, 19.8), None, None, (2.8, 3.1, 9.3), None, (3.0, 4.2, 13.9)),
    "sdf-sh-qp": ((3.1, 4.9, 8.7), (3.2, 4.4, 13.2), (3.0, 6.3, 9.5), (2.5, 3.4, 9.7), None, (2.6, 6.7, 16.2)),
    "cdf-sh-qp": ((3.1, 4.7, 6.9), (3.1, 4.4, 12.6), (3.0, 6.3, 7.2), (2.5, 2.9, 9.3), None, (2.5, 2.8, 15.8)),
}  # fmt: skip

_PATH: dict[str, tuple[Triple | None, ...]] = {
    "cdf-tvcbf-qp": (
        (6.12, 7.50, 6.72), (7.48, 8.75, 7.47), (6.46, 10.43, 8.25), (2.64, 4.09, 3.24), (2.06, 7.19, 4.43),
        (3.67, 6.84, 4.83),
    ),
    "sdf-tvcbf-qp": (
        (6.22, 7.71, 6.64), (6.30, 8.03, 7.06), (6.38, 12.37, 8.52), (2.78, 4.35, 3.51), (2.29, 4.80, 2.77),
        (4.21, 10.04, 5.09),
    ),
    "sdf-cbf-qp": ((6.13, 6.13, 6.13), None, None, (2.38, 2.16, 2.63), None, (3.53, 4.03, 3.73)),
    "sdf-sh-qp": (
        (6.73, 9.52, 7.58), (6.66, 8.69, 7.41), (6.63, 10.43, 8.85), (2.09, 3.97, 2.78), None, (3.75, 6.44, 4.62),
    ),
    "cdf-sh-qp": (
        (6.54, 10.04, 7.48), (6.82, 9.63, 7.62), (6.68, 13.62, 9.60), (2.07, 3.49, 2.68), None, (3.07, 3.75, 3.23),
    ),
}  # fmt: skip

_SUCCESS: dict[str, tuple[float, ...]] = {
    "cdf-tvcbf-qp": (1.00, 1.00, 1.00, 1.00, 0.66, 0.92),
    "sdf-tvcbf-qp": (1.00, 1.00, 1.00, 1.00, 0.42, 0.81),
    "sdf-cbf-qp": (0.01, 0.00, 0.00, 0.62, 0.00, 0.37),
    "sdf-sh-qp": (0.69, 0.41, 0.68, 0.63, 0.00, 0.24),
    "cdf-sh-qp": (0.79, 0.45, 0.82, 0.59, 0.00, 0.24),
}

_IMPOSSIBLE: dict[tuple[str, str], tuple[str, str]] = {
    ("S2", "cdf-tvcbf-qp"): ("joint_path_rad", "the mean, 7.47, is below the least, 7.48"),
    ("C1", "sdf-cbf-qp"): ("joint_path_rad", "the least, 2.38, is above the greatest, 2.16"),
    ("C1", "sdf-sh-qp"): (
        "time_to_reach_s",
        "with failures as 20 s the mean, 9.7, implies 3.65 over the successes, above the greatest, 3.4",
    ),
    ("C1", "cdf-sh-qp"): (
        "time_to_reach_s",
        "with failures as 20 s the mean, 9.3, implies 1.9 over the successes, below the least, 2.5",
    ),
}


def printed(scenario: str, controller: str) -> Printed | None:
    """The paper's cell, None where it has none."""
    if scenario not in SCENARIOS or controller not in METHODS:
        return None
    column = SCENARIOS.index(scenario)
    flaw = _IMPOSSIBLE.get((scenario, controller))
    return Printed(
        time=_TIME[controller][column],
        path=_PATH[controller][column],
        success=_SUCCESS[controller][column],
        impossible=MappingProxyType({flaw[0]: flaw[1]} if flaw else {}),
        time_comparable=scenario != "C2",
    )
