r"""Pictures of pixels as PNG files (ISO/IEC 15948): of full colours, or of a palette where there are few.

>>> png(np.zeros((1, 2, 4), np.int64))[:8]
b'\x89PNG\r\n\x1a\n'
"""

import struct
import zlib

import numpy as np

from cyclopean.arrays import Ints

_OF_PALETTE, _RGBA = 3, 6  # colour types


def png(pixel: Ints, palette: Ints | None = None) -> bytes:
    """A picture (h, w, 4) of red, green, blue and opacity, 0 to 255; or (h, w), rows of a palette (n, 4), n <= 256."""
    h, w = pixel.shape[:2]
    rows = np.zeros((h, pixel.size // h + 1), np.uint8)  # the leading 0 of each says that it is not filtered
    rows[:, 1:] = pixel.reshape(h, -1)
    head = struct.pack(">IIBBBBB", w, h, 8, _RGBA if palette is None else _OF_PALETTE, 0, 0, 0)
    parts = [(b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b"")]
    if palette is not None:
        colour = palette.astype(np.uint8)
        parts[1:1] = [(b"PLTE", colour[:, :3].tobytes()), (b"tRNS", colour[:, 3].tobytes())]
    chunks = (struct.pack(">I", len(d)) + kind + d + struct.pack(">I", zlib.crc32(kind + d)) for kind, d in parts)
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)
