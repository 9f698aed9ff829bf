"""What strangers may do to the server over plain sockets: hold connections, crowd in, name hosts, and follow links."""

import asyncio
import contextlib
import json
import os
import re
import socket
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

for name in ("rhino3dm", "starlette", "uvicorn"):
    pytest.importorskip(name, reason=f"{name} of the extra rhino is not installed")

import uvicorn  # noqa: E402
from starlette.exceptions import HTTPException  # noqa: E402
from starlette.requests import Request  # noqa: E402

from cyclopean.design.stones.inventory import Inventory  # noqa: E402
from cyclopean.design.stones.quarry import quarry  # noqa: E402
from cyclopean.io import write_stones  # noqa: E402
from cyclopean.service import Options  # noqa: E402
from cyclopean.service import server as module  # noqa: E402
from cyclopean.service.connections import connection_limit, protocol  # noqa: E402
from hops_cases import request, serving, tower  # noqa: E402

PATIENCE = 120.0  # s for an answer, on whatever machine


@pytest.fixture(scope="module")
def yards(tmp_path_factory):
    """A folder that may be read and one that may not, each with two stones."""
    root = tmp_path_factory.mktemp("yards")
    for part in ("allowed", "other"):
        (root / part).mkdir()
        write_stones(root / part, Inventory(quarry(2, seed=1, volume=(0.6, 1.4), detail=1)))
    return root


@pytest.fixture(scope="module")
def port(yards):
    with serving("--workers", 2, "--seconds", 120, "--allow-folders", yards / "allowed") as (address, _):
        yield int(address.rpartition(":")[2])


def opened(port):
    return socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)


def asking(port, *lines, body=b""):
    """The bytes of a request of these lines, after whose answer the server hangs up."""
    own = [] if any(line.lower().startswith("host:") for line in lines) else [f"Host: 127.0.0.1:{port}"]
    head = [lines[0], *own, *lines[1:], "Connection: close", f"Content-Length: {len(body)}"]
    return "\r\n".join([*head, "", ""]).encode() + body


def heard(connection):
    """Status and body of an answer."""
    with connection.makefile("rb") as stream:
        answer = stream.read()
    head, _, body = answer.partition(b"\r\n\r\n")
    return int(re.match(rb"HTTP/1\.1 (\d{3}) ", head)[1]), body


def answered(port, *lines, body=b""):
    with opened(port) as connection:
        connection.sendall(asking(port, *lines, body=body))
        return heard(connection)


CHECK = json.dumps(request("check", {"Blocks": tower()})).encode()


def test_five_hundred_at_once_are_all_answered(port) -> None:
    """All are connected before the first one asks; of the solves those are refused, in words, that find no place."""
    solves = [k % 10 == 0 for k in range(min(500, connection_limit() - 2))]
    with contextlib.ExitStack() as held:
        connections = [held.enter_context(opened(port)) for _ in solves]
        for connection, solve in zip(connections, solves, strict=True):
            lines = "POST /solve HTTP/1.1" if solve else "GET /check HTTP/1.1"
            connection.sendall(asking(port, lines, body=CHECK if solve else b""))
        answers = [heard(connection) for connection in connections]
    assert {status for (status, _), solve in zip(answers, solves, strict=True) if not solve} == {200}
    told = [(status, json.loads(body)) for (status, body), solve in zip(answers, solves, strict=True) if solve]
    assert {status for status, _ in told} <= {200, 503}
    assert all(body["errors"] for status, body in told if status == 503)
    assert sum(status == 200 for status, _ in told) >= 2


def test_dripping_connections_keep_nobody_out(port) -> None:
    """More than there may be, half without a whole head and half without a whole body: the oldest give way."""
    with contextlib.ExitStack() as held:
        dripping = [held.enter_context(opened(port)) for _ in range(connection_limit() + 40)]
        for k, connection in enumerate(dripping):
            body = b"" if k % 2 else f"Content-Length: 1000\r\n\r\n{'x' * 9}".encode()
            with contextlib.suppress(OSError):  # it has given way already
                connection.sendall(
                    f"POST /solve HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Slow: ".encode() + b"1\r\n" + body
                )
        for _ in range(3):
            assert answered(port, "GET /healthcheck HTTP/1.1") == (200, b"Healthy")
        assert answered(port, "POST /solve HTTP/1.1", body=CHECK)[0] == 200


def test_a_head_that_never_ends_is_not_listened_to(port) -> None:
    """A byte now and then keeps nothing open, neither at once nor after an answer; the end comes in five seconds."""

    def heard(before: bytes) -> bytes:
        with opened(port) as connection:
            connection.sendall(before + b"GET / HTTP/1.1\r\nX-Slow: ")
            connection.settimeout(0.5)
            until = time.monotonic() + PATIENCE
            said = b""
            with contextlib.suppress(ConnectionError):
                while time.monotonic() < until:
                    with contextlib.suppress(TimeoutError):
                        part = connection.recv(4096)
                        said += part
                        if not part:
                            break
                    with contextlib.suppress(ConnectionError):  # what it said last is still to be read
                        connection.sendall(b"x")
        assert time.monotonic() < until
        return said

    healthy = f"GET /healthcheck HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
    with ThreadPoolExecutor(2) as pool:
        at_once, after = pool.map(heard, (b"", healthy))
    assert b" 408 " in at_once
    assert b"Healthy" in after


def test_a_body_that_never_ends_is_not_listened_to(monkeypatch) -> None:
    """However long a solve may take."""
    monkeypatch.setattr(module, "ARRIVAL", 0.1)

    async def dripping():
        await asyncio.sleep(0.02)
        return {"type": "http.request", "body": b"x", "more_body": True}

    asked = Request({"type": "http", "method": "POST", "headers": []}, dripping)
    with pytest.raises(HTTPException, match="did not arrive in time"):
        asyncio.run(asyncio.wait_for(module._body(asked, Options(seconds=3600.0), lambda _: None), PATIENCE))


def test_all_bodies_together_are_bounded() -> None:
    bodies = module._Bodies(100)
    with bodies.held() as first, bodies.held() as second:
        first(60)
        with pytest.raises(HTTPException, match="for others"):
            second(60)
        second(40)
    with bodies.held() as third:
        third(100)  # what was held is given back


def test_held_bodies_are_refused_over_the_wire() -> None:
    """One process and 1 KB: five bodies that are almost there, and the sixth is told to come again."""
    with serving("--max-body", 1024) as (address, _), contextlib.ExitStack() as held:
        port = int(address.rpartition(":")[2])
        for _ in range(5):
            slow = held.enter_context(opened(port))
            slow.sendall(asking(port, "POST /solve HTTP/1.1", body=bytes(1024))[:-1])
            slow.sendall(b"")
        statuses = set()
        until = time.monotonic() + PATIENCE
        while 503 not in statuses and time.monotonic() < until:  # the server reads them when it comes to it
            statuses.add(answered(port, "POST /solve HTTP/1.1", body=b" " * 1024)[0])
        assert 503 in statuses


@pytest.mark.parametrize(
    "said",
    [
        "Host: evil@127.0.0.1:{port}", "Host: localhost", "Host: localhost:1", "Host: localhost:{port}/x",
        "Host: localhost:{port}@evil.example", "Host: localhost.evil.example:{port}", "Host: xlocalhost:{port}",
        "Host: localhost:0{port}0", "Host: [::1:{port}", "Host: localhost:", "Host: ", "Host: localhost:{port}?x",
    ],
)  # fmt: skip
def test_only_the_own_name_and_port_are_answered(port, said) -> None:
    assert answered(port, "GET /version HTTP/1.1", said.format(port=port))[0] in (400, 403)


@pytest.mark.parametrize("name", ["localhost", "LocalHost", "127.0.0.1", "[::1]"])
def test_own_names_are_answered(port, name) -> None:
    assert answered(port, "GET /version HTTP/1.1", f"Host: {name}:{port}")[0] == 200


@pytest.mark.parametrize("order", [1, -1])
def test_every_origin_is_read(port, order) -> None:
    own, other = f"Origin: http://127.0.0.1:{port}", "Origin: http://evil.example"
    assert answered(port, "GET /version HTTP/1.1", own)[0] == 200
    assert answered(port, "GET /version HTTP/1.1", *(own, other)[::order])[0] == 403
    for strange in ("ftp://127.0.0.1", f"http://evil@127.0.0.1:{port}", f"http://127.0.0.1:{port}/", "null", ""):
        assert answered(port, "GET /version HTTP/1.1", f"Origin: {strange}")[0] == 403


def test_links_that_lead_out_of_the_folder_are_not_read(port, yards) -> None:
    """A stone that lies elsewhere, and one beside it by another name: the first is refused and named, unread."""
    stones = sorted((yards / "other").glob("*.obj"))
    own = sorted((yards / "allowed").glob("*.obj"))
    os.symlink(stones[0], yards / "allowed" / "out.obj")
    os.symlink(own[0], yards / "allowed" / "within.obj")
    body = json.dumps(request("settle", {"Folder": ".", "Look Ahead": 2}, "Meters")).encode()
    status, answer = answered(port, "POST /solve HTTP/1.1", body=body)
    found = json.loads(answer)
    values = {made["ParamName"]: made["InnerTree"] for made in found["values"]}
    count = sum(len(rows) for name in ("Stone", "Left Over") for rows in values[name].values())
    assert (status, found["errors"], count) == (200, [], 3)
    (said,) = [line for line in found["warnings"] if "leads out" in line]
    assert "out.obj" in said
    assert "other" not in said


def test_of_a_burst_each_takes_another_s_place() -> None:
    """Five at once where two may be: three give way, though none is gone yet when the next one comes."""

    class Line(asyncio.Transport):
        ended = False

        def abort(self) -> None:
            self.ended = True

        def is_closing(self) -> bool:
            return self.ended

    async def answer(scope: object, receive: object, send: object) -> None: ...

    async def burst() -> list[bool]:
        config, state = uvicorn.Config(answer, log_config=None), uvicorn.server.ServerState()
        config.load()
        lines = [Line() for _ in range(5)]
        for line in lines:
            protocol(2)(config=config, server_state=state, app_state={}).connection_made(line)
        return [line.ended for line in lines]

    assert sorted(asyncio.run(burst())) == [False, False, True, True, True]
