"""Cuts that can be marked on a stone, and templates of the faces that they leave.

A sheet shows the stone as it was found, turned as it will lie in the wall, from two opposite corners; so every side of
it is seen. Numbered points are where a person can find them. Each cut has three marks, found by their distances to the
numbered points; its line runs through them, round the stone where it may be sawn right through.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.carving.carve import Carved
from cyclopean.design.carving.cuts import Cut
from cyclopean.design.carving.marks import CutMarks, NumberedPoints, cut_marks, numbered_points, template_of
from cyclopean.design.construction.laying import LaidStone
from cyclopean.design.stones.stone import Stone
from cyclopean.geometry.frames import unit
from cyclopean.view.colours import INK, SOFT
from cyclopean.view.site.bodies import Solid, on_paper
from cyclopean.view.site.cards import PAD, RED, THIN, Card, Place, drawn_pages, heading
from cyclopean.view.site.paper import (
    BOLD,
    BOLDER,
    HEADING,
    LETTERS,
    LINE,
    Form,
    Page,
    columns,
    portions,
    width,
    words,
    wrapped,
)
from cyclopean.view.svg import EXACT, Paper, View, closed, layer, project, rect, segments, sheet, to_scale

TINT = "#ded5c4"  # stone as it was found
CUT = "#0b4f8a"  # lines of cuts
PICTURES = 0.5  # of a card's width
HEAD = 24.0  # mm that heading and head of the table take
EACH = 1  # cards on a page: the table needs the room
COLUMNS = 15.0, 11.0, 13.0, 13.0, 13.0, 11.0, 13.0  # mm, of the table; the angles take the rest
DISC = 2.4  # mm, radius of a numbered point
EDGE = 12.0  # mm round a template
BENT = 30.0  # degrees that neighbouring faces may turn and be one bent face; a joint turns by more


@dataclass(frozen=True, slots=True, eq=False)
class CutStone:
    """A stone to be cut, with all that is marked on it."""

    carved: Carved
    found: Stone
    points: NumberedPoints  # stone frame
    marks: tuple[CutMarks | None, ...]  # of each cut; None for mere dressing, and where there is nothing to mark

    def in_wall(self, point: Floats) -> Floats:
        """Points (k, 3) of the stone's frame, m, in that of the wall."""
        return np.asarray(point @ self.carved.rotation.T + self.carved.shift)


def cut_stone(carved: Carved, found: Stone) -> CutStone:
    """Mark the cuts of a stone that are no mere dressing."""
    points = numbered_points(found.vertices, found.triangles)
    marks = [None if cut.dressing else cut_marks(carved, found, k, points) for k, cut in enumerate(carved.cuts)]
    return CutStone(carved, found, points, tuple(marks))


def cut_pages(stones: Sequence[LaidStone], cut: Mapping[int, CutStone], axes: Floats, form: Form) -> tuple[Page, ...]:
    """Cards of cuts, those of `cut` (by block); `axes` (3, 3) are along the wall, from face to back, up."""
    cards = [card for stone in stones if stone.block in cut for card in _cards(stone, cut[stone.block], axes, form)]
    return drawn_pages("cuts", "Cuts of stones", cards, form, EACH)


def _cards(stone: LaidStone, one: CutStone, axes: Floats, form: Form) -> Iterator[Card]:
    """The card of a stone, and more where its table is long."""
    each = int((form.room[3] - HEAD - 2.0 * PAD) / LINE)
    parts = portions(list(_rows(one)), each // 3 * 3) or [()]
    for k, part in enumerate(parts):
        again = f"card {k + 1} of {len(parts)}" if len(parts) > 1 else ""
        yield stone.step, partial(_card, stone, one, axes, again, part)


Row = tuple[str, ...]


def _card(
    stone: LaidStone, one: CutStone, axes: Floats, again: str, rows: Sequence[Row], place: Place
) -> Iterator[str]:
    """Heading; pictures and how the points are found at the left, the table at the right."""
    yield heading(place, str(stone.step), f"{stone.id}: cuts of found stone {one.carved.stone}", again)
    x, y, half = place.x + PAD, place.y + PAD + HEADING + 4.0, place.wide * PICTURES
    how = _how(one, half - PAD)
    high = (place.high - 2.0 * PAD - HEADING - 4.0 - LINE * len(how)) / 2.0
    for side in (0, 1):
        yield from _picture(one, axes, side, Place(x, y + side * high, half - PAD, high))
    said = (words(x, y + 2.0 * high + (k + 0.8) * LINE, line) for k, line in enumerate(how))
    yield layer("facts", said)
    yield layer("table", _table(x + half + PAD, y + LINE, place.wide - half - 3.0 * PAD, rows))


def _how(one: CutStone, room: float) -> list[str]:
    """How the numbered points are found, and what is left to the chisel."""
    kind = "1, 2, 3 are its sharpest corners" if one.points.corners else (
        "It has no three sharp corners: 1 and 2 are its two points farthest apart, 3 is farthest from their line; paint"
        " them on before you measure"
    )  # fmt: skip
    pairs = zip(((1, 2), (1, 3), (2, 3)), one.points.apart.tolist(), strict=True)
    apart = ", ".join(f"{a}-{b}: {_mm(d)}" for (a, b), d in pairs)
    said = f"{kind}. Check: {apart} mm. Dashed: on the far side. Mark every cut before the first is sawn."
    lines = wrapped(f"{said} Measure straight, with callipers or a beam compass.", room, 6)
    for bent in bent_faces(one.carved.cuts):
        lines += wrapped(f"Cuts {', '.join(str(k + 1) for k in bent)} are one face with a bend.", room, 2)
    dressed = [str(k) for k, cut in enumerate(one.carved.cuts, 1) if cut.dressing]
    if dressed:
        deepest = max(cut.depth for cut in one.carved.cuts if cut.dressing)
        lines += wrapped(f"With the chisel, at most {1000.0 * deepest:.1f} mm: faces {', '.join(dressed)}.", room, 1)
    return lines


def _mm(length: float) -> str:
    return f"{1000.0 * length:.0f}"


def _rows(one: CutStone) -> Iterator[Row]:
    """Three rows for each cut: marks with their distances, then depth, area, angles to its neighbours."""
    cuts = one.carved.cuts
    first = {k: bent[0] for bent in bent_faces(cuts) for k in bent}
    for k in sorted(range(len(cuts)), key=lambda k: (first.get(k, k), k)):
        if not cuts[k].dressing:
            yield from _cut_rows(k, cuts[k], one.marks[k], cuts)


def bent_faces(cuts: Sequence[Cut]) -> list[list[int]]:
    """Cuts (from 0) that leave one bent face together, as facets of a curved wall do: each meets another bluntly."""
    face = list(range(len(cuts)))
    for k, cut in enumerate(cuts):
        for j, degrees in cut.beside:
            if abs(180.0 - degrees) <= BENT and not (cut.dressing or cuts[j].dressing):
                face = [face[k] if one == face[j] else one for one in face]
    found = ([k for k, one in enumerate(face) if one == which] for which in dict.fromkeys(face))
    return [those for those in found if len(those) > 1]


def _cut_rows(k: int, cut: Cut, marks: CutMarks | None, every: Sequence[Cut]) -> Iterator[Row]:
    angles = [f"{j + 1}: {degrees:.0f}°" for j, degrees in cut.beside if not every[j].dressing]
    said = [", ".join(part) for part in portions(angles, 3)]
    if len(said) > 3:
        said = [*said[:2], f"{said[2]}, …"]
    first = str(k + 1), _mm(cut.depth), f"{1e4 * cut.area:.0f}"
    how = "" if marks is None else "through" if marks.through else "ends"
    for row in range(3):
        number, depth, area = first if row == 0 else ("", "", "")
        if marks is None:
            far: Row = ("", "by its", "angles", "") if row == 0 else ("", "", "", "")
        else:
            far = f"{k + 1}{'abc'[row]}", *(_mm(d) for d in marks.distance[row].tolist())
        yield number or (how if row == 1 else ""), *far, depth, area, said[row] if row < len(said) else ""


def _table(x: float, y: float, room: float, rows: Sequence[Row]) -> Iterator[str]:
    """Cuts with their marks."""
    wide = (*COLUMNS, room - sum(COLUMNS))
    yield columns(x, wide, ("", "", "", "", "", "off", "face", "angle of stone"), y - LINE + 0.4, BOLD)
    yield words(x + sum(wide[:2]), y - LINE + 0.4, "mm to point", more=BOLD)
    yield columns(x, wide, ("Cut", "mark", "1", "2", "3", "mm", "cm²", "to next cut"), y, BOLD)
    for k, row in enumerate(rows):
        if k % 3 == 0:
            yield f'<path d="M{x:.2f} {y + k * LINE + 1.3:.2f}h{room:.2f}" {THIN}/>'
        yield columns(x, wide, row, y + (k + 1) * LINE)


@dataclass(slots=True)
class _Labels:
    """Puts labels where they do not lie on each other."""

    taken: list[tuple[float, float, float, float]] = field(default_factory=list)

    def put(self, at: Floats, away: Floats, said: str) -> str:
        """Words near a point (2,), on the side `away` (2,) if there is room, with a line to it."""
        wide, high = BOLDER * width(said) + 0.8, LETTERS
        heading_ = float(np.arctan2(away[1], away[0]))
        for reach in (3.8, 5.5, 8.0, 11.0, 14.0):
            for turn in (0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 2.4, -2.4, 3.1):
                x = float(at[0]) + reach * np.cos(heading_ + turn)
                y = float(at[1]) + reach * np.sin(heading_ + turn)
                box = x - wide / 2.0, y - high / 2.0, x + wide / 2.0, y + high / 2.0
                if not any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in self.taken):
                    self.taken.append(box)
                    leader = f'<path d="M{at[0]:.2f} {at[1]:.2f}L{x:.2f} {y:.2f}" {THIN}/>' if reach > 5.0 else ""
                    style = f'text-anchor="middle" {BOLD} fill="{CUT}"'
                    ground = rect(box[0], box[1], wide, high, 'fill="#ffffff"', 2)  # lines pass below the words
                    return leader + ground + words(x, y + 0.36 * LETTERS, said, more=style)
        return ""


def _picture(one: CutStone, axes: Floats, side: int, place: Place) -> Iterator[str]:
    """The found stone from above its face and right end, or from below its back and left end."""
    along, into, up = axes
    sight = unit(into - along - 0.8 * up) * (1.0 if side == 0 else -1.0)
    right = unit(np.cross(sight, up))
    view = View(right, sight, np.cross(right, sight))
    solid = Solid(one.found.id, one.in_wall(one.found.vertices), one.found.triangles)
    flat = project(solid.vertices, view)[0]
    low, span = flat.min(axis=0), np.ptp(flat, axis=0)
    times = float(min((place.wide - 16.0) / span[0], (place.high - 16.0) / span[1]))
    middle = np.array([place.x + place.wide / 2.0, place.y + place.high / 2.0 - 2.0])
    paper = Paper(view, low + span / 2.0, middle, times)
    yield layer("stones", [on_paper(solid, paper).drawn(TINT)])
    yield layer("cuts", _lines(one, paper))
    yield layer("marks", _points(one, paper))
    said = "from the right, above the face" if side == 0 else "from the left, below the back"
    yield layer("names", [words(place.x, place.y + place.high - 1.0, said, more=f'fill="{SOFT}"')])


def _lines(one: CutStone, paper: Paper) -> Iterator[str]:
    """Lines of the cuts on what is seen of the surface."""
    for marks in one.marks:
        if marks is not None:
            way = segments(paper.of(one.in_wall(marks.line[_faces(one, marks.normal, paper.view)])), 2)
            style = f'stroke="{CUT}" stroke-width="0.4" stroke-linecap="round" fill="none"'
            yield f'<path d="{way}" {style}/>' if way else ""


def _faces(one: CutStone, normal: Floats, view: View) -> Bools:
    """(k,) whether surface with such normals (k, 3), in the stone's frame, looks at the viewer."""
    return np.asarray((normal @ one.carved.rotation.T) @ view.sight < 0.0)


def _points(one: CutStone, paper: Paper) -> Iterator[str]:
    """Marks that are seen, and numbered points, dashed where they are on the far side."""
    labels = _Labels()
    points, centre = one.in_wall(one.points.point), one.in_wall(one.found.centroid[None])[0]
    seen = [
        (f"{marks.cut + 1}{'abc'[k]}", paper.of(one.in_wall(marks.point[k])))
        for marks in one.marks
        if marks is not None
        for k in np.flatnonzero(_faces(one, marks.facing, paper.view)).tolist()
    ]
    for _, (x, y) in seen:
        labels.taken.append((x - 1.2, y - 1.2, x + 1.2, y + 1.2))
        yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="0.7" fill="{CUT}"/>'
    for k, (point, (x, y)) in enumerate(zip(points, paper.of(points).tolist(), strict=True), 1):
        labels.taken.append((x - DISC, y - DISC, x + DISC, y + DISC))
        dashed = ' stroke-dasharray="0.8 0.6"' if (point - centre) @ paper.view.sight > 0.0 else ""
        yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{DISC}" fill="#ffffff" stroke="{RED}" stroke-width="0.4"{dashed}/>'
        yield words(x, y + 0.36 * LETTERS, str(k), more=f'text-anchor="middle" {BOLD}')
    for name, at in seen:
        yield labels.put(at, at - paper.foot, name)


def template_svg(one: CutStone, cut: int, step: int, up: Floats) -> str:
    """The face that a cut leaves, 1:1, as one `<svg>` element: seen from outside, `up` (3,) of the wall upwards."""
    made = template_of(one.carved, cut, up)
    every = 1000.0 * np.concatenate(made.rings) if made.rings else np.zeros((1, 2))
    low, span = every.min(axis=0), np.ptp(every, axis=0)
    size = float(np.ceil(max(span[0], 70.0) + 2.0 * EDGE)), float(np.ceil(span[1] + 2.0 * EDGE + 2.0 * LINE))
    at = np.array([EDGE, EDGE + span[1]]) - low * [1.0, -1.0]
    way = "".join(closed(at + 1000.0 * ring * [1.0, -1.0], EXACT) for ring in made.rings)
    said = f"stone {step}, cut {cut + 1} of {one.carved.stone}"
    told = "1:1, seen from outside the stone, up is up"
    parts = [
        layer("outline", [f'<path d="{way}" fill="none" stroke="{INK}" stroke-width="0.25"/>']),
        layer("names", [words(EDGE, size[1] - EDGE, said, more=BOLD), words(EDGE, size[1] - EDGE + LINE, told)]),
    ]
    more = f' width="{size[0]:g}mm" height="{size[1]:g}mm" font-family="Arial, Helvetica, sans-serif"'
    more += f' font-size="{LETTERS}" fill="{INK}"' + to_scale(1000.0, (float(at[0]), float(at[1])))
    return sheet(size, said, parts, more=more)
