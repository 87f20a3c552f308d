"""The controllers by name: a table, field x safety condition x task, and the default of every controller parameter.

A variant is data. The code that runs it reads the three choices and wires rows accordingly; adding a controller is
adding a row here. A row is present only if the code can run it, so the table is also the list of what is allowed.

Equations, with h = d - margin, u the joint velocity and all derivatives as in the method page:

- ``tvcbf``: dh/dq . u + dh/dt >= -alpha h
- ``cbf``: dh/dq . u >= -alpha h (the same without the time term)
- ``hyperplane``: -dd/dq . u Dt <= ln(d + b), the separating hyperplane; it takes d itself, not h
- task ``tvclf``: dV+/dq . u <= -gamma V - (V+ - V)/Dt + delta, delta >= 0, with V the distance to the target where it
  is and V+ where it will be one step on; the reference velocity is zero
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from cdfctl.errors import unknown_name

FieldKind = Literal["sdf", "cdf", "dual"]
SafetyKind = Literal["tvcbf", "cbf", "hyperplane"]
TaskKind = Literal["joint-goal", "tvclf"]
Value = float | int | str


@dataclass(frozen=True)
class Default:
    """A controller parameter's default ``value``, and the ``source`` of that number."""

    value: Value
    source: str


@dataclass(frozen=True)
class Variant:
    """One controller: three choices, its equation, where it comes from, and the defaults it changes.

    Attributes:
        name: what a scenario's ``controller.variant`` says.
        field: the distance field its safety rows use.
        safety: the form of a safety row.
        task: ``joint-goal`` tracks a joint goal (tasks joint-goal and hold); ``tvclf`` reaches with the whole body.
        equation: its safety row in one line.
        source: paper section, or ours.
        plans: it follows plans over predicted obstacles; the safety rows act where no free plan is found.
        defaults: parameters whose default differs from :data:`DEFAULTS`.
    """

    name: str
    field: FieldKind
    safety: SafetyKind
    task: TaskKind
    equation: str
    source: str
    plans: bool = False
    defaults: Mapping[str, Default] = dataclasses.field(default_factory=lambda: MappingProxyType({}))


DEFAULTS: Mapping[str, Default] = MappingProxyType(
    {
        "alpha": Default(1.0, "paper, settings of the planar experiments"),
        "gamma": Default(1.0, "paper, settings of the planar experiments"),
        "margin": Default(0.05, "paper, settings of the planar experiments"),
        "reach_tolerance": Default(0.02, "paper, settings of the planar experiments"),
        "gain": Default(4.0, "ours; planar scenarios write 9.9, the one-step problem of the paper's predecessor"),
        "effort_weight": Default(1.0, "ours"),
        "smoothness_weight": Default(0.0, "ours"),
        "slack_weight": Default(100.0, "ours: at least 100 times the effort weight"),
        "violation_weight": Default(100.0, "ours"),
        "hyperplane_offset": Default(0.3, "ours: the paper does not print it"),
        "limit_alpha": Default(3.0, "ours: the paper does not print it"),
        "self_collision": Default(0, "ours: off; 6 rows cost 0.2 ms a step"),
        "self_collision_margin": Default(0.02, "ours"),
        "links": Default("nearest", "paper: the least distance over the links, one row an obstacle"),
        "sheets": Default(1, "paper: the nearest contact only"),
        "on_infeasible": Default("least-violation", "ours: the paper is silent"),
        "solver": Default("daqp", "ours"),
    }
)

VARIANTS: Mapping[str, Variant] = MappingProxyType(
    {
        variant.name: variant
        for variant in (
            Variant(
                name="dual-tvcbf-qp",
                field="dual",
                safety="tvcbf",
                task="joint-goal",
                equation="dh/dq . u + dh/dt >= -alpha h,  both for h = d_c - margin and for h = d_s - margin",
                source="ours: rows in configuration space, and signed-distance rows where those can jump",
                defaults=MappingProxyType(
                    {
                        "alpha": Default(3.0, "ours"),
                        "sheets": Default(4, "ours: with the nearest contact alone the next one gets crossed"),
                        "links": Default("all", "ours: one signed-distance row a link"),
                    }
                ),
            ),
            Variant(
                name="cdf-tvcbf-qp",
                field="cdf",
                safety="tvcbf",
                task="joint-goal",
                equation="dh/dq . u + dh/dt >= -alpha h,  h = d_c - margin",
                source="paper, time-varying CBF with the configuration-space distance field",
            ),
            Variant(
                name="cdf-cbf-qp",
                field="cdf",
                safety="cbf",
                task="joint-goal",
                equation="dh/dq . u >= -alpha h,  h = d_c - margin",
                source="ours: the ablation of the time term",
            ),
            Variant(
                name="sdf-tvcbf-qp",
                field="sdf",
                safety="tvcbf",
                task="joint-goal",
                equation="dh/dq . u + dh/dt >= -alpha h,  h = d_s - margin",
                source="paper, time-varying CBF with the signed distance field",
            ),
            Variant(
                name="sdf-cbf-qp",
                field="sdf",
                safety="cbf",
                task="joint-goal",
                equation="dh/dq . u >= -alpha h,  h = d_s - margin",
                source="paper, baseline: blind to the obstacle's velocity",
            ),
            Variant(
                name="sdf-sh-qp",
                field="sdf",
                safety="hyperplane",
                task="joint-goal",
                equation="-dd/dq . u Dt <= ln(d + b),  d = d_s",
                source="paper, baseline: separating hyperplanes of its predecessor",
            ),
            Variant(
                name="cdf-sh-qp",
                field="cdf",
                safety="hyperplane",
                task="joint-goal",
                equation="-dd/dq . u Dt <= ln(d + b),  d = d_c",
                source="paper, baseline: separating hyperplanes with the configuration-space distance",
            ),
            Variant(
                name="cdf-tvcbf-tvclf-qp",
                field="cdf",
                safety="tvcbf",
                task="tvclf",
                equation="as cdf-tvcbf-qp, and dV+/dq . u <= -gamma V - (V+ - V)/Dt + delta,  V = d_c of the target",
                source="paper, whole-body reaching",
            ),
            Variant(
                name="sdf-tvcbf-tvclf-qp",
                field="sdf",
                safety="tvcbf",
                task="tvclf",
                equation="as sdf-tvcbf-qp, and dV+/dq . u <= -gamma V - (V+ - V)/Dt + delta,  V = d_s of the target",
                source="paper, whole-body reaching, with the signed distance field: singular where the CDF is not",
            ),
            Variant(
                name="predictive-tvcbf",
                field="sdf",
                safety="tvcbf",
                task="joint-goal",
                equation="the fastest plan found with d_s >= margin(t); else as sdf-tvcbf-qp around the longest",
                source="ours: rollout plans over predicted obstacles, with the rows behind them",
                plans=True,
                defaults=MappingProxyType(
                    {
                        "alpha": Default(3.0, "ours"),
                        "margin": Default(0.03, "ours: 0.01 loses 0.07 of the successes on X2"),
                        "segments": Default(16, "ours"),
                        "horizon": Default(8.0, "ours: 3 s leave some of X2 unsolved"),
                        "candidates": Default(256, "ours"),
                        "planner_seed": Default(0, "ours"),
                        "prediction": Default("constant-twist", "ours"),
                        "delay": Default(0.0, "ours"),
                        "position_error": Default(0.0, "ours"),
                        "velocity_error": Default(0.0, "ours"),
                    }
                ),
            ),
        )
    }
)

DEFAULT_VARIANT = "dual-tvcbf-qp"

TASKS_OF: Mapping[TaskKind, tuple[str, ...]] = MappingProxyType(
    {"joint-goal": ("joint-goal", "hold"), "tvclf": ("reach",)}
)
"""Which task types of a scenario a variant's task part can do."""


def variant_named(name: str) -> Variant:
    """The row called ``name``.

    Raises:
        InputError: there is none; the hint names what is allowed.
    """
    if name not in VARIANTS:
        raise unknown_name("controller", name, VARIANTS)
    return VARIANTS[name]


def defaults_of(name: str) -> dict[str, Value]:
    """Every controller parameter's default for the variant ``name`` (an :class:`InputError` if there is none)."""
    merged = {**DEFAULTS, **variant_named(name).defaults}
    return {parameter: default.value for parameter, default in merged.items()}
