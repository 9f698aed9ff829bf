"""`serve`: answer Grasshopper, by Hops."""

import importlib.util
import os
from pathlib import Path
from typing import Annotated

import typer

from cyclopean.cli.terminal import say, warn
from cyclopean.cli.workers import MOST
from cyclopean.errors import InputError
from cyclopean.texts import number, whole

__all__ = ["serve"]

NEEDED = ("rhino3dm", "starlette", "uvicorn")
SIZES = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30}
LARGEST = 2**31  # bytes of a body: openNURBS reads no larger archive


def serve(
    hops: Annotated[bool, typer.Option("--hops", help="Serve components for Hops, in Grasshopper.")] = False,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on; another one opens it to a network.")
    ] = "127.0.0.1",
    port: Annotated[str, typer.Option(metavar="N", help="Port to listen on; 0: any that is free.")] = "5000",
    max_body: Annotated[
        str, typer.Option("--max-body", metavar="SIZE", help="Largest request, in bytes or as 64M.")
    ] = "64M",
    seconds: Annotated[str, typer.Option(metavar="S", help="Time after which a solve is ended.")] = "60",
    workers: Annotated[str, typer.Option(metavar="N", help="Solves at the same time, each in a process.")] = "1",
    allow_folders: Annotated[
        str | None,
        typer.Option("--allow-folders", metavar="DIR", help="Folder from which requests may have stones read."),
    ] = None,
) -> int:
    """Serve this program's components to Rhino's Grasshopper until interrupted.

    There is no authentication: whoever reaches the address may use it.
    """
    if not hops:
        raise InputError("serve: say what is to be served: --hops")
    limit, count, size, place = (
        number("--seconds", seconds),
        whole("--workers", workers),
        _bytes(max_body),
        whole("--port", port),
    )
    if not 0.1 <= limit <= 86_400.0:
        raise InputError(f"--seconds: {limit:g} is not between 0.1 and 86400")
    if not 1 <= count <= MOST:
        raise InputError(f"--workers: {count} is not between 1 and {MOST}")
    if not 0 <= place <= 65_535:
        raise InputError(f"--port: {place} is not between 0 and 65535")
    folder = None if allow_folders is None else Path(allow_folders)
    if folder is not None and not folder.is_dir():
        raise InputError(f"--allow-folders {allow_folders}: no such folder")
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(f"serve: needs {', '.join(missing)}; install with: pip install 'cyclopean[rhino]'")

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean.service import Options
    from cyclopean.service import serve as run

    options = Options(host, place, size, limit, count, None if folder is None else folder.resolve())
    if not options.local:
        warn(f"--host {host}: whoever reaches this machine may use the server; there is no authentication")
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
