"""The plant of a scenario: what becomes of a commanded velocity. ``plant: mujoco`` is short for ``{type: mujoco}``."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import BeforeValidator, Field

from cdfctl.scenario.values import Flag, Label, PlainNonNegative, PlainPositive, Strict, about


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


class FrankaConfig(Strict):
    """A Franka Research 3 over libfranka's network interface (extra ``franka``)."""

    type: Annotated[Literal["franka"], about("a Franka Research 3, real or franky-sim (extra franka)")]
    host: Annotated[
        Label, about("the arm's address; the default is a simulator on this machine: a real arm is always named")
    ] = "127.0.0.1"
    hold: Annotated[
        PlainPositive | None,
        about("a command not renewed ramps to zero after this, in the arm's time; without it, 2.5 control steps", "s"),
    ] = None
    connect_timeout: Annotated[PlainPositive, about("give up connecting after this", "s")] = 5.0
    state_timeout: Annotated[PlainPositive, about("without a new state for this long, the run ends", "s")] = 0.5
    start_tolerance: Annotated[PlainPositive, about("how far each joint may be from robot.q0 at the start", "rad")] = (
        0.01
    )
    move_to_start: Annotated[
        Flag, about("where it is farther: go there slowly, by the scenario's safety rows; otherwise refuse")
    ] = False
    approach_speed: Annotated[PlainPositive, about("greatest joint speed of that", "rad/s")] = 0.2
    acceleration: Annotated[
        PlainPositive, about("greatest joint acceleration of the ramp from one command to the next", "rad/s^2")
    ] = 10.0
    jerk: Annotated[PlainPositive, about("greatest joint jerk of that ramp", "rad/s^3")] = 5000.0
    realtime: Annotated[Flag, about("insist on a real-time kernel (franky-sim needs none)")] = False


PlantConfig: TypeAlias = KinematicConfig | MujocoConfig | FrankaConfig
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
