"""The accuracy report of a contact table, for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cdfctl.fields.table.accuracy import NEAR, WayError
from cdfctl.fields.table.store import StoredTable
from cdfctl.report.tables import facts


def table_report(stored: StoredTable, size: int) -> RenderableType:
    """The whole report, legible at 80 columns and without colour; ``size`` is the file's, in bytes."""
    residual, coverage, parameters = stored.accuracy.residual, stored.accuracy.coverage, stored.parameters
    nx, ny, nz = (int(k) for k in stored.table.shape)
    share = f"{100.0 * coverage.covered / coverage.reachable:.1f} %" if coverage.reachable else "-"
    rows = [
        ("table", str(stored.path)),
        ("robot", f"{stored.robot} ({stored.robot_hash[:12]})"),
        ("grid", f"{nx} x {ny} x {nz} points, {stored.table.spacing:.4f} m apart, ball of {parameters.radius:g} m"),
        ("entries", f"{len(stored.table.piece)} in {size / 1e6:.1f} MB"),
        ("built with", f"{parameters.starts} starts, seed {parameters.seed}, {parameters.device}, {stored.version}"),
        ("residual", f"{residual.max:.1e} m at most, {residual.mean:.1e} m mean ({residual.entries} entries, by coal)"),
        ("coverage", f"{share} ({coverage.covered} of {coverage.reachable} held-out points in reach)"),
    ]
    parts: list[RenderableType] = [facts(rows)]
    near = f"errors, d < {NEAR:g} rad"
    for title, ways in (("errors, all pairs", stored.accuracy.comparison), (near, stored.accuracy.near)):
        parts += [Text(), _errors(title, ways)]
    return Group(*parts)


def _errors(title: str, ways: Sequence[WayError]) -> Table:
    comparison = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="bold")
    comparison.add_column(title, no_wrap=True)
    for name in ("mean error", "95 %", "within 0.01 rad", "no answer"):
        comparison.add_column(name, justify="right")
    for way in ways:
        within = f"{100.0 * way.within:.0f} %"
        comparison.add_row(way.way, radians(way.mean), radians(way.p95), within, f"{way.missed} of {way.pairs}")
    return comparison


def radians(value: float | None) -> str:
    """``value`` in rad, or a dash."""
    return "-" if value is None else f"{value:.4f} rad"
