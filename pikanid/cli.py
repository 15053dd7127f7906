"""The command line: which commands there are, and what becomes of failures.

Exit codes: 0 done; 2 bad input, with one sentence on standard error; 3 fitted, but the model does
not explain the recording; 70 something failed that nobody foresaw, with one sentence that says
where and how to report it (``--debug`` shows the traceback); 130 interrupted; 141 the reader of
the output has left.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from typing import Annotated, Any, TextIO

import typer

from pikanid import errors
from pikanid.commands import interrupts, unforeseen
from pikanid.commands.benchmark import EXAMPLES as BENCHMARK
from pikanid.commands.benchmark import benchmark
from pikanid.commands.channels import EXAMPLES as CHANNELS
from pikanid.commands.channels import channels
from pikanid.commands.conceal import EXAMPLES as CONCEAL
from pikanid.commands.conceal import conceal
from pikanid.commands.confusable import EXAMPLES as CONFUSABLE
from pikanid.commands.confusable import confusable
from pikanid.commands.design import EXAMPLES as DESIGN
from pikanid.commands.design import design
from pikanid.commands.diagnose import EXAMPLES as DIAGNOSE
from pikanid.commands.diagnose import diagnose
from pikanid.commands.effects import EXAMPLES as EFFECTS
from pikanid.commands.effects import effects
from pikanid.commands.equivalence import EXAMPLES as EQUIVALENCE
from pikanid.commands.equivalence import equivalence
from pikanid.commands.extract import EXAMPLES as EXTRACT
from pikanid.commands.extract import extract
from pikanid.commands.identify import EXAMPLES as IDENTIFY
from pikanid.commands.identify import identify
from pikanid.commands.models import EXAMPLES as MODELS
from pikanid.commands.models import models
from pikanid.commands.score import EXAMPLES as SCORE
from pikanid.commands.score import score
from pikanid.commands.simulate import EXAMPLES as SIMULATE
from pikanid.commands.simulate import simulate
from pikanid.commands.study import EXAMPLES as STUDY
from pikanid.commands.study import study
from pikanid.commands.track import EXAMPLES as TRACK
from pikanid.commands.track import track
from pikanid.commands.validate import EXAMPLES as VALIDATE
from pikanid.commands.validate import validate

EXIT_UNFORESEEN = 70  # definition: EX_SOFTWARE of sysexits.h
EXIT_INTERRUPTED = 130  # definition: 128 + SIGINT, as shells have it
EXIT_PIPE = 141  # definition: 128 + SIGPIPE: what other programs end with when nobody reads on
EXAMPLES = """Examples:

  pikanid simulate --model sloshing --sigma 0.1deg --out run.csv

  pikanid identify run.csv --model sloshing --sigma 0.1deg --plot fit.png

  pikanid models sloshing

Exit codes: 0 done, 2 bad input, 3 fitted, but the model does not explain the recording, \
70 a failure of pikanid itself (--debug shows where), 130 interrupted."""

# What typer raises for wrong usage; where its base class lives depends on the version.
UsageError: Any = typer.BadParameter.__mro__[2]

app = typer.Typer(
    name="pikanid", add_completion=False, rich_markup_mode="rich",
    pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]})
app.command(epilog=IDENTIFY)(identify)
app.command(epilog=CHANNELS)(channels)
app.command(epilog=TRACK)(track)
app.command(epilog=VALIDATE)(validate)
app.command(epilog=DIAGNOSE)(diagnose)
app.command(epilog=EFFECTS)(effects)
app.command(epilog=CONFUSABLE)(confusable)
app.command(epilog=DESIGN)(design)
app.command(epilog=SIMULATE)(simulate)
app.command(epilog=MODELS)(models)
app.command(epilog=STUDY)(study)
app.command(epilog=BENCHMARK)(benchmark)
app.command(epilog=EQUIVALENCE)(equivalence)
app.command(epilog=EXTRACT)(extract)
app.command(epilog=CONCEAL)(conceal)
app.command(epilog=SCORE)(score)


@app.callback(invoke_without_command=True, epilog=EXAMPLES)
def pikanid(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="print the version")] = False,
    debug: Annotated[bool, typer.Option(
        unforeseen.DEBUG, help="show the traceback of a failure of pikanid itself; may stand "
        "anywhere in the line")] = False,  # taken from the line by `main`
) -> None:
    """Parameters of a simulation model from a recording, and how far to trust them."""
    if version:
        from importlib.metadata import version as installed

        print(f"pikanid {installed('pikanid')}")
        raise typer.Exit(0)
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit(0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code.

    >>> main(["identify", "absent.csv", "--model", "sloshing"])
    2
    """
    for stream in (sys.stdout, sys.stderr):
        _never_fail_to_print(stream)
    words, debug = unforeseen.without_debug(sys.argv[1:] if arguments is None else arguments)
    try:
        with interrupts.none_lost():
            code = app(args=words, prog_name="pikanid", standalone_mode=False)
        sys.stdout.flush()
    except errors.PikanidError as problem:
        return _complain(str(problem), problem.exit_code)
    except UsageError as problem:
        command = " ".join(["pikanid", *(w for w in words[:1] if w in _commands())])
        # Unlike str(), it names the option.
        return _complain(errors.usage(problem.format_message(), command), 2)
    except (BrokenPipeError, SystemExit):
        # The reader has left (typer and rich make SystemExit of it).
        _leave_unsaid()
        return EXIT_PIPE
    except OSError as problem:
        try:
            sys.stdout.flush()
        except OSError:  # a full disk behind a buffer that still holds what was printed
            _leave_unsaid()
        place = str(problem.filename or "the output")
        return _complain(errors.cannot_write(place, problem.strerror or ""), 2)
    except MemoryError:
        return _complain(errors.out_of_memory(), 2)
    except (KeyboardInterrupt, typer.Abort):
        code = EXIT_INTERRUPTED
    except Exception as failure:  # the net: the only place that takes what nobody foresaw
        # an import that was interrupted half-way raises something of its own
        if not interrupts.became(failure):
            if debug:
                traceback.print_exception(failure)
            return _complain(unforeseen.sentence(failure, words), EXIT_UNFORESEEN)
        code = EXIT_INTERRUPTED
    if code == EXIT_INTERRUPTED:
        print("Interrupted.", file=sys.stderr)
    return int(code or 0)


def _leave_unsaid() -> None:
    """Python flushes once more when it ends, which would fail again, with an exit code of its own.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(text: str, code: int) -> int:
    from pikanid.reporting.console import complain

    complain(text)
    return code


def _commands() -> list[str]:
    return [str(getattr(command.callback, "__name__", "")) for command in app.registered_commands]


def _never_fail_to_print(stream: TextIO) -> None:
    """Where a terminal has no χ or ±, print a question mark rather than stop."""
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="replace")


