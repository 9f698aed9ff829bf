"""Lines of a DXF drawing: LINE, LWPOLYLINE and POLYLINE with bulges, ARC, CIRCLE, ELLIPSE, SPLINE, inserts resolved.

Layers that are off or frozen, paper space, text, dimensions and hatches are passed over.
"""

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.geometry.curves import Curve, bulged, elliptic, straight, thinned
from cyclopean.io.dxf import opened, parts, said_unit
from cyclopean.io.line_work import DrawnLine, Sheet

__all__ = ["read_dxf_lines"]

FINE = 8.0  # a spline is sampled so many times finer than its facets may deviate, then left with as few as will do
CONTROL = 16  # flag of a vertex of a polyline that only controls a spline


def read_dxf_lines(path: str, data: bytes) -> Sheet:
    """Read the lines of a DXF drawing.

    Raises
    ------
    InputError
        It is damaged, or ezdxf is not installed; one line.
    """
    passed: Counter[str] = Counter()
    with opened(path, data) as drawing:
        unit = said_unit(drawing)
        lines = tuple(_lines(path, data, drawing, passed))
    left = [f"{count} {kind}" for kind, count in passed.items()][:4]
    notes = (f"{path}: {', '.join(left)} passed over; only lines and outlines are read",) if left else ()
    return Sheet(lines, unit, notes)


def _lines(path: str, data: bytes, drawing: Any, passed: Counter[str]) -> Iterator[DrawnLine]:
    """Lines that are seen, in their order."""
    unseen = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    for entity, _, layer, _ in parts(path, len(data), drawing):
        kind = entity.dxftype()
        if layer.lower() in unseen or entity.dxf.get("invisible", 0):
            passed["hidden"] += 1
        elif kind not in SHAPES or not (made := SHAPES[kind](entity)):
            passed[kind] += 1
        else:
            pieces, closed = made
            for piece in pieces:
                piece.corners(np.inf)  # what is damaged shows here
            yield DrawnLine(tuple(pieces), layer, closed)


Shape = tuple[list[Curve], bool] | None  # pieces, and whether the line is closed; None = not a line


def _points(vectors: Any) -> Floats:
    return np.array([(v[0], v[1], v[2]) for v in vectors], np.float64).reshape(-1, 3)


def _line(entity: Any) -> Shape:
    return [straight(_points([entity.dxf.start, entity.dxf.end]))], False


def _light(entity: Any) -> Shape:
    """A polyline in a plane, some of whose pieces may be arcs."""
    rows = entity.get_points("xyb")
    return _with_bulges(entity, np.array(rows, np.float64).reshape(-1, 3), float(entity.dxf.elevation))


def _polyline(entity: Any) -> Shape:
    vertices = [one for one in entity.vertices if not one.dxf.flags & CONTROL]
    if entity.is_2d_polyline:
        rows = [(one.dxf.location.x, one.dxf.location.y, one.dxf.get("bulge", 0.0)) for one in vertices]
        height = vertices[0].dxf.location.z if vertices else 0.0
        return _with_bulges(entity, np.array(rows, np.float64).reshape(-1, 3), height)
    if entity.is_3d_polyline:
        found = _points([one.dxf.location for one in vertices])
        return ([straight(found)], bool(entity.is_closed)) if len(found) > 1 else None
    return None


def _with_bulges(entity: Any, rows: Floats, height: float) -> Shape:
    """A polyline by its corners and bulges (k, 3) in its own plane at a height."""
    closed = bool(entity.is_closed)
    if len(rows) < 2:
        return None
    if closed:
        rows = np.concatenate([rows, rows[:1]])
    if np.all(rows[:-1, 2] == 0.0):
        pieces = [straight(rows[:, :2])]
    else:
        pieces = [bulged(a[:2], b[:2], float(a[2])) for a, b in pairwise(rows)]
    return [_placed(piece, entity, height) for piece in pieces], closed


def _placed(piece: Curve, entity: Any, height: float) -> Curve:
    """A curve (k, 2) of an entity's own plane, in space."""
    to_world = entity.ocs()

    def corners(deviation: float) -> Floats:
        flat = piece.corners(deviation)
        return _points(to_world.points_to_wcs([(x, y, height) for x, y in flat.tolist()]))

    return Curve(corners, piece.bent)


def _round(entity: Any) -> Shape:
    """A circle, or an arc of one."""
    to_world, radius = entity.ocs(), entity.dxf.radius
    centre, a, b = _points(to_world.points_to_wcs([entity.dxf.center, (radius, 0.0, 0.0), (0.0, radius, 0.0)]))
    if entity.dxftype() == "CIRCLE":
        return [elliptic(centre, a, b, 0.0, 2.0 * np.pi)], True
    start, end = np.radians([entity.dxf.start_angle, entity.dxf.end_angle])
    return [elliptic(centre, a, b, start, start + ((end - start) % (2.0 * np.pi) or 2.0 * np.pi))], False


def _ellipse(entity: Any) -> Shape:
    centre, a, b = _points([entity.dxf.center, entity.dxf.major_axis, entity.minor_axis])
    start, turn = entity.dxf.start_param, (entity.dxf.end_param - entity.dxf.start_param) % (2.0 * np.pi)
    whole = turn < 1e-9 or 2.0 * np.pi - turn < 1e-9  # rounding of the parameters in the file
    return [elliptic(centre, a, b, start, start + (2.0 * np.pi if whole else turn))], whole


def _spline(entity: Any) -> Shape:
    curve = entity.construction_tool()
    size = float(np.linalg.norm(np.ptp(_points(curve.control_points), axis=0)))

    def corners(deviation: float) -> Floats:
        fine = min(deviation, size) / FINE
        dense = _points(curve.flattening(fine, int(FINE)))
        return thinned(dense, deviation - fine) if np.isfinite(deviation) else dense

    return [Curve(corners)], bool(entity.closed)


SHAPES = {
    "LINE": _line, "LWPOLYLINE": _light, "POLYLINE": _polyline, "ARC": _round, "CIRCLE": _round, "ELLIPSE": _ellipse,
    "SPLINE": _spline,
}  # fmt: skip
