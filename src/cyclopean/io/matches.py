"""The match file `cyclopean.match/1`: which stone goes where, and how to tell whether stones and wall are still those.

Written by one command and read by another, so that both agree on it here. Paths in it are absolute, or relative to the
folder that the file lies in. Stones and wall are not repeated: they are named, with a hash of each, in metres.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean import __version__
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry.frames import affine
from cyclopean.io.fields import array, first_repeat, found, label, mapping, number, optional, read_json, text
from cyclopean.io.files import PathLike, one_line, picked
from cyclopean.io.units import check_units

if TYPE_CHECKING:  # only names here: reading a file must not load the matching
    from collections.abc import Mapping, Sequence

    from cyclopean.design.matching.cells import Cells
    from cyclopean.design.matching.match import Match
    from cyclopean.design.matching.tradeoff import Tradeoff
    from cyclopean.design.stones.stone import Stone

__all__ = [
    "MATCH_FILE",
    "StoredMatch",
    "StoredPlacement",
    "match_dict",
    "read_match",
    "read_matched",
    "stone_hash",
    "tradeoff_dict",
    "wall_hash",
]

SCHEMA = "cyclopean.match/1"
TRADEOFF = "cyclopean.tradeoff/1"
MATCH_FILE = "match.json"  # in the folder that a match is written to
STRAIGHT = 1e-9  # departure from a rotation that the digits of a file explain


@dataclass(frozen=True, slots=True, eq=False)
class StoredPlacement:
    """One stone in one cell, by name."""

    stone: str
    cell: str  # block of the wall
    transform: Floats  # (4, 4), stone frame -> wall frame, m


@dataclass(frozen=True, slots=True, eq=False)
class StoredMatch:
    """What a match file says."""

    file: Path
    stones: Path  # as it is to be opened
    wall: Path
    placements: tuple[StoredPlacement, ...]
    unused: tuple[str, ...]  # stones
    empty: tuple[str, ...]  # cells
    stone_units: str | None  # those the files were read in, where the command said so
    wall_units: str | None
    hashes: "Mapping[str, str]"  # of each placed stone
    wall_hash: str | None
    supports: str | None = None  # which blocks were held, where the command said so
    sawn: tuple[str, ...] = ()  # blocks that are sawn new

    def changed(self, stones: "Mapping[str, Stone]", wall: Assembly) -> str | None:
        """What is not as it was when the match was made, in a line; None where all is."""
        if self.wall_hash is not None and wall_hash(wall) != self.wall_hash:
            return f"the wall '{one_line(self.wall)}' has changed since the match was made; match again"
        blocks = {block.id for block in wall.blocks}
        for name in self.sawn:
            if name not in blocks:
                return f"the wall '{one_line(self.wall)}' has no block {label(name)}"
        for placed in self.placements:
            if placed.stone not in stones:
                return f"stone {label(placed.stone)} is not among the stones of '{one_line(self.stones)}'"
            if placed.stone in self.hashes and stone_hash(stones[placed.stone]) != self.hashes[placed.stone]:
                return f"stone {label(placed.stone)} has changed since the match was made; match again"
            if placed.cell not in blocks:
                return f"the wall '{one_line(self.wall)}' has no block {label(placed.cell)}"
        return None


def read_matched(
    stored: StoredMatch,
) -> "tuple[Assembly, tuple[tuple[Stone, Block, Floats, Floats], ...], tuple[Stone, ...]]":
    """Read stones and wall of a match again; what their files leave open was said when they were matched.

    Returns
    -------
    wall : Assembly
        As drawn.
    placed : tuple
        Stone, cell, rotation (3, 3) and shift (3,) in m, of each placement: as `carve_all` takes them.
    stones : tuple of Stone
        All that there were to choose from.

    Raises
    ------
    InputError
        Stones or wall cannot be read, or are not those that were matched.
    """
    from cyclopean.io.models import read_model
    from cyclopean.io.stones import read_stones

    wall, _ = read_model(stored.wall, stored.wall_units)
    inventory, _ = read_stones(stored.stones, stored.stone_units)
    stones = {stone.id: stone for stone in inventory.stones}
    changed = stored.changed(stones, wall)
    if changed is not None:
        raise InputError(f"{stored.file}: {changed}")
    blocks = {block.id: block for block in wall.blocks}
    placed = ((stones[p.stone], blocks[p.cell], p.transform[:3, :3], p.transform[:3, 3]) for p in stored.placements)
    return wall, tuple(placed), tuple(inventory.stones)


def tradeoff_dict(found: "Tradeoff", names: "Sequence[Mapping[str, str]]" = ()) -> dict[str, Any]:
    """Return what the walls of a trade-off come to, ready for JSON; `names` are the files of each, by what they are."""
    files = names or [{}] * len(found)
    rows = [
        {
            **files[k],
            "Lambda": one.imposition,
            "gap": one.gap,
            "J": one.interlock,
            "verdict": one.verdict,
            "non_dominated": k in found.non_dominated,
            "fault": one.fault(found.gap) or None,
            "carved": sum(p.carved for p in one.match.placements),
            "asked": {**picked(one.asked, "seed", "coursing", "depth", "improved"), "negotiate": one.asked.share},
            "notes": list(one.match.notes),
        }
        for k, one in enumerate(found.alternatives)
    ]
    return {
        "schema": TRADEOFF,
        "gap": found.gap,
        "alternatives": rows,
        "notes": list(found.notes),
        "provenance": {"cyclopean": __version__},
    }


def stone_hash(stone: "Stone") -> str:
    """SHA-256 (hex) of a stone's vertices, as little-endian doubles in metres, and triangles, as 64-bit integers."""
    return _digest([(np.asarray(stone.vertices), np.asarray(stone.triangles))])


def wall_hash(wall: Assembly) -> str:
    """SHA-256 (hex) of the blocks of a wall: ids, vertices and faces."""
    rows = [
        (block.vertices, np.array([i for f in block.faces for i in (len(f), *f)], np.int64)) for block in wall.blocks
    ]
    return _digest(rows, [block.id for block in wall.blocks])


def _digest(meshes: "Sequence[tuple[Floats, Any]]", names: "Sequence[str]" = ()) -> str:
    said = hashlib.sha256("\0".join(names).encode())
    for vertices, corners in meshes:
        said.update(np.array([vertices.size, corners.size], "<i8").tobytes())
        said.update(np.ascontiguousarray(vertices, "<f8").tobytes())
        said.update(np.ascontiguousarray(corners, "<i8").tobytes())
    return said.hexdigest()


@dataclass(frozen=True, slots=True)
class MatchFiles:
    """Where stones and wall of a match lie: absolute, or relative to the folder of the match file."""

    stones: str
    wall: str
    stone_units: str | None = None  # that the stones were read in, where the command said so


def match_dict(
    match: "Match",
    stones: "Sequence[Stone]",
    cells: "Cells",
    files: MatchFiles,
    rounds: "Sequence[Mapping[str, Any]]" = (),
    settings: "Mapping[str, Any] | None" = None,
) -> dict[str, Any]:
    """Return a match as plain lists, numbers and text, ready for JSON.

    Parameters
    ----------
    match : Match
        Which stone goes where.
    stones : sequence of Stone
        Those that were matched.
    cells : Cells
        Those that were matched.
    files : MatchFiles
        Where stones and wall lie.
    rounds : sequence of mapping
        Of a negotiation: Lambda, gap, seconds of each.
    settings : mapping, optional
        What was asked for.
    """
    ids, volume = [block.id for block in cells.assembly.blocks], cells.assembly.mass.volume.tolist()
    return {
        "schema": SCHEMA,
        "stones": files.stones,
        "wall": files.wall,
        "units": {"stones": files.stone_units, "wall": None},
        "Lambda": match.imposition,
        **picked(match, "gap", "gap_of_wall", "seconds"),
        "placements": [
            {
                "stone": stones[placed.stone].id,
                "cell": ids[cells.block[placed.cell]],
                "transform": affine(placed.rotation, placed.shift).tolist(),
                "lambda": placed.carved_share,
                "gap": placed.gap_share,
                "stone_volume": stones[placed.stone].volume,
                "cell_volume": float(cells.volume[placed.cell]),
            }
            for placed in match.placements
        ],
        "unused": [stones[i].id for i in match.unused.tolist()],
        "empty": [ids[cells.block[j]] for j in match.empty.tolist()],
        "sawn": [{"cell": ids[k], "volume": volume[k]} for k in cells.sawn.tolist()],
        "rounds": [dict(row) for row in rounds],
        "settings": dict(settings or {}),
        "hashes": {stones[placed.stone].id: stone_hash(stones[placed.stone]) for placed in match.placements},
        "wall_hash": wall_hash(cells.assembly),
        "provenance": {"cyclopean": __version__},
    }


def read_match(path: PathLike) -> StoredMatch:
    """Read a match file, or the one in a folder.

    Raises
    ------
    InputError
        One line that names the file, the place in it and what was expected there.
    """
    file = Path(path)
    if os.path.isdir(path):
        file = file / MATCH_FILE
        if not file.exists():
            raise InputError(f"{one_line(path)}: the folder holds no {MATCH_FILE}; name one that 'match' has written")
    shown = one_line(file)
    data = read_json(file)
    said = data.get("schema") if isinstance(data, dict) else None
    if said != SCHEMA:
        what = f"its schema is {found(said)}" if said is not None else "it has no schema"
        raise InputError(f'{shown}: is not a match: {what}; a match has "schema": "{SCHEMA}"')
    rows = array(_field(shown, data, "placements"), f"{shown}: placements")
    placements = tuple(_placement(f"{shown}: placements[{k}]", row) for k, row in enumerate(rows))
    for what, names in (("stone", [p.stone for p in placements]), ("cell", [p.cell for p in placements])):
        if twice := first_repeat(names):
            raise InputError(f"{shown}: {what} {label(twice)} is placed twice")
    units = mapping(data.get("units") or {}, f"{shown}: units")
    settings = mapping(data.get("settings") or {}, f"{shown}: settings")
    hashes = mapping(data.get("hashes") or {}, f"{shown}: hashes")
    return StoredMatch(
        file,
        file.parent / text(_field(shown, data, "stones"), f"{shown}: stones"),
        file.parent / text(_field(shown, data, "wall"), f"{shown}: wall"),
        placements,
        _names(shown, data, "unused"),
        _names(shown, data, "empty"),
        optional(units.get("stones"), f"{shown}: units.stones", _units),
        optional(units.get("wall"), f"{shown}: units.wall", _units),
        {name: text(value, f"{shown}: hashes.{one_line(name, 40)}") for name, value in hashes.items()},
        optional(data.get("wall_hash"), f"{shown}: wall_hash", text),
        optional(settings.get("supports"), f"{shown}: settings.supports", text),
        tuple(
            text(_field(where, mapping(row, where), "cell"), f"{where}.cell")
            for where, row in ((f"{shown}: sawn[{k}]", row) for k, row in enumerate(data.get("sawn") or ()))
        ),
    )


def _field(shown: str, data: dict[str, Any], key: str) -> Any:
    if key not in data:
        raise InputError(f'{shown}: has no "{key}"')
    return data[key]


def _units(value: Any, where: str) -> str:
    return check_units(text(value, where), where)


def _names(shown: str, data: dict[str, Any], key: str) -> tuple[str, ...]:
    rows = array([] if data.get(key) is None else data[key], f"{shown}: {key}")
    return tuple(text(row, f"{shown}: {key}[{k}]") for k, row in enumerate(rows))


def _placement(where: str, value: Any) -> StoredPlacement:
    row = mapping(value, where)
    stone, cell = (text(_field(where, row, key), f"{where}.{key}") for key in ("stone", "cell"))
    lines = array(_field(where, row, "transform"), f"{where}.transform")
    if len(lines) != 4 or any(len(array(line, f"{where}.transform[{i}]")) != 4 for i, line in enumerate(lines)):
        raise InputError(f"{where}.transform must be four rows of four numbers")
    matrix = np.array(
        [[number(x, f"{where}.transform[{i}][{k}]") for k, x in enumerate(r)] for i, r in enumerate(lines)]
    )
    turn = matrix[:3, :3]
    rigid = np.abs(turn @ turn.T - np.eye(3)).max() <= STRAIGHT and np.linalg.det(turn) > 0.0
    if not rigid or (matrix[3] != [0.0, 0.0, 0.0, 1.0]).any():
        raise InputError(f"{where}.transform is not a rotation and a shift: a stone is not scaled, sheared or mirrored")
    return StoredPlacement(stone, cell, matrix)
