"""Work that was interrupted goes on where it stopped: what each call of a long job returned, kept in a folder.

The calls of matching are pure functions of arrays. Each is known by the SHA-256 of its function, its arguments and the
version of the program; what it returns, a tuple of arrays, is kept as `.npz` under that name. A later run with the same
input makes the same calls and finds their answers. A file that cannot be read counts as not there.
"""

import hashlib
import io
import pickle
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean import __version__
from cyclopean.errors import InputError
from cyclopean.io.files import read_bytes, write_bytes
from cyclopean.io.npz import UNREADABLE, arrays_of

__all__ = ["Checkpoints"]


class Checkpoints(Executor):
    """An executor that asks its folder before it has a call done, and keeps what comes back.

    Parameters
    ----------
    folder : Path
        Made when the first answer is kept.
    inner : Executor, optional
        Does the calls; this process, one after the other, where not given.
    """

    def __init__(self, folder: Path, inner: Executor | None = None) -> None:
        self.folder, self.inner, self.found, self.made = folder, inner, 0, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Have one call done, or find its answer; done when this returns unless there is an inner executor."""
        path = self._place(fn, (args, kwargs))
        answer = self._kept(path)
        given: Future[Any] = Future()
        if answer is None and self.inner is not None:
            self.inner.submit(fn, *args, **kwargs).add_done_callback(lambda done: self._hand_on(path, done, given))
            return given
        if answer is None:
            answer = fn(*args, **kwargs)
            self._keep(path, answer)
        given.set_result(answer)
        return given

    def map(self, fn: Callable[..., Any], *iterables: Any, timeout: float | None = None, chunksize: int = 1) -> Any:
        """Answers in order; calls are made as they are asked for, or all at once where there is an inner executor."""
        calls = zip(*iterables, strict=False)
        if self.inner is None:
            return (self.submit(fn, *call).result() for call in calls)
        futures = [self.submit(fn, *call) for call in calls]
        return (future.result(timeout) for future in futures)

    def clear(self) -> None:
        """Forget everything: the work is done."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _place(self, fn: Callable[..., Any], call: object) -> Path:
        key = hashlib.sha256(pickle.dumps((__version__, np.__version__, fn, call), protocol=5)).hexdigest()
        return self.folder / f"{key}.npz"

    def _kept(self, path: Path) -> Any:
        if not path.exists():
            return None
        try:
            kept = arrays_of(read_bytes(path))
            answer = tuple(kept[f"arr_{k}"] for k in range(len(kept)))
        except UNREADABLE:
            return None
        self.found += 1
        return answer

    def _hand_on(self, path: Path, done: "Future[Any]", given: "Future[Any]") -> None:
        """Keep an answer that has come in, then give it: whoever has it may rely on its being kept."""
        if done.cancelled():  # the work was given up
            given.cancel()
            return
        error = done.exception()
        if error is None:
            try:
                self._keep(path, done.result())
            except InputError as fault:  # the folder cannot be written: for whoever asked, not for this thread
                error = fault
        if error is not None:
            given.set_exception(error)
        else:
            given.set_result(done.result())

    def _keep(self, path: Path, answer: Any) -> None:
        self.folder.mkdir(exist_ok=True)
        buffer = io.BytesIO()
        np.savez(buffer, *answer)
        write_bytes(path, buffer.getvalue())
        self.made += 1

    def __iter__(self) -> Iterator[Path]:
        """Files that are kept, by name."""
        return iter(sorted(self.folder.glob("*.npz")) if self.folder.is_dir() else [])
