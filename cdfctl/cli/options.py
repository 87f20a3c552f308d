"""The options that commands share, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

if TYPE_CHECKING:
    from cdfctl.scenario.overrides import Override

Scenario: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="The name of a shipped scenario (see cdfctl scenarios), or a path: anything with a '/' or a suffix.",
        show_default=False,
    ),
]
Json: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output and nothing else there.")
]
Quiet: TypeAlias = Annotated[
    bool, typer.Option("--quiet", "-q", help="No progress, no notes, no summary; errors only.")
]
NamesOnly: TypeAlias = Annotated[bool, typer.Option("--quiet", "-q", help="Only the names, one a line.")]
Debug: TypeAlias = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]
Seed: TypeAlias = Annotated[
    int | None,
    typer.Option("--seed", metavar="N", min=0, help="Seed of the draws. [default: the scenario's]", show_default=False),
]
Trial: TypeAlias = Annotated[int, typer.Option("--trial", metavar="N", min=0, help="Which draw of the seed.")]
Controller: TypeAlias = Annotated[
    str | None,
    typer.Option("--controller", metavar="NAME", help="Controller. [default: the scenario's]", show_default=False),
]
Plant: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--plant",
        metavar="NAME",
        help="What becomes of a commanded velocity: kinematic (the integrator), mujoco (physics), franka (an arm). "
        "[default: the scenario's]",
        show_default=False,
    ),
]
Host: TypeAlias = Annotated[
    str | None,
    typer.Option("--host", metavar="ADDRESS", help="Plant franka: where the arm is.", show_default=False),
]
MoveToStart: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--move-to-start", help="Plant franka: where the arm is not at the start, go there slowly, by the safety rows."
    ),
]
DryRun: TypeAlias = Annotated[
    bool, typer.Option("--dry-run", help="Plant franka: print what would be sent; needs no arm and writes no folder.")
]
Live: TypeAlias = Annotated[
    bool, typer.Option("--live", help="Let cdfctl view RUN --live follow the run while it goes on.")
]
Settings: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="FIELD=VALUE",
        help="Set any field of the scenario by its path, for example robot.q0=[0,0]; may be repeated.",
        show_default=False,
    ),
]
RunFolder: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="FOLDER",
        help="The run folder. [default: runs/<scenario>-<controller>-<seed>-<trial>]",
        show_default=False,
    ),
]


def overrides(
    settings: list[str] | None,
    controller: str | None,
    seed: int | None,
    plant: str | None = None,
    host: str | None = None,
    move_to_start: bool = False,
) -> list[Override]:
    """``--plant``, ``--set``, then the options of one field, as overrides of the scenario; the last one wins. The plant
    comes first so that ``--set plant.timestep=...`` meets the plant it is for."""
    from cdfctl.scenario.overrides import Override, parse_override

    changes = [] if plant is None else [Override(("plant",), plant, f"--plant {plant}", switch=True)]
    changes += [parse_override(setting) for setting in settings or ()]
    if controller is not None:
        changes.append(Override(("controller", "variant"), controller, f"--controller {controller}"))
    if seed is not None:
        changes.append(Override(("seed",), seed, f"--seed {seed}"))
    if host is not None:
        changes.append(Override(("plant", "host"), host, f"--host {host}"))
    if move_to_start:
        changes.append(Override(("plant", "move_to_start"), True, "--move-to-start"))
    return changes
