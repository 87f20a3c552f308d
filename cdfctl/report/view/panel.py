"""The buttons of the live page: they write to a clock and to a stage, and show where the clock is."""

from __future__ import annotations

import html
import time
from typing import Any

from cdfctl.report.view.chart_html import ChartPanel
from cdfctl.report.view.charts import charts_of
from cdfctl.report.view.clock import SPEEDS, Clock
from cdfctl.report.view.replay import Instant, Replay
from cdfctl.report.view.stage import HIDDEN, Stage
from cdfctl.types import Array

SWITCHES = {
    "contact": ("Nearest contact q*", "the configuration in contact that is nearest to the arm's"),
    "distance": ("Distance", "the judge's least distance between robot and obstacles"),
    "trails": ("Trails", "where the tip and the obstacles have been"),
    "plan": ("Plan", "where the controller plans the tip to go"),
    "goal": ("Goal", "the tip at the joint goal, or the target to touch"),
    "obstacles": ("Obstacles", "the obstacles"),
}
LOOKS = ("visual meshes", "collision geometry", "both")
STEP = 0.01
"""Resolution of the time slider, s."""

CHART_PERIOD = 0.1
"""Between two drawings of the charts while the clock runs, s: they are far larger than a pose."""


class Panel:
    """viser's controls for one replay."""

    def __init__(self, gui: Any, clock: Clock, stage: Stage, replay: Replay, title: str, facts: list[str]) -> None:
        """``gui`` is viser's interface to the controls; ``facts`` are lines shown under the title."""
        self._clock, self._stage, self._end = clock, stage, replay.duration
        self._charts_at = -CHART_PERIOD
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large", brand_color=(0, 114, 178))
        gui.set_panel_label("cdfctl view")
        gui.add_markdown("\n\n".join((f"**{_plain(title)}**", *(_plain(fact) for fact in facts))))
        with gui.add_folder("Time"):
            end = max(self._end, STEP)
            self._slider = gui.add_slider("t [s]", min=0.0, max=end, step=STEP, initial_value=0.0)
            self._play = gui.add_button("Pause")
            speed = gui.add_dropdown("Speed", [f"{s:g}x" for s in SPEEDS], initial_value="1x")
            loop = gui.add_checkbox("Repeat", clock.loop, visible=not clock.following)
        self._loop = loop
        self._status = gui.add_markdown("")
        self._charts = gui.add_html("")
        with gui.add_folder("Show"):
            look = gui.add_dropdown("Robot", LOOKS, initial_value=LOOKS[0])
            for group, (label, hint) in SWITCHES.items():
                if group in stage.groups:
                    self._switch(gui.add_checkbox(label, group not in HIDDEN, hint=hint), group)

        self._slider.on_update(self._sought)
        self._play.on_click(lambda _: clock.toggle(self._end))
        speed.on_update(lambda _: setattr(clock, "speed", float(speed.value.removesuffix("x"))))
        loop.on_update(lambda _: setattr(clock, "loop", bool(loop.value)))
        look.on_update(lambda _: self._look(look.value))

    def _sought(self, event: Any) -> None:
        if event.client is not None:  # a value set from here calls back too: only people move the clock
            self._clock.go_to(float(self._slider.value))

    def _look(self, choice: str) -> None:
        self._stage.set_visible("visual", choice != LOOKS[1])
        self._stage.set_visible("collision", choice != LOOKS[0])

    def _switch(self, box: Any, group: str) -> None:
        box.on_update(lambda _: self._stage.set_visible(group, bool(box.value)))

    def load(self, replay: Replay, clearance: Array) -> None:
        """Take over a replay that has become longer, and ``clearance`` (N+1,), the judge's distances at its states."""
        run, self._end = replay.trajectory, replay.duration
        self._slider.max = max(self._end, STEP)
        self._loop.visible = not self._clock.following
        self._drawn = ChartPanel(charts_of(replay, clearance), self._end, run.t[:-1][run.infeasible])

    def show(self, instant: Instant, replay: Replay) -> None:
        """Show where the clock is: slider, button, status and charts."""
        self._slider.value = min(round(instant.t / STEP) * STEP, self._slider.max)
        self._play.label = "Pause" if self._clock.playing else "Play"
        self._status.content = _plain(status(instant, replay, following=self._clock.following))
        now = time.monotonic()
        if now - self._charts_at >= CHART_PERIOD or not self._clock.playing:
            self._charts.content, self._charts_at = self._drawn.html(instant.t), now


def status(instant: Instant, replay: Replay, *, following: bool) -> str:
    """What there is to say of an instant, in a line."""
    names, parts = replay.body.names, [f"t = {instant.t:.2f} s"]
    if following:
        parts.append("the run goes on")
    if instant.closest is not None:
        link = replay.body.robot.geometry_links[instant.closest.object]
        parts.append(f"{instant.closest.distance:.3f} m from {link} to {names[instant.closest.obstacle]}")
    if instant.contact_obstacle is not None:
        parts.append(f"q* of {names[instant.contact_obstacle]}")
    if instant.infeasible:
        parts.append("no velocity satisfies all rows")
    return "; ".join(parts)


def _plain(text: str) -> str:
    """Text that Markdown leaves as it is."""
    return "".join(f"&#{ord(c)};" if c in "\\`*_{}[]()#+-.!|<>~$" else c for c in html.unescape(text))
