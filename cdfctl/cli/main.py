"""The ``cdfctl`` command: which commands there are, and how every error ends.

Heavy imports wait until a command needs them: ``cdfctl --help`` imports neither Pinocchio nor numpy.
"""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from cdfctl import __version__
from cdfctl.cli import bench, build_cdf, check, doctor, options, plot, robots, run, scenarios, schema, view
from cdfctl.cli.console import abandon, note, open_streams
from cdfctl.cli.failures import failure_of_system, report_bug, report_failure, report_usage
from cdfctl.errors import CdfctlError

# What Typer raises for a bad command line. It does not export this class, only the class two below it.
CommandLineError: type[Exception] = typer.BadParameter.__mro__[2]

INTERRUPTED = 130

app = typer.Typer(
    name="cdfctl",
    help="Safe motion of robot arms among moving obstacles.",
    epilog="Exit status: 0 done; 1 not reached, or collided; 2 bad input; 3 something needed is missing; "
    "4 the plant failed; 70 a bug of cdfctl; 130 interrupted.",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("run")(run.run)
app.command("bench", short_help="Run many trials of scenarios under controllers.")(bench.bench)
app.command("check")(check.check)
app.command("build-cdf", short_help="Build a robot's table of contact configurations.")(build_cdf.build_cdf)
app.command("plot", short_help="Draw figures of a run, a benchmark or the paper.")(plot.plot)
app.command("view", short_help="Replay a run in the browser.")(view.view)
app.command("robots")(robots.robots)
app.command("scenarios")(scenarios.scenarios)
app.command("schema")(schema.schema)
app.command("doctor")(doctor.doctor)


def _version(value: bool) -> None:
    if value:
        typer.echo(f"cdfctl {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    debug: options.Debug = False,
) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit(2)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status; nothing but the interpreter's own end escapes from here."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    open_streams()
    if arguments is None:
        # Taking all modules apart at the end takes a sixth of a short command, and the system frees the memory anyhow.
        atexit.register(gc.freeze)
    debug = "--debug" in words  # looked for here, because an error may come before the options are read
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a character the terminal lacks must not end a run
    try:
        return int(app(args=words, prog_name="cdfctl", standalone_mode=False) or 0)
    except CdfctlError as error:
        return report_failure(error, debug=debug)
    except CommandLineError as error:
        return report_usage(error, debug=debug)
    except (KeyboardInterrupt, typer.Abort) as error:
        if isinstance(error.__cause__, EOFError):  # Typer takes it for the end of what someone types
            return report_bug(error.__cause__, words, debug=debug)
        note("cdfctl: interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        abandon(sys.stdout)  # the reader has gone (`cdfctl schema | head`): say nothing
        return CdfctlError.exit_status
    except Exception as error:  # the one place: whatever else escapes is a bug, and a bug is one line and a log
        failure = failure_of_system(error)
        return report_bug(error, words, debug=debug) if failure is None else report_failure(failure, debug=debug)
