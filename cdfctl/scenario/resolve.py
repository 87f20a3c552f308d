"""From a scenario as written to one that can be run: the variant's defaults filled in, and whether it can run."""

from __future__ import annotations

from cdfctl.errors import InputError, name_hint
from cdfctl.scenario.schema import ControllerConfig, Scenario
from cdfctl.scenario.values import Complaint
from cdfctl.scenario.variants import TASKS_OF, VARIANTS, defaults_of


def resolve_controller(controller: ControllerConfig) -> ControllerConfig:
    """``controller`` with every parameter set: what the file says, else the variant's default."""
    missing = {
        name: value for name, value in defaults_of(controller.variant).items() if getattr(controller, name) is None
    }
    return controller.model_copy(update=missing)


def resolve(scenario: Scenario) -> Scenario:
    """``scenario`` with the defaults of its variant written out; resolving twice changes nothing."""
    return scenario.model_copy(update={"controller": resolve_controller(scenario.controller)})


def obstructions(scenario: Scenario) -> list[Complaint]:
    """Why this valid scenario cannot be run, as (message, hint, place); empty where it can."""
    task, variant = scenario.task.type, VARIANTS[scenario.controller.variant]
    if task in TASKS_OF[variant.task]:
        return []
    able = [v.name for v in VARIANTS.values() if task in TASKS_OF[v.task]]
    if able:
        allowed = f"controllers for it: {', '.join(able)}; tasks of {variant.name}: {', '.join(TASKS_OF[variant.task])}"
        if "variant" in scenario.controller.model_fields_set:
            return [(f"controller '{variant.name}' cannot do task '{task}'", allowed, ("controller", "variant"))]
        # Nobody named that controller: what stands in the file is the task.
        message = f"the controller taken where none is named, '{variant.name}', cannot do task '{task}'"
        return [(message, f"set controller.variant; {allowed}", ("task", "type"))]
    runnable = [t for kind, tasks in TASKS_OF.items() for t in tasks if any(v.task == kind for v in VARIANTS.values())]
    return [(f"task '{task}' is not available yet", name_hint(task, runnable), ("task", "type"))]


def check_runnable(scenario: Scenario) -> None:
    """Refuse a scenario whose task no controller, or not this one, can do.

    Raises:
        InputError: it cannot run; the hint names what is allowed. (A :class:`ScenarioFile` has the same check with the
            place in the file.)
    """
    for message, hint, _ in obstructions(scenario):
        raise InputError(message, hint)
