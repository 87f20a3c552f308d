"""``view``: a page, a server that ends at Ctrl-C, a run in progress, and one line for whatever is wrong."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest


@pytest.fixture
def run(cli, small: Path) -> Path:
    """A finished run folder."""
    assert cli("run", small, "--out", "run", "--quiet").status == 0
    return Path("run")


def started(*arguments: object) -> subprocess.Popen[str]:
    """The viewer in a process of its own."""
    command = [sys.executable, "-m", "cdfctl", "view", *map(str, arguments), "--no-open", "--port", "0"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_one_page(cli, run):
    result = cli("view", run, "--html", "page.html")
    assert (result.status, result.out) == (0, "")
    assert re.fullmatch(r"wrote page\.html \(\d\.\d MB\)\n", result.err)
    text = Path("page.html").read_text(encoding="utf-8")
    assert "<title>small: sdf-tvcbf-qp</title>" in text
    assert "reached in" in text
    document = cli("view", run, "--html", "page.html", "--json").document()
    assert document == {"run": "run", "file": "page.html", "bytes": Path("page.html").stat().st_size, "warnings": []}
    assert sorted(path.name for path in Path().iterdir()) == ["page.html", "run", "small.yaml"]


def test_it_serves_until_ctrl_c_and_that_is_no_failure(run):
    viewer = started(run, "--json", "--live")
    assert "no run into run is in progress; showing the finished one" in viewer.stderr.readline()
    out = ""
    while not out.endswith("}\n"):
        line = viewer.stdout.readline()
        assert line, viewer.communicate()
        out += line
    document = json.loads(out)
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+", document["url"])
    assert b"<html" in urllib.request.urlopen(document["url"], timeout=30).read()
    viewer.send_signal(signal.SIGINT)
    rest, errors = viewer.communicate(timeout=60)
    assert (viewer.returncode, rest) == (0, "")
    assert "Traceback" not in errors
    assert errors.endswith("cdfctl: closed\n")


def test_a_run_in_progress_is_waited_for_and_followed(cli, small):
    viewer = started("later", "--live")
    assert "waiting for a run: cdfctl run ... --live --out later" in viewer.stderr.readline()
    assert cli("run", small, "--live", "--out", "later", "--quiet", "--set", "simulation.dt=0.02").status == 0
    assert re.search(r"later at http://127\.0\.0\.1:\d+", viewer.stderr.readline())
    viewer.send_signal(signal.SIGINT)
    viewer.communicate(timeout=60)
    assert viewer.returncode == 0
    assert sorted(path.name for path in Path().iterdir()) == ["later", "small.yaml"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere",), "nowhere: not a run folder"),
        (("small.yaml",), "small.yaml: not a run folder"),
        (("run", "--html", "page.pdf"), "ends in .html"),
        (("run", "--html", "no/page.html"), "no such folder: no"),
        (("run", "--html", "run.html", "--live"), "exclude each other"),
        (("run", "--port", "70000"), "65535"),
        (("damaged",), "damaged"),
        (("foreign",), "foreign: not a run folder"),
        (("foreign", "--live"), "foreign: not a run folder"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(cli, run, arguments, words):
    Path("foreign").mkdir()
    Path("foreign/notes.txt").write_text("mine")
    Path("damaged").mkdir()
    for name in ("scenario.yaml", "result.json"):
        (Path("damaged") / name).write_bytes((run / name).read_bytes())
    (Path("damaged") / "trajectory.npz").write_bytes((run / "trajectory.npz").read_bytes()[:200])
    before = sorted(Path().rglob("*"))
    result = cli("view", *arguments, "--no-open")
    assert result.status == 2
    assert words in result.err
    assert "Traceback" not in result.err
    assert len([line for line in result.err.splitlines() if not line.startswith("  hint")]) == 1
    assert sorted(Path().rglob("*")) == before


def test_a_port_that_is_taken(cli, run):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        result = cli("view", run, "--port", port, "--no-open")
    assert result.status == 2
    assert f"cannot serve on 127.0.0.1:{port}" in result.err
    assert "--port" in result.err


def test_a_missing_package_is_status_3_with_the_command(cli, run, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    result = cli("view", run, "--html", "page.html")
    assert result.status == 3
    assert "the 3-D view needs viser, which is not installed" in result.err
    assert "python -m pip install 'cdfctl[view]'" in result.err
    assert not os.path.exists("page.html")


def test_the_browser_is_opened_unless_told_not_to(monkeypatch):
    import webbrowser

    from cdfctl.cli.view import _open

    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) or True)
    monkeypatch.setenv("DISPLAY", ":0")
    _open("http://127.0.0.1:1", quiet=True)
    assert opened == ["http://127.0.0.1:1"]
    if sys.platform != "darwin":  # without a screen a text browser would take the terminal
        monkeypatch.delenv("DISPLAY")
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        _open("http://127.0.0.1:2", quiet=True)
        assert len(opened) == 1
