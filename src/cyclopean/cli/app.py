"""The commands together, and what every one of them owes its caller: a status, and errors on one line."""

import os
import sys
import traceback
from typing import Annotated, Any

import typer

from cyclopean import __version__
from cyclopean.cli import files, make
from cyclopean.cli.ashlar import ashlar, pack
from cyclopean.cli.carve import carve
from cyclopean.cli.check import check
from cyclopean.cli.completion import ASKED, candidates, completion
from cyclopean.cli.demo import demo
from cyclopean.cli.doctor import doctor
from cyclopean.cli.info import info
from cyclopean.cli.limit import LimitCommand, limit
from cyclopean.cli.match import match
from cyclopean.cli.plain import PlainCommand, PlainGroup
from cyclopean.cli.sequence import sequence
from cyclopean.cli.serve import serve
from cyclopean.cli.settle import settle
from cyclopean.cli.studio import studio
from cyclopean.cli.terminal import ClosedPipeError, as_option, complain, say
from cyclopean.cli.view import view
from cyclopean.errors import CyclopeanError, InputError, SolverError

__all__ = ["run"]

BAD_INPUT, UNDECIDED, INTERNAL, INTERRUPTED, CLOSED_PIPE = 2, 3, 70, 130, 141

# The parent of everything that typer's parser raises; typer names only a child of it in public.
UsageError: type[Any] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")

app = typer.Typer(
    cls=PlainGroup,
    help="Does dry-jointed stone stand? Every verdict comes with a certificate that anyone can check.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["--help", "-h"]},
)


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context, version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False
) -> int:
    """Does dry-jointed stone stand? Every verdict comes with a certificate that anyone can check."""
    if version:
        say(f"cyclopean {__version__}")
        raise typer.Exit(0)
    if context.invoked_subcommand is None:
        raise InputError("no command given; see cyclopean --help")
    return 0


for command in (demo, check, files.verify, info, files.convert, sequence, match, carve, ashlar, pack, settle, serve):
    app.command(cls=PlainCommand)(command)
for to_look_at in (view, studio):
    app.command(cls=PlainCommand)(to_look_at)
app.command(cls=LimitCommand)(limit)
app.add_typer(make.commands, name="make")
for about_itself in (doctor, completion):
    app.command(cls=PlainCommand)(about_itself)


def run(arguments: list[str]) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : list of str
        Without the program's name.

    Returns
    -------
    int
        Exit status: that of the command, 2 for bad input, 3 when a solver failed, 130 when interrupted, 141 when nobody
        reads the output, 70 for a fault of ours (never 1, which is a verdict).
    """
    try:
        if ASKED in os.environ:
            return _complete(arguments)
        return _guarded(arguments)
    except ClosedPipeError:
        _stop_writing()
        return CLOSED_PIPE


def _complete(words: list[str]) -> int:
    """Answer the shell that asks what a word may become."""
    found = candidates(typer.main.get_command(app), words)
    if found:
        say("\n".join(found))
    return 0


def _guarded(arguments: list[str]) -> int:
    """Run one command and put whatever goes wrong into one line and a status."""
    try:
        status = typer.main.get_command(app).main(arguments, prog_name="cyclopean", standalone_mode=False)
        if status == INTERRUPTED:
            complain("interrupted")
        return int(status or 0)
    except UsageError as error:
        command = error.ctx.command_path if error.ctx else "cyclopean"
        complain(f"{error.format_message().rstrip('.')}; see {command} --help")
    except SolverError as error:
        complain(error.spelt(as_option))
        return UNDECIDED
    except CyclopeanError as error:
        complain(error.spelt(as_option))
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted")
        return INTERRUPTED
    except OSError as error:
        complain(f"{error.filename or 'standard output'}: {(error.strerror or str(error)).lower()}")
    except MemoryError:
        complain("not enough memory for a model of this size")
    except ClosedPipeError:
        raise
    except Exception as error:  # noqa: BLE001  Python would leave with 1, and 1 says that the model falls
        last = traceback.extract_tb(error.__traceback__)[-1]
        complain(f"internal error, please report it: {type(error).__name__}: {error} ({last.filename}:{last.lineno})")
        return INTERNAL
    except SystemExit as leaving:  # typer's own answer to a closed pipe
        raise ClosedPipeError from leaving
    return BAD_INPUT


def _stop_writing() -> None:
    """Keep the interpreter from complaining about the closed pipe when it flushes at its end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
