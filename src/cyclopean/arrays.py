"""One gate for arrays: shape, kind, finiteness, read-only. Everything numeric enters a dataclass through it."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cyclopean.errors import InputError

__all__ = ["Bools", "Floats", "Ints", "sealed"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def sealed(name: str, value: ArrayLike, *shape: int | None, dtype: Any = np.float64, nan: bool = False) -> NDArray[Any]:
    """Return `value` as a finite, read-only array of the wanted shape; the message names the field and row.

    Parameters
    ----------
    name : str
        What the message calls the array.
    value : array_like
        Anything numpy reads as an array; copied unless it is already sealed.
    *shape : int or None
        Wanted shape; None stands for any length.
    dtype : data-type
        float64, int64 or bool; a cast that would change a value is refused.
    nan : bool
        Let NaN pass where it stands for "not given".

    Raises
    ------
    InputError
        Wrong shape, a value that is not finite, or one that the dtype cannot hold.

    Examples
    --------
    >>> sealed("point", [[1, 2, 3]], None, 3).tolist()
    [[1.0, 2.0, 3.0]]
    >>> sealed("point", [[1, 2]], None, 3)
    Traceback (most recent call last):
    cyclopean.errors.InputError: point: expected shape (any, 3), got (1, 2)
    """
    if isinstance(value, np.ndarray) and value.dtype == dtype and not value.flags.writeable:
        array = value
    else:
        try:
            raw = np.asarray(value)
            if raw.dtype.kind not in "biuf":  # text, objects, complex numbers
                raw = np.asarray(value, dtype=np.float64)
            array = raw.astype(dtype)
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"{name}: expected numbers in a regular array") from None
        if array.dtype.kind in "biu" and raw.size and not np.array_equal(array, raw):
            raise InputError(f"{name}: expected whole numbers of type {np.dtype(dtype).name}")
        array.flags.writeable = False
    if array.ndim != len(shape) or any(w is not None and w != n for w, n in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("any" if w is None else str(w) for w in shape)
        raise InputError(f"{name}: expected shape ({wanted}), got {array.shape}")
    if array.dtype.kind == "f":
        bad = np.isinf(array) if nan else ~np.isfinite(array)
        if bad.any():
            where = np.argwhere(bad)[0].tolist()
            raise InputError(f"{name}{where}: {array[tuple(where)]} is not a finite number")
    return array
