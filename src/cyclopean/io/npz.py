"""Arrays from `.npz` files of our own, which never take more memory than the file has bytes.

`numpy.savez` packs nothing: what is compressed, or says that it holds more than its bytes, was not written by this
program, and would be unpacked to any size.
"""

import math
import zipfile
import zlib
from io import BytesIO
from typing import Any

import numpy as np
from numpy.lib import format as npy

from cyclopean.errors import InputError

__all__ = ["UNREADABLE", "arrays_of"]

# What damage makes zipfile, zlib and numpy raise; whoever keeps such a file takes each of them for "not there".
UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    MemoryError,
    NotImplementedError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
    InputError,
)


def arrays_of(data: bytes) -> dict[str, np.ndarray[Any, Any]]:
    """Arrays of an uncompressed `.npz` file by their names, in its order.

    Raises
    ------
    ValueError
        A member is compressed or no array of plain numbers, or the members would hold more than the file.
    Exception
        Others of `UNREADABLE`, where the file is damaged.
    """
    with zipfile.ZipFile(BytesIO(data)) as archive:
        members = archive.infolist()
        if any(m.compress_type != zipfile.ZIP_STORED or not m.filename.endswith(".npy") for m in members):
            raise ValueError("holds what is compressed, or is no array")
        if sum(m.file_size for m in members) > len(data):  # members that lie over one another
            raise ValueError("would hold more than its own bytes")
        return {m.filename.removesuffix(".npy"): _array(archive.read(m)) for m in members}


def _array(data: bytes) -> np.ndarray[Any, Any]:
    """One array, once its head agrees with the number of its bytes: numpy makes room before it reads."""
    stream = BytesIO(data)
    read = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read(stream)
    if dtype.hasobject or math.prod(shape) * dtype.itemsize != len(data) - stream.tell():
        raise ValueError("an array has another size than it says")
    stream.seek(0)
    array: np.ndarray[Any, Any] = npy.read_array(stream, allow_pickle=False)
    return array
