"""Stock lists of sawn stones in, cut lists and `cyclopean.ashlar/1` out.

A stock list is CSV with one heading line that names its columns, in any order: `length`, `height`, `depth` in metres,
and where wanted `count`, `id` and `density` (kg/m3). Cut lists are CSV as for carved stones: lengths in mm, volumes in
litres, points for decimals, UTF-8.
"""

import csv
import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean import __version__
from cyclopean.design.ashlar.stock import Slab
from cyclopean.errors import InputError
from cyclopean.geometry.frames import affine
from cyclopean.io.csv_tables import cell_text, csv_number, csv_text
from cyclopean.io.fields import REACH, label
from cyclopean.io.files import PathLike, decoded, one_line, picked, plain, read_bytes

if TYPE_CHECKING:  # only names here
    from cyclopean.design.ashlar.planning import LaidStone
    from cyclopean.design.ashlar.wall import AshlarWall

__all__ = ["MOST", "ashlar_cutlist_csv", "ashlar_dict", "left_csv", "read_stocklist", "repeated", "transform_of"]

SCHEMA = "cyclopean.ashlar/1"
NEEDED, KNOWN = ("length", "height", "depth"), ("count", "id", "density")
MOST = 100_000  # slabs
LITRES, MILLIMETRES = 1e3, 1e3


def read_stocklist(path: PathLike) -> tuple[Slab, ...]:
    """Read a stock list.

    Raises
    ------
    InputError
        It cannot be read, a column is missing or unknown, or a row holds something else than it should; names the line.
    """
    shown = one_line(path)
    rows = csv.reader(io.StringIO(decoded(shown, read_bytes(path)), newline=""), strict=True)
    slabs: list[Slab] = []
    try:
        head = [cell.strip().lower() for cell in next(rows, [])]
        _refuse_heading(shown, head)
        for cells in rows:
            if any(cell.strip() for cell in cells):
                where = f"{shown}: line {rows.line_num}"
                slabs += _row(where, head, cells, len(slabs))
    except csv.Error as error:
        raise InputError(f"{shown}: line {rows.line_num}: is not CSV ({error})") from None
    if not slabs:
        raise InputError(f"{shown}: lists no stone")
    return tuple(slabs)


def _refuse_heading(shown: str, head: Sequence[str]) -> None:
    for name in NEEDED:
        if name not in head:
            raise InputError(
                f"{shown}: line 1: no column '{name}'; a stock list has length,height,depth[,count,id,density]"
            )
    for name in head:
        if name not in NEEDED + KNOWN or head.count(name) > 1:
            fault = "stands twice" if head.count(name) > 1 else "is unknown"
            raise InputError(f"{shown}: line 1: column {label(name)} {fault}")


def _row(where: str, head: Sequence[str], cells: Sequence[str], before: int) -> list[Slab]:
    if len(cells) != len(head):
        raise InputError(f"{where}: {len(cells)} columns, the heading has {len(head)}")
    given = {name: cell.strip() for name, cell in zip(head, cells, strict=True)}
    length, height, depth = (_positive(where, name, given[name]) for name in NEEDED)
    density = _positive(where, "density", given["density"]) if given.get("density") else None
    count = given.get("count") or "1"
    if not (count.isascii() and count.isdigit() and 0 < int(count) <= MOST - before):
        raise InputError(f"{where}: count {label(count)} is not a whole number of 1 to {MOST - before:,}")
    name = cell_text(given.get("id", ""))
    if not name.isprintable():
        raise InputError(f"{where}: id {label(name)} does not print on one line")
    return repeated(name, (length, depth, height), int(count), before, density)


def _positive(where: str, name: str, text: str) -> float:
    try:
        value = float(text if "_" not in text else "")
    except ValueError:
        value = math.nan
    if not 0.0 < value <= REACH:
        raise InputError(f"{where}: {name} {label(text)} is not a positive number")
    return value


def repeated(name: str, size: Sequence[float], count: int, before: int = 0, density: float | None = None) -> list[Slab]:
    """Slabs of one size (length, depth, height; m). Where they have no name, they are numbered on from `before`."""
    if name:
        names = [name] if count == 1 else [f"{name}-{k}" for k in range(1, count + 1)]
    else:
        names = [f"slab-{k:04d}" for k in range(before + 1, before + count + 1)]
    return [Slab(n, np.asarray(size, float), density) for n in names]


def ashlar_cutlist_csv(wall: "AshlarWall") -> str:
    """One row a stone, in the order of laying: what it is sawn from, where in its slab, and where it goes."""
    head = (
        "stone", "course", "kind", "slab", "sawn off", "length [mm]", "depth [mm]", "height [mm]", "from length [mm]",
        "from depth [mm]", "cuts", "dressed [mm]", "turned", "x [mm]", "y [mm]", "z [mm]",
    )  # fmt: skip
    return csv_text(head, (_cut_row(wall, name, stone) for name, stone in _named(wall)))


def _cut_row(wall: "AshlarWall", name: str, stone: "LaidStone") -> list[str]:
    sawn = stone.sawn
    source = "offcut" if sawn.offcut else "slab" if sawn.cuts else ""
    return [
        name,
        str(stone.slot.course + 1),
        stone.slot.kind,
        wall.stock.slabs[sawn.slab].id,
        source,
        *(csv_number(MILLIMETRES * x) for x in (sawn.high - sawn.low).tolist()),
        *(csv_number(MILLIMETRES * x) for x in sawn.low[:2].tolist()),
        str(sawn.cuts),
        csv_number(MILLIMETRES * sawn.dressed),
        "90" if stone.turned else "",
        *(csv_number(MILLIMETRES * x) for x in stone.slot.low),
    ]


def left_csv(wall: "AshlarWall") -> str:
    """One row for each piece that is left in store, the smallest first."""
    head = ("slab", "kind", "length [mm]", "depth [mm]", "height [mm]", "volume [L]")
    stock = wall.stock
    rows = (
        [
            stock.slabs[k].id,
            "slab" if whole else "offcut",
            *(csv_number(MILLIMETRES * x) for x in size),
            csv_number(LITRES * math.prod(size)),
        ]
        for k, whole, size in zip(stock.slab.tolist(), stock.whole().tolist(), stock.sizes().tolist(), strict=True)
    )
    return csv_text(head, rows)


def ashlar_dict(wall: "AshlarWall", asked: dict[str, Any]) -> dict[str, Any]:
    """Return a wall of sawn stones as plain lists, numbers and text, ready for JSON; SI units throughout.

    Parameters
    ----------
    wall : AshlarWall
    asked : dict
        What the settings do not say of how it was made, such as the method.
    """
    stock = wall.stock
    return {
        "schema": SCHEMA,
        "settings": plain(wall.settings) | asked,
        **picked(wall, "readout", "gaps", "notes"),
        "placements": [_placement(wall, name, stone) for name, stone in _named(wall)],
        "left": [
            {"slab": stock.slabs[k].id, "whole": whole, "low": low, "high": high}
            for k, whole, low, high in zip(
                stock.slab.tolist(), stock.whole().tolist(), stock.low.tolist(), stock.high.tolist(), strict=True
            )
        ],
        "provenance": {"cyclopean": __version__},
    }


def _placement(wall: "AshlarWall", name: str, stone: "LaidStone") -> dict[str, Any]:
    return {
        "block": name,
        "slab": wall.stock.slabs[stone.sawn.slab].id,
        **picked(stone.slot, "course", "kind", "leaf", "low", "high"),
        "sawn_low": stone.sawn.low.tolist(),
        "sawn_high": stone.sawn.high.tolist(),
        "cuts": stone.sawn.cuts,
        "turned": stone.turned,
        "transform": transform_of(wall, stone).tolist(),
    }


def transform_of(wall: "AshlarWall", stone: "LaidStone") -> np.ndarray[Any, np.dtype[np.float64]]:
    """(4, 4) matrix from the frame in which the slab was given into that of the wall, m."""
    slab = wall.stock.slabs[stone.sawn.slab]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) if stone.turned else np.eye(3)
    start = np.array(stone.slot.low) + ([stone.slot.size[0], 0.0, 0.0] if stone.turned else np.zeros(3))
    return affine(turn @ slab.frame, start - turn @ (slab.frame @ slab.corner + stone.sawn.low))


def _named(wall: "AshlarWall") -> "list[tuple[str, LaidStone]]":
    return [(b.id, s) for b, s in zip(wall.assembly.blocks[1:], wall.laid, strict=True)]
