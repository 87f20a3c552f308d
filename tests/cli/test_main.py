"""The frame of the command line: help, version, completion, and how every error ends."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import typer

import cdfctl
from cdfctl.cli import main as module
from cdfctl.errors import InputError, MissingError, PlantError

COMMANDS = ["run", "check", "robots", "scenarios", "schema", "doctor"]
HEAVY = ["torch", "pinocchio", "coal", "scipy", "numba", "numpy", "pydantic", "yaml", "qpsolvers", "rich"]


def test_help_lists_every_command(cli):
    result = cli("--help")
    assert (result.status, result.err) == (0, "")
    for command in COMMANDS:
        assert f"\n  {command} " in result.out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_the_common_options_and_fits_80_columns(cli, command):
    result = cli(command, "--help")
    assert result.status == 0
    for option in ("--json", "--quiet", "--debug", "--help"):
        assert option in result.out
    assert max(len(line) for line in result.out.splitlines()) <= 80


def test_no_command_shows_the_help_and_is_a_usage_error(cli):
    result = cli()
    assert result.status == 2
    assert "Commands:" in result.out
    assert result.out.endswith("interrupted.\n")
    assert "..." not in result.out.partition("Commands:")[2]  # what a command is for, in one line


@pytest.mark.parametrize("words", [("run", "C1", "--seed", "-1"), ("bench", "--suite", "papr")])
def test_an_option_s_value_is_refused_in_our_words(cli, words):
    result = cli(*words)
    assert result.status == 2
    assert f"Invalid value for '{words[-2]}'" in result.err
    for jargon in ("Input should", "Value error"):
        assert jargon not in result.err


def test_version(cli):
    assert cli("--version").out == f"cdfctl {cdfctl.__version__}\n"


def test_importing_the_command_line_imports_nothing_heavy():
    code = f"import sys, cdfctl.cli.main; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(process, shell):
    result = process(_CDFCTL_COMPLETE=f"source_{shell}")
    assert result.status == 0
    assert "cdfctl" in result.out
    assert "_CDFCTL_COMPLETE" in result.out


def test_completion_completes_commands(process):
    result = process(_CDFCTL_COMPLETE="complete_bash", COMP_WORDS="cdfctl sce", COMP_CWORD="1")
    assert result.out.split() == ["scenarios"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["--frobnicate"],
        ["robts"],
        ["run"],
        ["run", "C1", "extra"],
        ["run", "C1", "--seed", "one"],
        ["run", "C1", "--seed", "-1"],
        ["run", "C1", "--trial", "-1"],
        ["run", "C1", "--trial", "1.5"],
        ["run", "C1", "--set"],
        ["robots", "--out", "x"],
    ],
)
def test_usage_errors_are_one_message_and_status_2(cli, here: Path, arguments):
    result = cli(*arguments)
    assert result.status == 2
    assert result.out == ""
    assert result.err.startswith("cdfctl: error: ")
    assert "Traceback" not in result.err
    assert "--help" in result.err
    assert list(here.iterdir()) == []


def failing(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Make ``cdfctl fail`` end in ``error``."""
    app = typer.Typer()

    @app.command()
    def fail(debug: bool = False) -> None:
        raise error

    @app.command()
    def other() -> None:
        pass

    monkeypatch.setattr(module, "app", app)


@pytest.mark.parametrize(
    ("error", "status"),
    [(InputError("bad", hint="good"), 2), (MissingError("bad", hint="good"), 3), (PlantError("bad", hint="good"), 4)],
)
def test_our_errors_end_in_message_hint_and_their_status(cli, monkeypatch, error, status):
    failing(monkeypatch, error)
    result = cli("fail")
    assert (result.status, result.out) == (status, "")
    assert result.err == "cdfctl: error: bad\n  hint   good\n"


def test_a_message_that_names_its_file_first_is_left_as_it_is(cli, monkeypatch):
    failing(monkeypatch, InputError("mine.yaml:3:1: error: bad\n  field  seed"))
    assert cli("fail").err == "mine.yaml:3:1: error: bad\n  field  seed\n"


def test_debug_shows_the_traceback_and_keeps_the_status(cli, monkeypatch):
    failing(monkeypatch, InputError("bad"))
    result = cli("fail", "--debug")
    assert result.status == 2
    assert "Traceback" in result.err
    assert result.err.endswith("cdfctl: error: bad\n")


def test_a_bug_is_one_line_and_a_log(cli, monkeypatch, tmp_path):
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path))
    failing(monkeypatch, ZeroDivisionError("one\ntwo"))
    result = cli("fail")
    assert (result.status, result.out) == (70, "")
    assert result.err.count("\n") == 1
    assert "ZeroDivisionError: one two" in result.err
    (log,) = tmp_path.rglob("*.log")
    assert str(log) in result.err
    assert "Traceback" in log.read_text()


def test_a_bug_without_a_place_for_its_log_is_still_one_line(cli, monkeypatch, tmp_path):
    block = tmp_path / "file"
    block.write_text("")
    monkeypatch.setenv("CDFCTL_CACHE", str(block / "below"))
    monkeypatch.setattr("cdfctl.cli.failures.gettempdir", lambda: str(block))
    failing(monkeypatch, ZeroDivisionError("oh"))
    result = cli("fail")
    assert result.status == 70
    assert result.err.count("\n") == 1
    assert "--debug" in result.err


def test_the_end_of_a_file_is_a_bug_and_no_interrupt(cli, monkeypatch, tmp_path):
    """An empty file among the compiled kernels, for example: Typer would call it the end of what someone types."""
    monkeypatch.setenv("CDFCTL_CACHE", str(tmp_path))
    failing(monkeypatch, EOFError("Ran out of input"))
    result = cli("fail")
    assert result.status == 70
    assert "EOFError: Ran out of input" in result.err


def test_an_interrupt_is_130(cli, monkeypatch):
    failing(monkeypatch, KeyboardInterrupt())
    result = cli("fail")
    assert result.status == 130
    assert "Traceback" not in result.err


def test_a_reader_that_leaves_early_is_no_traceback(here: Path):
    done = subprocess.run(
        f"{sys.executable} -m cdfctl schema | head -1",
        shell=True,
        cwd=here,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "{\n"
    assert done.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("command", ["schema", "scenarios"])
def test_an_output_that_cannot_be_written_is_status_2(here: Path, command):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "cdfctl", command],
            cwd=here,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr.startswith("cdfctl: error: cannot write to standard output")
    assert "Traceback" not in done.stderr
