"""The replay as one HTML file: opens from the disk, without a server and without the network.

viser's own player shows the scene and has the time slider, play, pause, speed and the tree in which each group can be
shown and hidden. A recording of viser's holds the scene alone, no buttons and no charts, so the charts are put beside
it and moved to the time its slider shows (``page.js``).
"""

from __future__ import annotations

import html
import itertools
import json
import math
import os
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from cdfctl.errors import InputError
from cdfctl.reading import drafted
from cdfctl.report.view.chart_html import LEFT, RIGHT, WIDTH, ChartPanel
from cdfctl.report.view.charts import Chart, charts_of, clearance_curve
from cdfctl.report.view.replay import Replay
from cdfctl.report.view.server import serving
from cdfctl.report.view.stage import Stage
from cdfctl.types import Array

RATE = 25.0
"""Pictures a second of the run."""

MOST_PICTURES = 1500
"""Most pictures of a page; a run of more than a minute has fewer a second."""

PANEL_SHARE = 0.16
"""By how much of the picture's height the run is moved to the right, out of the charts' way."""

HOLD = 1.0
"""How long the player stands at the end before it begins again, s."""


def html_page(replay: Replay, title: str, facts: list[str]) -> tuple[str, list[str]]:
    """The page, and what could not be drawn as it should.

    Args:
        replay: of a finished run.
        title: of the page.
        facts: lines shown above the charts.

    Raises:
        MissingError: viser is not installed.
    """
    count = max(2, min(math.ceil(RATE * replay.duration) + 1, MOST_PICTURES))
    times = np.linspace(0.0, replay.duration, count)
    with serving(port=0) as server:
        stage = Stage(server.scene, replay)
        stage.camera.apply(server.initial_camera, PANEL_SHARE)
        stage.show(replay.at(0.0), replay)
        recording = server.get_scene_serializer()
        for before, t in itertools.pairwise(times):
            recording.insert_sleep(float(t - before))
            stage.show(replay.at(float(t)), replay)
        recording.insert_sleep(HOLD)
        page: str = recording.as_html()
    charts = charts_of(replay, clearance_curve(replay))
    run = replay.trajectory
    drawn = ChartPanel(charts, replay.duration, run.t[:-1][run.infeasible]).html(0.0)
    return _with_panel(page, title, _panel(title, facts, drawn), _data(replay, charts)), stage.warnings


def check_page(path: Path) -> None:
    """Say at once, before the work, that a page cannot be written into ``path``. Raises :class:`InputError`."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"cannot write a page as '{path}'", hint="its name ends in .html")
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not path.parent.is_dir():
        raise InputError(f"no such folder: {path.parent}")


def write_page(path: Path, text: str) -> None:
    """Write ``text`` into ``path``, whole or not at all. Raises :class:`InputError` where it cannot be written."""
    check_page(path)
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with drafted(path, draft):
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None


def _with_panel(page: str, title: str, panel: str, data: dict[str, Any]) -> str:
    files = resources.files("cdfctl.report.view")
    script, style = ((files / name).read_text(encoding="utf-8") for name in ("page.js", "page.css"))
    # "</" would end the script element wherever it stood in a name.
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
    ours = f"<style>{style}</style>{panel}<script>window.CDFCTL_RUN={text};\n{script}</script>"
    page = page.replace("<title>Viser</title>", f"<title>{html.escape(title)}</title>", 1)
    at = page.rindex("</body>")
    return page[:at] + ours + page[at:]


def _panel(title: str, facts: list[str], charts: str) -> str:
    lines = "".join(f"<p>{html.escape(fact)}</p>" for fact in facts)
    return (
        f'<details id="cdfctl" open><summary>{html.escape(title)}</summary>{lines}'
        f'<div class="now" role="status" aria-live="off"></div>{charts}</details>'
    )


def _data(replay: Replay, charts: list[Chart]) -> dict[str, Any]:
    run = replay.trajectory
    return {
        "duration": replay.duration,
        "left": LEFT,
        "width": WIDTH - LEFT - RIGHT,
        "steps": _numbers(run.t[:-1]),
        "infeasible": [int(x) for x in run.infeasible],
        "charts": [{"t": _numbers(c.t), "curves": [_numbers(curve.values) for curve in c.curves]} for c in charts],
    }


def _numbers(values: Array) -> list[float | None]:
    return [round(float(x), 5) if math.isfinite(x) else None for x in values]
