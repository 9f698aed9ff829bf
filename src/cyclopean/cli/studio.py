"""`studio`: the model in a browser, with sliders and a verdict that follows."""

import os
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

from cyclopean.cli.model_options import Density, Gravity, ModelFile, Mu, Supports, Tolerance, Units
from cyclopean.cli.outputs import folder
from cyclopean.cli.terminal import long_work, of_file, say, warn
from cyclopean.cli.values import choice, optional_number, tilt, vector, whole
from cyclopean.errors import InputError

__all__ = ["studio"]

METHODS = ("cra", "rbe")
HIGHEST = 65535
GLANCE = 0.2  # s
LOCAL = ("localhost", "::1")


def studio(
    model: ModelFile,
    port: Annotated[str | None, typer.Option(metavar="P", help="Where to listen [one that is free].")] = None,
    host: Annotated[
        str, typer.Option(metavar="H", help="Address to listen on; others than this machine's are open to the network.")
    ] = "127.0.0.1",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
    out: Annotated[
        str | None, typer.Option(metavar="DIR", help="Folder that the page saves to [where the model is].")
    ] = None,
    method: Annotated[
        str | None, typer.Option(metavar="|".join(METHODS), help="Coupled analysis or equilibrium alone [cra].")
    ] = None,
    mu: Mu = None,
    density: Density = None,
    supports: Supports = "",
    gravity: Gravity = None,
    tilt_by: Annotated[str | None, typer.Option("--tilt", metavar="DEG[,AZ]", help="Where the tilt begins.")] = None,
    units: Units = None,
    tolerance: Tolerance = None,
) -> int:
    """Open a live page of a model: turn friction, tilt and push, move blocks, and see whether it stands.

    Ctrl-C ends it.
    """
    wanted: dict[str, Any] = {
        "method": "" if method is None else choice("--method", method, METHODS),
        "mu": optional_number("--mu", mu, least=0.0),
        "density": optional_number("--density", density, above=0.0),
        "supports": supports,
        "gravity": vector("--gravity", gravity),
        "tilt": tilt("--tilt", tilt_by),
        "tolerance": optional_number("--tolerance", tolerance, above=0.0),
    }
    number = _port(port)
    place = Path(os.path.dirname(model) or os.curdir) if out is None else folder("--out", out, out)

    from cyclopean import analysis, io

    settings = analysis.Settings(**wanted)
    with ExitStack() as open_things:
        with long_work(f"opening {model}"), of_file(model):
            assembly, warnings = io.read_model(model, units)
            from cyclopean.view.studio.panel import studio as serve

            _listenable(host, number)
            page = open_things.enter_context(
                serve(
                    assembly, settings, folder=place, stem=Path(model).stem, host=host, port=number, warnings=warnings
                )
            )
        for warning in warnings:
            warn(warning)
        if not _local(host):
            warn(f"--host {host}: whoever sees the address can use the page, and save files into {place}")
        return _waited(page.address, not no_browser)


def _waited(address: str, browse: bool) -> int:
    """Tell where the page is and wait for Ctrl-C, which is how this ends well."""
    try:
        say(f"{address}  (Ctrl-C ends it)")
        if browse:
            import webbrowser

            webbrowser.open(address)
        while True:  # the signal may wake any thread, and this one answers it only when it is awake
            time.sleep(GLANCE)
    except KeyboardInterrupt:
        say("")
    return 0


def _port(text: str | None) -> int:
    """Number of the port; 0 = one that is free."""
    if text is None:
        return 0
    number = whole("--port", text)
    if not 1 <= number <= HIGHEST:
        raise InputError(f"--port: {number} is not between 1 and {HIGHEST}")
    return number


def _local(host: str) -> bool:
    return host in LOCAL or host.startswith("127.")


def _listenable(host: str, port: int) -> None:
    """Refuse a port that is taken, where the server would quietly take the next one, and a host that is not ours."""
    import socket

    try:
        family, kind, protocol, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            if os.name == "posix":
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(where)
    except (OSError, UnicodeError) as error:
        why = (getattr(error, "strerror", None) or str(error)).lower()
        what = f"--port {port}" if port else f"--host {host}"
        raise InputError(f"{what}: cannot listen there ({why}); choose another{'' if port else ' address'}") from None
