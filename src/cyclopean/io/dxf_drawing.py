"""Drawings as DXF, with the extra `dxf` (ezdxf): one of the kit (`view.svg`) that is to scale, 1:1 in millimetres.

Layers keep their names, outlines become closed LWPOLYLINEs, lines LINEs or LWPOLYLINEs, circles CIRCLEs, words TEXT.
y runs up from the foot of what is drawn. Paint has no meaning here: paper, hatches and shading are left out, and what
paint hides on a layer that is solid is cut away instead, so that an elevation shows what is seen. The same drawing
gives the same bits.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import reduce
from io import StringIO
from typing import Any
from xml.etree import ElementTree

import numpy as np
import shapely

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import InputError
from cyclopean.io.extras import extra
from cyclopean.io.line_work import corners
from cyclopean.io.svg_lines import SPACE, Placed, hex_digits, placed

__all__ = ["dxf_text"]

RELEASE = "R2010"  # true colours and Unicode, and read by every program in use
FINEST = 3  # decimals of a millimetre that are written; drawings have fewer that mean something
DEVIATION = 0.1  # mm that facets may lie off a curve
CAPITAL = 0.72  # height of a capital in that of its letters, as in Arial and Liberation Sans; DXF measures capitals
SLIT = 0.05  # drawing units: what is narrower is rounding, nothing seen
SHADING = "shading"  # a layer of paint alone
WHITE = {"#fff", "#ffffff", "white"}  # of paper and of halos round lines
DARK = 0x404040  # a colour darker than this is ink: 7, which CAD draws black on white and white on black
INK = 7  # that colour
ALIGNED = {"start": "LEFT", "middle": "CENTER", "end": "RIGHT"}


Lines = tuple[tuple[Floats, bool], ...]  # (k, 2) mm, corners of each, the first again at its end where it is closed


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """Something drawn, in mm, y up."""

    layer: str
    colour: int | None  # 0xrrggbb; None = ink
    lines: Lines = ()
    dashes: tuple[float, ...] = ()  # mm, lines and gaps in turn
    circle: tuple[float, float, float] | None = None  # centre and radius
    words: str = ""
    at: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)  # of words: x, y, height of capitals, degrees
    anchor: str = "start"
    region: Any = None  # what it covers where it is filled, as a geometry of shapely
    seen: bool = True  # has lines of its own; others only hide
    solid: bool = False  # is hidden by what is painted later and hides
    hides: bool = False  # what lies below it and is solid


def dxf_text(drawing: str) -> str:
    """Make the text of a DXF file of a drawing.

    Parameters
    ----------
    drawing : str
        One `<svg>` element with a scale (`view.svg.to_scale`).

    Raises
    ------
    InputError
        ezdxf is not installed, or the drawing is not to scale.
    """
    library = extra("dxf")
    root = ElementTree.fromstring(drawing)
    try:
        per_metre = float(root.get("data-units-per-metre", "nan"))
        x, y = map(float, root.get("data-origin", "").split())
        wide, high = map(float, root.get("viewBox", "").split()[2:])
    except ValueError:
        per_metre = math.nan
    if not 0.0 < per_metre < math.inf:
        raise InputError("the drawing is not to scale, so that DXF cannot hold it in millimetres; write it as SVG")
    times = 1000.0 / per_metre
    to_mm = np.array([[times, 0.0, -times * x], [0.0, -times, times * y]])
    shapes = _merged(_shapes(root, to_mm, SLIT * times))
    with _same_bits(library):
        document = library.new(RELEASE, units=4)  # mm
        document.styles.get("Standard").dxf.font = "arial.ttf"  # has all signs that we write; all programs replace it
        for shape in _as_seen(shapes, SLIT * times):
            _add(document, shape)
        document.set_modelspace_vport(times * high, (times * (wide / 2.0 - x), times * (y - high / 2.0)))
        stream = StringIO()
        document.write(stream)
    return stream.getvalue()


@contextmanager
def _same_bits(library: Any) -> Iterator[None]:
    """Have the library write fixed times and numbers instead of those of the moment."""
    before = library.options.write_fixed_meta_data_for_testing
    library.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        library.options.write_fixed_meta_data_for_testing = before


def _shapes(root: ElementTree.Element, matrix: Floats, slit: float) -> Iterator[tuple[str, _Shape]]:
    """What is drawn, with the path as it is written, by which a shape that is painted twice is known."""
    clips = {f"url(#{one.get('id')})": _clip(one, matrix) for one in root.iter(f"{SPACE}clipPath")}
    for one in placed("drawing", root, matrix):
        if one.layer == SHADING:
            continue
        if one.kind == "text":
            yield "", _words(one)
            continue
        fill, stroke = one.style.get("fill", "none"), one.style.get("stroke", "none")
        line, solid = "none" if stroke in WHITE else stroke, "data-solid" in one.style
        colour = fill if line == "none" else line
        seen = line not in ("none", fill) if solid else colour not in {"none", *WHITE}
        shape = _Shape(one.layer, _colour(colour), seen=seen, solid=solid)
        if one.kind == "circle":
            (x, y), radius = one.point("cx", "cy"), float(one.element.get("r", "0")) * one.larger
            yield "", replace(shape, circle=(x, y, radius))
        elif lines := _lines(one):
            dashes = tuple(float(d) * one.larger for d in one.style.get("stroke-dasharray", "").split())
            shape = replace(shape, lines=lines, dashes=dashes)
            if fill != "none" and all(closed and len(points) > 3 for points, closed in lines):
                opaque = fill.startswith("#") and "fill-opacity" not in one.style
                shape = _filled(shape, clips.get(one.style.get("clip-path", "")), solid and opaque, slit)
            yield one.element.get("d", ""), shape


def _lines(one: Placed) -> Lines:
    """Lines of an element."""
    return tuple((corners(line, DEVIATION)[0], line.closed) for line in one.lines())


def _filled(shape: _Shape, clip: Any, hides: bool, slit: float) -> _Shape:
    """A shape that is filled, within a clip if there is one; its lines are outlines of what it covers."""
    whole = len(shape.lines) == 1 and shapely.is_valid(polygon := shapely.polygons(shape.lines[0][0]))
    region = polygon if whole else _region([points for points, _ in shape.lines])
    if clip is not None and not clip.covers(region):
        region, whole = region.intersection(clip), False
    return replace(shape, region=region, hides=hides, lines=shape.lines if whole else _rings(region, slit))


def _clip(element: ElementTree.Element, matrix: Floats) -> Any:
    """What a clip lets through, by the even-odd rule."""
    rings = [points for part in element for one in placed("drawing", part, matrix) for points, _ in _lines(one)]
    return reduce(lambda a, b: a.symmetric_difference(b), [_region([ring]) for ring in rings])


def _merged(found: Iterable[tuple[str, _Shape]]) -> list[_Shape]:
    """Shapes, once each where a colour and a hatch, or a halo and a line, are painted over each other."""
    made: list[_Shape] = []
    last = ""
    for path, shape in found:
        if path and path == last:
            first = made.pop()
            shape = replace(first if first.seen else shape, hides=first.hides or shape.hides)
        made.append(shape)
        last = path
    return made


def _words(one: Placed) -> _Shape:
    """A line of text."""
    for part in one.element:
        if part.get("dx"):
            part.text = f" {part.text or ''}"
    said, (x, y) = "".join(one.element.itertext()), one.point("x", "y")
    height = CAPITAL * one.larger * float(one.style.get("font-size", "16"))
    turn = math.degrees(math.atan2(one.matrix[1, 0], one.matrix[0, 0]))
    colour, anchor = _colour(one.style.get("fill", "")), one.style.get("text-anchor", "start")
    solid = "data-solid" in one.style
    return _Shape(one.layer, colour, words=said, at=(x, y, height, turn), anchor=anchor, solid=solid)


def _colour(text: str) -> int | None:
    """0xrrggbb; None for ink, for hatches and for what has no colour."""
    value = int(hex_digits(text) or "0", 16)
    dark = all((value >> shift & 0xFF) <= (DARK >> shift & 0xFF) for shift in (0, 8, 16))
    return None if dark else value


def _as_seen(shapes: list[_Shape], slit: float) -> Iterator[_Shape]:
    """Shapes without what others, painted later, hide; whatever nothing hides stays to the last bit."""
    hiding = np.array([k for k, shape in enumerate(shapes) if shape.hides], np.int64)
    # drawn in a little, so that neighbours that touch hide nothing of each other
    tree = shapely.STRtree(shapely.buffer([shapes[k].region for k in hiding], -slit))
    for k, shape in enumerate(shapes):
        if not shape.seen:
            continue
        own = _line_of(shape) if shape.region is None else shape.region
        above = hiding[tree.query(own, predicate="intersects")] if shape.solid else hiding[:0]
        above = np.sort(above[above > k])
        yield _rest(shape, shapely.union_all([shapes[i].region for i in above]), slit) if len(above) else shape


def _rest(shape: _Shape, hidden: Any, slit: float) -> _Shape:
    """A shape without what is hidden of it."""
    if shape.region is not None:
        return replace(shape, lines=_rings(shape.region.difference(hidden), slit))
    hidden = hidden.buffer(-slit)
    if shape.words:
        return replace(shape, words="" if _line_of(shape).intersects(hidden) else shape.words)
    lines: list[tuple[Floats, bool]] = []
    for points, closed in shape.lines:
        line = shapely.linestrings(points)
        if not line.intersects(hidden):
            lines.append((points, closed))
        else:
            parts = shapely.get_parts(line.difference(hidden))
            lines += [(shapely.get_coordinates(part), False) for part in parts if part.length > slit]
    return replace(shape, lines=tuple(lines))


def _line_of(shape: _Shape) -> Any:
    """What is not filled, as one geometry; of words and circles, where they are."""
    if shape.lines:
        return shapely.multilinestrings([shapely.linestrings(points) for points, _ in shape.lines])
    return shapely.Point((shape.circle or shape.at)[:2])


def _region(rings: Sequence[Floats]) -> Any:
    """What rings (k, 2) cover, by the non-zero rule."""
    edges = shapely.get_parts(shapely.union_all([shapely.linestrings(ring) for ring in rings]))
    faces = shapely.get_parts(shapely.polygonize(edges))
    within = shapely.get_coordinates(shapely.point_on_surface(faces))
    return shapely.union_all(faces[sum((_winding(ring, within) for ring in rings), np.zeros(len(faces), int)) != 0])


def _winding(ring: Floats, point: Floats) -> Ints:
    """How often a ring (k, 2), its first corner again at its end, runs round each of points (n, 2)."""
    (x, y), (ahead, up) = ring[:-1].T[:, :, None], ring[1:].T[:, :, None]
    across = (ahead - x) * (point[:, 1] - y) - (up - y) * (point[:, 0] - x)
    rising, falling = (y <= point[:, 1]) & (point[:, 1] < up), (up <= point[:, 1]) & (point[:, 1] < y)
    return np.asarray((rising & (across > 0.0)).sum(axis=0) - (falling & (across < 0.0)).sum(axis=0))


def _rings(region: Any, slit: float) -> Lines:
    """Outlines of a region, holes too, without slivers, which are rounding."""
    rings = shapely.get_rings([part for part in shapely.get_parts(region) if part.geom_type == "Polygon"])
    wide = shapely.area(shapely.polygons(rings)) > slit * shapely.length(rings) / 2.0
    return tuple((shapely.get_coordinates(ring), True) for ring in rings[wide])


def _add(document: Any, shape: _Shape) -> None:
    """Put a shape into the model space."""
    space, style = document.modelspace(), _style(document, shape)
    if shape.circle is not None:
        x, y, radius = _rounded(shape.circle)
        space.add_circle((x, y), radius, dxfattribs=style)
    elif shape.words:
        alignment = extra("dxf", ".enums").TextEntityAlignment[ALIGNED[shape.anchor]]
        x, y, height, turn = _rounded(shape.at)
        space.add_text(shape.words, height=height, rotation=turn, dxfattribs=style).set_placement(
            (x, y), align=alignment
        )
    for points, closed in shape.lines:
        corner = _rounded(points)
        if closed:
            space.add_lwpolyline(corner[:-1], close=True, dxfattribs=style)
        elif len(corner) == 2 and corner[0] != corner[1]:
            space.add_line(*corner, dxfattribs=style)
        elif len(corner) > 2:
            space.add_lwpolyline(corner, dxfattribs=style)


def _rounded(lengths: Any) -> Any:
    """Lengths (mm) to what is written of them, as plain numbers."""
    return (np.round(lengths, FINEST) + 0.0).tolist()  # no -0


def _style(document: Any, shape: _Shape) -> dict[str, Any]:
    """Layer, colour and dashes as attributes; a layer takes the colour of what comes first, and others tell theirs."""
    name = shape.layer or "0"
    if name not in document.layers:
        document.layers.add(name, color=INK, true_color=shape.colour)
    style: dict[str, Any] = {"layer": name}
    if document.layers.get(name).dxf.get("true_color") != shape.colour:
        style |= {"color": INK} if shape.colour is None else {"true_color": shape.colour}
    if shape.dashes:
        lengths = [length if k % 2 == 0 else -length for k, length in enumerate(_rounded(shape.dashes))]
        style["linetype"] = "dashes-" + "-".join(f"{abs(length):g}" for length in lengths)
        if style["linetype"] not in document.linetypes:
            document.linetypes.add(style["linetype"], [sum(map(abs, lengths)), *lengths], description="- - -")
    return style
