"""`studio`: the model in a browser, with sliders and a verdict that follows."""

import os
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopean.analysis.settings import Settings
from cyclopean.api.inputs import Reading, assembly_of
from cyclopean.cli.check import MODEL
from cyclopean.cli.command import command, some
from cyclopean.cli.outputs import folder
from cyclopean.cli.terminal import long_work, of_file, say, warn
from cyclopean.errors import InputError
from cyclopean.options import Option, option

HIGHEST = 65535  # port of TCP
GLANCE = 0.2  # s
LOCAL = ("localhost", "::1")


@dataclass(frozen=True, slots=True)
class Page:
    """Where the page is to be seen."""

    port: int | None = option(None, "Where to listen [one that is free].", "whole", metavar="P")
    host: str = option(
        "127.0.0.1", "Address to listen on; others than this machine's are open to the network.", metavar="H"
    )
    no_browser: bool = option(False, "Only print the address.", "flag")


@command()
def studio(
    model: Annotated[str, MODEL],
    settings: Annotated[
        Settings, some("method mu density supports gravity tilt tolerance", tilt="Where the tilt begins.")
    ] = Settings(),
    reading: Reading = Reading(),
    page: Page = Page(),
    out: Annotated[str | None, Option("Folder that the page saves to [where the model is].", metavar="DIR")] = None,
) -> int:
    """Open a live page of a model: turn friction, tilt and push, move blocks, and see whether it stands.

    Ctrl-C ends it.
    """
    if page.port is not None and not 1 <= page.port <= HIGHEST:
        raise InputError.of("port", page.port, f"expected a whole number from 1 to {HIGHEST}")
    host, port = address = page.host, page.port or 0
    place = Path(os.path.dirname(model) or os.curdir) if out is None else folder("--out", out, out)
    with ExitStack() as open_things:
        with long_work(f"opening {model}"), of_file(model):
            assembly, warnings = assembly_of(model, reading)
            from cyclopean.view.studio.panel import studio as serve

            _listenable(host, port)
            served = open_things.enter_context(
                serve(assembly, settings, folder=place, stem=Path(model).stem, address=address, warnings=warnings)
            )
        for warning in warnings:
            warn(warning)
        if host not in LOCAL and not host.startswith("127."):
            warn(f"--host {host}: whoever sees the address can use the page, and save files into {place}")
        return _waited(served.address, not page.no_browser)


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
