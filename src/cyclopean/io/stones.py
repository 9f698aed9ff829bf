"""Stones as found: a folder of scans, or one file of many, read, repaired and measured."""

import hashlib
import os
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, Block, size_classes
from cyclopean.design.stones.inventory import CLASSES, Inventory, Shape, flat_faces, shape_of, size_of
from cyclopean.design.stones.stone import Stone, stone_of
from cyclopean.errors import InputError
from cyclopean.geometry.mending import welded
from cyclopean.geometry.mesh_repair import Piece, repair
from cyclopean.geometry.polyhedra import compacted, face_triangles, pack
from cyclopean.io.bodies import Body
from cyclopean.io.fields import REACH, first_repeat, label
from cyclopean.io.files import PathLike, one_line, picked, read_bytes, together, write_bytes
from cyclopean.io.formats import FORMATS, MESH_SUFFIXES, loaded
from cyclopean.io.models import read_as_drawn, write_mesh
from cyclopean.io.obj import obj_text
from cyclopean.io.stone_cache import Reading, cache_folder, pack_path, read_pack, write_pack
from cyclopean.io.units import ASSUMED, LONG, check_units, likely_unit, metres

__all__ = ["inventory_dict", "read_stones", "write_stones"]

SIZES = 0.02, 5.0  # m: diameters of pebbles and of megaliths; half of an inventory outside them is a slip of units
_UNSHARED = (".glb", ".stl")  # formats whose faces do not share vertices: welding is no repair there


def read_stones(
    path: PathLike,
    units: str | None = None,
    strict: bool = False,
    cache: bool = True,
    within: Path | None = None,
) -> tuple[Inventory, tuple[str, ...]]:
    """Read an inventory: a folder of OBJ, STL, PLY and GLB files, one such file, or a model in JSON.

    A stone has the name of its file, with its own name or number in the file added where that holds several; stones
    of one file that were named there keep their names where only this file is read.

    Parameters
    ----------
    path : path
        Folder or file. Folders in it, hidden files and files of other kinds are passed over and counted.
    units : str, optional
        Unit of length of files that do not say it: m, cm, mm, in or ft. Metres are assumed, with a warning.
    strict : bool
        Refuse the whole inventory if anything in it cannot be used.
    cache : bool
        Keep what was read in the user's cache folder, by the content of each file (see `stone_cache`).
    within : Path, optional
        Folder, links resolved, out of which no link may lead: such files are refused unread.

    Returns
    -------
    inventory : Inventory
        In metres; stones sorted by name of file, then in its order.
    warnings : tuple of str
        What was left out and why, what was assumed, and a suspicion of the units; one line each.

    Raises
    ------
    InputError
        The path cannot be read, or no stone in it can be used; with `strict`, any stone cannot.
    """
    if units is not None:
        check_units(units, "`units`")
    files, others = _listed(path)
    if files[0].suffix.lower() in MESH_SUFFIXES:
        readings, said = _readings(path, files, units or "m", cache, within), _unsaid(path, files, units)
    else:
        model, said = read_as_drawn(path, units)
        blocks = [b for b in model.blocks if b.faces]
        meshes = [_Mesh(b.id, b.vertices, face_triangles(b.vertices, b.faces), True, b.density) for b in blocks]
        readings = [_mended(meshes)]
    inventory = _gathered(path, files, readings, others)
    if not inventory.stones or (strict and inventory.refused):
        raise InputError(_refusal(path, inventory))
    warnings = [f"{line}; left out" for line in inventory.refused]
    return inventory, (*warnings, *said, *_suspicion(inventory, units or "m"))


def _unsaid(path: PathLike, files: Sequence[Path], units: str | None) -> tuple[str, ...]:
    if units is not None or all(file.suffix.lower() == ".glb" for file in files):  # glTF is in metres
        return ()
    said = "does not say its units" if len(files) == 1 else "no file says its units"
    return (f"{one_line(path)}: {said}; {ASSUMED} (`units`)",)


def _listed(path: PathLike) -> tuple[list[Path], int]:
    """Files to read, in order, and how many others there are."""
    if not os.path.isdir(path):
        return [Path(path)], 0
    try:
        names = sorted(os.listdir(path))
    except OSError as error:
        raise InputError(f"{one_line(path)}: cannot be read ({error.strerror or error})") from None
    files = [Path(path) / name for name in names if not name.startswith(".")]
    chosen = [file for file in files if file.suffix.lower() in MESH_SUFFIXES and not file.is_dir()]
    if not chosen:
        kinds = ", ".join(suffix[1:] for suffix in MESH_SUFFIXES)
        raise InputError(f"{one_line(path)}: no stones in this folder (files {kinds}); check the path")
    return chosen, len(names) - len(chosen)


def _readings(path: PathLike, files: Sequence[Path], units: str, cache: bool, within: Path | None) -> list[Reading]:
    """One reading for each file, from the cache where its content is known there."""
    folder = cache_folder() if cache else None
    place = None if folder is None else pack_path(folder, path, units)
    known = {} if place is None else read_pack(place)
    held: dict[str, Reading] = {}
    result: list[Reading] = []
    for file in files:
        if within is not None and not Path(os.path.realpath(file)).is_relative_to(within):
            result.append(Reading(refused=("is a link that leads out of the folder that may be read",)))
            continue
        try:
            data = read_bytes(file)
        except InputError as error:
            result.append(Reading(refused=(_without(str(error), file),)))
            continue
        kind = file.suffix.lower()
        digest = hashlib.sha256(kind.encode() + b"\0" + data).hexdigest()
        if digest not in held:
            held[digest] = known[digest] if digest in known else _read(file, data, units)
        result.append(held[digest])
    if place is not None and held.keys() != known.keys():
        write_pack(place, held)
    return result


def _without(said: str, file: PathLike) -> str:
    return said.removeprefix(f"{one_line(file)}: ")


def _read(file: Path, data: bytes, units: str) -> Reading:
    """Read one mesh file."""
    try:
        return _mended(_bodies(file, data, units))
    except InputError as error:
        return Reading(refused=(_without(str(error), file),))


def _mended(bodies: "Sequence[_Mesh]") -> Reading:
    """Repair and measure every body of one file."""
    found: list[Reading] = []
    many = len(bodies) > 1
    for k, body in enumerate(bodies):
        name = body.name or (str(k) if many else "")
        mended = repair(body.vertices, body.triangles, wedges=True)
        count = len(mended.pieces)
        if not count or (many and body.whole and count > 1):
            why = f"is in {count} pieces; a stone is one" if count else mended.done[-1]
            found.append(Reading(refused=(_said(name if many else "", why),)))
            continue
        found.append(Reading(notes=_done(name if many else "", mended.done)))
        for m, piece in enumerate(mended.pieces):
            own = "-".join(filter(None, (name, str(m)))) if count > 1 else name
            found.append(_of_piece(own, own if many or count > 1 else "", piece, body.density))
        many = many or count > 1
    stones, notes, refused = (
        tuple(x for reading in found for x in getattr(reading, part)) for part in ("stones", "notes", "refused")
    )
    return Reading(stones, notes, refused, any(body.name for body in bodies), not many)


def _of_piece(name: str, shown: str, piece: Piece, density: float | None) -> Reading:
    """Measure one piece, unless it has a fault; `shown` is what sentences call it."""
    if piece.fault:
        return Reading(refused=(_said(shown, piece.fault),))
    try:
        stone = stone_of(name, piece.vertices, piece.triangles, density)
    except InputError as error:
        return Reading(refused=(_said(shown, str(error).partition(": ")[2]),))
    return Reading((stone,), _done(shown, piece.done))


def _done(shown: str, done: Sequence[str]) -> tuple[str, ...]:
    return (_said(shown, "; ".join(done)),) if done else ()


def _said(shown: str, what: str) -> str:
    return f"stone {label(shown)}: {what}" if shown else what


@dataclass(frozen=True, slots=True, eq=False)
class _Mesh:
    """One body of a file, in metres."""

    name: str | None
    vertices: Floats  # (v, 3) m
    triangles: Ints  # (t, 3)
    whole: bool = True  # the file says that it is one block
    density: float | None = None  # kg/m3


def _bodies(file: Path, data: bytes, units: str) -> list[_Mesh]:
    """Meshes of one mesh file."""
    shown, suffix = one_line(file), file.suffix.lower()
    found = [_mesh(shown, suffix, body, units) for body in loaded(FORMATS[suffix].bodies)(shown, data) if body.faces]
    if not found:
        raise InputError(f"{shown}: has no faces; a stone is a closed mesh")
    return [replace(found[0], name=None)] if suffix == ".obj" and len(found) == 1 else found


def _mesh(shown: str, suffix: str, body: Body, units: str) -> _Mesh:
    where = f"{shown}: {label(body.name)}" if body.name else shown
    if not (np.abs(body.vertices) <= REACH).all():
        raise InputError(f"{where}: a coordinate is not a finite number below 1e12")
    corner = np.fromiter((i for face in body.faces for i in face), np.int64)
    if corner.min() < 0 or corner.max() >= len(body.vertices):
        raise InputError(f"{where}: a face names a vertex that is not there; there are {len(body.vertices)}")
    if min(map(len, body.faces)) < 3:
        raise InputError(f"{where}: a face has fewer than 3 corners")
    vertices = metres(body.vertices, "m" if suffix == ".glb" else units)
    corners = face_triangles(vertices, body.faces)
    if suffix in _UNSHARED:
        mesh = compacted(welded(pack([(vertices, corners)])))
        vertices, corners = mesh.vertex, mesh.corner.reshape(-1, 3)
    name = "".join(c if c.isprintable() else "_" for c in body.name) if body.name else None
    return _Mesh(name, vertices, corners, body.whole)


def _gathered(path: PathLike, files: Sequence[Path], readings: Iterable[Reading], others: int) -> Inventory:
    """Put the stones of all files together under names of their own."""
    stones: dict[str, Stone] = {}
    taken: Counter[str] = Counter()
    notes: list[str] = []
    refused: list[str] = []
    folder = os.path.isdir(path)
    for file, reading in zip(files, readings, strict=True):
        shown = one_line(file)
        notes += [f"{shown}: {text}" for text in reading.notes]
        refused += [f"{shown}: {text}" for text in reading.refused]
        stem = file.stem if file.stem.isprintable() and file.stem else "stone"
        for stone in reading.stones:
            own = reading.named and not folder and not reading.alone
            wanted = stem if reading.alone else stone.id if own else f"{stem}-{stone.id}"
            name = wanted
            while name in stones:
                taken[wanted] += 1
                name = f"{wanted}-{taken[wanted] + 1}"
            if name != wanted:
                notes.append(f"{shown}: the name {label(wanted)} is taken; this stone is {label(name)}")
            stones[name] = replace(stone, id=name)
    if others:
        kinds = "1 entry that is" if others == 1 else f"{others} entries that are"
        notes.append(f"{one_line(path)}: passed over {kinds} no mesh file")
    source = PurePath(os.path.abspath(path)).name
    return Inventory(tuple(stones.values()), tuple(notes), tuple(refused), source)


def _refusal(path: PathLike, inventory: Inventory) -> str:
    if not inventory.refused:
        return f"{one_line(path)}: no stone can be used"
    first, more = inventory.refused[0], len(inventory.refused) - 1
    others = f" ({more} more cannot be used either)" if more else ""
    return f"{first}{others}" if inventory.stones else f"{first}{others}; no stone is left"


def _suspicion(inventory: Inventory, units: str) -> tuple[str, ...]:
    """Name the units that would make stones of what is too large or too small for stones."""
    size = float(np.median([size_of(stone) for stone in inventory.stones]))
    if SIZES[0] <= size <= SIZES[1]:
        return ()
    over_or_under = "less" if size < SIZES[0] else "more"
    said = f"{inventory.source}: half of the stones are {over_or_under} than {size:.3g} m across"
    best = likely_unit(size, units, SIZES)
    if best is None:
        return (f"{said}, which no stone is; check the units (`units`)",)
    return (f"{said}; the lengths look as if in {LONG[best]}: `units` {best}",)


def inventory_dict(inventory: Inventory, warnings: Sequence[str] = (), every: bool = True) -> dict[str, Any]:
    """Return what is known of an inventory as `cyclopean.inventory/1`: SI units, frames as in the files.

    Parameters
    ----------
    inventory : Inventory
        The stones.
    warnings : sequence of str
        Told as they are.
    every : bool
        Also what is known of every single stone, flat faces included.
    """
    shapes = [shape_of(stone) for stone in inventory.stones]
    volume = np.array([stone.volume for stone in inventory.stones])
    ratios = {name: np.array([getattr(shape, name) for shape in shapes]) for name in _RATIOS}
    found: dict[str, Any] = {
        "schema": "cyclopean.inventory/1",
        "source": inventory.source,
        "count": len(inventory),
        "volume": {
            "total": float(volume.sum()),
            "least": float(volume.min(initial=np.inf)) if len(volume) else 0.0,
            "quartiles": np.quantile(volume, (0.25, 0.5, 0.75)).tolist() if len(volume) else None,
            "classes": [list(row) for row in size_classes(volume)],
            "most": float(volume.max(initial=0.0)),
        },
        "shape": {name: [float(x.mean()), float(x.std())] for name, x in ratios.items() if len(x)},
        "classes": {name: sum(shape.aspect == name for shape in shapes) for name in CLASSES},
        "repaired": list(inventory.notes),
        "refused": list(inventory.refused),
        "warnings": list(warnings),
    }
    if every:
        found["stones"] = [_stone_dict(s, shape) for s, shape in zip(inventory.stones, shapes, strict=True)]
    return found


_RATIOS = ("elongation", "flatness", "thinness", "solidity", "sphericity")


def _stone_dict(stone: Stone, shape: Shape) -> dict[str, Any]:
    return {
        **picked(stone, "id", "volume", "centroid", "axes", "half", "hull_volume", "area", "density"),
        "class": shape.aspect,
        **picked(shape, *_RATIOS),
        "flat_faces": [picked(face, "area", "normal", "point", "misfit") for face in flat_faces(stone)],
    }


def write_stones(path: PathLike, inventory: Inventory) -> None:
    """Write an inventory in metres: to a folder, one OBJ file a stone, or to one OBJ, PLY, STL or GLB file.

    All files are written, or none. In a folder they take the names of the stones, in which characters
    that not every file system allows become "_".

    Raises
    ------
    InputError
        There are no stones, two stones would have one file, or the place cannot be written.
    """
    if not inventory.stones:
        raise InputError(f"{one_line(path)}: there are no stones to write")
    if not os.path.isdir(path):
        write_mesh(path, _assembly(inventory.stones))
        return
    names = [re.sub(r"[^\w.\- ]", "_", stone.id).strip(" .") or "stone" for stone in inventory.stones]
    folded = [name.casefold() for name in names]
    if (twice := first_repeat(folded)) is not None:
        one, two = [stone.id for stone, name in zip(inventory.stones, folded, strict=True) if name == twice][:2]
        raise InputError(f"{one_line(path)}: stones {label(one)} and {label(two)} would have one file; rename one")
    with together():
        for name, stone in zip(names, inventory.stones, strict=True):
            write_bytes(Path(path) / f"{name}.obj", obj_text(_assembly([stone])).encode())


def _assembly(stones: Sequence[Stone]) -> Assembly:
    return Assembly(
        tuple(Block(s.id, s.vertices, tuple(map(tuple, s.triangles.tolist())), density=s.density) for s in stones)
    )
