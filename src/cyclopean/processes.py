"""Processes beside this one: they leave interrupts to it, and end when it ends, however that happens."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.context import SpawnContext, SpawnProcess

__all__ = ["ChildContext", "ChildProcess", "held_back"]

# A terminal sends these to every process that it knows; the first one answers them.
LEFT_TO_PARENT = tuple(getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name))


@contextmanager
def held_back() -> Iterator[None]:
    """Have signals that ask for an end wait; a process that is begun meanwhile is begun whole, and never interrupted.

    What a terminal sends is blocked, which a new process inherits. That is not enough for this one, where another
    thread may take a signal: so they are noted here, and sent again afterwards.
    """
    noted: list[int] = []
    main = threading.current_thread() is threading.main_thread()
    caught = (n for n in (*LEFT_TO_PARENT, signal.SIGTERM) if main and callable(signal.getsignal(n)))
    before = {n: signal.signal(n, lambda number, _: noted.append(number)) for n in caught}
    masks = hasattr(signal, "pthread_sigmask")
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, LEFT_TO_PARENT) if masks else set()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in noted:
            signal.raise_signal(number)


class ChildProcess(SpawnProcess):
    """A new interpreter that outlives its parent by no more than the call into a library that it is in."""

    def start(self) -> None:
        """As ever, but not to be interrupted."""
        with held_back():
            super().start()

    def run(self) -> None:
        """What is asked of it, while a thread waits for the end of the parent."""
        for number in LEFT_TO_PARENT:
            signal.signal(number, signal.SIG_IGN)
        threading.Thread(target=_end_with_parent, name="end-with-parent", daemon=True).start()
        super().run()


def _end_with_parent() -> None:
    """Wait until the system closes the parent's end of a pipe, as it does for a killed process too; then end."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class ChildContext(SpawnContext):
    """For pools of such processes."""

    Process = ChildProcess
