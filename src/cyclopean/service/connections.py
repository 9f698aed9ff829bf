"""Connections that cannot keep others out: how long one may take, how many there are, and which one gives way.

A connection waits for its client while the head of a request, or its body, is not whole, or while nobody fetches the
answer. Each such wait has an end; and where there are as many connections as there may be, a new one takes the place
of the one that has waited longest, those without a whole head first. Sending slowly is then of no use to anybody.
"""

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

CONNECTIONS = 512  # open at once, where the system allows the process twice as many
HEAD = 5.0  # s for the head of a request, also the next one of a connection
ARRIVAL = 60.0  # s for a body, and to fetch what is ready of an answer
GRACE = 5.0  # s more, in which who reads the body says so in words
LATE = b"HTTP/1.1 408 Request Timeout\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"


def connection_limit() -> int:
    """Connections at one time: half of the files that the process may open leaves enough for everything else."""
    with contextlib.suppress(ImportError):  # Windows has no such limit
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        return CONNECTIONS if most < 0 else max(min(CONNECTIONS, most // 2), 1)
    return CONNECTIONS


def protocol(most: int) -> Callable[..., asyncio.Protocol]:
    """HTTP as uvicorn and h11 speak it, with at most so many connections."""

    def made(*given: Any, **named: Any) -> asyncio.Protocol:
        return _Connection(most, *given, **named)

    return made


class _Connection(H11Protocol):
    """One connection of the server."""

    def __init__(self, most: int, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._most = most
        self._stage: tuple[object, ...] = ()  # how far the client has come, and with which request
        self._since = 0.0
        self._end: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._watch()
        if len(self.connections) <= self._most:
            return
        held = [c for c in self.connections if isinstance(c, _Connection) and not c.transport.is_closing()]
        if len(held) > self._most:  # those that were ended are among the connections for a moment yet
            others = (c for c in held if c is not self and c.patience)
            if last := min(others, key=lambda c: (c.conn.their_state is not h11.IDLE, c._since), default=None):
                last.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._rest()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._watch()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._watch()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._watch()

    def resume_writing(self) -> None:
        super().resume_writing()
        self._watch()

    @property
    def patience(self) -> float | None:
        """Seconds that the client has for what it has to do next; None where it has done all."""
        if self.conn.their_state is h11.IDLE:
            return HEAD
        return ARRIVAL + GRACE if self.conn.their_state is h11.SEND_BODY or self.flow.write_paused else None

    def _watch(self) -> None:
        """Start the clock anew where the client has come further; what trickles in does not."""
        stage = (self.conn.their_state, self.flow.write_paused, self.cycle)
        if stage == self._stage:
            return
        self._rest()
        self._stage, self._since = stage, self.loop.time()
        if self.patience is not None and not self.transport.is_closing():
            self._end = self.loop.call_later(self.patience, self._give_up)

    def _rest(self) -> None:
        if self._end is not None:
            self._end.cancel()
            self._end = None

    def _give_up(self) -> None:
        """End the connection; one that has begun a head, and awaits no other answer, is told why."""
        if self.conn.their_state is h11.IDLE and self.conn.our_state is h11.IDLE and self.conn.trailing_data[0]:
            self.transport.write(LATE)
            self.transport.close()
        else:
            self.transport.abort()
