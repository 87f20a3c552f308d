"""The controller's parameters with every default filled in, checked by the scenario's own rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from cdfctl.control.qp import OnInfeasible
from cdfctl.errors import unknown_name
from cdfctl.scenario.schema import ControllerConfig
from cdfctl.scenario.variants import VARIANTS, Variant, defaults_of
from cdfctl.scenario.wording import checked


@dataclass(frozen=True)
class Parameters:
    """Meaning and unit of each are those of the scenario's ``controller`` section."""

    alpha: float
    gamma: float
    margin: float
    reach_tolerance: float
    gain: float
    effort_weight: float | tuple[float, ...]
    smoothness_weight: float | tuple[float, ...]
    slack_weight: float
    violation_weight: float
    hyperplane_offset: float
    limit_alpha: float
    self_collision: int
    self_collision_margin: float
    links: Literal["nearest", "all"]
    sheets: int
    on_infeasible: OnInfeasible
    solver: str
    segments: int | None = None
    horizon: float | None = None
    candidates: int | None = None
    budget_ms: float | None = None
    planner_seed: int = 0
    prediction: Literal["constant-twist", "known"] = "constant-twist"
    delay: float = 0.0
    position_error: float = 0.0
    velocity_error: float = 0.0


def resolved(config: ControllerConfig) -> tuple[Variant, Parameters]:
    """The variant of a scenario's controller section and its parameters, the variant's defaults where none is given."""
    given = {name: value for name, value in config.model_dump().items() if value is not None}
    variant = VARIANTS[given.pop("variant")]
    values: dict[str, Any] = {**defaults_of(variant.name), **given}
    return variant, Parameters(**values)


def config_of(variant: str, given: dict[str, Any]) -> ControllerConfig:
    """A controller section from keyword arguments.

    Raises:
        InputError: an unknown variant or parameter (with the nearest valid name), or a value that is not allowed; all
            values at once.
    """
    if not isinstance(variant, str) or variant not in VARIANTS:
        raise unknown_name("controller", str(variant), VARIANTS)
    names = [name for name in ControllerConfig.model_fields if name != "variant"]
    for name in given:
        if name not in names:
            raise unknown_name("controller parameter", name, names)
    numeric = (np.ndarray, np.generic)
    plain = {name: value.tolist() if isinstance(value, numeric) else value for name, value in given.items()}
    return checked(ControllerConfig, {"variant": variant, **plain}, "controller")
