"""Cuts that can be marked on a stone, and templates of the faces that they leave.

A card shows the stone as it was found, as it will lie in the wall, from two opposite corners; so every side of it is
seen. Numbered points are where a person can find them, letters where cuts meet the surface: a letter is found by its
distances to the three points, and a cut runs through its three letters.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.carving.carve import Carved
from cyclopean.design.carving.cuts import Cut
from cyclopean.design.carving.marks import CutMarks, NumberedPoints, cut_marks, numbered_points, rim_of, template_of
from cyclopean.design.construction.laying import LaidStone
from cyclopean.design.stones.stone import Stone
from cyclopean.view.colours import INK, SOFT
from cyclopean.view.site.bodies import Solid, on_paper
from cyclopean.view.site.cards import PAD, RED, THIN, Card, Place, drawn_pages, heading
from cyclopean.view.site.paper import BOLD, HEADING, LETTERS, LINE, Form, Page, columns, portions, width, words, wrapped
from cyclopean.view.svg import EXACT, View, closed, layer, project, rect, sheet, text, to_scale

__all__ = ["CutStone", "cut_pages", "cut_stone", "template_svg"]

SAME = 0.0005  # m: marks nearer to each other than a pencil's line is wide are one
TINT = "#ded5c4"  # stone as it was found
CUT = "#0b4f8a"  # lines of cuts
PICTURES = 0.40  # of a card's height
EACH = 2  # cards on a page: their tables need the room
MARKS = 10.0, 15.0, 15.0, 15.0  # mm, columns of the table of marks
CUTS = 9.0, 17.0, 13.0, 17.0  # mm, columns of the table of cuts; the angles take the rest
DISC = 2.4  # mm, radius of a numbered point
EDGE = 12.0  # mm round a template


@dataclass(frozen=True, slots=True, eq=False)
class CutStone:
    """A stone to be cut, with all that is marked on it."""

    carved: Carved
    found: Stone
    points: NumberedPoints  # stone frame
    marks: tuple[CutMarks | None, ...]  # of each cut
    letter: Floats  # (m, 3) m, stone frame: marks, each once; several cuts may run through one

    @property
    def distances(self) -> Floats:
        """(m, 3) m of each letter to the points 1, 2, 3."""
        return np.asarray(np.linalg.norm(self.letter[:, None] - self.points.point[None], axis=2))

    def through(self, cut: int) -> str:
        """Letters of a cut; none where it has no marks."""
        found = self.marks[cut]
        if found is None:
            return ""
        which = [int(np.argmin(np.linalg.norm(self.letter - point, axis=1))) for point in found.point]
        return " ".join(_name(k) for k in dict.fromkeys(which))

    def in_wall(self, point: Floats) -> Floats:
        """Points (k, 3) of the stone's frame, m, in that of the wall."""
        return np.asarray(point @ self.carved.rotation.T + self.carved.shift)


def cut_stone(carved: Carved, found: Stone) -> CutStone:
    """Mark the cuts of a stone that are no mere dressing."""
    points = numbered_points(found.vertices, found.triangles)
    marks = tuple(None if cut.dressing else cut_marks(carved, k, points) for k, cut in enumerate(carved.cuts))
    letters: list[Floats] = []
    for one in marks:
        for point in one.point if one is not None else ():
            if all(np.linalg.norm(point - other) > SAME for other in letters):
                letters.append(point)
    return CutStone(carved, found, points, marks, np.array(letters).reshape(-1, 3))


def _name(k: int) -> str:
    """a, b, .. z, aa, ab, ..."""
    return chr(97 + k) if k < 26 else _name(k // 26 - 1) + chr(97 + k % 26)


def cut_pages(
    stones: Sequence[LaidStone], cut: dict[int, CutStone], axes: Floats, form: Form
) -> tuple[Page, ...]:
    """Cards of cuts, those of `cut` (by block); `axes` (3, 3) are along the wall, from face to back, up."""
    cards = [card for stone in stones if stone.block in cut for card in _cards(stone, cut[stone.block], axes, form)]
    return drawn_pages("cuts", "Cuts of stones", cards, form, EACH)


def _cards(stone: LaidStone, one: CutStone, axes: Floats, form: Form) -> Iterator[Card]:
    """The card of a stone, and more where its tables are long."""
    high = form.room[3]
    whole, rest = (int((high - used) / LINE) for used in (PICTURES * high + 52.0, 30.0))
    marks, cuts = _mark_rows(one), _cut_rows(one)
    count = max(len(marks), len(cuts))
    starts = [0, *range(whole, count, rest)]
    for k, start in enumerate(starts):
        end = starts[k + 1] if k + 1 < len(starts) else count
        part = marks[start:end], cuts[start:end]
        yield Card(stone.step, lambda place, k=k, part=part: _card(stone, one, axes, place, (k, len(starts)), part))


Rows = tuple[list[tuple[str, ...]], list[tuple[str, ...]]]


def _card(
    stone: LaidStone, one: CutStone, axes: Floats, place: Place, number: tuple[int, int], rows: Rows
) -> Iterator[str]:
    """Heading, pictures and how the points are found; then the tables."""
    k, count = number
    again = f", card {k + 1} of {count}" if count > 1 else ""
    yield heading(place, str(stone.step), f"cut from {one.carved.stone}", f"cuts{again}")
    x, y, room = place.x + PAD, place.y + PAD + HEADING + 4.0, place.wide - 2.0 * PAD
    if k == 0:
        high = PICTURES * place.high
        half = (room - PAD) / 2.0
        for side in (0, 1):
            yield from _picture(one, axes, side, Place(x + side * (half + PAD), y, half, high))
        y += high + LINE
        for line in _how(one, room):
            yield layer("facts", [words(x, y, line)])
            y += LINE
    y += LINE
    yield layer("tables", _tables(x, y, room, rows))


def _how(one: CutStone, room: float) -> list[str]:
    """How the numbered points are found, and what is left to the chisel."""
    kind = "1, 2, 3 are its most pointed corners" if one.points.corners else (
        "It has no three corners: 1 and 2 are its two points farthest apart, 3 is farthest from their line"
    )  # fmt: skip
    apart = ", ".join(f"{a} to {b} {_mm(d)}" for (a, b), d in zip(((1, 2), (1, 3), (2, 3)), one.points.apart, strict=True))
    lines = wrapped(f"{kind}. Check: {apart} mm. Measure straight, with callipers or a beam compass.", room, 3)
    dressed = [str(k) for k, cut in enumerate(one.carved.cuts, 1) if cut.dressing]
    if dressed:
        deepest = max(cut.depth for cut in one.carved.cuts if cut.dressing)
        lines += wrapped(f"Only dress with the chisel, at most {1000.0 * deepest:.1f} mm: {', '.join(dressed)}.", room, 1)
    return lines


def _mm(length: float) -> str:
    return f"{1000.0 * length:.0f}"


def _mark_rows(one: CutStone) -> list[tuple[str, ...]]:
    """Each letter with its distances to the three points."""
    return [(_name(k), *(_mm(d) for d in row)) for k, row in enumerate(one.distances.tolist())]


def _cut_rows(one: CutStone) -> list[tuple[str, ...]]:
    """Each cut: letters that it runs through, depth, area, angles to its neighbours."""
    return [_cut_row(one, k, cut) for k, cut in enumerate(one.carved.cuts) if not cut.dressing]


def _cut_row(one: CutStone, k: int, cut: Cut) -> tuple[str, ...]:
    angles = [f"{j + 1}: {degrees:.0f}°" for j, degrees in cut.beside if not one.carved.cuts[j].dressing]
    marks = one.marks[k]
    said = one.through(k) + ("" if marks is None or marks.firm else " *") if marks is not None else "none *"
    return str(k + 1), said, f"{1000.0 * cut.depth:.0f}", f"{1e4 * cut.area:.0f}", "  ".join(angles)


def _tables(x: float, y: float, room: float, rows: Rows) -> Iterator[str]:
    """Marks at the left, cuts at the right."""
    left = sum(MARKS) + 4.0
    rooms = (*CUTS, room - left - sum(CUTS))
    for begin, wide, head, lines in (
        (x, MARKS, ("Mark", "to 1", "to 2", "to 3"), rows[0]),
        (x + left, rooms, ("Cut", "marks", "off", "cm²", "stone left between it and"), rows[1]),
    ):
        at = [begin + sum(wide[:k]) for k in range(len(wide))]
        if lines:
            yield columns(at, wide, head, y, BOLD)
            yield f'<path d="M{begin:.2f} {y + 1.2:.2f}h{sum(wide) - 2.0:.2f}" {THIN}/>'
        for k, line in enumerate(lines, 1):
            yield columns(at, wide, line, y + k * LINE + 0.6)
    if any("*" in row[1] for row in rows[1]):
        said = "* too short or no line on the found surface: set it off by its angles once its neighbours are cut"
        for k, line in enumerate(wrapped(said, room), 2):
            yield words(x, y + (max(map(len, rows)) + k) * LINE, line, more=f'fill="{SOFT}"')


@dataclass(slots=True)
class _Labels:
    """Puts labels where they do not lie on each other."""

    taken: list[tuple[float, float, float, float]] = field(default_factory=list)

    def put(self, at: Floats, away: Floats, said: str) -> str:
        """Words near a point (2,), on the side `away` (2,) if there is room, with a line to it."""
        wide, high = width(said) + 0.6, LETTERS
        heading_ = float(np.arctan2(away[1], away[0]))
        for reach in (3.4, 5.5, 8.0, 11.0, 14.0):
            for turn in (0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 2.4, -2.4, 3.1):
                x = float(at[0]) + reach * np.cos(heading_ + turn)
                y = float(at[1]) + reach * np.sin(heading_ + turn)
                box = x - wide / 2.0, y - high / 2.0, x + wide / 2.0, y + high / 2.0
                if not any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in self.taken):
                    self.taken.append(box)
                    leader = f'<path d="M{at[0]:.2f} {at[1]:.2f}L{x:.2f} {y:.2f}" {THIN}/>' if reach > 4.0 else ""
                    style = f'text-anchor="middle" {BOLD} fill="{CUT}"'
                    return leader + words(x, y + 0.36 * LETTERS, said, more=style)
        return ""


def _picture(one: CutStone, axes: Floats, side: int, place: Place) -> Iterator[str]:
    """The found stone from above its face and right end, or from below its back and left end."""
    along, into, up = axes
    sight = _unit(into - along - 0.8 * up) * (1.0 if side == 0 else -1.0)
    right = _unit(np.cross(sight, up))
    view = View(right, sight, np.cross(right, sight))
    solid = Solid(one.found.id, one.in_wall(one.found.vertices), one.found.triangles)
    flat = project(solid.vertices, view)[0]
    low, span = flat.min(axis=0), np.ptp(flat, axis=0)
    times = float(min((place.wide - 16.0) / span[0], (place.high - 20.0) / span[1]))
    middle = np.array([place.x + place.wide / 2.0, place.y + place.high / 2.0 - 2.0])
    at = middle + times * (low + span / 2.0) * [-1.0, 1.0]

    def of(point: Floats) -> Floats:
        return np.asarray(at + times * project(point, view)[0] * [1.0, -1.0])

    yield layer("stones", [on_paper(solid, view, times, at).drawn(TINT)])
    yield layer("cuts", _lines(one, view, of))
    yield layer("marks", _points(one, view, of, middle))
    said = "from the right, above the face" if side == 0 else "from the left, below the back"
    yield layer("names", [words(place.x, place.y + place.high - 1.0, said, more=f'fill="{SOFT}"')])


def _unit(way: Floats) -> Floats:
    return np.asarray(way / np.linalg.norm(way))


def _lines(one: CutStone, view: View, of: Callable[[Floats], Floats]) -> Iterator[str]:
    """Lines of the cuts on what is seen of the surface."""
    for k, cut in enumerate(one.carved.cuts):
        rim, normal = rim_of(one.carved, k)
        seen = rim[normal @ view.sight < 0.0]
        if len(seen) and not cut.dressing:
            ends = of(seen.reshape(-1, 3)).reshape(-1, 2, 2)
            way = "".join(f"M{a:.2f} {b:.2f}L{c:.2f} {d:.2f}" for (a, b), (c, d) in ends.tolist())
            yield f'<path d="{way}" stroke="{CUT}" stroke-width="0.5" stroke-linecap="round" fill="none"/>'


def _points(one: CutStone, view: View, of: Callable[[Floats], Floats], middle: Floats) -> Iterator[str]:
    """Numbered points, dashed where they are on the far side, and letters that are seen."""
    labels = _Labels()
    points, letters = one.in_wall(one.points.point), one.in_wall(one.letter)
    centre = one.in_wall(one.found.centroid[None])[0]
    for k, (point, (x, y)) in enumerate(zip(points, of(points).tolist(), strict=True), 1):
        labels.taken.append((x - DISC, y - DISC, x + DISC, y + DISC))
        dashed = ' stroke-dasharray="0.8 0.6"' if (point - centre) @ view.sight > 0.0 else ""
        yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{DISC}" fill="#ffffff" stroke="{RED}" stroke-width="0.4"{dashed}/>'
        yield words(x, y + 0.36 * LETTERS, str(k), more=f'text-anchor="middle" {BOLD}')
    seen = [k for k, point in enumerate(letters) if _seen(one, k, view)]
    for k in seen:
        x, y = of(letters[k]).tolist()
        labels.taken.append((x - 0.8, y - 0.8, x + 0.8, y + 0.8))
        yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="0.8" fill="{CUT}"/>'
    for k in seen:
        place = of(letters[k])
        yield labels.put(place, place - middle, _name(k))


def _seen(one: CutStone, letter: int, view: View) -> bool:
    """Whether the surface at a mark looks at the viewer."""
    found = one.found
    point = one.letter[letter]
    corner = found.vertices[found.triangles]
    near = np.argsort(np.linalg.norm(corner.mean(axis=1) - point, axis=1), kind="stable")[:6]
    normal = np.cross(corner[near, 1] - corner[near, 0], corner[near, 2] - corner[near, 0])
    return bool((normal.sum(axis=0) @ one.carved.rotation.T) @ view.sight < 0.0)


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
