"""Processes that answer requests. One that takes too long, or dies, is replaced; the server itself solves nothing."""

import asyncio
import json
import multiprocessing
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection

from cyclopean.processes import ChildProcess
from cyclopean.service.parameters import Context

MOST_WAITING = 16  # requests whose bodies are held while every process is at work
TICK = 0.05  # s between looks at whether the client is still there
START = 60.0  # s that a process may take to be ready
READY = b"ready"
BUSY, LATE, DIED = 503, 504, 500

Reply = tuple[int, bytes]  # status of HTTP, and JSON


class WorkerPool:
    """A fixed number of processes, and who waits for one.

    Parameters
    ----------
    count : int
        Processes.
    context : Context
        What a solve may do, and the seconds after which it is ended.
    """

    def __init__(self, count: int, context: Context) -> None:
        self.count = count
        self._context = context
        self._threads = ThreadPoolExecutor(count, thread_name_prefix="solve")
        self._all = {_Worker(context) for _ in range(count)}
        self._idle: asyncio.Queue[_Worker] = asyncio.Queue()
        self._waiting = 0
        self._closed = False
        for worker in self._all:
            self._idle.put_nowait(worker)

    async def answer(self, path: str, body: bytes) -> Reply:
        """Have one request answered; ends the solve where it is cancelled."""
        if self._waiting >= MOST_WAITING:
            return _trouble(
                BUSY, "the server is busy, and many are waiting; try again, or start it with more --workers"
            )
        self._waiting += 1
        try:
            async with asyncio.timeout(self._context.seconds):
                worker = await self._idle.get()
        except TimeoutError:
            return _trouble(BUSY, "the server is busy; try again, or start it with more --workers")
        finally:
            self._waiting -= 1
        given_up = threading.Event()
        job = asyncio.get_running_loop().run_in_executor(
            self._threads, worker.run, path, body, self._context.seconds, given_up
        )
        job.add_done_callback(lambda _: self._back(worker))
        try:
            return await asyncio.shield(job)
        finally:
            given_up.set()  # nobody waits any more, whether it is done or not

    def _back(self, worker: "_Worker") -> None:
        """A process is free again, or gone and replaced."""
        if self._closed:
            return
        if worker.ended:
            self._all.discard(worker)
            worker = _Worker(self._context)
            self._all.add(worker)
        self._idle.put_nowait(worker)

    def close(self) -> None:
        """End all processes, whatever they are doing."""
        self._closed = True
        for worker in self._all:
            worker.end()
        self._threads.shutdown(wait=True)


class _Worker:
    """One process and our end of the pipe to it."""

    def __init__(self, context: Context) -> None:
        self._pipe, theirs = multiprocessing.Pipe()
        self._process = ChildProcess(target=_work, args=(theirs, context), daemon=True)
        self._process.start()
        theirs.close()
        self._ready = False
        self.ended = False

    def run(self, path: str, body: bytes, seconds: float, given_up: threading.Event) -> Reply:
        """Send a request and wait for the answer, in a thread of its own."""
        try:
            if not self._ready:
                if self._heard(START, given_up) != READY:
                    self.end()
                    return _trouble(DIED, "the process that solves did not start")
                self._ready = True
            self._pipe.send_bytes(path.encode())
            self._pipe.send_bytes(body)
            heard = self._heard(seconds, given_up)
        except (EOFError, OSError):
            self.end()
            return _trouble(DIED, "the solve ended without an answer: the meshes may be damaged, or memory was short")
        if heard is None:
            self.end()
            return _trouble(
                LATE, f"the solve was ended after {seconds:g} s; ask for less, or start the server with more --seconds"
            )
        return int.from_bytes(heard[:2], "big"), heard[2:]

    def _heard(self, seconds: float, given_up: threading.Event) -> bytes | None:
        """What the process says; None where it says nothing in time, or nobody waits for it."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0.0 and not given_up.is_set():
            if self._pipe.poll(min(left, TICK)):
                return self._pipe.recv_bytes()
        return None

    def end(self) -> None:
        """End the process at once."""
        self.ended = True
        self._process.kill()
        self._process.join()


def _trouble(status: int, said: str) -> Reply:
    """What is not the request's fault; in the words of `protocol.refusal`, which the server does without."""
    return status, json.dumps({"values": [], "errors": [said], "warnings": []}).encode("ascii")


def _work(pipe: Connection, context: Context) -> None:
    """What a process does: answer requests until nobody is at the other end."""
    import rhino3dm  # noqa: F401

    from cyclopean.analysis import check
    from cyclopean.design import stack
    from cyclopean.service.solving import solved

    check(stack(1))  # what nearly every solve needs is loaded while nobody waits
    try:
        pipe.send_bytes(READY)
        while True:
            path, body = pipe.recv_bytes().decode(), pipe.recv_bytes()
            status, answer = solved(path, body, context)
            pipe.send_bytes(status.to_bytes(2, "big") + answer)
    except (EOFError, OSError):
        return
