"""What the packaging says agrees with the code."""

from __future__ import annotations

import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

import cdfctl

ROOT = Path(__file__).resolve().parents[2]


def test_one_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert metadata.version("cdfctl") == cdfctl.__version__ == citation["version"]


def test_the_citation_names_the_paper_and_its_authors():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    (paper,) = citation["references"]
    assert paper["title"].startswith("Safe Dynamic Motion Generation in Configuration Space")
    names = [author["family-names"] for author in paper["authors"]]
    assert names == ["Chi", "Li", "Huang", "Dai", "Liu", "Calinon"]


def test_every_requirement_has_a_tested_version_within_its_range():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    pinned = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            assert re.fullmatch(r"[A-Za-z0-9._-]+==[0-9][0-9a-z.]*", line), line
            name, _, version = line.partition("==")
            pinned[name.lower().replace("_", "-")] = version
    wanted = [
        *project["dependencies"],
        *(item for extra in project["optional-dependencies"].values() for item in extra),
    ]
    for text in wanted:
        requirement = Requirement(text)
        assert requirement.specifier.contains(pinned[requirement.name.lower().replace("_", "-")]), text


@pytest.mark.parametrize("name", cdfctl.__all__)
def test_every_public_name_is_there(name):
    assert getattr(cdfctl, name) is not None
    assert name in dir(cdfctl)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        cdfctl.nothing  # noqa: B018


def test_public_names_and_their_homes_agree():
    assert {*cdfctl._HOME, "__version__"} == set(cdfctl.__all__)
    for name, home in cdfctl._HOME.items():
        assert getattr(cdfctl, name).__module__.startswith(home.rpartition(".")[0])


def test_the_page_on_installing_names_every_extra():
    page = (ROOT / "docs" / "install.md").read_text()
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for extra in extras:
        assert f"`{extra}`" in page, extra
