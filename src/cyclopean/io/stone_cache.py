"""What was read of stone files, kept: one .npz for each folder or file, in which every file stands under its content.

A pack is found by the path that was read, the units, and the version of the reader; what it holds of a file counts only
while the SHA-256 of the file's bytes is the same, so a file that changes is read again and the others are not.
A pack that cannot be read, or is not as it should be, counts as none. Nothing is ever unpickled or decompressed, and
only shapes are kept: volumes and all other measures are taken of them anew.
"""

import hashlib
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean import __version__
from cyclopean.arrays import sealed
from cyclopean.design.stones.stone import Stone, stone_of
from cyclopean.errors import InputError
from cyclopean.io.files import LARGEST, PathLike, read_bytes, write_bytes
from cyclopean.io.npz import UNREADABLE, arrays_of

__all__ = ["Reading", "cache_folder", "pack_path", "packed", "read_pack", "write_pack"]

READER = "4"  # to be raised whenever another mesh, measure or sentence would come out of the same bytes
VARIABLE = "CYCLOPEAN_CACHE"


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """What one file gave; ids and sentences do not name the file."""

    stones: tuple[Stone, ...] = ()  # ids within the file
    notes: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    named: bool = False  # whether the ids are the file's own
    alone: bool = True  # whether the file holds one stone, and so gives it its name


def cache_folder() -> Path | None:
    """Folder of the packs: CYCLOPEAN_CACHE where it is set (empty: none), else the platform's place for such files."""
    said = os.environ.get(VARIABLE)
    if said is not None:
        return Path(said) if said else None
    home = Path(os.path.expanduser("~"))
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "cyclopean" if base.is_absolute() else None


def pack_path(folder: Path, source: PathLike, units: str) -> Path:
    """Where the pack of a source is kept."""
    key = "\0".join((READER, __version__, units, os.path.realpath(source)))
    return folder / f"stones-{hashlib.sha256(key.encode('utf-8', 'surrogateescape')).hexdigest()[:32]}.npz"


def read_pack(path: Path) -> dict[str, Reading]:
    """Readings by the digest of their file; none where there is no sound pack."""
    try:
        return _unpacked(arrays_of(read_bytes(path)))
    except UNREADABLE:
        return {}


def write_pack(path: Path, readings: Mapping[str, Reading]) -> bool:
    """Write a pack, whole or not at all; False where that is not possible: a cache is no reason to fail."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        stream = BytesIO()
        np.savez(stream, **packed(readings))
        if stream.tell() > LARGEST:  # it would never be read
            return False
        write_bytes(path, stream.getvalue())
    except (OSError, InputError):
        return False
    return True


def packed(readings: Mapping[str, Reading]) -> dict[str, Any]:
    """Readings as arrays: the stones of all files end to end, and one JSON text."""
    stones = [stone for reading in readings.values() for stone in reading.stones]
    text = [[digest, [s.id for s in r.stones], r.notes, r.refused, r.named, r.alone] for digest, r in readings.items()]
    return {
        "text": np.frombuffer(json.dumps(text).encode(), np.uint8),
        "vertices": np.concatenate([np.zeros((0, 3)), *(s.vertices for s in stones)]),
        "triangles": np.concatenate([np.zeros((0, 3), np.int32), *(s.triangles.astype(np.int32) for s in stones)]),
        "counts": np.array([(len(s.vertices), len(s.triangles)) for s in stones], np.int64).reshape(-1, 2),
        "density": np.array([np.nan if s.density is None else s.density for s in stones]),
    }


def _unpacked(data: Mapping[str, Any]) -> dict[str, Reading]:
    text = json.loads(data["text"].tobytes())
    counts = sealed("counts", data["counts"], None, 2, dtype=np.int64)
    start = np.concatenate([[[0, 0]], np.cumsum(counts, axis=0)])
    density = sealed("density", data["density"], len(counts), nan=True)
    vertices = sealed("vertices", data["vertices"], int(start[-1, 0]), 3)
    triangles = sealed("triangles", data["triangles"], int(start[-1, 1]), 3, dtype=np.int64)
    if (counts < 0).any() or (triangles < 0).any():
        raise ValueError("not a pack")
    if (triangles >= np.repeat(counts[:, 0], counts[:, 1])[:, None]).any():
        raise ValueError("not a pack")
    names = [name for row in text for name in row[1]]
    if len(names) != len(counts):
        raise ValueError("not a pack")
    stones = [
        stone_of(name, vertices[v:w], triangles[t:u], None if np.isnan(said) else float(said))
        for name, (v, t), (w, u), said in zip(names, start[:-1].tolist(), start[1:].tolist(), density, strict=True)
    ]
    rest = iter(stones)
    return {
        digest: Reading(tuple(islice(rest, len(names))), tuple(notes), tuple(refused), named, alone)
        for digest, names, notes, refused, named, alone in text
    }
