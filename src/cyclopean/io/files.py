"""Files, whole or not at all: every failure of the operating system becomes one line that names the path."""

import json
import math
import os
import secrets
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.errors import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

__all__ = [
    "PathLike",
    "decoded",
    "json_text",
    "one_line",
    "picked",
    "plain",
    "read_bytes",
    "together",
    "write_bytes",
    "write_json",
    "write_text",
]

PathLike = str | os.PathLike[str]

LARGEST = 1 << 30  # bytes that a model may have: room for ten thousand finely scanned stones


def one_line(text: PathLike, limit: int = 0) -> str:
    r"""Return `text` fit for a one-line message: control characters escaped, clipped to `limit` characters if given.

    Examples
    --------
    >>> print(one_line("a\nb"))
    a\nb
    """
    plain = os.fspath(text)
    if not plain.isprintable():
        plain = plain.encode("unicode_escape").decode("ascii")
    return f"{plain[:limit]}..." if 0 < limit < len(plain) else plain


def read_bytes(path: PathLike) -> bytes:
    """Read a whole file.

    Raises
    ------
    InputError
        It is missing, a folder, a device, a named pipe, not readable, empty, or too large.
    """
    shown = one_line(path) or "''"
    try:
        status = os.stat(path)
        mode = status.st_mode
        if stat.S_ISDIR(mode):
            raise InputError(f"{shown}: is a folder; name a file in it")
        if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):  # /dev/zero never ends
            raise InputError(f"{shown}: is a device; name a file")
        if stat.S_ISFIFO(mode) and not os.fspath(path).startswith("/dev/"):  # a shell's own pipes end, others need not
            raise InputError(f"{shown}: is a pipe; name a file")
        if status.st_size > LARGEST:
            size = f"{status.st_size / 1e9:.1f} GB"
            raise InputError(f"{shown}: holds {size}, more than the {LARGEST / 1e9:.1f} that are read; simplify it")
        data = Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError(f"{shown}: no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{shown}: cannot be read ({error.strerror or error})") from None
    except ValueError:  # an embedded null character
        raise InputError(f"{shown}: is not a path") from None
    if not data:
        raise InputError(f"{shown}: the file is empty")
    return data


def decoded(path: PathLike, data: bytes) -> str:
    """Decode UTF-8, with or without a byte order mark.

    Raises
    ------
    InputError
        Names the first byte that is not UTF-8, or is zero as in UTF-16 and in binary files.
    """
    if (zero := data.find(b"\0")) >= 0:
        raise InputError(f"{one_line(path)}: byte {zero} is zero, so it is not UTF-8 text; save the file as UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{one_line(path)}: line {line}: byte {error.start} is not UTF-8 text; save the file as UTF-8"
        ) from None


def write_text(path: PathLike, text: str) -> None:
    """Write `text` as UTF-8, whole or not at all; errors as `write_bytes`."""
    try:
        data = text.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{one_line(path)}: a name in it is not valid text (a lone surrogate)") from None
    write_bytes(path, data)


def write_bytes(path: PathLike, data: bytes) -> None:
    """Write `data`, whole or not at all: a temporary file in the same folder takes the place of the old one.

    A symbolic link stays one. What is not a regular file (a pipe, /dev/null) is written to directly.

    Raises
    ------
    InputError
        The folder is missing, `path` is a folder, or the place cannot be written.
    """
    with together() as files:
        files.add(path, data)


@contextmanager
def together() -> Iterator["_Files"]:
    """Have all files that are written meanwhile take their places at the end, or none of them.

    Until then they lie in a temporary folder beside each. Where one cannot take its place, those before it give theirs
    back to what was there. What is written within another such set belongs to that.

    Raises
    ------
    InputError
        As `write_bytes`.
    """
    outer = _OPEN.get()
    if outer is not None:
        yield outer
        return
    files = _Files()
    token = _OPEN.set(files)
    try:
        yield files
        with _one_at_a_time(files.aside):
            files.take_places()
    finally:
        _OPEN.reset(token)
        files.clear()


@dataclass(frozen=True, slots=True)
class _Files:
    """What is to be written."""

    aside: dict[str, str] = field(default_factory=dict)  # temporary folder in each folder that is written to
    ready: list[tuple[str, str, str]] = field(default_factory=list)  # as named, where it is to be, where it lies
    poured: list[tuple[PathLike, bytes]] = field(default_factory=list)  # into pipes and devices

    def add(self, path: PathLike, data: bytes) -> None:
        """Look at the place, and lay the file beside it."""
        shown = one_line(path)
        with _refusals(shown):
            target = os.path.realpath(path)
            folder = os.path.dirname(target)
            mode = os.stat(path).st_mode if os.path.exists(path) else None
            if mode is not None and stat.S_ISDIR(mode):
                raise InputError(f"{shown}: is a folder; name a file in it")
            if not os.path.isdir(folder) and mode is None:
                parent = one_line(os.path.dirname(os.fspath(path)) or folder)
                raise InputError(f"{shown}: the folder '{parent}' does not exist; make it first")
            if mode is not None and not os.access(path, os.W_OK):
                raise InputError(f"{shown}: cannot be written (it is read-only)")
            if mode is not None and not stat.S_ISREG(mode):
                self.poured.append((path, data))
                return
            if folder not in self.aside:
                self.aside[folder] = os.path.join(folder, f".{secrets.token_hex(8)}.tmp")
                os.mkdir(self.aside[folder], 0o700)
            place = os.path.join(self.aside[folder], str(len(self.ready)))
            _write_new(place, data, 0o666 if mode is None else stat.S_IMODE(mode))
            self.ready.append((shown, target, place))

    def take_places(self) -> None:
        """Have all take their places."""
        done: list[tuple[str, str, bool]] = []
        try:
            for shown, target, place in self.ready:
                with _refusals(shown):
                    old = f"{place}.old"
                    done.append((target, old, os.path.exists(target)))
                    if done[-1][2] and len(self.ready) + len(self.poured) > 1:
                        _keep(target, old)
                    os.replace(place, target)
            for path, data in self.poured:
                with _refusals(one_line(path)):
                    _pour(path, data)
        except BaseException:  # also an interrupt
            for target, old, was_there in reversed(done):
                with suppress(OSError):
                    if os.path.exists(old):
                        os.replace(old, target)
                    elif not was_there:
                        os.unlink(target)
            raise

    def clear(self) -> None:
        """Remove the temporary folders, and what is left in them."""
        for folder in self.aside.values():
            with suppress(OSError):
                for name in os.listdir(folder):
                    os.unlink(os.path.join(folder, name))
                os.rmdir(folder)


_OPEN: ContextVar[_Files | None] = ContextVar("files that are written together", default=None)


@contextmanager
def _one_at_a_time(folders: Iterable[str]) -> Iterator[None]:
    """Have other runs that write to these folders wait, so that what lies there in the end is all of one run."""
    with ExitStack() as held:
        for folder in sorted(folders) if fcntl is not None else ():
            with suppress(OSError):  # a file system without locks
                number = os.open(folder, os.O_RDONLY)
                held.callback(os.close, number)
                fcntl.flock(number, fcntl.LOCK_EX)
        yield


@contextmanager
def _refusals(shown: str) -> Iterator[None]:
    """Put what the operating system refuses into one line."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{shown}: cannot be written ({error.strerror or error})") from None
    except ValueError:  # an embedded null character
        raise InputError(f"{shown}: is not a path") from None


def _keep(target: str, old: str) -> None:
    """Give what is there a second name, so that it can come back."""
    try:
        os.link(target, old)
    except OSError:  # a file system without links
        os.replace(target, old)


def _write_new(path: str, data: bytes, mode: int) -> None:
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
    with os.fdopen(handle, "wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def _pour(path: PathLike, data: bytes) -> None:
    """Write into a pipe or a device; a pipe that nobody reads is an error, not a wait without end."""
    handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
    with os.fdopen(handle, "wb") as stream:
        if hasattr(os, "O_NONBLOCK"):
            os.set_blocking(handle, True)
        stream.write(data)


def write_json(path: PathLike, data: Any) -> None:
    """Write `data` as JSON (see `json_text`), whole or not at all.

    Raises
    ------
    InputError
        As `write_bytes`, and when a number is not finite.
    """
    try:
        text = json_text(data)
    except InputError as error:
        raise InputError(f"{one_line(path)}: {error}") from None
    write_text(path, text)


def json_text(data: Any) -> str:
    """Return `data` as JSON text: one line for each key of the top level, and for each entry of a list of objects.

    Numbers keep every digit (shortest text that reads back the same); numpy scalars and arrays become plain ones. What
    has a seal comes with sorted keys and without blanks, as the seal covers it: that is quicker to check.

    Raises
    ------
    InputError
        A number is NaN or infinite.
    """
    try:
        if not isinstance(data, dict):
            return _compact(data) + "\n"
        if "seal" in data:
            return "{\n" + ",\n".join(f"{_sealed(k)}:{_lines(data[k], _sealed)}" for k in sorted(data)) + "\n}\n"
        return "{\n" + ",\n".join(f" {_compact(str(k))}: {_lines(v, _compact, 1)}" for k, v in data.items()) + "\n}\n"
    except ValueError:
        raise InputError("a number in it is NaN or infinite, which JSON cannot hold") from None


def _lines(value: Any, text: Callable[[Any], str], indent: int = 0) -> str:
    if isinstance(value, list | tuple) and value and isinstance(value[0], dict):
        start = "\n" + " " * indent
        inner = start + " " * indent
        return "[" + inner + ("," + inner).join(map(text, value)) + start + "]"
    return text(value)


def _sealed(value: Any) -> str:
    return json.dumps(value, allow_nan=False, sort_keys=True, separators=(",", ":"), default=_default)


def _compact(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False, default=_default)


def _default(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not JSON")


def plain(value: Any) -> Any:
    """Lists, dicts, text and finite numbers for JSON.

    Arrays and numpy scalars become those, dataclasses dicts of their fields, what is not finite null, the rest text.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if is_dataclass(value):
        return picked(value, *(part.name for part in fields(value)))
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def picked(thing: Any, *names: str) -> dict[str, Any]:
    """Some attributes of a thing by their names, ready for JSON.

    Examples
    --------
    >>> picked(np.zeros((2, 3)), "shape", "size")
    {'shape': [2, 3], 'size': 6}
    """
    return {name: plain(getattr(thing, name)) for name in names}
