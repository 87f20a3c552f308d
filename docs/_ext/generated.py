"""Pages made from the code: a line ``<!-- generated: NAME -->`` is replaced by what :data:`MAKERS` gives for NAME.

Figures are drawn into ``_figures`` first. Nothing generated is committed, so nothing can lag behind the code.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from sphinx.application import Sphinx

if TYPE_CHECKING:
    from cdfctl.scenario.reference import FieldRow

MARK = re.compile(r"^<!-- generated: ([a-z-]+) -->$", re.MULTILINE)


def scenario_reference() -> str:
    """Every field of a scenario file: a section for each mapping, a row for each key, from the schema."""
    from cdfctl.scenario.reference import reference

    sections: dict[str, list[FieldRow]] = {"": []}
    for row in reference():
        parent, _, _ = row.path.rpartition(".")
        sections.setdefault(parent, []).append(row)
    parts, seen = [], {}
    for name, rows in sections.items():
        parts.append(f"### `{name}`" if name else "### The whole file")
        content = tuple((_key(row), row.kind, row.description) for row in rows)
        if content in seen:
            parts.append(f"The same keys as `{seen[content]}`.")
            continue
        seen[content] = name
        table = ["| key | value | unit | default | meaning |", "| --- | --- | --- | --- | --- |"]
        table += [
            f"| `{_key(row)}` | {_cell(row.kind)} | {_cell(row.unit)} | {_default(row)} | {_meaning(row)} |"
            for row in rows
        ]
        parts.append("\n".join(table))
    return "\n\n".join(parts)


def _key(row: FieldRow) -> str:
    return row.path.rpartition(".")[2]


def _default(row: FieldRow) -> str:
    if row.required:
        return "required"
    return "" if row.default in (None, "", [], {}) else f"`{json.dumps(row.default)}`"


def _meaning(row: FieldRow) -> str:
    source = f" *Default: {_cell(row.source)}.*" if row.source and row.source != "ours" and not row.required else ""
    return _cell(row.description) + source


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def controllers() -> str:
    """The table of controllers: three choices, the safety row, the source."""
    from cdfctl.scenario.variants import VARIANTS

    rows = ["| controller | field | safety row | task | source |", "| --- | --- | --- | --- | --- |"]
    rows += [f"| `{v.name}` | {v.field} | {v.safety} | {v.task} | {_cell(v.source)} |" for v in VARIANTS.values()]
    return "\n".join(rows)


def robots() -> str:
    """The shipped robots."""
    from cdfctl.robots.robot_file import shipped_robots

    return "\n".join(
        [
            "| robot | description |",
            "| --- | --- |",
            *(f"| `{r.name}` | {_cell(r.description)} |" for r in shipped_robots()),
        ]
    )


def commands() -> str:
    """The help of every command, as it prints."""
    from typer.main import get_command
    from typer.testing import CliRunner

    from cdfctl.cli.main import app

    parts = []
    names = ["", *sorted(get_command(app).commands)]  # type: ignore[attr-defined]  # a Typer app is a group
    for name in names:
        result = CliRunner().invoke(app, [*name.split(), "--help"], prog_name="cdfctl", env={"COLUMNS": "80"})
        lines = [line.rstrip() for line in result.output.strip().splitlines()]
        parts.append(f"## {f'cdfctl {name}'.strip()}\n\n```text\n" + "\n".join(lines) + "\n```")
    return "\n\n".join(parts)


MAKERS: dict[str, Callable[[], str]] = {
    "scenario-reference": scenario_reference,
    "controllers": controllers,
    "robots": robots,
    "commands": commands,
}


def replace(app: Sphinx, docname: str, source: list[str]) -> None:
    """Fill in the generated parts of one page."""
    source[0] = MARK.sub(lambda match: MAKERS[match[1]](), source[0])


def draw(app: Sphinx) -> None:
    """Draw the figures of the pages, before the pages are read."""
    from cdfctl.report.figures.levels import levels
    from cdfctl.report.figures.output import save_figure
    from cdfctl.report.figures.part import figure_of

    folder = Path(app.srcdir) / "_figures"
    folder.mkdir(exist_ok=True)
    save_figure(figure_of([levels()]), folder / "levels.png")


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("builder-inited", draw)
    app.connect("source-read", replace)
    return {"parallel_read_safe": True}
