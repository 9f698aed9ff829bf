"""Standard output, standard error, and what goes wrong with them."""

import json
import os
import re
import shlex
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from cyclopean.errors import InputError, spelt

_UNUSUAL = re.compile(r"[^ -~\n]")
CALLED = os.environ.get("CYCLOPEAN_CALLED", "cyclopean")  # as it was typed: by a script, under the name of that
PATIENCE = 1.0  # s without a sign of life that a person takes for granted


class ClosedPipeError(Exception):
    """Nobody reads our output any more, as after `| head`."""


def one_line(text: str) -> str:
    """Put text on one line, without control characters: file names may hold anything."""
    return "".join(c if c.isprintable() else " " for c in " ".join(text.split()))


def say(text: str) -> None:
    """Print lines of text on standard output; control characters in them as JSON writes them."""
    _write(sys.stdout, spelt(text, as_option) + "\n")


def say_json(data: object) -> None:
    """Print data as one JSON document on standard output."""
    from cyclopean.io import json_text

    _write(sys.stdout, json_text(data))


def as_option(name: str) -> str:
    """An option as the command line spells it: beta_min is --beta-min."""
    return f"--{name.replace('_', '-')}"


def typed(*words: object) -> str:
    """A command that can be typed as it is.

    >>> typed("check", "my walls/arch.json").partition(" ")[2]
    "check 'my walls/arch.json'"
    """
    return f"{CALLED} {shlex.join(str(word) for word in words)}"


@contextmanager
def of_file(path: str) -> Iterator[None]:
    """Refusals of a block, a contact or loads name the file that it is in, too."""
    try:
        yield
    except InputError as error:
        if not str(error).startswith(("block ", "contact ", "loads:")):
            raise
        raise InputError(f"{path}: {error.spelt(as_option)}") from None


def warn(text: str) -> None:
    """Print a warning, one line on standard error."""
    _write(sys.stderr, f"cyclopean: warning: {one_line(spelt(text, as_option))}\n")


def complain(text: str) -> None:
    """Print an error, one line on standard error; where that is gone, as a closed terminal is, nobody can be told."""
    with suppress(OSError):
        _write(sys.stderr, f"cyclopean: error: {one_line(spelt(text, as_option))}\n")


@contextmanager
def long_work(what: str) -> Iterator[Callable[[str], None]]:
    """Show on a terminal that work goes on and for how long, once it takes more than a second.

    Yields
    ------
    callable
        To be told the name of each stage as it begins.
    """
    stages = [what]
    if not sys.stderr.isatty():
        yield stages.append
        return
    done = threading.Event()
    shown = threading.Thread(target=_tick, args=(stages, done), daemon=True)
    shown.start()
    try:
        yield lambda stage: stages.append(f"{what}: {stage}")
    finally:
        done.set()
        shown.join()


def _tick(stages: list[str], done: threading.Event) -> None:
    began = time.monotonic()
    width = 0
    while not done.wait(PATIENCE):
        line = f"{one_line(stages[-1])} ... {time.monotonic() - began:.0f} s"
        width = max(width, len(line))
        sys.stderr.write(f"\r{line:{width}}")
        sys.stderr.flush()
    if width:
        sys.stderr.write("\r" + " " * width + "\r")
        sys.stderr.flush()


def _write(stream: TextIO, text: str) -> None:
    encoding = stream.encoding or "utf-8"
    # characters that may command the terminal, or turn the direction of writing, in words instead
    text = _UNUSUAL.sub(lambda found: found[0] if found[0].isprintable() else json.dumps(found[0])[1:-1], text)
    try:
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        stream.flush()
    except BrokenPipeError:
        raise ClosedPipeError from None
    except OSError as error:
        raise OSError(error.errno, error.strerror, "standard output") from None
