"""A wall of rubble as SVG: from its four sides, from above, cut through, and course by course; stones as they are.

The shading is a picture of pixels from a depth buffer (`relief`), with shade in joints; outlines, numbers and
dimensions are vectors above it, so that they stay sharp in print. Triangles as vectors would have no
shade in joints.

>>> import numpy as np
>>> from cyclopean.assembly import Assembly, Block
>>> corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
>>> faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
>>> ground = Block("ground", corner - [0.0, 0.0, 1.0], faces, fixed=True)
>>> wall = Assembly((ground, Block("a", corner, faces, fixed=False)))
>>> rubble_svg(wall, "One", (("front",),)).count("<title>a</title>")
1
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, supports
from cyclopean.errors import InputError
from cyclopean.geometry.solids import cross_section, fans, solid_of
from cyclopean.view.colours import ACCENT, GHOST, INK, SOFT, STONES, shaded
from cyclopean.view.figures import number
from cyclopean.view.relief import Relief, outlines, picture, places, relief
from cyclopean.view.stone_faces import facing
from cyclopean.view.svg import (
    EXACT,
    PAPER,
    WIDTH,
    Paper,
    View,
    closed,
    hatch,
    layer,
    legend,
    project,
    rect,
    scale_bar,
    segments,
    sheet,
    text,
    to_scale,
)

_VIEWS = {
    "front": ("Front", (1, 0, 0), (0, 1, 0)),
    "back": ("Back", (-1, 0, 0), (0, -1, 0)),
    "left": ("Left end", (0, -1, 0), (1, 0, 0)),
    "right": ("Right end", (0, 1, 0), (-1, 0, 0)),
    "above": ("From above", (1, 0, 0), (0, 0, -1)),
    "section": ("Section", (0, -1, 0), (1, 0, 0)),
}  # name, and the ways to the right of the sheet and away from the viewer
SECTION, UNSTEADY, THICK = "section", "unsteady", "unsteady-thick"  # names of hatches too
SIDES = tuple(side for side in _VIEWS if side != SECTION)
SHEET = (("front", "right"), ("back", "left"))
ROLES = {
    "through-stone": "#d0b48a", "hearting": "#bbb0c0", "pin": "#cfa69b", "cope": "#b5bf9f", "lintel": "#a5b8c6",
}  # fmt: skip
_TINTS = (*STONES, *ROLES.values())
MARGIN, GAP = 30.0, 44.0  # drawing units, round a sheet and between its pictures
CAPTION, DIMENSION, STRIP = 24.0, 44.0, 10.0  # drawing units: height of a caption, of a dimension, of the ground
TALLEST = 640.0  # drawing units that a picture may be high
FINE, LESS_FINE = 1.5, 1.2  # pixels a drawing unit, 210 an inch where a sheet is as wide as A4; those of courses
LETTERS, LETTER = 13.0, 6.8  # drawing units: size of letters, and mean width of one
LEAST, MOST = 7.5, 13.0  # drawing units: letters of a stone's number
BAR = 140.0  # drawing units that the scale may be long
ACROSS, APART = 3, 18.0  # pictures of courses in a row, and drawing units between them
SHOWN = 60  # courses that are drawn; of more, the lowest
GROUND, SOIL = "#c9c5b8", "#8b867b"
RIM = "#4b443a"  # outline of a stone
RED = ACCENT["unstable"]  # of stones that do not stand by themselves
PALE_RIM = ' stroke-opacity="0.35"'  # outline of a stone of which a picture does not speak
CUT = 0.82  # light of a stone that is cut
BEYOND = 10.0  # drawing units by which ground and levels reach beyond the stones
GRAIN = 5  # steps of coordinates in a drawing unit; whole numbers keep the file small
ASKED = f'stroke="{GHOST}" stroke-width="1.2" stroke-dasharray="6 4"'
_NUMBERS = (
    f'<g text-anchor="middle" fill="{INK}" stroke="{PAPER}" stroke-opacity="0.75" stroke-width="2.4"'
    ' stroke-linejoin="round" paint-order="stroke" pointer-events="none" data-layer="numbers">'
)


@dataclass(frozen=True, slots=True)
class Profile:
    """The wall that was asked for, from x = 0 and from its front face y = 0 at the ground, z = 0."""

    length: float  # m
    thickness: float  # m, at the ground
    height: float  # m
    batter: tuple[float, float] = (0.0, 0.0)  # m that the front and the back face lean in for each m of height

    def edges(self) -> Floats:
        """(12, 2, 3) m."""
        corner = np.array([
            [x, y + way * lean * z, z]
            for x in (0.0, self.length)
            for y, way, lean in ((0.0, 1.0, self.batter[0]), (self.thickness, -1.0, self.batter[1]))
            for z in (0.0, self.height)
        ])  # fmt: skip
        pairs = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]
        return np.asarray(corner[np.array(pairs)])


@dataclass(frozen=True, slots=True)
class Told:
    """What is told of the stones of a wall, by the ids of their blocks."""

    number: Mapping[str, int] | None = None  # None: in the order of the model; those that are not there have none
    role: Mapping[str, str] = field(default_factory=dict)  # of ROLES; others are plain stones
    course: Mapping[str, int] = field(default_factory=dict)
    unsteady: Mapping[str, str] = field(default_factory=dict)  # those that do not stand by themselves, and why
    profile: Profile | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Stones:
    """The stones of a wall, as they are drawn: n of them."""

    told: Told
    name: tuple[str, ...]
    number: tuple[str, ...]  # "" where there is none
    vertices: tuple[Floats, ...]  # m
    triangles: tuple[Ints, ...]
    tint: Ints  # (n,) of _TINTS
    low: Floats  # (3,) m
    high: Floats  # (3,) m

    @classmethod
    def of(cls, assembly: Assembly, told: Told) -> "_Stones":
        held, _ = supports(assembly)
        blocks = [block for block, fixed in zip(assembly.blocks, held.tolist(), strict=True) if not fixed]
        if not blocks:
            raise InputError(f"{assembly.name}: there is no stone to draw")
        name = tuple(block.id for block in blocks)
        numbers = {one: k + 1 for k, one in enumerate(name)} if told.number is None else told.number
        kind = [list(ROLES).index(role) if (role := told.role.get(one)) in ROLES else -1 for one in name]
        tint = [k * 5 % len(STONES) if one < 0 else len(STONES) + one for k, one in enumerate(kind)]
        point = np.concatenate([block.vertices for block in blocks])
        return cls(
            told,
            name,
            tuple(str(numbers.get(one, "")) for one in name),
            tuple(block.vertices for block in blocks),
            tuple(fans(block.faces) for block in blocks),
            np.array(tint),
            point.min(axis=0),
            point.max(axis=0),
        )

    @property
    def ends(self) -> Floats:
        """(8, 3) m, corners of the box round all stones."""
        box = np.stack([self.low, self.high])
        return np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])

    def extent(self, view: View) -> tuple[Floats, Floats]:
        """(2,) m: least and largest right and up of all that is drawn, the wall as asked for among it."""
        asked = self.told.profile.edges().reshape(-1, 3) if self.told.profile else self.ends
        flat = project(np.concatenate([self.ends, asked]), view)[0]
        return flat.min(axis=0), flat.max(axis=0)

    @property
    def size(self) -> float:
        """Mean extent (m) of a stone."""
        return float(np.mean([np.ptp(point, axis=0).mean() for point in self.vertices]))


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """One picture on a sheet, from the upper left corner of what it shows."""

    side: str
    cut: float | None  # m along the wall, of a section
    paper: Paper
    left: float
    top: float
    wide: float
    high: float
    fine: float  # pixels a drawing unit

    @classmethod
    def placed(cls, stones: _Stones, side: str | float, scale: float, foot: Floats, fine: float = FINE) -> "_Frame":
        """A picture of a scale (drawing units a metre) with its lower left corner at `foot` (2,)."""
        side, cut = (side, None) if isinstance(side, str) else (SECTION, float(side))
        view = _view(side)
        low, high = stones.extent(view)
        across, up = (scale * (high - low)).tolist()
        paper = Paper(view, low, foot, scale)
        return cls(side, cut, paper, float(foot[0]), float(foot[1]) - up, across, up, fine)

    @property
    def foot(self) -> float:
        """Drawing units, down."""
        return self.top + self.high

    @property
    def shape(self) -> tuple[int, int]:
        """Pixels, down and across."""
        return int(np.ceil(self.high * self.fine)), int(np.ceil(self.wide * self.fine))

    def pixels(self, point: Floats) -> Floats:
        """(..., 3) pixels to the right, down and towards the viewer, of points (..., 3) in m."""
        flat, depth = project(point, self.paper.view)
        at = self.paper.of_flat(flat) - [self.left, self.top]
        return np.asarray(np.concatenate([at, -depth[..., None] * self.paper.scale], axis=-1) * self.fine)


def rubble_svg(
    assembly: Assembly,
    title: str,
    rows: Sequence[Sequence[str | float]] = (),
    *,
    told: Told | None = None,
    cuts: Sequence[float] = (),
    keys: bool = True,
) -> str:
    """Draw a wall whose front looks to -y, as one static `<svg>` element that loads nothing.

    Each row holds pictures side by side: `SIDES` by name, and a number for a section there (m along the wall, seen from
    the left); all are of one scale. Without rows there are its four sides, the plan and a section through the middle.
    Sections, and further `cuts`, are lettered along the wall, and marked on the front and on the plan. `keys` say below
    what tints mean, where some do. The title is for readers that do not see it.

    Raises
    ------
    InputError
        There is no free block to draw, no such side, or a section beside the wall.
    """
    stones = _Stones.of(assembly, told or Told())
    rows = rows or (*SHEET, ("above", float(stones.low[0] + stones.high[0]) / 2.0))
    every = sorted({float(c) for c in (*cuts, *(one for row in rows for one in row)) if not isinstance(c, str)})
    for cut in every:
        if not stones.low[0] < cut < stones.high[0]:
            raise InputError(f"section at x = {cut:g} m: the wall lies from {stones.low[0]:g} to {stones.high[0]:g} m")
    frames, height = _laid_out(stones, rows)
    parts = [_patterns(), *(_picture(stones, frame, every) for frame in frames)]
    foot, height = _foot(stones, frames[0], height, keys)
    first = frames[0].paper
    parts.append(layer("legend", foot))
    return sheet((WIDTH, height), title, parts, letters=LETTERS, more=to_scale(first.scale, first.foot))


def courses_svg(assembly: Assembly, title: str, told: Told) -> str:
    """Draw each course of `told` from above, on those below it in pale, as one `<svg>` element as `rubble_svg` does.

    Raises
    ------
    InputError
        There is no free block to draw, or none of which it is told in which course it lies.
    """
    stones = _Stones.of(assembly, told)
    course = np.array([told.course.get(name, -1) for name in stones.name])
    every = np.unique(course[course >= 0])[:SHOWN].tolist()
    if not every:
        raise InputError(f"{assembly.name}: nothing says in which course its stones lie")
    across, up = np.subtract(*stones.extent(_view("above"))[::-1]).tolist()
    wide = (WIDTH - 2.0 * MARGIN - (ACROSS - 1) * APART) / ACROSS
    scale = min(wide / across, TALLEST / up)
    pitch = scale * up + APART + CAPTION
    parts, seen = [_patterns()], None
    for k, one in enumerate(every):
        foot = np.array([(wide + APART) * (k % ACROSS), pitch * (k // ACROSS) + scale * up]) + MARGIN
        frame = _Frame.placed(stones, "above", scale, foot, LESS_FINE)
        here = np.flatnonzero(course == one).tolist()
        stones_here = f"{len(here)} stone{'s' * (len(here) != 1)}"
        seen = _seen(stones, frame, here, seen)
        parts.append(_image(stones, seen, frame, course != one))
        parts.append(layer("stones", [_rims(stones, seen, frame, here)], solid=True))
        parts.append(layer("text", [_words(frame, CAPTION - 6.0, f"Course {one + 1}", stones_here)]))
    height, first = MARGIN + pitch * -(-len(every) // ACROSS), (MARGIN, MARGIN + scale * up)
    return sheet((WIDTH, height), title, parts, letters=LETTERS, more=to_scale(scale, first))


def _laid_out(stones: _Stones, rows: Sequence[Sequence[str | float]]) -> tuple[list[_Frame], float]:
    """Place pictures on a sheet, at the largest scale at which all rows fit; and where they end."""
    room = WIDTH - 2.0 * MARGIN - DIMENSION
    size = [[np.subtract(*stones.extent(_view(one))[::-1]).tolist() for one in row] for row in rows]
    scale = min((room - GAP * (len(row) - 1)) / sum(wide for wide, _ in row) for row in size)
    scale = min(scale, *(TALLEST / high for row in size for _, high in row))
    widest = max(scale * sum(wide for wide, _ in row) + GAP * (len(row) - 1) for row in size)
    frames, foot = [], 0.0
    for row, sizes in zip(rows, size, strict=True):
        foot += MARGIN + scale * max(high for _, high in sizes)
        left = MARGIN + DIMENSION + (room - widest) / 2.0
        for one, (wide, _) in zip(row, sizes, strict=True):
            frames.append(_Frame.placed(stones, one, scale, np.array([left, foot])))
            left += scale * wide + GAP
        foot += STRIP + DIMENSION + CAPTION
    return frames, foot + MARGIN / 2.0


def _view(side: str | float) -> View:
    """How a side is looked at, or a section."""
    if isinstance(side, str) and side not in _VIEWS:
        raise InputError(f"'{side}' is no side of a wall; choose among {', '.join(SIDES)}")
    _, right, into = _VIEWS[side if isinstance(side, str) else SECTION]
    return View(np.array(right, float), np.array(into, float), np.cross(right, into).astype(float))


def _picture(stones: _Stones, frame: _Frame, cuts: Sequence[float]) -> str:
    """One picture with all that is written about it."""
    seen = _seen(stones, frame, range(len(stones.name)))
    section = frame.cut is not None
    rims = _rims(stones, seen, frame, () if section else range(len(stones.name)))
    front = frame.side == "front"
    level, line = _level(seen, frame) if front else (0.0, "")
    ends = frame.paper.of(stones.ends)
    (left, top), (right, foot) = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
    sizes = []
    if front:
        upright = f"translate({frame.left - 0.62 * DIMENSION:.1f} {foot:.{EXACT}f}) rotate(-90)"
        sizes.append(f'<g transform="{upright}">{_dimension(0.0, foot - top, 0.0, frame.paper.scale)}</g>')
    if frame.side in ("front", "right", SECTION):
        sizes.append(_dimension(left, right - left, frame.foot + STRIP + 0.7 * DIMENSION, frame.paper.scale))
    name, words = _VIEWS[frame.side][0], f"dashed: mean top, {number(level)} m" if front else ""
    if frame.cut is not None:
        name, words = f"Section {_letter(cuts, frame.cut)}", f"x = {number(frame.cut)} m"
    marks = (_mark(frame, cut, _letter(cuts, cut)) for cut in cuts) if frame.side in ("front", "above") else ()
    parts = [
        layer("ground", [_ground(frame)]),
        layer("shading", [_image(stones, seen, frame, np.full(len(stones.name), section))]),
        layer("beyond" if section else "stones", [rims], solid=True),
        layer("cuts", (_cut(stones, frame, k) for k in range(len(stones.name)) if section), solid=True),
        layer("as-asked-for", [_asked(stones.told.profile, frame)]),
        layer("level", [line]),
        layer("dimensions", sizes),
        layer("sections", marks),
        layer("text", [_words(frame, STRIP + DIMENSION, name, words)]),
    ]
    return layer(name.lower().replace(" ", "-"), parts)


def _seen(stones: _Stones, frame: _Frame, which: Iterable[int], before: Relief | None = None) -> Relief:
    """What is seen of some stones, after what was there before; of a section, what lies behind it."""
    nearest = np.inf if frame.cut is None else -frame.cut * frame.paper.scale * frame.fine
    found = ((k, *facing(frame.pixels(stones.vertices[k]), stones.triangles[k])) for k in which)
    return relief(before or Relief.empty(*frame.shape), found, nearest)


def _image(stones: _Stones, seen: Relief, frame: _Frame, pale: Bools) -> str:
    """The shaded stones, some of them pale."""
    high, wide = frame.shape
    pixels = picture(seen, stones.size * frame.paper.scale * frame.fine, stones.tint, pale, _TINTS)
    return (
        f'<image x="{frame.left:.2f}" y="{frame.top:.2f}" width="{wide / frame.fine:.2f}"'
        f' height="{high / frame.fine:.2f}" preserveAspectRatio="none" href="{pixels}"/>'
    )


def _rims(stones: _Stones, seen: Relief, frame: _Frame, numbered: Collection[int]) -> str:
    """Outlines of what is seen of the stones, those that are numbered in ink, and their numbers."""
    rims = outlines(seen)
    paths = []
    for k in sorted(rims, key=lambda k: (k in numbered, stones.name[k] in stones.told.unsteady, k)):
        style = "" if k in numbered else PALE_RIM
        if k in numbered and stones.name[k] in stones.told.unsteady:
            style = f' fill="url(#{THICK})" stroke="{RED}" stroke-width="{2.0 * GRAIN:g}"'
        way = "".join(_way(ring / frame.fine) for ring in rims[k])
        paths.append(f'<path d="{way}"{style}><title>{escape(_told(stones, k))}</title></path>')
    room = places(seen) if numbered else {}
    labels = [
        _number(stones.number[k], frame.left + x / frame.fine, frame.top + y / frame.fine, far / frame.fine)
        for k, (x, y, far) in room.items()
        if k in numbered
    ]
    return (
        f'<g transform="translate({frame.left:.2f} {frame.top:.2f}) scale({1.0 / GRAIN:g})" fill="none"'
        f' pointer-events="all" stroke="{RIM}" stroke-width="{0.9 * GRAIN:g}" stroke-linejoin="round">'
        f"{''.join(paths)}</g>{_NUMBERS}{''.join(labels)}</g>"
    )


def _way(ring: Floats) -> str:
    """Path round points (k, 2) in drawing units, in steps of 1 / `GRAIN`."""
    at = np.rint(ring * GRAIN).astype(np.int64)
    step = np.diff(at, axis=0).tolist()
    return f"M{at[0, 0]} {at[0, 1]}l" + " ".join(f"{x} {y}" for x, y in step if x or y) + "z"


def _told(stones: _Stones, k: int) -> str:
    """A stone by its id and what it is for."""
    role = stones.told.role.get(stones.name[k])
    return stones.name[k] + (f", {role}" if role in ROLES else "")


def _number(words: str, x: float, y: float, room: float) -> str:
    """A stone's number where there is so much room (drawing units) all round; nothing where there is too little."""
    letters = min(MOST, 1.8 * room / max(len(words), 1.4) ** 0.5)
    return text(x, y + 0.35 * letters, words, f'font-size="{letters:.1f}"') if words and letters >= LEAST else ""


def _cut(stones: _Stones, frame: _Frame, k: int) -> str:
    """What a section cuts of one stone, with its number; nothing where it misses the stone."""
    point = stones.vertices[k]
    assert frame.cut is not None
    if not point[:, 0].min() < frame.cut < point[:, 0].max():
        return ""
    solid = solid_of(point[:, [1, 2, 0]], stones.triangles[k], stones.name[k])
    rings = [frame.paper.of(np.insert(ring, 0, frame.cut, axis=1)) for ring in cross_section(solid, frame.cut)]
    if not rings:
        return ""
    way = "".join(closed(ring, EXACT) for ring in rings)
    unsteady = stones.name[k] in stones.told.unsteady
    low, high = rings[0].min(axis=0), rings[0].max(axis=0)
    x, y = ((low + high) / 2.0).tolist()
    return (
        f'<path d="{way}" fill="{shaded(_TINTS[stones.tint[k]], CUT)}"><title>{escape(_told(stones, k))}</title></path>'
        f'<path d="{way}" fill="url(#{UNSTEADY if unsteady else SECTION})" stroke="{RED if unsteady else RIM}"'
        f' stroke-width="1.6" stroke-linejoin="round" pointer-events="none"/>'
        f"{_NUMBERS}{_number(stones.number[k], x, y, float(np.min(high - low)) / 3.0)}</g>"
    )


def _patterns() -> str:
    """Hatches of stones that are cut, and of those that do not stand by themselves; the same in every drawing."""
    red = "".join(hatch(name, -45, 1.2, colour=RED, scale=scale) for name, scale in ((UNSTEADY, 1.0), (THICK, GRAIN)))
    return f"<defs>{hatch(SECTION, 45, 1.0)}{red}</defs>"


def _ground(frame: _Frame) -> str:
    """A strip of ground; nothing on a plan."""
    if frame.side == "above":
        return ""
    left, wide = frame.left - BEYOND, frame.wide + 2.0 * BEYOND
    line = f'<path d="M{left:.1f} {frame.foot:.1f}h{wide:.1f}" stroke="{SOIL}" stroke-width="1.6"/>'
    return rect(left, frame.foot, wide, STRIP, f'fill="{GROUND}"') + line


def _asked(profile: Profile | None, frame: _Frame) -> str:
    """Lines of the wall that was asked for."""
    if profile is None:
        return ""
    ends = frame.paper.of(profile.edges()).round(EXACT)
    ends = np.unique(np.sort(ends.reshape(-1, 4).view("f8,f8"), axis=1).view(np.float64), axis=0).reshape(-1, 2, 2)
    return f'<path d="{segments(ends, EXACT)}" fill="none" {ASKED}/>'


def _level(seen: Relief, frame: _Frame) -> tuple[float, str]:
    """Mean height (m) of the top along the wall, above what is lowest, and a line there."""
    there = seen.stone >= 0
    top = float(there.argmax(axis=0)[there.any(axis=0)].mean()) / frame.fine
    y, left, right = frame.top + top, frame.left - BEYOND, frame.left + frame.wide + BEYOND
    line = (
        f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="{INK}" stroke-dasharray="10 4 2 4"/>'
        f'<path d="M{right:.1f} {y:.1f}l-5 -9h10z" fill="{PAPER}" stroke="{INK}"/>'
    )
    return (frame.high - top) / frame.paper.scale, line


def _dimension(x: float, long: float, y: float, scale: float) -> str:
    """A level line of a length (drawing units) with its ends marked, and what it measures."""
    ends = "".join(f"M{end:.{EXACT}f} {y - 6:.1f}v12m-4 -2l8 -8" for end in (x, x + long))
    way = f"M{x:.{EXACT}f} {y:.1f}h{long:.{EXACT}f}{ends}"
    return f'<path class="dimension" d="{way}" stroke="{SOFT}" stroke-width="0.9" fill="none"/>' + text(
        x + long / 2.0, y - 5.0, f"{number(long / scale)} m", f'text-anchor="middle" fill="{INK}"'
    )


def _mark(frame: _Frame, cut: float, letter: str) -> str:
    """Where a section is cut, and which way it is looked at."""
    low = float(frame.paper.low[0])
    x, top = frame.left + (cut - low) * frame.paper.scale, frame.top - 6.0
    foot = frame.foot + (0.0 if frame.side == "above" else STRIP) + 3.0
    return (
        f'<path d="M{x:.1f} {top:.1f}v-12M{x:.1f} {foot:.1f}v6" stroke="{INK}" stroke-width="1.6"/>'
        f'<path d="M{x:.1f} {top - 12:.1f}l9 4 -9 4z" fill="{INK}"/>'
        + text(x - 4.0, top - 2.0, letter, 'text-anchor="end" font-weight="600"')
    )


def _letter(cuts: Sequence[float], cut: float) -> str:
    """A, B, ..., and numbers beyond Z."""
    k = list(cuts).index(cut)
    return chr(ord("A") + k) if k < 26 else str(k + 1)


def _words(frame: _Frame, below: float, name: str, more: str) -> str:
    """What a picture shows, so far below it (drawing units)."""
    said = f'<tspan font-weight="600">{name}</tspan>' + (f'<tspan dx="8" fill="{SOFT}">{more}</tspan>' if more else "")
    return text(frame.left, frame.foot + below + 8.0, said)


def _foot(stones: _Stones, frame: _Frame, y: float, keys: bool) -> tuple[list[str], float]:
    """The scale at a height; what tints and lines mean, where there are such; and where that ends."""
    x, line, found = frame.left, y, [scale_bar(frame.left, y - 5.0, frame.paper.scale, BAR)]
    for mark, words in _keys(stones) if keys else ():
        wide = 34.0 + LETTER * len(words) + 20.0
        if line == y or x + wide > WIDTH:
            x, line = min(frame.left, MARGIN + DIMENSION), line + MARGIN
        found += legend("", [(mark, words)], [x], (0.0, line))
        x += wide
    return found, line + MARGIN


def _keys(stones: _Stones) -> Iterable[tuple[str, str]]:
    """What tints, hatches and dashes mean, of those that there are."""
    for role, tint in ROLES.items():
        if count := sum(stones.told.role.get(name) == role for name in stones.name):
            yield _swatch(tint, RIM), f"{role} ({count})"
    if stones.told.unsteady:
        yield _swatch(f"url(#{UNSTEADY})", RED), "does not stand by itself"
    if stones.told.profile is not None:
        yield f'<path d="M0 -5H26" {ASKED}/>', "as asked for"


def _swatch(fill: str, stroke: str) -> str:
    return rect(0.0, -12.0, 26.0, 14.0, f'fill="{fill}" stroke="{stroke}"')
