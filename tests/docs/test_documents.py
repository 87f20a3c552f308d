"""Every command and every Python example of the README and the documentation runs as printed.

A ``console`` block holds commands behind ``$ ``. One that sets up is in :data:`SET_UP` and is not run here; any other
must be a ``cdfctl`` command, and runs in an empty folder with the files that the page shows. ``# exit status N``
behind it says what it ends in, 0 where nothing is said. ``python`` blocks of a page run one after the other.
"""

from __future__ import annotations

import pkgutil
import re
import shlex
from pathlib import Path

import pytest

from cdfctl.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
BLOCK = re.compile(r"^(?P<fence>```+)(?P<info>[^\n]*)\n(?P<body>.*?)^(?P=fence)$", re.MULTILINE | re.DOTALL)
CAPTION = re.compile(r":caption: (?P<name>\S+)\n+(?P<text>.*)", re.DOTALL)

# What a reader types to set up; `make run` and `make test` are what CI and this test suite are.
SET_UP = re.compile(r"(git clone \S+|cd cdfctl|make (run|test)|python -m pip install .+)")


def blocks(page: Path, info: str) -> list[str]:
    return [
        match["body"] for match in BLOCK.finditer(page.read_text(encoding="utf-8")) if match["info"].strip() == info
    ]


def commands(page: Path) -> list[str]:
    lines = [line for body in blocks(page, "console") for line in body.splitlines() if line.startswith("$ ")]
    return [command for line in lines if not SET_UP.fullmatch(command := line.removeprefix("$ ").strip())]


def files(page: Path) -> dict[str, str]:
    """The files a page shows: code blocks with a caption."""
    shown = [body for kind in ("yaml", "xml") for body in blocks(page, f"{{code-block}} {kind}")]
    found = (CAPTION.match(body) for body in shown)
    return {match["name"]: match["text"] for match in found if match}


def write_files(folder: Path, page: Path) -> None:
    for name, text in files(page).items():
        (folder / name).write_text(text)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.name)
def test_every_command_of_a_page_ends_as_it_says(folder: Path, page: Path, capfd):
    write_files(folder, page)
    for command in commands(page):
        words = shlex.split(command, comments=True)
        said = re.search(r"# exit status (\d+)$", command)
        assert words[0] == "cdfctl", f"{page.name}: cannot run {command!r}"
        status = main(words[1:])
        assert status == (int(said[1]) if said else 0), f"{command}\n{capfd.readouterr().err}"


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=lambda page: page.name)
def test_the_python_of_a_page_runs(folder: Path, page: Path):
    write_files(folder, page)
    names: dict[str, object] = {}
    for body in blocks(page, "python"):
        exec(compile(body, page.name, "exec"), names)


def test_no_shell_block_escapes_these_tests():
    for page in PAGES:
        infos = {match["info"].strip() for match in BLOCK.finditer(page.read_text(encoding="utf-8"))}
        assert not infos & {"bash", "sh", "shell", "shell-session", "py"}, page.name
        for body in blocks(page, "console"):
            assert body.startswith("$ "), f"{page.name}: a console block begins with a command"


def test_the_pages_have_commands_and_python():
    assert sum(len(commands(page)) for page in PAGES) >= 8
    assert any(blocks(page, "python") for page in PAGES)


def test_every_name_of_the_code_in_the_pages_is_there():
    names = {name for page in PAGES for name in re.findall(r"`(cdfctl(?:\.\w+)+)`", page.read_text(encoding="utf-8"))}
    assert "cdfctl.control.rows.tvcbf_rows" in names
    for name in names:
        pkgutil.resolve_name(name)


def test_the_readme_s_two_commands_are_targets_of_the_makefile():
    readme, makefile = (ROOT / "README.md").read_text(), (ROOT / "Makefile").read_text()
    for target in ("run", "test"):
        assert f"$ make {target}\n" in readme
        assert f"\n{target}:" in makefile
