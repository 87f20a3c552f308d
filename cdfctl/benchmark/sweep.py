"""Sweeps: ``--sweep controller.alpha=1,2,3`` sets a scenario field to each of some values; several make a grid."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from cdfctl.errors import InputError
from cdfctl.scenario.overrides import Override, parse_override
from cdfctl.scenario.problems import path_text

FLAG = "--sweep"


@dataclass(frozen=True, eq=False)
class Setting:
    """One field at one value: ``field`` by its path, ``text`` the value as written, ``override`` both, parsed."""

    field: str
    text: str
    override: Override

    @property
    def short(self) -> str:
        """For tables: the last part of the path, and the value."""
        return f"{self.field.rpartition('.')[2]}={self.text}"


def parse_sweep(text: str) -> tuple[Setting, ...]:
    """``FIELD=a,b,c`` as settings of one field. A value may be a list: commas inside brackets do not count.

    Raises:
        InputError: no '=', no valid path, a value that is missing or not YAML, or one given twice.
    """
    field, equals, values = text.partition("=")
    if not equals:
        raise InputError(f"{FLAG} {text}: expected FIELD=a,b,c", "for example --sweep controller.alpha=1,2,3")
    parts = _split(values)
    if not all(parts):
        raise InputError(f"{FLAG} {text}: the value is missing", "for example --sweep controller.alpha=1,2,3")
    if len(set(parts)) != len(parts):
        raise InputError(f"{FLAG} {text}: the same value twice")
    overrides = [parse_override(f"{field}={part}", FLAG) for part in parts]
    return tuple(Setting(path_text(o.path), part, o) for part, o in zip(parts, overrides, strict=True))


def combinations(sweeps: Sequence[str]) -> tuple[tuple[Setting, ...], ...]:
    """Every combination of the values of some sweeps, the last changing fastest; one empty one where there is none.

    Raises:
        InputError: a malformed sweep, or two of the same field.
    """
    axes = [parse_sweep(sweep) for sweep in sweeps]
    fields = [axis[0].field for axis in axes]
    for field in fields:
        if fields.count(field) > 1:
            raise InputError(f"{FLAG} {field}: given twice", "name all its values in one")
        if field in ("seed", "controller.variant", "controller.on_infeasible"):
            option = {"seed": "--seed", "controller.variant": "--controller"}.get(field, "--on-infeasible")
            raise InputError(f"{FLAG} {field}: this field has an option of its own", f"use {option}")
    return tuple(itertools.product(*axes))


def label(settings: Sequence[Setting]) -> str:
    """``alpha=2,margin=0.1``; the whole path where two fields end alike."""
    short = [setting.short for setting in settings]
    ends = [setting.field.rpartition(".")[2] for setting in settings]
    return ",".join(
        text if ends.count(end) == 1 else f"{setting.field}={setting.text}"
        for text, end, setting in zip(short, ends, settings, strict=True)
    )


def _split(values: str) -> list[str]:
    """``values`` at its commas, but for those inside brackets, braces or quotes."""
    parts, depth, quote = [""], 0, ""
    for c in values:
        if quote:
            quote = "" if c == quote else quote
        elif c in "\"'":
            quote = c
        elif c in "[{":
            depth += 1
        elif c in "]}":
            depth -= 1
        if c == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += c
    return [part.strip() for part in parts]
