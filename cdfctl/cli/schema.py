"""``cdfctl schema``: the JSON Schema of a scenario file."""

from __future__ import annotations

from cdfctl.cli import options
from cdfctl.cli.console import write_json


def schema(json: options.Json = False, quiet: options.Quiet = False, debug: options.Debug = False) -> None:
    """Print the JSON Schema of a scenario file, for editors."""
    from cdfctl.scenario.reference import json_schema

    write_json(json_schema())
