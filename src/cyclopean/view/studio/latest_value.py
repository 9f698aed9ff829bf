"""What threads hand to each other that only care for the newest."""

import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class LatestValue(Generic[T]):
    """Holds what was put in last; what came before is forgotten."""

    def __init__(self) -> None:
        self._change = threading.Condition()
        self._next: T | None = None
        self.ended = False

    @property
    def waiting(self) -> bool:
        """Whether something is in it."""
        return self._next is not None

    def put(self, thing: T) -> None:
        """Put this in, in place of whatever is there."""
        with self._change:
            self._next = thing
            self._change.notify()

    def end(self) -> None:
        """Wake who waits; nothing more will come."""
        with self._change:
            self.ended = True
            self._change.notify()

    def take(self, seconds: float | None = None) -> T | None:
        """Take out what is there, or comes in so many seconds; None where nothing did, or all has ended."""
        with self._change:
            self._change.wait_for(lambda: self.ended or self._next is not None, seconds)
            thing, self._next = self._next, None
            return None if self.ended else thing
