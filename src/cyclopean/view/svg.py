"""The drawing kit: views, paper, shapes, scale bars, legends; every picture that is written as SVG is made of these.

Points (..., 2) of a drawing are in its own units, y down; a sheet is `WIDTH` of them wide unless it says otherwise.

A drawing that is to scale says so (`to_scale`) and puts its parts on layers by name (`layer`). In a page neither is
seen. Written as a file it is as large as what it shows (`true_size`); `io.dxf_text` makes a DXF file of it.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.view.colours import HATCH, INK, LINE, SOFT
from cyclopean.view.figures import number

WIDTH = 1000.0  # drawing units
PAPER = "#ffffff"
EXACT = 4  # decimals of what may be measured: within a thousandth of a millimetre where the sheet is 10 m wide
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A parallel view onto an upright plane; oblique where depth is drawn aslant."""

    right: Floats  # (3,) unit: to the right of the drawing
    into: Floats  # (3,) unit: away from the viewer, where the view is not oblique
    up: Floats = field(default_factory=_UP.copy)  # (3,) unit
    slant: tuple[float, float] = (0.0, 0.0)  # where a metre of depth goes, m: right, up

    @property
    def sight(self) -> Floats:
        """(3,) unit: away from the viewer."""
        line = self.into - self.slant[0] * self.right - self.slant[1] * self.up
        return np.asarray(line / np.linalg.norm(line))


def front_view(point: Floats) -> View:
    """Look where points (k, 3) are least deep, to a degree; along +y, with x to the right, unless another is better."""
    angle = np.radians(np.arange(180.0))
    if not len(point):
        return View(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    flat = point[:, :2] - point[0, :2]
    depth = np.array([np.ptp(flat @ [-np.sin(t), np.cos(t)]) for t in angle])
    best = int(np.argmin(depth)) if depth.min() < 0.99 * depth[0] else 0
    c, s = np.cos(angle[best]), np.sin(angle[best])
    return View(np.array([c, s, 0.0]), np.array([-s, c, 0.0]))


def project(point: Floats, view: View) -> tuple[Floats, Floats]:
    """(..., 2) right and up, and (...,) depth away from the viewer, all in m.

    Examples
    --------
    >>> front = front_view(np.zeros((0, 3)))
    >>> flat, depth = project(np.array([1.0, 2.0, 3.0]), front)
    >>> flat.tolist(), float(depth)
    ([1.0, 3.0], 2.0)
    """
    right, up = (axis + part * view.into for axis, part in zip((view.right, view.up), view.slant, strict=True))
    return np.stack([point @ right, point @ up], -1), np.asarray(point @ view.sight)


@dataclass(frozen=True, slots=True, eq=False)
class Paper:
    """A view at a scale on a sheet: from metres to drawing units."""

    view: View
    low: Floats  # (2,) m, right and up: what lies at `foot`
    foot: Floats  # (2,) drawing units
    scale: float  # drawing units a metre
    width: float = WIDTH
    height: float = 0.0

    def of(self, point: Floats) -> Floats:
        """(..., 2) drawing units of points (..., 3) in m."""
        return self.of_flat(project(point, self.view)[0])

    def of_flat(self, flat: Floats) -> Floats:
        """(..., 2) drawing units of what lies so far right and up, (..., 2) m."""
        return np.asarray(self.foot + (flat - self.low) * [self.scale, -self.scale])

    def way(self, move: Floats) -> Floats:
        """(2,) drawing units that a shift (3,) in m amounts to."""
        return np.asarray(self.of(move) - self.of(np.zeros(3)))


def fitted(
    view: View, point: Floats, tallest: float, margins: tuple[float, float, float, float], *, wide: bool = False
) -> Paper:
    """The largest scale at which points (k, 3) in m, at least one, fit onto a sheet.

    They may be `tallest` drawing units high; `margins` are those at the left, top, right and bottom. A `wide` sheet
    keeps its full width where they are high and narrow: they stand in its middle then.
    """
    left, top, right, bottom = margins
    flat = project(point, view)[0]
    low, span = flat.min(axis=0), np.ptp(flat, axis=0)
    span = np.maximum(span, 1e-9 * max(float(span.max()), 1e-300))
    room = WIDTH - left - right
    scale = float(min(room / span[0], tallest / span[1]))
    across, high = (span * scale).tolist()
    spare = room - across if wide else 0.0
    foot = np.array([left + spare / 2.0, top + high])
    return Paper(view, low, foot, scale, left + across + spare + right, top + high + bottom)


def sheet(
    size: tuple[float, float],
    title: str,
    parts: Iterable[str],
    *,
    letters: float = 0.0,
    white: bool = True,
    more: str = "",
) -> str:
    """A whole drawing of (width, height) units as one `<svg>` element: static, nothing that is loaded.

    The title, escaped here, is for readers that do not see it. `parts` are painted in order. `letters` is the size of
    what is written; 0 where nothing is. `more` holds further attributes.
    """
    font = f' font-family="sans-serif" font-size="{letters:g}" fill="{INK}"' if letters else ""
    wide, high = (f"{length:.0f}" for length in size)
    paper = layer("paper", [f'<rect width="{wide}" height="{high}" fill="{PAPER}"/>']) if white else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" role="img"{font}{more}>'
        f"<title>{escape(title)}</title>{paper}{''.join(parts)}</svg>"
    )


def layer(name: str, parts: Iterable[str], *, solid: bool = False) -> str:
    """Parts of a drawing on a layer; nothing where there are none.

    What lies under a `solid` part, on this layer or on another one that is solid too, is hidden by it: on the sheet by
    its paint, in CAD by leaving it out.
    """
    drawn, hides = "".join(parts), ' data-solid="1"' if solid else ""
    return f'<g data-layer="{name}"{hides}>{drawn}</g>' if drawn else ""


def to_scale(scale: float, foot: Floats | tuple[float, float]) -> str:
    """Attributes of a sheet: its scale, drawing units a metre, and the point (2,) of it from which CAD measures."""
    x, y = foot
    return f' data-units-per-metre="{float(scale)!r}" data-origin="{x:.{EXACT}f} {y:.{EXACT}f}"'


def true_size(drawing: str) -> str:
    """A drawing as it is written to a file: a millimetre of what it shows is one of the sheet, layers as Inkscape's.

    One that is not to scale stays as it is.

    Examples
    --------
    >>> file = true_size(sheet((500.0, 300.0), "2 m of wall", [layer("stones", ["..."])], more=to_scale(250.0, (0, 0))))
    >>> file.split(" viewBox")[1].partition('width="')[2].partition(" data")[0]
    '2000mm" height="1200mm"'
    >>> file[file.index('<g id="stones"') :]
    '<g id="stones" inkscape:groupmode="layer" inkscape:label="stones">...</g></svg>'
    """
    scale = re.search(r' data-units-per-metre="([^"]+)"', drawing)
    size = re.search(r'viewBox="0 0 (\d+) (\d+)"', drawing)
    if scale is None or size is None:
        return drawing
    wide, high = (f"{float(side) * 1000.0 / float(scale[1]):.12g}mm" for side in size.groups())
    root = f' xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" width="{wide}" height="{high}"'
    seen: Counter[str] = Counter()

    def named(found: re.Match[str]) -> str:
        """A layer of Inkscape, and by its id of other programs; names may come again, ids may not."""
        name = found[1]
        seen[name] += 1
        number = f"-{seen[name]}" if seen[name] > 1 else ""
        return f'<g id="{name}{number}" inkscape:groupmode="layer" inkscape:label="{name}"'

    return re.sub(r'<g data-layer="([^"]+)"( data-solid="1")?', named, drawing).replace(scale[0], root + scale[0], 1)


def open_path(points: Floats, digits: int = 1) -> str:
    """Path through points (k, 2)."""
    return "M" + "L".join(f"{x:.{digits}f} {y:.{digits}f}" for x, y in points.tolist())


def closed(points: Floats, digits: int = 1) -> str:
    """Path round a polygon (k, 2)."""
    return f"{open_path(points, digits)}Z"


def segments(ends: Floats, digits: int = 1) -> str:
    """Path of line segments (e, 2, 2)."""
    return "".join(open_path(pair, digits) for pair in ends)


def rect(x: float, y: float, width: float, height: float, style: str, digits: int = 1) -> str:
    """A rectangle with such attributes."""
    at, size = f'x="{x:.{digits}f}" y="{y:.{digits}f}"', f'width="{width:.{digits}f}" height="{height:.{digits}f}"'
    return f"<rect {at} {size} {style}/>"


def text(x: float, y: float, words: str, style: str = "") -> str:
    """Words, already escaped, that begin at a point unless the attributes say otherwise."""
    return f'<text x="{x:.1f}" y="{y:.1f}"{style and " " + style}>{words}</text>'


def hatch(
    name: str = "hatch", turn: int = 45, width: float = 3.0, back: str = "", colour: str = HATCH, scale: float = 1.0
) -> str:
    """A pattern of lines, in the colour of supports unless another is given, to be filled with by its name."""
    larger = "" if scale == 1.0 else f" scale({scale:g})"
    return (
        f'<pattern id="{name}" width="7" height="7" patternUnits="userSpaceOnUse"'
        f' patternTransform="rotate({turn}){larger}">'
        f'{back}<path d="M0 0V7" stroke="{colour}" stroke-width="{width:g}"/></pattern>'
    )


def grain() -> str:
    """The filter `grain`: the surface of stone in low light, for the pages' style sheet to lay over what is drawn."""
    return (
        '<filter id="grain" x="0" y="0" width="100%" height="100%"><feTurbulence type="fractalNoise"'
        ' baseFrequency=".09" numOctaves="4" seed="7"/><feDiffuseLighting surfaceScale="1.4" diffuseConstant="1.15"'
        ' lighting-color="#fff"><feDistantLight azimuth="235" elevation="60"/></feDiffuseLighting><feComposite in2='
        '"SourceGraphic" operator="arithmetic" k1="1"/><feComposite in2="SourceGraphic" operator="in"/></filter>'
    )


def round_length(most: float) -> tuple[float, str]:
    """The largest length (m) of 1, 2 or 5 times a power of ten that is not above this one, and its name.

    Examples
    --------
    >>> round_length(0.3), round_length(70.0)
    ((0.2, '200 mm'), (50.0, '50 m'))
    """
    power = 10.0 ** np.floor(np.log10(most))
    length = float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= most * (1.0 + 1e-9)))
    return length, f"{number(length)} m" if length >= 1.0 else f"{number(1000.0 * length)} mm"


def scale_bar(x: float, y: float, scale: float, room: float) -> str:
    """A bar of a round length, at most `room` drawing units, that begins at a point, and its name behind it."""
    length, name = round_length(room / scale)
    right = x + length * scale
    way = f"M{x:.1f} {y - 5:.1f}v10m0-5h{length * scale:.{EXACT}f}m0-5v10"
    bar = f'<path d="{way}" stroke="{SOFT}" stroke-width="1.5" fill="none"/>'
    return layer("scale", [bar, text(right + 10.0, y + 5.0, name, f'fill="{SOFT}"')])


def legend(lead: str, marks: Sequence[tuple[str, str]], columns: Sequence[float], at: tuple[float, float]) -> list[str]:
    """One line from a point (x, y): words in bold, then small drawings, about 25 units wide, each with what it means.

    `columns` says where each of `marks`, (drawing, text), begins.
    """
    found = [text(*at, lead, 'font-weight="600"')] if lead else []
    for x, (mark, words) in zip(columns, marks, strict=True):
        found.append(f'<g transform="translate({x:.1f} {at[1]:.1f})">{mark}<text x="34" y="0">{words}</text></g>')
    return found


def grid(
    left: float, wide: float, levels: Iterable[tuple[float, str]], ticks: Iterable[tuple[float, str]], foot: float
) -> str:
    """Lines of a chart, (y, label), `wide` units long from `left`; below, at `foot`, labels of ticks, (x, label)."""
    lines = "".join(
        f'<path d="M{left:g} {y:.1f}h{wide:g}" stroke="{LINE}"/>'
        + text(left - 6.0, y + 4.0, label, f'text-anchor="end" fill="{SOFT}"')
        for y, label in levels
    )
    return lines + "".join(text(x, foot, label, f'text-anchor="middle" fill="{SOFT}"') for x, label in ticks)
