"""HTTP: what is asked, by whom, how much of it, and the answer. All else happens in processes of a `WorkerPool`.

It has no authentication. It listens on this machine only, unless told otherwise, and then refuses requests that were
made for another name (a web page that has its own name point here) and those that a web page of another origin makes.
"""

import asyncio
import contextlib
import ipaddress
import json
import re
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route

from cyclopean import __version__
from cyclopean.errors import InputError
from cyclopean.service.components.catalogue import COMPONENTS
from cyclopean.service.connections import ARRIVAL, connection_limit, protocol
from cyclopean.service.parameters import Component, Context
from cyclopean.service.protocol import described, refusal
from cyclopean.service.solving import encoded
from cyclopean.service.worker_pool import WorkerPool
from cyclopean.view.markup import STILL, document, section

LOCAL = ("localhost", "127.0.0.1", "::1")
DRAIN = 4  # times the largest body that is read, and thrown away, so that the client gets to hear why
BODIES = 4  # of the largest size that are held at one time, beside one for each process
HOST = re.compile(r"(\[[0-9a-z:.%_-]+\]|[0-9a-z._-]+)(?::([0-9]{1,5}))?")  # name and port, in small letters
UNREAD = (403, 408, 413, 415, 503)  # refusals after which a body may still be under way: it is not listened to


@dataclass(frozen=True, slots=True)
class Options:
    """How the server is run."""

    host: str = "127.0.0.1"
    port: int = 5000  # 0 = any that is free
    largest: int = 64 * 2**20  # bytes of a body
    seconds: float = 60.0  # after which a solve is ended
    workers: int = 1  # processes
    folder: Path | None = None  # that stones may be read from

    @property
    def local(self) -> bool:
        """Whether only this machine can reach it."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host.lower() == "localhost"


def serve(options: Options, ready: Callable[[str], None]) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    options : Options
        How.
    ready : callable
        Is told the address once requests are answered.

    Raises
    ------
    InputError
        The address cannot be listened on.
    """
    listening = _listening(options)
    port = listening.getsockname()[1]
    shown = f"[{options.host}]" if ":" in options.host else options.host
    most = connection_limit()
    config = uvicorn.Config(
        application(options),
        http=protocol(most),  # type: ignore[arg-type]  # uvicorn only calls it
        ws="none",
        lifespan="on",
        log_config=None,
        log_level="critical",
        access_log=False,
        server_header=False,
        limit_concurrency=2 * most,  # reached only where none of them gives way; of a burst many end at once
        timeout_graceful_shutdown=1,
    )
    with listening:
        _Announced(config, lambda: ready(f"http://{shown}:{port}")).run(sockets=[listening])


class _Announced(uvicorn.Server):
    """Says when it is there."""

    def __init__(self, config: uvicorn.Config, ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn's, then say so."""
        await super().startup(sockets)
        if self.started:
            self._ready()


def _listening(options: Options) -> socket.socket:
    try:
        found = socket.getaddrinfo(options.host, options.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):
        raise InputError(f"--host {options.host}: is no address of this machine") from None
    family, _, _, _, address = found[0]
    try:
        return socket.create_server(address[:2], family=family, backlog=128)
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise InputError(f"--port {options.port}: cannot listen on {options.host} ({why}); choose another") from None


def application(options: Options) -> Starlette:
    """The application; its processes start and end with it."""
    told = {name: encoded(described(component)) for name, component in COMPONENTS.items()}
    listed = b"[" + b",".join(told.values()) + b"]"
    page = _page(COMPONENTS)
    pools: list[WorkerPool] = []
    bodies = _Bodies((BODIES + options.workers) * options.largest)

    @contextlib.asynccontextmanager
    async def running(_: Starlette) -> AsyncIterator[None]:
        pools.append(WorkerPool(options.workers, Context(options.seconds, options.folder)))
        try:
            yield
        finally:
            await asyncio.to_thread(pools[-1].close)

    async def root(request: Request) -> Response:
        _refuse_strangers(request, options)
        if "text/html" in request.headers.get("accept", ""):
            return HTMLResponse(page)
        return _json(200, listed)

    async def description(request: Request) -> Response:
        _refuse_strangers(request, options)
        name = request.path_params["name"]
        if name not in told:
            raise HTTPException(404, f"there is no component '{name[:60]}'; GET / lists them")
        return _json(200, told[name])

    async def solve(request: Request) -> Response:
        _refuse_strangers(request, options)
        with bodies.held() as hold:
            body = await _body(request, options, hold)
            return await _answer(request, pools[-1], request.path_params.get("name", ""), body)

    async def plain(request: Request) -> Response:
        _refuse_strangers(request, options)
        says = {"/healthcheck": "Healthy", "/activechildren": str(options.workers)}
        return PlainTextResponse(says[request.url.path])

    async def version(request: Request) -> Response:
        _refuse_strangers(request, options)
        return _json(200, json.dumps({"cyclopean": __version__}).encode())

    return Starlette(
        routes=[
            Route("/", root),
            Route("/healthcheck", plain),
            Route("/activechildren", plain),
            Route("/version", version),
            Route("/solve", solve, methods=["POST"]),
            Route("/{name}", description, methods=["GET"]),
            Route("/{name}", solve, methods=["POST"]),
        ],
        exception_handlers={HTTPException: _refused},
        lifespan=running,
    )


def _json(status: int, body: bytes) -> Response:
    return Response(body, status, media_type="application/json")


async def _refused(_: Request, error: Exception) -> Response:
    """Every refusal in the form that Hops shows."""
    assert isinstance(error, HTTPException)
    answer = _json(error.status_code, encoded(refusal([error.detail])))
    if error.status_code in UNREAD:
        answer.headers["Connection"] = "close"
    return answer


def _refuse_strangers(request: Request, options: Options) -> None:
    """Refuse what a web page elsewhere may have made a browser send."""
    hosts = [said.lower() for said in request.headers.getlist("host")]
    asked = HOST.fullmatch(hosts[0]) if len(hosts) == 1 else None
    port = request.scope["server"][1]
    if asked is None:
        raise HTTPException(403, "a request names one host, as in 'Host: localhost:5000'")
    if options.local and asked[1].strip("[]") not in (*LOCAL, options.host.lower()):
        raise HTTPException(403, "this server answers to localhost only; start it with --host to open it")
    if options.local and int(asked[2] or 80) != port:
        raise HTTPException(403, f"this server answers at its own port only: localhost:{port}")
    own = [f"{way}://{hosts[0]}" for way in ("http", "https")]
    if any(origin.lower() not in own for origin in request.headers.getlist("origin")):
        raise HTTPException(403, "requests from web pages of another origin are not answered")


class _Bodies:
    """What all bodies together may take of the memory."""

    def __init__(self, most: int) -> None:
        self._left = most

    @contextlib.contextmanager
    def held(self) -> Iterator[Callable[[int], None]]:
        """Yield what is to be told the size of each part of one body before it is kept."""
        mine = 0

        def hold(size: int) -> None:
            nonlocal mine
            if size > self._left:
                raise HTTPException(503, "the server holds as much as it may for others; try again")
            mine += size
            self._left -= size

        try:
            yield hold
        finally:
            self._left += mine


async def _body(request: Request, options: Options, hold: Callable[[int], None]) -> bytes:
    """Read the body, but not more than is allowed, nor for longer than a solve may take, or a minute."""
    most = f"{options.largest / 2**20:g} MB"
    said = f"the request is larger than {most}; send coarser meshes, or start the server with more --max-body"
    length = request.headers.get("content-length", "0")
    if request.headers.get("content-encoding", "identity") != "identity":
        raise HTTPException(415, "compressed requests are not read")
    if len(length) > 15 or not length.isdecimal() or int(length) > DRAIN * options.largest:
        raise HTTPException(413, said)
    parts: list[bytes] = []
    size = 0
    try:
        async with asyncio.timeout(min(options.seconds, ARRIVAL)):
            async for part in request.stream():
                size += len(part)
                if size <= options.largest:
                    hold(len(part))
                    parts.append(part)
                elif size > DRAIN * options.largest:
                    raise HTTPException(413, said)
    except TimeoutError:
        raise HTTPException(408, "the request did not arrive in time") from None
    except ClientDisconnect:
        raise HTTPException(400, "the request was cut off") from None
    if size > options.largest:
        raise HTTPException(413, said)
    return b"".join(parts)


async def _answer(request: Request, pool: WorkerPool, name: str, body: bytes) -> Response:
    """The answer, unless the client goes: then its solve is ended, for Hops asks anew at every turn of a slider."""
    solving = asyncio.ensure_future(pool.answer(name, body))
    going = asyncio.ensure_future(_gone(request))
    try:
        await asyncio.wait((solving, going), return_when=asyncio.FIRST_COMPLETED)
        if solving.done():
            return _json(*solving.result())
        return Response(status_code=400)  # nobody reads it
    finally:
        for task in (solving, going):
            task.cancel()


async def _gone(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _page(components: dict[str, Component]) -> str:
    """What a person sees who opens the address in a browser."""
    lead = (
        "<h1>cyclopean for Grasshopper</h1><p>Put a Hops component on the canvas, double-click it, and give it one of"
        " these addresses. Numbers are in SI units; meshes, curves and points in the units of the Rhino document.</p>"
    )
    parts = [section(escape(c.name), _told(c), escape(c.about)) for c in components.values()]
    return document("cyclopean for Grasshopper", [lead, *parts], may=f"{STILL}; img-src data:")


def _told(component: Component) -> str:
    rows = [("in", given.name, given.nickname, given.kind, given.access, given.about) for given in component.inputs]
    rows += [("out", made.name, made.nickname, made.kind, made.access, made.about) for made in component.outputs]
    cells = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    heads = "".join(f"<th>{head}</th>" for head in ("", "Name", "", "Type", "Access", "Meaning"))
    return (
        f'<p><img src="data:image/png;base64,{described(component)["Icon"]}" width="24" height="24" alt=""> '
        f'<a href="/{component.path}"><code>/{component.path}</code></a></p>'
        f'<div class="wide"><table><thead><tr>{heads}</tr></thead><tbody>{cells}</tbody></table></div>'
    )
