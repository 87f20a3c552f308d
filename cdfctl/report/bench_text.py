"""The table of a benchmark as Markdown, LaTeX or CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence

from cdfctl.benchmark.document import paper_cell
from cdfctl.benchmark.statistics import CellSummary
from cdfctl.report import bench_rows as rows
from cdfctl.report.bench_grid import grid_markdown, sweep_grids

SPECIAL = {"%": r"\%", "_": r"\_", "&": r"\&", "#": r"\#", "<": "$<$", "[": "{[}", "]": "{]}"}


def markdown(summaries: Sequence[CellSummary]) -> str:
    """One table a scenario and rule, then the notes."""
    parts: list[str] = []
    for group in rows.groups(summaries):
        shown = _shown(group)
        parts.append(f"### {group.title}\n")
        parts.append("| | " + " | ".join(rows.COLUMNS[column] for column in shown) + " |")
        parts.append("| --- |" + " ---: |" * len(shown))
        for line in group.lines:
            title = f"*{line.title}*" if line.printed else f"`{line.title}`"
            cells = (line.cells.get(column, "").replace("*", r"\*").replace("<", r"\<") for column in shown)
            parts.append(f"| {title} | " + " | ".join(cells) + " |")
        parts.append("")
    for grid in sweep_grids(summaries):
        parts += grid_markdown(grid)
    for items in (rows.LEGEND, rows.solvable(summaries), rows.notes(summaries), rows.assumptions(summaries)):
        parts += [f"- {item.replace('*', chr(92) + '*').replace('+ ', chr(92) + '+ ')}" for item in items]
        parts += [""] * bool(items)
    return "\n".join(parts).rstrip() + "\n"


def latex(summaries: Sequence[CellSummary]) -> str:
    r"""One ``tabular`` a scenario and rule, for ``\usepackage{booktabs}``; the notes as comments."""
    parts: list[str] = []
    for group in rows.groups(summaries):
        shown = _shown(group)
        parts.append(f"% {group.title}")
        parts.append(rf"\begin{{tabular}}{{l{'r' * len(shown)}}}")
        parts += [r"\toprule", _latex_row(["", *(rows.COLUMNS[column] for column in shown)]), r"\midrule"]
        for line in group.lines:
            parts.append(_latex_row([line.title, *(line.cells.get(column, "") for column in shown)]))
        parts += [r"\bottomrule", r"\end{tabular}", ""]
    for items in (rows.LEGEND, rows.solvable(summaries), rows.notes(summaries), rows.assumptions(summaries)):
        parts += [f"% {item}" for item in items]
    return "\n".join(parts) + "\n"


def table_csv(summaries: Sequence[CellSummary]) -> str:
    """One line a cell, numbers unrounded, the paper's beside ours; a value that does not exist is empty."""
    text = io.StringIO()
    lines = [dict(_csv_cells(summary)) for summary in summaries]
    writer = csv.DictWriter(text, list(lines[0]) if lines else ["scenario"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue()


def _csv_cells(summary: CellSummary) -> Iterator[tuple[str, object]]:
    cell, paper = summary.cell, paper_cell(summary)
    yield from (("scenario", cell.name), ("controller", cell.controller), ("on_infeasible", cell.on_infeasible))
    yield from (("trials", summary.trials), ("successes", summary.successes))
    yield from (("success_low", summary.ci95[0]), ("success_high", summary.ci95[1]))
    yield from (("successes_sampled", summary.successes_sampled), ("mcnemar_p", summary.p_value))
    yield from ((f"{outcome}_trials", count) for outcome, count in summary.outcomes.items())
    for name, spread in (
        ("time_s", summary.time),
        ("joint_path_rad", summary.joint_path),
        ("path_m", summary.path),
    ):
        yield from ((f"{name}_{part}", getattr(spread, part)) for part in ("min", "max", "mean"))
    yield "min_clearance_m", summary.min_clearance
    share = summary.share
    yield from zip(("solvable_low", "solvable_high"), share.bounds if share else (None, None), strict=True)
    yield from (
        ("trials_with_infeasible_steps", summary.infeasible_trials),
        ("infeasible_steps", summary.infeasible_steps),
    )
    yield from (("step_ms_p50", summary.step_ms[0]), ("step_ms_p99", summary.step_ms[1]))
    yield "paper_success", None if paper is None else paper.success
    for name, triple in (("time_s", paper and paper.time), ("joint_path_rad", paper and paper.path)):
        for i, part in enumerate(("min", "max", "mean")):
            yield f"paper_{name}_{part}", triple[i] if triple else None
    yield "paper_impossible", "; ".join(paper.impossible.values()) if paper else None
    yield "paper_time_comparable", None if paper is None else paper.time_comparable


def _shown(group: rows.Group) -> list[str]:
    return rows.shown(group, rows.COLUMNS)


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join("".join(SPECIAL.get(c, c) for c in cell) for cell in cells) + r" \\"
