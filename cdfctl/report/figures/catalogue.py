"""Which figures there are: of a run, of a benchmark, and of the paper.

What a figure needs is imported when it is asked for: a run's figures are there before the solvers would be loaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdfctl.errors import InputError, unknown_name
from cdfctl.report.figures.part import OVERVIEW, Part

PAPER = ("levels", "avoidance", "reaching")
"""Figures that need no source: they run what they show."""

MANIFEST = "manifest.json"  # of a benchmark's store


def paper_parts(names: Sequence[str]) -> list[Part]:
    """The paper's figures of these names. Raises :class:`InputError` for a name that is none of them."""
    for name in names:
        if name not in PAPER:
            raise unknown_name("figure", name, PAPER)
    from cdfctl.report.figures.avoidance import avoidance
    from cdfctl.report.figures.levels import levels
    from cdfctl.report.figures.reaching import reaching

    makers = {"levels": levels, "avoidance": avoidance, "reaching": reaching}
    return [makers[name]() for name in names]


def source_parts(source: Path, names: Sequence[str], fields: tuple[str, ...] | None, at: Sequence[float]) -> list[Part]:
    """The figures of these names of a run or a benchmark; all there are where there is no name or ``overview``.

    Args:
        source: a run folder, or a benchmark's.
        names: of figures.
        fields: of the plane of the joints, ``cdf`` and ``sdf``; None for the controller's.
        at: instants of the plane of the joints, s; none for those that are chosen by themselves.

    Raises:
        InputError: the source is neither, or damaged; a name is unknown; ``fields`` or ``at`` do not apply.
    """
    parts = _of_bench(source, fields, at) if (source / MANIFEST).is_file() else _of_run(source, fields, at)
    if not names or list(names) == [OVERVIEW]:
        # Of a sweep, the panels of the other figures would be one a combination: they are there to be asked for.
        return parts[:1] if parts[0].name == "sweep" else parts
    by_name = {part.name: part for part in parts}
    for name in names:
        if name not in by_name:
            kind = "a benchmark" if (source / MANIFEST).is_file() else "this run"
            raise unknown_name(f"figure of {kind}", name, [*by_name, OVERVIEW])
    return [by_name[name] for name in names]


def _of_bench(source: Path, fields: tuple[str, ...] | None, at: Sequence[float]) -> list[Part]:
    if fields is not None or at:
        raise InputError("--field and --at are for runs, and this is a benchmark")
    from cdfctl.benchmark.reading import read_store
    from cdfctl.report.figures.bench_panels import bench_parts
    from cdfctl.report.figures.sweep import sweep_part, swept

    bench = read_store(source)
    return [*([sweep_part(bench)] if swept(bench) else []), *bench_parts(bench)]


def _of_run(source: Path, fields: tuple[str, ...] | None, at: Sequence[float]) -> list[Part]:
    from cdfctl.report.figures.joint_space import default_instants, joint_space
    from cdfctl.report.figures.run_view import view_run
    from cdfctl.report.figures.task_space import task_space
    from cdfctl.report.figures.time_course import time_course

    view = view_run(source)
    parts = [task_space(view)] if view.in_plane else []
    end = float(view.t[-1])
    for t in at:
        if t > end + 1e-9:
            raise InputError(f"--at {t:g} is after the end of the run, {end:g} s")
    if view.two_joints:
        instants = sorted({view.step_at(t) for t in at}) if at else default_instants(view)
        parts.append(joint_space(view, fields or view.field_names, instants))
    elif fields is not None or at:
        raise InputError(f"--field and --at need a robot of two joints, and '{view.robot.name}' is none")
    return [*parts, time_course(view)]
