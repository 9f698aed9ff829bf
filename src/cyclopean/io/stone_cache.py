"""What was read of stone files, kept: one .npz for each folder or file, in which every file stands under its content.

A pack is found by the path that was read, the units, and the version of the reader; what it holds of a file counts only
while the SHA-256 of the file's bytes is the same, so a file that changes is read again and the others are not.
A pack that cannot be read, or is not as it should be, counts as none. Nothing is ever unpickled.
"""

import hashlib
import json
import os
import sys
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean import __version__
from cyclopean.arrays import Floats, sealed
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.io.files import PathLike, write_bytes

__all__ = ["Reading", "cache_folder", "pack_path", "packed", "read_pack", "write_pack"]

READER = "3"  # to be raised whenever another mesh, measure or sentence would come out of the same bytes
VARIABLE = "CYCLOPEAN_CACHE"

_UNREADABLE = (
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
_FACTS = 20  # numbers of a stone: volume, centroid, axes, half, hull volume, area, density (NaN: not said), and 0


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
        with np.load(BytesIO(path.read_bytes()), allow_pickle=False) as data:
            return _unpacked({name: data[name] for name in data.files})
    except _UNREADABLE:
        return {}


def write_pack(path: Path, readings: Mapping[str, Reading]) -> bool:
    """Write a pack, whole or not at all; False where that is not possible: a cache is no reason to fail."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        stream = BytesIO()
        np.savez(stream, **packed(readings))
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
        "facts": np.array([_facts(s) for s in stones]).reshape(-1, _FACTS),
    }


def _facts(s: Stone) -> Floats:
    density = np.nan if s.density is None else s.density
    single = [s.hull_volume, s.area, density, 0.0]
    return np.concatenate([[s.volume], s.centroid, s.axes.reshape(-1), s.half, single])


def _unpacked(data: Mapping[str, Any]) -> dict[str, Reading]:
    text = json.loads(data["text"].tobytes())
    counts = sealed("counts", data["counts"], None, 2, dtype=np.int64)
    start = np.concatenate([[[0, 0]], np.cumsum(counts, axis=0)])
    facts = sealed("facts", data["facts"], len(counts), _FACTS, nan=True)
    vertices = sealed("vertices", data["vertices"], int(start[-1, 0]), 3)
    triangles = sealed("triangles", data["triangles"], int(start[-1, 1]), 3, dtype=np.int64)
    if (counts < 0).any() or (triangles < 0).any() or np.isnan(facts[:, :-2]).any():
        raise ValueError("not a pack")
    if (triangles >= np.repeat(counts[:, 0], counts[:, 1])[:, None]).any():
        raise ValueError("not a pack")
    names = [name for row in text for name in row[1]]
    if len(names) != len(counts):
        raise ValueError("not a pack")
    stones = [
        _stone(name, vertices[v:w], triangles[t:u], fact)
        for name, (v, t), (w, u), fact in zip(names, start[:-1].tolist(), start[1:].tolist(), facts, strict=True)
    ]
    return _by_file(text, stones)


def _stone(name: str, vertices: Floats, triangles: Any, fact: Floats) -> Stone:
    volume, hull, area, density = (float(fact[k]) for k in (0, 16, 17, 18))
    said = None if np.isnan(density) else density
    return Stone(name, vertices, triangles, volume, fact[1:4], fact[4:13].reshape(3, 3), fact[13:16], hull, area, said)


def _by_file(text: Sequence[Any], stones: Sequence[Stone]) -> dict[str, Reading]:
    found: dict[str, Reading] = {}
    first = 0
    for digest, names, notes, refused, named, alone in text:
        last = first + len(names)
        found[digest] = Reading(tuple(stones[first:last]), tuple(notes), tuple(refused), named, alone)
        first = last
    return found
