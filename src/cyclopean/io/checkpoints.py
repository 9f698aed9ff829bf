"""Work that was interrupted goes on where it stopped: what each call of a long job returned, kept in a folder.

The calls of matching are pure functions of arrays. Each is known by the SHA-256 of its function, its arguments and the
version of the program; what it returns, a tuple of arrays, is kept as `.npz` under that name, behind the SHA-256 of
name and content. A later run with the same input makes the same calls and finds their answers. A file that was damaged
or changed, or is of another call, does not bear its digest: it counts as not there.
"""

import hashlib
import io
import pickle
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean import __version__
from cyclopean.errors import InputError
from cyclopean.io.files import read_bytes, write_bytes
from cyclopean.io.npz import UNREADABLE, arrays_of

__all__ = ["Checkpoints"]

_PART = re.compile(r"[0-9a-f]{64}\.npz")
_ASIDE = re.compile(r"\.[0-9a-f]{16}\.tmp")  # folder that a part was being written in when the run was killed


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
        self.unfit = set(self)  # left by an earlier run, and of no use to this one so far
        self._written: set[Path] = set()

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
        """Forget everything, for the work is done; what others put into the folder stays, and the folder with it."""
        with suppress(OSError):
            for path in list(self.folder.iterdir()):
                if _ASIDE.fullmatch(path.name):
                    for file in path.iterdir():
                        file.unlink()
                    path.rmdir()
                elif _PART.fullmatch(path.name):
                    path.unlink()
            self.folder.rmdir()
        self.unfit = set(self)

    def _place(self, fn: Callable[..., Any], call: object) -> Path:
        key = hashlib.sha256(pickle.dumps((__version__, np.__version__, fn, call), protocol=5)).hexdigest()
        return self.folder / f"{key}.npz"

    def _kept(self, path: Path) -> Any:
        if not path.exists():
            return None
        try:
            data = read_bytes(path)
            content = data[hashlib.sha256().digest_size :]
            if data != _sealed(path, content):
                return None
            kept = arrays_of(content)
            answer = tuple(kept[f"arr_{k}"] for k in range(len(kept)))
        except UNREADABLE:
            return None
        self.found += 1
        if path not in self._written:
            self.unfit.discard(path)
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
        write_bytes(path, _sealed(path, buffer.getvalue()))
        self._written.add(path)
        self.made += 1

    def __iter__(self) -> Iterator[Path]:
        """Files that are kept, by name."""
        paths = sorted(self.folder.iterdir()) if self.folder.is_dir() else []
        return iter([path for path in paths if _PART.fullmatch(path.name)])


def _sealed(path: Path, content: bytes) -> bytes:
    """What a part's file holds: the digest of its name and its content, then the content."""
    return hashlib.sha256(path.name.encode() + content).digest() + content
