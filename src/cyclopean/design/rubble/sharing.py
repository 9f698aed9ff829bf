"""One wall laid by two processes, the same to the last digit as by one.

Both do all of it, stone by stone, but for what takes long: of places to be swept and stones to be tried, each does
every other one, and tells the other what came out, in a few numbers or words. Neither waits but for what it needs.
"""

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any, TypeVar
from zlib import crc32

from cyclopean.errors import InputError

__all__ = ["Share", "shared"]

PATIENCE = 0.2  # s, after which it is asked whether the other process still is there
T = TypeVar("T")


class Share:
    """What this process does, and what the other one tells it; without a line to another, it does all."""

    def __init__(self, line: "Connection[Any, Any] | None" = None, which: int = 0) -> None:
        self.line, self.which = line, which
        self.turn, self.mark = 0, 0  # how often something was shared, and what was laid until then
        self.heard: dict[int, list[Any]] = {}  # what was told, by turns

    def mine(self, k: int) -> bool:
        """Whether the k-th of some is for this process."""
        return self.line is None or k % 2 == self.which

    def laid(self, where: bytes) -> None:
        """Note what is laid: the same has to be laid here and there."""
        self.mark = crc32(where, self.mark)

    def both(self, own: T) -> tuple[T, ...]:
        """What either found out, the first one's before."""
        if self.line is None:
            return (own,)
        self.turn += 1
        if self.which == 0:  # only one tells at a time: both would wait for each other to listen
            self._tell(own)
            return own, self._told(wait=True)[0]
        other = self._told(wait=True)[0]
        self._tell(own)
        return other, own

    def until(self, count: int, do: Callable[[int], T | str]) -> list[T | str]:
        """What do(0), do(1), ... are up to the first that is no word, that one included."""
        self.turn += 1
        told: dict[int, T | str | None] = {}  # None: no word, says the other process

        def last() -> int:
            return min((k for k, found in told.items() if not isinstance(found, str)), default=count - 1)

        for k in range(self.which, count, 1 if self.line is None else 2):
            told.update(self._told())
            if k > last():
                break
            one = do(k)
            told[k] = one
            if self.line is not None:
                self._tell((k, one if isinstance(one, str) else None))
        while not all(k in told for k in range(last() + 1)):
            told.update(self._told(wait=True))
        return [do(k) if (found := told[k]) is None else found for k in range(last() + 1)]

    def _tell(self, found: Any) -> None:
        assert self.line is not None
        with suppress(OSError):  # one that has come to the end needs nothing; of another it is heard that it is gone
            self.line.send((self.turn, self.mark, found))

    def _told(self, wait: bool = False) -> list[Any]:
        """What was told of this turn."""
        while self.line is not None and ((missing := wait and self.turn not in self.heard) or self.line.poll()):
            try:
                turn, mark, found = self.line.recv()
            except EOFError:
                if missing:
                    raise
                break  # the other process has come to the end
            self.heard.setdefault(turn, []).append((mark, found))
        self.heard = {turn: found for turn, found in self.heard.items() if turn >= self.turn}
        told = self.heard.pop(self.turn, [])
        if any(mark != self.mark for mark, _ in told):
            raise InputError("`workers`: two processes came to different walls; lay it with one")
        return [found for _, found in told]


@contextmanager
def shared(executor: Executor | None, do: Callable[..., object], *given: Any) -> Iterator[Share]:
    """Have a process of the executor do(*given, share) as well; without an executor, this one does all."""
    if executor is None:
        yield Share()
        return
    here, there = multiprocessing.Pipe()
    with here, there:
        other = executor.submit(_beside, there, do, *given)
        try:
            while not here.poll(PATIENCE):
                if other.done():
                    break
            else:
                here.recv()
            there.close()  # so that the end of the other process is heard of
            yield Share(here, 0)
        except (EOFError, OSError):
            here.close()
            other.result()
            raise
        other.result()


def _beside(line: "Connection[Any, Any]", do: Callable[..., object], *given: Any) -> None:
    """What the other process does."""
    with line:
        line.send("begun")
        do(*given, Share(line, 1))
