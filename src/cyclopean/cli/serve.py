"""`serve`: answer Grasshopper, by Hops."""

import importlib.util
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopean.cli.command import command
from cyclopean.cli.terminal import say, warn
from cyclopean.cli.workers import MOST
from cyclopean.errors import InputError
from cyclopean.options import Option, option
from cyclopean.texts import number

NEEDED = ("rhino3dm", "starlette", "uvicorn")
SIZES = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30}
LARGEST = 2**31  # bytes of a body: openNURBS reads no larger archive


@dataclass(frozen=True, slots=True)
class Serving:
    """How the server is run, as typed."""

    host: str = option("127.0.0.1", "Address to listen on; another one opens it to a network.", metavar="ADDRESS")
    port: int = option(5000, "Port to listen on; 0: any that is free.", "whole", metavar="N", least=0, most=65_535)
    max_body: str = option("64M", "Largest request, in bytes or as 64M.", metavar="SIZE")
    seconds: float = option(60.0, "Time after which a solve is ended.", "number", metavar="S", least=0.1, most=86_400.0)
    workers: int = option(1, "Solves at the same time, each in a process.", "whole", metavar="N", least=1, most=MOST)
    allow_folders: str | None = option(None, "Folder from which requests may have stones read.", metavar="DIR")


@command()
def serve(
    hops: Annotated[bool, Option("Serve components for Hops, in Grasshopper.", "flag")] = False,
    asked: Serving = Serving(),
) -> int:
    """Serve this program's components to Rhino's Grasshopper until interrupted.

    There is no authentication: whoever reaches the address may use it.
    """
    if not hops:
        raise InputError("serve: say what is to be served: --hops")
    size = _bytes(asked.max_body)
    folder = None if asked.allow_folders is None else Path(asked.allow_folders)
    if folder is not None and not folder.is_dir():
        raise InputError(f"--allow-folders {asked.allow_folders}: no such folder")
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(f"serve: needs {', '.join(missing)}; install with: pip install 'cyclopean[rhino]'")

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean.service import Options
    from cyclopean.service import serve as run

    where = None if folder is None else folder.resolve()
    options = Options(asked.host, asked.port, size, asked.seconds, asked.workers, where)
    if not options.local:
        warn(f"--host {asked.host}: whoever reaches this machine may use the server; there is no authentication")
    try:
        run(options, lambda address: say(f"serving Grasshopper's Hops at {address} (Ctrl-C ends it)"))
    except KeyboardInterrupt:  # that is how a server ends
        pass
    return 0


def _bytes(text: str) -> int:
    """Read a size such as 64M.

    Raises
    ------
    InputError
        It is none, or not between a kilobyte and what can be read.
    """
    unit = text[-1:].upper() if text[-1:].isalpha() else ""
    if unit not in SIZES:
        raise InputError(f"--max-body: '{text}' should be a number of bytes, or one with K, M or G")
    size = number("--max-body", text.removesuffix(text[-1:]) if unit else text) * SIZES[unit]
    if not 2**10 <= size <= LARGEST:
        raise InputError(f"--max-body: {text} is not between 1K and 2G")
    return int(size)
