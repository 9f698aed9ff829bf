"""Where long work is done: in this process, in others on this machine, or on a cluster."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from cyclopean.errors import InputError
from cyclopean.options import option

MOST = 256  # processes; more is a slip of the hand
PATIENCE = "10s"  # for a cluster to answer
SOON = 2.0  # s for the thread that reads answers to see that nobody answers any more


@dataclass(frozen=True, slots=True)
class Hands:
    """Who does the work."""

    workers: int | None = option(None, "Processes that share the work [2 beyond 100 blocks].", "whole", metavar="N")
    cluster: str | None = option(None, "Scheduler of a dask cluster that does the work.", metavar="ADDRESS")


@contextmanager
def workers(count: int, cluster: str | None) -> Iterator[Executor | None]:
    """Open what the work is to be done by, and close it afterwards.

    Parameters
    ----------
    count : int
        Processes on this machine; 1 = this one.
    cluster : str, optional
        Address of the scheduler of a dask cluster, such as tcp://10.0.0.1:8786.

    Raises
    ------
    InputError
        Both are asked for, the cluster does not answer, or its library is not installed.
    """
    if not 1 <= count <= MOST:
        raise InputError(f"--workers: {count} is not between 1 and {MOST}")
    if cluster is not None:
        if count != 1:
            raise InputError("--workers: has no say over a cluster; leave it out, or leave out --cluster")
        with _cluster(cluster) as executor:
            yield executor
    else:
        with beside(count if count > 1 else 0) as executor:
            yield executor


@contextmanager
def beside(count: int) -> Iterator[Executor | None]:
    """Open so many processes beside this one; None for none.

    Where the work is given up, by Ctrl-C or another signal, they are ended at once, and say nothing.

    Raises
    ------
    InputError
        One of them was ended by somebody else.
    """
    if not count:
        yield None
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor
    from concurrent.futures.process import BrokenProcessPool

    from cyclopean.processes import ChildContext, held_back

    with held_back():  # Python's own process that cleans up after others begins here
        pool = ProcessPoolExecutor(count, mp_context=ChildContext())
    with pool as executor:
        before = multiprocessing.active_children()
        try:
            yield executor
        except BrokenProcessPool:
            raise InputError(
                "--workers: a process that did part of the work was ended, perhaps for want of memory;"
                " run the command again, or with fewer --workers"
            ) from None
        except BaseException:
            answers: Any = getattr(executor, "_result_queue", None)
            calls: Any = getattr(executor, "_call_queue", None)
            reader = getattr(executor, "_executor_manager_thread", None)
            executor.shutdown(wait=False, cancel_futures=True)
            for child in multiprocessing.active_children():
                if child not in before:
                    child.terminate()
            # who reads answers would wait for the rest of one that a child was ended in, and who hands out calls for
            # room, were our own ends of these pipes left open
            for end in (getattr(answers, "_writer", None), getattr(calls, "_reader", None)):
                if end is not None:
                    end.close()
            if reader is not None:  # or the interpreter wakes it as it ends, and complains that it has ended
                reader.join(SOON)
            raise


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--cluster: needs dask; install it with: pip install 'cyclopean[cluster]'") from None
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"--cluster {address}: no scheduler answers there ({why})") from None
    with client:
        if not client.scheduler_info()["workers"]:
            raise InputError(f"--cluster {address}: the cluster has no workers; start some")
        yield client.get_executor()
