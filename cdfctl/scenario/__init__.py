"""What to do: scenario files, their schema, their defaults, their draws. Pure data, no numerics.

file = load_scenario("S1", overrides=["controller.alpha=3"])
trial = draw(resolve(file.scenario), seed=0, trial=17)
"""

from cdfctl.scenario.draws import draw, has_draws
from cdfctl.scenario.dump import dump
from cdfctl.scenario.library import Entry, ScenarioFile, find_scenario, list_scenarios, load_scenario
from cdfctl.scenario.overrides import Override, parse_override, set_fields
from cdfctl.scenario.problems import Problem, ScenarioErrors
from cdfctl.scenario.reference import FieldRow, json_schema, reference
from cdfctl.scenario.resolve import check_runnable, resolve, resolve_controller
from cdfctl.scenario.schema import (
    ControllerConfig,
    HoldTask,
    JointGoalTask,
    ReachTask,
    RobotConfig,
    Scenario,
    SimulationConfig,
    TargetConfig,
)
from cdfctl.scenario.shapes import (
    BallShape,
    BoxShape,
    CapsuleShape,
    CloudShape,
    CylinderShape,
    MeshShape,
    ObstacleConfig,
    SinusoidMotion,
    WaypointMotion,
)
from cdfctl.scenario.values import Uniform, floats, number
from cdfctl.scenario.variants import VARIANTS, Variant, defaults_of

__all__ = [
    "VARIANTS",
    "BallShape",
    "BoxShape",
    "CapsuleShape",
    "CloudShape",
    "ControllerConfig",
    "CylinderShape",
    "Entry",
    "FieldRow",
    "HoldTask",
    "JointGoalTask",
    "MeshShape",
    "ObstacleConfig",
    "Override",
    "Problem",
    "ReachTask",
    "RobotConfig",
    "Scenario",
    "ScenarioErrors",
    "ScenarioFile",
    "SimulationConfig",
    "SinusoidMotion",
    "TargetConfig",
    "Uniform",
    "Variant",
    "WaypointMotion",
    "check_runnable",
    "defaults_of",
    "draw",
    "dump",
    "find_scenario",
    "floats",
    "has_draws",
    "json_schema",
    "list_scenarios",
    "load_scenario",
    "number",
    "parse_override",
    "reference",
    "resolve",
    "resolve_controller",
    "set_fields",
]
