"""The command line: the only room that prints or exits. Heavy libraries are imported inside the commands."""

import atexit
import contextlib
import gc
import os
import signal
import sys
import threading
import types
import typing

__all__ = ["main", "process"]

_INTERRUPTED = 130  # 128 + SIGINT, as a shell has it
_SIGNALLED = (_INTERRUPTED, 128 + 1, 128 + 15)  # SIGINT, SIGHUP, SIGTERM
_PATIENCE = 5.0  # s for threads to end after a signal; they take a tenth of one
_GC_THRESHOLD = 50_000  # new objects between searches for garbage; loading makes several times that, and uses it all


def process() -> typing.NoReturn:
    """Run the command of this process and end it with the status.

    After a signal it waits for threads, but not for ever: one that an interrupt has cut off from its lock never ends.
    Of the garbage that libraries make as they load nothing is looked for, neither now nor at the end.
    """
    signalled: list[int] = []
    atexit.register(_leave, signalled)  # what is registered first is called last
    gc.set_threshold(_GC_THRESHOLD)
    status = main()
    gc.freeze()
    if status in _SIGNALLED:
        signalled.append(status)
        end = threading.Timer(_PATIENCE, os._exit, (status,))
        end.daemon = True
        end.start()
    raise SystemExit(status)


def _leave(signalled: list[int]) -> None:
    """End with the status of a signal that was answered.

    The interpreter would end by the signal itself if an interrupt came while it ran a string, as it does to make a
    dataclass, however the command has answered it.
    """
    if signalled:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):  # the terminal may be gone
                stream.flush()
        os._exit(signalled[0])


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit status.

    SIGTERM and SIGHUP end it as Ctrl-C does, with the status that a shell gives what ends by them.

    Parameters
    ----------
    argv : list of str, optional
        Arguments without the program's name; those of the process by default.
    """
    seen: list[int] = []
    before = _answered(seen)
    try:
        from cyclopean.cli.app import run  # here, so that an interrupt while it loads ends quietly too

        status = run(sys.argv[1:] if argv is None else list(argv))
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):  # the terminal may be gone
            sys.stderr.write("cyclopean: error: interrupted; no result was written\n")
        status = _INTERRUPTED
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return 128 + seen[0] if seen and status == _INTERRUPTED else status


def _answered(seen: list[int]) -> dict[int, typing.Any]:
    """Have the signals that ask for an end interrupt the command; return who answered them before.

    What is ignored, as under `nohup`, stays so. Only the first signal interrupts: others often follow at once, such as
    the kernel's after the shell's when a terminal is closed, and must not disturb the cleaning up.
    """

    def interrupt(number: int, _: types.FrameType | None) -> None:
        if not seen:
            seen.append(number)
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        return {}
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    return {n: signal.signal(n, interrupt) for n in numbers if signal.getsignal(n) == signal.SIG_DFL}
