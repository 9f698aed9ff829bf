"""Drawings of joints: lines from DXF and SVG, or as they come from a modelling program.

`design.walls.line_work` says what becomes of them. Here they are brought into one plane, to the right and up, and
curves become facets.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.options import positive
from cyclopean.design.walls.line_work import Line, LineReading, LineWork, usual_snap
from cyclopean.errors import InputError
from cyclopean.geometry.curves import Curve
from cyclopean.io.files import PathLike, one_line, read_bytes
from cyclopean.io.formats import loaded
from cyclopean.io.units import ASSUMED, UNITS, stated_units

__all__ = ["DrawnLine", "Sheet", "corners", "line_work_of", "read_line_work"]

READERS = {".dxf": "dxf_lines.read_dxf_lines", ".svg": "svg_lines.read_svg_lines"}
SHARE = 0.25  # of the gap that is closed: how far facets may lie off a curve, unless it is said
MOST = 200_000  # corners and facets; more would take minutes
LARGEST = 1e5  # m: across; no wall is larger
SIZES = 0.1, 100.0  # m: across; a wall outside them whose unit nobody said is a slip of units
FLAT = 1e-6  # of the drawing's size: lines that lie nearer to a plane than this lie in it


@dataclass(frozen=True, slots=True, eq=False)
class DrawnLine:
    """A line as it was drawn: pieces end to end."""

    pieces: tuple[Curve, ...]
    layer: str = ""
    closed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """What a file holds."""

    lines: tuple[DrawnLine, ...]
    unit: str = ""  # one of `io.units`, another word, or "" where the file does not say it
    notes: tuple[str, ...] = field(default=())
    downwards: bool = False  # the second coordinate runs down the sheet


def read_line_work(path: PathLike, reading: LineReading) -> LineWork:
    """Read the lines of a drawing.

    Parameters
    ----------
    path : path
        DXF (with the extra `dxf`) or SVG, by its ending.
    reading : LineReading
        Units, scale, deviation of facets, and layers.

    Raises
    ------
    InputError
        Another ending, a damaged or empty file, no lines, units that are not known; one line.
    """
    shown = one_line(path)
    suffix = PurePath(shown).suffix.lower()
    if suffix not in READERS:
        raise InputError(f"{shown}: is no drawing of lines by its ending; save it as DXF or SVG")
    data = read_bytes(path)
    return line_work_of(shown, loaded(READERS[suffix])(shown, data), reading)


def line_work_of(name: str, sheet: Sheet, reading: LineReading) -> LineWork:
    """The lines of a sheet in one plane, curves as facets; errors as `read_line_work`."""
    lines, passed = _chosen(name, sheet.lines, reading.layer)
    if not lines:
        raise InputError(f"{name}: holds no lines; draw the joints as lines, polylines, arcs or splines")
    unit, warnings = stated_units(name, sheet.unit, reading.units)
    with np.errstate(all="ignore"):  # what is not finite is refused below
        rough = [corners(line, np.inf)[0] for line in lines]
    axes = _plane(name, rough)
    turn = np.array([1.0, -1.0 if sheet.downwards else 1.0])
    times, over = UNITS[unit]
    per_metre = over / times / reading.scale
    work = LineWork(name, unit, per_metre, tuple(Line(points[:, axes]) for points in rough), downwards=sheet.downwards)
    _refuse_size(work, any(ASSUMED in line for line in warnings))
    snap = usual_snap(work) if reading.snap is None else reading.snap
    deviation = SHARE * snap if reading.deviation is None else positive("deviation", reading.deviation)
    least = FLAT * usual_snap(work)
    if not least <= deviation <= snap:
        raise InputError.of("deviation", deviation, f"at least {least:.2g} m, and at most `snap`, {snap:.2g} m")
    made, count = [], 0
    for line in lines:
        points, curved = corners(line, deviation * per_metre)
        made.append(Line(points[:, axes] * turn, line.layer, curved))
        count += len(points)
        if count > MOST:
            raise InputError(f"{name}: has more than {MOST:,} corners and facets; leave out layers (`layer`)")
    facets = sum(int(one.curved.sum()) for one in made if one.curved is not None)
    bends = sum(any(piece.bent for piece in line.pieces) for line in lines)
    told = (f"{name}: {bends} curved lines have facets within {deviation * 1000:.2g} mm of them",) if facets else ()
    return replace(work, lines=tuple(made), notes=(*sheet.notes, *passed, *warnings, *told))


def _chosen(
    name: str, lines: Sequence[DrawnLine], wanted: Sequence[str]
) -> tuple[tuple[DrawnLine, ...], tuple[str, ...]]:
    """The lines of the layers that are wanted, all where none is named; what that leaves out."""
    if not wanted:
        return tuple(lines), ()
    names = {layer.lower() for layer in wanted}
    there = {line.layer.lower(): line.layer for line in lines}
    if missing := sorted(names - there.keys()):
        known = ", ".join(f"'{one_line(layer, 30)}'" for layer in sorted(there.values())[:8]) or "none"
        raise InputError(f"{name}: has no lines on a layer '{one_line(missing[0], 30)}'; it has {known}")
    kept = tuple(line for line in lines if line.layer.lower() in names)
    left = len(lines) - len(kept)
    return kept, (f"{name}: {left} lines on other layers passed over",) if left else ()


def corners(line: DrawnLine, deviation: float) -> tuple[Floats, Bools]:
    """Corners of a line (k, d), and which of them stand for a curve, (k,)."""
    points: list[Floats] = []
    curved: list[Bools] = []
    for piece in line.pieces:
        here = piece.corners(deviation)
        inner = np.full(len(here), piece.bent)
        inner[[0, -1]] = False
        first = 1 if points else 0  # where one piece ends the next begins
        points.append(here[first:])
        curved.append(inner[first:])
    made, flags = np.concatenate(points), np.concatenate(curved)
    near = np.linalg.norm(made[0] - made[-1]) <= FLAT * np.linalg.norm(np.ptp(made, axis=0))
    if near or not line.closed:
        return np.concatenate([made[:-1], made[:1] if near else made[-1:]]), flags
    return np.concatenate([made, made[:1]]), np.append(flags, False)


def _plane(name: str, lines: Sequence[Floats]) -> list[int]:
    """The two coordinates that are drawn: x and y, or x and z or y and z of lines in an upright plane."""
    every = np.concatenate(lines)
    if not np.all(np.abs(every) < np.finfo(np.float32).max):  # squares of larger ones are infinite
        raise InputError(f"{name}: has coordinates that are not finite or far too large; draw it anew")
    if every.shape[1] == 2:
        return [0, 1]
    thick = np.ptp(every, axis=0) <= FLAT * float(np.linalg.norm(np.ptp(every, axis=0)))
    for across in (2, 1, 0):
        if thick[across]:
            return [k for k in range(3) if k != across]
    raise InputError(f"{name}: its lines lie in no plane of the axes; flatten them, or leave out layers (`layer`)")


def _refuse_size(work: LineWork, unsaid: bool) -> None:
    """Refuse what is no wall, and what is none in metres where nobody said that they are metres."""
    size = float(np.hypot(*np.ptp(np.concatenate([line.point for line in work.lines]), axis=0))) / work.per_metre
    if unsaid and not SIZES[0] <= size <= SIZES[1]:
        raise InputError(f"{work.name}: does not say its units, and in metres it is {size:.3g} m across; say `units`")
    if not 0.0 < size <= LARGEST:
        raise InputError(f"{work.name}: is {size:.3g} m across; check its units (`units`) and its scale (`scale`)")
