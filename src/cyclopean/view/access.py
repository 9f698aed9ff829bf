"""Who may reach a page that is served, and what of theirs gets through to viser.

viser answers to whoever asks: under any name, for a page of any origin, and takes whatever is sent. So its server is
made with checks in front. A request must name this server (else a web page has its own name point here), come from no
page of another origin, and know the token of the address; then messages are read before viser reads them.
"""

import hmac
import logging
import secrets
import threading
from collections.abc import Callable, Collection, Sequence
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, quote

from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from cyclopean.view.messages import Value, fits, read
from cyclopean.view.rate_limit import RateLimit

LARGEST = 16 * 2**10  # bytes of a message; those of a page of ours have some hundreds
CLIENTS = 32  # at the same time
LINES, SPAN = 30, 60.0  # in the log, in so many seconds: who is refused may come back at once
ANY = ("", "0.0.0.0", "::")  # no names, but all addresses of a machine
PAGES = ("", "/", "/index.html")
KEPT_IN = {  # headers of every page: nobody else frames it, and its address, which has the token, goes nowhere
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}

_LOG = logging.getLogger("cyclopean.view")
_MAKING = threading.Lock()


class AccessControl:
    """Access control of a viser server, which has none of its own.

    Parameters
    ----------
    host : str
        Where it listens, as the user said it.
    """

    def __init__(self, host: str) -> None:
        self.token = secrets.token_urlsafe(24)
        self.accepts: Callable[[str, Value], bool] = lambda uuid, value: False  # until there are elements
        self._host = host
        self._lines = RateLimit(LINES, SPAN)

    def guarded(self, make: Callable[[], Any]) -> Any:
        """What `make` makes: a viser server, whose websocket server has these checks; viser has no option for that.

        Raises
        ------
        RuntimeError
            It has another one: a page that everybody can reach is not served.
        """
        made: list[Any] = []

        def serve(handler: Any, *where: Any, **options: Any) -> Any:
            if not handler.__module__.startswith("viser."):
                return plain(handler, *where, **options)
            made.append(handler)
            return plain(handler, *where, **self._options(options))

        with _MAKING:
            plain = websockets_server.serve
            websockets_server.serve = serve  # type: ignore[misc,assignment]
            try:
                running = make()
            finally:
                websockets_server.serve = plain  # type: ignore[misc]
        if not made:
            running.stop()
            raise RuntimeError("this version of viser makes its server in another way, without access control")
        return running

    def _options(self, options: dict[str, Any]) -> dict[str, Any]:
        """Options of viser's server, with the checks among them."""
        answer, control = options["process_request"], self

        class Checked(ServerConnection):
            async def recv(self, decode: bool | None = None) -> Any:
                return await control._received(super().recv, self)

        def let_in(connection: ServerConnection, request: Request) -> Response | None:
            return control._answered(connection, request) or _kept_in(answer(connection, request))

        return {**options, "process_request": let_in, "create_connection": Checked, "max_size": LARGEST}

    def _answered(self, connection: ServerConnection, request: Request) -> Response | None:
        """The refusal of a request, or where to go instead; None where it may go on."""
        headers, (path, _, query) = request.headers, request.path.partition("?")
        allowed = authorities(self._host, *connection.local_address[:2])
        hosts, asked = headers.get_all("Host"), parse_qs(query)
        why = refusal(hosts, headers.get_all("Origin"), asked.get("token", []), allowed, self.token)
        if why:
            self._note(f"refused: {why}")
            return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
        if headers.get_all("Upgrade"):
            if len(connection.server.connections) < CLIENTS:
                return None
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"{CLIENTS} pages are open already\n")
        line = f"ws://{hosts[0]}/?token={self.token}"
        if path not in PAGES or asked.get("websocket") == [line]:
            return None
        onwards = connection.respond(HTTPStatus.FOUND, "")  # the page takes the place of its websocket from its address
        onwards.headers["Location"] = f"/?token={self.token}&websocket={quote(line, safe='')}"
        return _kept_in(onwards)

    async def _received(self, receive: Callable[[], Any], connection: ServerConnection) -> Any:
        """The next message that may go on to viser; who sends what is none is shown out, and nobody else."""
        while True:
            try:
                raw = await receive()
            except ConnectionClosedError as closed:
                if closed.sent is not None and closed.sent.code == CloseCode.MESSAGE_TOO_BIG:
                    self._note(f"a client sent more than {LARGEST // 2**10} kB in one message; it was disconnected")
                raise
            message = read(raw)
            if message is None:
                self._note("a client sent what is no message of the page; it was disconnected")
                await connection.close(CloseCode.POLICY_VIOLATION, "no message of the page")
                while True:  # until that is said and done
                    await receive()
            if fits(message, self.accepts):
                return raw
            self._note("a client sent a value out of range; it was left out")

    def _note(self, line: str) -> None:
        if self._lines.allows():
            _LOG.warning(line)


def _kept_in(response: Response | None) -> Response | None:
    if response is not None:
        response.headers.update(KEPT_IN)
    return response


def authorities(host: str, address: str, port: int) -> frozenset[str]:
    """Names, with the port, under which a server may be asked for.

    Parameters
    ----------
    host : str
        Where it listens, as the user said it.
    address, port : str, int
        Where this request came in: of all addresses of a machine the one that was used.

    Examples
    --------
    >>> sorted(authorities("0.0.0.0", "192.0.2.7", 8080))[:2]
    ['127.0.0.1:8080', '192.0.2.7:8080']
    """
    names = {"localhost", "127.0.0.1", "[::1]"}
    names |= {f"[{name}]" if ":" in name else name for name in (host.lower(), address.lower()) if name not in ANY}
    return frozenset(f"{name}:{port}" for name in names) | (frozenset(names) if port == 80 else frozenset())


def refusal(
    hosts: Sequence[str], origins: Sequence[str], tokens: Sequence[str], allowed: Collection[str], token: str
) -> str:
    """Why a request is refused, in one line; "" where it is not.

    Parameters
    ----------
    hosts, origins : sequence of str
        All headers of these names.
    tokens : sequence of str
        All that the address gives.
    allowed : collection of str
        Names with ports that are this server's.
    token : str
        The right one.
    """
    if len(hosts) != 1 or hosts[0].lower() not in allowed:
        return "the page does not answer to this name; open the address that the command printed"
    if any(origin.lower() not in {f"http://{name}" for name in allowed} for origin in origins):
        return "pages of another origin are not answered"
    if len(tokens) != 1 or not hmac.compare_digest(tokens[0].encode(errors="replace"), token.encode()):
        return "the token is missing or wrong; open the address that the command printed"
    return ""
