"""``plot``: a figure by name, into a file by suffix."""

from __future__ import annotations

import sys

import pytest

from cdfctl.report import figures_levels


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """The same figure on a coarse grid."""
    whole = figures_levels.levels_figure
    monkeypatch.setattr(figures_levels, "levels_figure", lambda: whole(points=9))


def test_a_figure_goes_into_the_current_folder(cli, here):
    result = cli("plot", "--figure", "levels")
    assert (result.status, result.out, result.err) == (0, "", "wrote levels.png\n")
    assert (here / "levels.png").read_bytes().startswith(b"\x89PNG")


def test_the_suffix_says_how(cli, here):
    result = cli("plot", "--figure", "levels", "--out", "a.svg", "--json")
    assert result.document() == {"figure": "levels", "file": "a.svg"}
    assert "<svg" in (here / "a.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--figure", "level"), "did you mean levels?"),
        (("--figure", "levels", "--out", "a.gif"), ".png, .svg, .pdf"),
        (("--figure", "levels", "--out", "no/a.png"), "no such folder: no"),
        ((), "--figure"),
    ],
)
def test_bad_input_writes_nothing(cli, here, arguments, words):
    result = cli("plot", *arguments)
    assert result.status == 2
    assert words in result.err
    assert not list(here.iterdir())


def test_a_missing_package_is_status_3_with_the_command(cli, here, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = cli("plot", "--figure", "levels")
    assert result.status == 3
    assert "python -m pip install 'cdfctl[plot]'" in result.err
