"""Rhino archives looked at before the library opens them: a damaged count can keep it busy for ever.

A 3DM file is a chain of chunks, each with a type, a length and that many bytes, and its last one says how long the file
is. What is cut off, or has lost or gained a byte, breaks the chain. Damage inside a chunk shows only when it is read,
so a process of its own tries that first, which can be stopped, and has no more memory than a sound file of that size
takes: meshes are compressed in it.
"""

import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

from cyclopean.errors import InputError
from cyclopean.io.fields import refuse_unfolded

__all__ = ["refuse_damaged"]

PATIENCE = 5  # s of the processor; beside one for each MB, which is a hundred times what a sound file takes
WAIT = 20  # times as many by the clock, where other work keeps the processor busy, or none are counted
_HEADER = 32  # bytes: the name of the format, and its version in the last eight
_SHORT = 0x80000000  # types that have a number in place of a length, and no bytes
_END = 0x00007FFF  # type of the last chunk
_ROOM = 1 << 30, 64  # bytes of the process that tries: these, and so many for each byte of the file
_TRIAL = """
import sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]),) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[3]),) * 2)
except (ImportError, ValueError, OSError):  # not on every system, nor above a lower limit
    pass
import rhino3dm
file = rhino3dm.File3dm.Read(sys.argv[1])
meshes = () if file is None else [g for g in (item.Geometry for item in file.Objects) if isinstance(g, rhino3dm.Mesh)]
print(sum(len(mesh.Vertices) + 4 * len(mesh.Faces) for mesh in meshes))
sys.exit(file is None)
"""


def refuse_damaged(path: str, data: bytes) -> None:
    """Refuse bytes that are no whole 3DM archive.

    Raises
    ------
    InputError
        It is of another format, cut off, or cannot be read in a reasonable time.
    """
    if not data.startswith(b"3D Geometry File Format ") or not data[24:_HEADER].strip().isdigit():
        raise InputError(f"{path}: is not a 3DM file: it does not begin with '3D Geometry File Format'")
    if not _chained(data):
        raise InputError(f"{path}: is a damaged 3DM file, or is cut off; save it again in Rhino")
    if "python" not in os.path.basename(sys.executable or "").lower():  # inside Rhino there is no Python to start
        return
    limit, room = PATIENCE + len(data) // 1_000_000, _ROOM[0] + _ROOM[1] * len(data)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "trial.3dm"
        place.write_bytes(data)
        trial = [sys.executable, "-c", _TRIAL, str(place), str(room), str(limit)]
        try:
            done = subprocess.run(trial, capture_output=True, timeout=WAIT * limit, check=False)
        except subprocess.TimeoutExpired:
            raise InputError(f"{path}: is a damaged 3DM file: it cannot be read in {WAIT * limit} s") from None
    if done.returncode:
        raise InputError(f"{path}: is a damaged 3DM file; save it again in Rhino")
    refuse_unfolded(path, int(done.stdout.split()[-1]), len(data))


def _chained(data: bytes) -> bool:
    """Whether the chunks fill the file to its last byte, and the last says that this is the end."""
    layout = "<Iq" if int(data[24:_HEADER]) >= 50 else "<Ii"  # lengths grew with Rhino 5
    step = struct.calcsize(layout)
    position, kind = _HEADER, 0
    while position + step <= len(data):
        kind, length = struct.unpack_from(layout, data, position)
        position += step
        if not kind & _SHORT:
            if not 0 <= length <= len(data) - position:
                return False
            position += length
    return position == len(data) and kind == _END
