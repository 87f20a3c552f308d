"""YAML 1.2 scalars, and what a file may look like otherwise."""

from __future__ import annotations

import math

import pytest

from cdfctl.scenario import load_scenario
from cdfctl.scenario.yaml_loader import read, scalar

from .conftest import GOOD

SCALARS = [
    ("1e-3", 1e-3), ("1E+3", 1e3), ("-1.5", -1.5), (".5", 0.5), ("5.", 5.0), ("0", 0), ("-7", -7), ("+7", 7),
    ("00.5", 0.5), ("0x1F", 31), ("0o17", 15), ("true", True), ("False", False), ("~", None), ("", None),
    ("null", None), (".inf", math.inf), ("-.INF", -math.inf), ("no", "no"), ("yes", "yes"), ("on", "on"),
    ("Off", "Off"), ("y", "y"), ("n", "n"), ("1:30", "1:30"), ("1_000", "1_000"), ("0b11", "0b11"),
    ("2020-01-01", "2020-01-01"), ("1e", "1e"), ("e5", "e5"), (".", "."), ("-", "-"), ("=", "="), ("<<", "<<"),
    ("NaN", "NaN"), ("inf", "inf"), ("tRuE", "tRuE"), ("1.5.2", "1.5.2"), ("0x", "0x"),
    ("1e-3\u0661", "1e-3\u0661"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), SCALARS)
def test_scalars(text, value):
    assert scalar(text) == value
    assert type(scalar(text)) is type(value)


def test_nan():
    assert math.isnan(scalar(".nan"))


@pytest.mark.parametrize("text", ["010", "-010", "00", "0777", "1" * 401])
def test_ambiguous_or_endless_numbers_are_refused(text):
    with pytest.raises(ValueError, match=r"ambiguous|characters"):
        scalar(text)


def test_quoted_scalars_are_text():
    assert read("""a: ["1.0", '010', "no", ""]""").data == {"a": ["1.0", "010", "no", ""]}


def test_places_of_keys_and_values():
    document = read("a:\n  - b: 1\n    c: [2, x]\n")
    assert document.keys["a", 0, "c"] == (3, 5)
    assert document.values["a", 0, "c"] == (3, 8)
    assert document.values["a", 0, "c", 1] == (3, 12)


def test_anchors_within_reason(load):
    file = load(("[2.5, 0.5]", "&q [2.5, 0.5]"), ("[-2.7, 0.5]", "*q"))
    assert file.scenario.task.goal == file.scenario.robot.q0


def test_crlf_and_byte_order_mark(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load_scenario(path).scenario.name == "mine"
