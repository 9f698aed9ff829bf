"""What goes to the mason: the cut list as tables, where each stone goes, and all of it as `cyclopean.carving/1`.

Tables are CSV with one heading line, lengths in mm, areas in m2, volumes in litres, angles in degrees, points for
decimals and UTF-8, as a spreadsheet opens them. One row a stone in the one, one row a cut in the other; a cut is told
in the stone's own frame, in which `normal . x = offset` is its plane and what lies beyond it comes off.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from cyclopean import __version__
from cyclopean.assembly import Assembly, Block
from cyclopean.geometry.frames import affine
from cyclopean.io.csv_tables import csv_number, csv_text
from cyclopean.io.files import picked, plain

if TYPE_CHECKING:  # only names here
    from cyclopean.design.carving.carve import Carved, Total
    from cyclopean.design.carving.carved_wall import CarvedWall
    from cyclopean.design.carving.cuts import Cut

__all__ = ["carved_meshes", "carving_dict", "cutlist_csv", "cuts_csv", "offcut_meshes", "placements_dict"]

CARVING, PLACEMENTS = "cyclopean.carving/1", "cyclopean.placements/1"
LITRES, MILLIMETRES = 1e3, 1e3


def cutlist_csv(carved: "Iterable[Carved]") -> str:
    """One row a stone: where it goes, what comes off, how often it is cut."""
    head = (
        "stone", "cell", "lambda", "gap", "stone [L]", "carved [L]", "cell [L]", "void [L]", "offcuts [L]", "offcuts",
        "largest offcut [L]", "dressing [L]", "lost [L]", "cuts", "cut area [m2]", "deepest cut [mm]", "dressed faces",
        "offcut volumes [L]",
    )  # fmt: skip
    return csv_text(head, (_stone_row(c) for c in carved))


def _stone_row(c: "Carved") -> list[str]:
    real = [piece for piece in c.offcuts if not piece.dressing]
    cuts = [cut for cut in c.cuts if not cut.dressing]
    volumes = [
        c.stone_volume, c.volume, c.cell_volume, c.cell_volume - c.volume, c.stone_volume - c.volume,
    ]  # fmt: skip
    return [
        c.stone,
        c.cell,
        csv_number(c.carved_share),
        csv_number(c.gap_share),
        *(csv_number(LITRES * max(v, 0.0)) for v in volumes),
        str(len(real)),
        csv_number(LITRES * max((piece.volume for piece in c.offcuts), default=0.0)),
        csv_number(LITRES * sum(piece.volume for piece in c.offcuts if piece.dressing)),
        csv_number(LITRES * sum(piece.volume for piece in c.offcuts if piece.lost)),
        str(len(cuts)),
        csv_number(sum(cut.area for cut in cuts)),
        csv_number(MILLIMETRES * max((cut.depth for cut in cuts), default=0.0)),
        str(len(c.cuts) - len(cuts)),
        " ".join(csv_number(LITRES * piece.volume) for piece in c.offcuts),
    ]


def cuts_csv(carved: "Iterable[Carved]") -> str:
    """One row a cut: how large, how deep, where in the stone's own frame, and at what angles."""
    head = (
        "stone", "cell", "cut", "kind", "area [m2]", "depth [mm]", "normal x", "normal y", "normal z", "offset [mm]",
        "to longest axis [deg]", "to nearest flat face [deg]", "neighbouring cuts [deg]",
    )  # fmt: skip
    rows = ([c.stone, c.cell, *_cut_row(k, cut)] for c in carved for k, cut in enumerate(c.cuts, 1))
    return csv_text(head, rows)


def _cut_row(number: int, cut: "Cut") -> list[str]:
    return [
        str(number),
        "dressing" if cut.dressing else "cut",
        csv_number(cut.area),
        csv_number(MILLIMETRES * cut.depth),
        *(f"{x:.6f}" for x in cut.normal.tolist()),
        csv_number(MILLIMETRES * cut.offset),
        f"{cut.to_axis:.2f}",
        "" if cut.to_flat is None else f"{cut.to_flat:.2f}",
        " ".join(f"{other + 1}:{angle:.2f}" for other, angle in cut.beside),
    ]


def placements_dict(carved: "Sequence[Carved]", wall: str) -> dict[str, Any]:
    """Where each stone goes: 4 x 4 matrices from its own frame into that of the wall, m."""
    return {
        "schema": PLACEMENTS,
        "wall": wall,
        "placements": [{"stone": c.stone, "cell": c.cell, "transform": _transform(c)} for c in carved],
    }


def _transform(c: "Carved") -> list[list[float]]:
    return plain(affine(c.rotation, c.shift))  # type: ignore[no-any-return]


def carving_dict(
    carved: "Sequence[Carved]", whole: "Total", built: "CarvedWall", least: float, check: dict[str, Any] | None
) -> dict[str, Any]:
    """Return a carving as plain lists, numbers and text, ready for JSON; SI units throughout.

    Parameters
    ----------
    carved : sequence of Carved
        The stones.
    whole : Total
        Of them.
    built : CarvedWall
        The wall they make.
    least : float
        m; depth up to which a cut was taken for dressing.
    check : dict, optional
        Verdict, reason and method of the wall as it will be built.
    """
    there = built.touching > 0.0
    return {
        "schema": CARVING,
        "Lambda": whole.imposition,
        "volumes": {"stones": whole.stone_volume, "cells": whole.cell_volume, "carved": whole.volume},
        **picked(whole, "gap", "dressing", "imbalance"),
        "least_cut": least,
        "check": check,
        "joints": {
            "drawn": len(built.drawn),
            "touching": int(there.sum()),
            "touching_share": built.touching_share,
            "least_hull_kept": float(built.kept.min(initial=1.0)),
        },
        "missing": list(built.missing),
        "stones": [_stone_dict(c) for c in carved],
        "notes": [*(note for c in carved for note in c.notes), *built.notes],
        "provenance": {"cyclopean": __version__},
    }


def _stone_dict(c: "Carved") -> dict[str, Any]:
    return {
        **picked(c, "stone", "cell", "stone_volume", "cell_volume", "volume"),
        "lambda": c.carved_share,
        "gap": c.gap_share,
        "offcuts": [picked(piece, "volume", "reach", "dressing", "lost") for piece in c.offcuts],
        "cuts": [plain(cut) for cut in c.cuts],
        "transform": _transform(c),
    }


def carved_meshes(carved: "Iterable[Carved]") -> Assembly:
    """Carved stones under the ids of their cells, for a mesh file."""
    return Assembly(tuple(Block(c.cell, c.vertices, _faces(c.triangles)) for c in carved if len(c.triangles)))


def offcut_meshes(carved: "Iterable[Carved]") -> Assembly:
    """Offcuts, named by the stone they come from and numbered from the largest, for a mesh file; dressing is none."""
    blocks = [
        Block(f"{c.stone} offcut {k}", piece.vertices, _faces(piece.triangles))
        for c in carved
        for k, piece in enumerate((p for p in c.offcuts if not p.dressing), 1)
    ]
    return Assembly(tuple(blocks))


def _faces(triangles: Any) -> tuple[tuple[int, ...], ...]:
    return tuple(map(tuple, triangles.tolist()))
