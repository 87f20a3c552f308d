"""The plant of a scenario: what becomes of a commanded velocity. ``plant: mujoco`` is short for ``{type: mujoco}``."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import BeforeValidator, Field

from cdfctl.scenario.values import PlainNonNegative, PlainPositive, Strict, about


class KinematicConfig(Strict):
    """The single integrator: q(t + dt) = q(t) + u dt."""

    type: Annotated[Literal["kinematic"], about("the single integrator: q(t + dt) = q(t) + u dt")] = "kinematic"


class MujocoConfig(Strict):
    """MuJoCo physics: a velocity servo with gravity compensation (extra ``mujoco``)."""

    type: Annotated[Literal["mujoco"], about("physics: velocity servos with gravity compensation (extra mujoco)")]
    timestep: Annotated[
        PlainPositive, about("step of the physics; simulation.dt must be a whole multiple of it", "s")
    ] = 0.002
    servo_time: Annotated[
        PlainPositive,
        about("time constant of the slowest joint's servo: kv is the arm's greatest inertia over it", "s"),
    ] = 0.008
    gravity_compensation: Annotated[
        PlainNonNegative, about("share of the arm's weight that is compensated: 1 is all of it, 0 none")
    ] = 1.0


PlantConfig: TypeAlias = KinematicConfig | MujocoConfig
PLANTS: tuple[str, ...] = tuple(get_args(model.model_fields["type"].annotation)[0] for model in get_args(PlantConfig))
"""The plants by name."""


def expanded(value: object) -> object:
    """``mujoco`` as ``{type: mujoco}``; anything else as it is."""
    return {"type": value} if isinstance(value, str) else value


def _schema(schema: dict[str, Any]) -> None:
    schema["oneOf"] = [*schema["oneOf"], {"type": "string", "enum": list(PLANTS)}]
    schema.update({"default": PLANTS[0], "x-unit": "", "x-source": "paper, the single integrator"})


PlantField: TypeAlias = Annotated[
    Annotated[PlantConfig, Field(discriminator="type")],
    BeforeValidator(expanded),
    Field(
        description="what becomes of a commanded velocity; a type alone may be written plant: mujoco",
        json_schema_extra=_schema,
    ),
]
