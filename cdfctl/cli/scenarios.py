"""``cdfctl scenarios``: what scenarios are shipped."""

from __future__ import annotations

from cdfctl.cli import options
from cdfctl.cli.console import show, write, write_json


def scenarios(json: options.Json = False, quiet: options.NamesOnly = False, debug: options.Debug = False) -> None:
    """List the shipped scenarios, one line each."""
    from cdfctl.scenario.library import list_scenarios

    shipped = list_scenarios()
    if quiet and not json:
        write("\n".join(item.name for item in shipped))
        return
    if json:
        write_json({"scenarios": [{"name": s.name, "description": s.description} for s in shipped]})
        return
    from cdfctl.report.tables import listing

    show(listing(("scenario", "description"), [(s.name, s.description) for s in shipped]))
