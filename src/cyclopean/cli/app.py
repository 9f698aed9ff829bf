"""The commands together, and what every one of them owes its caller: a status, and errors on one line."""

import os
import sys
import traceback
from collections import UserDict
from collections.abc import Mapping
from importlib import import_module
from typing import Annotated, Any

import typer

from cyclopean import __version__
from cyclopean.cli.completion import ASKED, candidates
from cyclopean.cli.plain import PlainGroup
from cyclopean.cli.terminal import CALLED, ClosedPipeError, as_option, complain, say
from cyclopean.errors import CyclopeanError, SolverError

BAD_INPUT, UNDECIDED, INTERNAL, INTERRUPTED, CLOSED_PIPE = 2, 3, 70, 130, 141

# The parent of everything that typer's parser raises; typer names only a child of it in public.
UsageError: type[Any] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")

# Commands, each with the module of `cli` that holds it: only that of the command that is called is imported.
COMMANDS = {
    "demo": ("demo", "Draw a wall, find it stones, carve them, prove that it stands, and plan how it is built."),
    "check": ("check", "Tell whether a model stands, and prove it."),
    "verify": ("files", "Check a certificate in exact arithmetic."),
    "info": ("info", "Say what is in a model file, or in a folder of stones."),
    "convert": ("files", "Write a model in another format, in metres."),
    "sequence": ("sequence", "Find the order in which a model is built, and check every stage."),
    "match": ("match", "Match found stones to the cells of a wall, so that as little as possible is carved away."),
    "carve": ("carve", "Cut matched stones back to their cells, write the cut list, and check the wall as built."),
    "ashlar": ("ashlar", "Build a wall of sawn stones in a bond."),
    "pack": ("ashlar", "Build a wall of the sawn stones that fit best."),
    "settle": ("settle", "Lay found stones, uncut, into a dry rubble wall that stands at every stage."),
    "serve": ("serve", "Serve this program's components to Rhino's Grasshopper until interrupted."),
    "view": ("view", "Show a model, or the result of a check, as a page that needs no network."),
    "studio": ("studio", "Open a live page of a model: turn friction, tilt and push, move blocks, and see."),
    "limit": ("limit", "Tell by how much live loads may grow before a mechanism forms, and prove it."),
    "make": (
        "make",
        "Make a stack, wall, arch, vault, dome, bridge, retaining or polygonal wall, or synthetic stones.",
    ),
    "doctor": ("doctor", "Look at what is installed, what is missing, and whether the core does its work here."),
    "completion": ("completion", "Print the script by which a shell completes commands, options and their words."),
}

SECTIONS = {
    "Begin here": ("demo", "doctor"),
    "Stability": ("check", "limit", "studio", "verify"),
    "Draw": ("make", "ashlar"),
    "Build with the stones at hand": ("match", "carve", "settle", "pack", "sequence"),
    "Files and other programs": ("info", "convert", "view", "serve", "completion"),
}

MADE = {
    "stack": ("make", "Make blocks on top of each other."),
    "wall": ("make", "Make a running-bond wall."),
    "arch": ("make", "Make a circular arch."),
    "vault": ("make", "Make a barrel vault."),
    "dome": ("make", "Make a hemispherical dome."),
    "retaining": ("earthworks", "Make a dry-stone wall with batter and through-stones, and the earth behind it."),
    "bridge": ("earthworks", "Make an arch bridge: arch, spandrel walls and fill."),
    "polygonal": ("polygonal", "Make a wall of polygonal stones, flat or curved, or two round a corner."),
    "stones": ("quarry", "Make synthetic stones with the shapes of real ones."),
}


class _Commands(UserDict[str, Any]):
    """Commands by their names, each made of its row in a table when it is asked for."""

    def __getitem__(self, name: str) -> Any:
        found = super().__getitem__(name)
        if isinstance(found, tuple):
            module, says = found
            if name == "make":
                found = Making(name=name, help=says, rich_markup_mode=None)
            else:
                found = getattr(import_module(f"cyclopean.cli.{module}"), name).click(name)
            self[name] = found
        return found


class Program(PlainGroup):
    """All commands; what each does is known without importing it."""

    table: Mapping[str, tuple[str, str]] = COMMANDS
    sections: Mapping[str, tuple[str, ...]] = SECTIONS

    def __init__(self, *words: Any, **options: Any) -> None:
        super().__init__(*words, **options)
        self.commands = _Commands(self.table)

    def format_commands(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]
        """One line for each command, by what they are for."""
        for title, names in self.sections.items():
            with formatter.section(title):
                formatter.write_dl([(name, self.table[name][1]) for name in names])


class Making(Program):
    """The commands below `make`."""

    table = MADE
    sections: Mapping[str, tuple[str, ...]] = {"Commands": tuple(MADE)}


app = typer.Typer(
    cls=Program,
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
        say(context.get_help())
    return 0


def program() -> Any:
    """The whole command line, as the parser knows it."""
    return typer.main.get_command(app)


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
    found = candidates(program(), words)
    if found:
        say("\n".join(found))
    return 0


def _guarded(arguments: list[str]) -> int:
    """Run one command and put whatever goes wrong into one line and a status."""
    try:
        status = _status(arguments)
        if status == INTERRUPTED:
            complain("interrupted; no result was written")
        return int(status or 0)
    except UsageError as error:
        command = error.ctx.command_path if error.ctx else CALLED
        complain(f"{error.format_message().rstrip('.')}; see {command} --help")
    except SolverError as error:
        complain(error.spelt(as_option))
        return UNDECIDED
    except CyclopeanError as error:
        complain(error.spelt(as_option))
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted; no result was written")
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


def _status(arguments: list[str]) -> int | None:
    """What a command answers; an interrupt that a library, while it was loaded, took for its own error is one again."""
    try:
        status: int | None = program().main(arguments, prog_name=CALLED, standalone_mode=False)
        return status
    except Exception as error:
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__ or cause.__context__
        if cause is None:
            raise
        raise KeyboardInterrupt from error


def _stop_writing() -> None:
    """Keep the interpreter from complaining about the closed pipe when it flushes at its end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
