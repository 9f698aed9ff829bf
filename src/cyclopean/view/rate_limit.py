"""How often something may be done."""

import threading
import time
from collections import deque
from collections.abc import Callable


class RateLimit:
    """So many in any span of so many seconds; any thread may ask.

    Parameters
    ----------
    most : int
        How many in a span.
    seconds : float
        How long a span is.
    clock : callable
        Tells the time (s).

    Examples
    --------
    >>> now = [0.0]
    >>> saves = RateLimit(2, 60.0, lambda: now[0])
    >>> saves.allows(), saves.allows(), saves.allows()
    (True, True, False)
    >>> now[0] = 60.0
    >>> saves.allows()
    True
    """

    def __init__(self, most: int, seconds: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.seconds = seconds
        self._clock, self._lock = clock, threading.Lock()
        self._taken: deque[float] = deque(maxlen=most)

    def allows(self) -> bool:
        """Whether it may be done now; if so, it counts."""
        with self._lock:
            now, oldest = self._clock(), self._taken[0] if len(self._taken) == self._taken.maxlen else None
            if oldest is not None and now - oldest < self.seconds:
                return False
            self._taken.append(now)
            return True
