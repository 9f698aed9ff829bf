"""Lines of an SVG drawing: paths, lines, polylines, polygons, rectangles, circles and ellipses, with their transforms.

Coordinates are those of the outermost `viewBox`, in the unit that `width` gives it: with `width="300mm"` and a box 300
wide a unit is a millimetre; where the box has other numbers, lengths are brought to the unit of `width`. A drawing in
pixels, or without a width, does not say its units. The layer of a line is the label (Inkscape) or the id of the group
that it lies in, or what our own drawings call it (`data-layer`). Text, images, clones, and what is not displayed are
passed over.

Source: Scalable Vector Graphics 2, chapters 7 (transforms), 9 (paths) and B.2 (elliptical arcs).
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.geometry.curves import Curve, bezier, elliptic, straight
from cyclopean.io.files import decoded, one_line
from cyclopean.io.line_work import DrawnLine, Sheet

__all__ = ["Placed", "hex_digits", "placed", "read_svg_lines"]

SPACE = "{http://www.w3.org/2000/svg}"
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
VALUE, FLAG, GAP = re.compile(NUMBER), re.compile("[01]"), re.compile(r"[\s,]*")
LENGTH = re.compile(rf"\s*({NUMBER})\s*([a-z%]*)\s*", re.IGNORECASE)
ABSOLUTE = {"mm": "mm", "cm": "cm", "in": "in", "m": "m", "ft": "ft"}  # units of a width that are lengths of stones
HIDDEN = {"defs", "clippath", "mask", "pattern", "marker", "symbol", "style", "script", "metadata", "title", "desc"}
INHERITED = (
    "fill", "fill-opacity", "stroke", "stroke-dasharray", "stroke-linecap", "stroke-width", "color", "clip-path",
    "font-size", "font-weight", "text-anchor", "data-solid",
)  # fmt: skip
GROUPS = {"svg", "g", "a", "switch"}
TAKES = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}  # numbers of each command
DEEP = 200  # groups in groups; a drawing program needs a dozen


def read_svg_lines(path: str, data: bytes) -> Sheet:
    """Read the lines of an SVG drawing.

    Raises
    ------
    InputError
        It is no SVG, or damaged; one line that names the element.
    """
    text = decoded(path, data)
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: is no SVG drawing, or a damaged one ({one_line(str(error), 60)})") from None
    if root.tag not in (f"{SPACE}svg", "svg"):
        raise InputError(f"{path}: is XML, but no SVG drawing")
    unit, matrix = _unit(path, root)
    passed: Counter[str] = Counter()
    lines = tuple(_lines(path, root, matrix, passed))
    left = [f"{count} {one_line(kind, 20)}" for kind, count in passed.items()][:4]
    notes = (f"{path}: {', '.join(left)} passed over; only lines and outlines are read",) if left else ()
    return Sheet(lines, unit, notes, downwards=True)


def _unit(path: str, root: ElementTree.Element) -> tuple[str, Floats]:
    """Unit of the sheet, "" where it has none, and the map (2, 3) from coordinates to it."""
    found = LENGTH.fullmatch(root.get("width", ""))
    unit = ABSOLUTE.get(found[2].lower(), "") if found else ""
    box = [float(x) for x in re.findall(NUMBER, root.get("viewBox", ""))]
    if unit and found:
        if not (len(box) == 4 and box[2] > 0.0 and float(found[1]) > 0.0):
            # user units without a box are pixels, whatever the width says
            unit = ""
        elif not np.isclose(box[2], float(found[1]), rtol=1e-9, atol=0.0):
            return unit, np.eye(2, 3) * (float(found[1]) / box[2])
    return unit, np.eye(2, 3)


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """An element of a drawing that is displayed, and what it has from the groups that it lies in."""

    kind: str
    element: ElementTree.Element
    where: str  # file and element, for what is said of it
    matrix: Floats  # (2, 3) from its coordinates to those of the sheet
    layer: str
    style: Mapping[str, str]  # presentation attributes, its own before those of groups

    def lines(self) -> Iterator[DrawnLine]:
        """Its lines on the sheet; none where it is no shape."""
        if self.kind in SHAPES:
            for pieces, closed in SHAPES[self.kind](self.where, self.element):
                if pieces:
                    yield DrawnLine(tuple(_moved(piece, self.matrix) for piece in pieces), self.layer, closed)

    def point(self, *names: str) -> tuple[float, float]:
        """Where the point of these attributes is on the sheet."""
        at = np.array([float(self.element.get(name, "0")) for name in names])
        x, y = (self.matrix[:, :2] @ at + self.matrix[:, 2]).tolist()
        return x, y

    @property
    def larger(self) -> float:
        """How many times larger it is on the sheet."""
        return float(np.sqrt(abs(np.linalg.det(self.matrix[:, :2]))))


def placed(path: str, root: ElementTree.Element, matrix: Floats) -> Iterator[Placed]:
    """Elements below one whose map to the sheet is `matrix` (2, 3), in their order, without groups and what is hidden.

    Raises
    ------
    InputError
        A transform that is none, or groups within each other without end; one line that names the element.
    """
    stack: list[tuple[ElementTree.Element, Floats, str, Mapping[str, str], int]] = [(root, matrix, "", {}, 0)]
    while stack:
        element, outer, layer, style, depth = stack.pop()
        kind = str(element.tag).removeprefix(SPACE).lower() if isinstance(element.tag, str) else ""
        css = element.get("style", "").replace(" ", "")
        if kind in HIDDEN or "display:none" in css or element.get("display") == "none" or "{" in kind or not kind:
            continue
        if depth > DEEP:
            raise InputError(f"{path}: has more than {DEEP} groups within each other; ungroup them")
        where = f"{path}: <{kind}{' ' + one_line(repr(element.get('id')), 30) if element.get('id') else ''}>"
        here = _after(outer, _transform(where, element.get("transform", "")))
        own = {name: value for name in INHERITED if (value := element.get(name)) is not None}
        style = {**style, **own} if own else style
        name = element.get("data-layer") or (element.get(LABEL) or element.get("id") if kind == "g" else "")
        layer = name or layer
        if kind in GROUPS:
            stack += [(child, here, layer, style, depth + 1) for child in reversed(element)]
        else:
            yield Placed(kind, element, where, here, layer, style)


def _lines(path: str, root: ElementTree.Element, matrix: Floats, passed: Counter[str]) -> Iterator[DrawnLine]:
    """Lines of an element and all within it, in their order."""
    for one in placed(path, root, matrix):
        if one.kind not in SHAPES:
            passed[one.kind] += 1
        yield from one.lines()


def hex_digits(colour: str) -> str:
    """The six digits of a colour; "" of one that is not written in them."""
    digits = colour[1:] if re.fullmatch(r"#(?:[0-9a-f]{3}){1,2}", colour) else ""
    return digits if len(digits) == 6 else "".join(2 * digit for digit in digits)


def _moved(piece: Curve, matrix: Floats) -> Curve:
    """A curve under a map (2, 3); deviations are those of the image."""
    larger = float(np.linalg.norm(matrix[:, :2], 2)) or 1.0
    return Curve(lambda far: piece.corners(far / larger) @ matrix[:, :2].T + matrix[:, 2], piece.bent)


def _after(outer: Floats, inner: Floats) -> Floats:
    """The map (2, 3) that is first the inner, then the outer one."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def _transform(where: str, text: str) -> Floats:
    """The map (2, 3) that an attribute `transform` says."""
    made = np.eye(2, 3)
    rest = re.sub(r"(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^)]*)\)", "", text)
    if rest.strip(" ,\t\r\n"):
        raise InputError(
            f"{where}: its transform '{one_line(text, 40)}' is not one of SVG; save the drawing as plain SVG"
        )
    for name, inner in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        made = _after(made, _simple(where, name, [float(x) for x in re.findall(NUMBER, inner)]))
    return made


def _simple(where: str, name: str, given: list[float]) -> Floats:
    """One of the maps of a transform, (2, 3)."""
    count = len(given)
    if name == "matrix" and count == 6:
        return np.array(given).reshape(3, 2).T
    if name == "translate" and count in (1, 2):
        return np.array([[1.0, 0.0, given[0]], [0.0, 1.0, given[1] if count == 2 else 0.0]])
    if name == "scale" and count in (1, 2):
        return np.array([[given[0], 0.0, 0.0], [0.0, given[-1], 0.0]])
    if name == "rotate" and count in (1, 3):
        sin, cos = np.sin(np.radians(given[0])), np.cos(np.radians(given[0]))
        about = np.array(given[1:] or [0.0, 0.0])
        turn = np.array([[cos, -sin], [sin, cos]])
        return np.column_stack([turn, about - turn @ about])
    if name in ("skewX", "skewY") and count == 1:
        lean = np.eye(2, 3)
        lean[(0, 1) if name == "skewX" else (1, 0)] = np.tan(np.radians(given[0]))
        return lean
    raise InputError(f"{where}: its transform '{name}' has {count} numbers; save the drawing as plain SVG")


Shape = Iterator[tuple[list[Curve], bool]]  # pieces of each line, and whether it is closed


def _numbers(where: str, element: ElementTree.Element, *names: str) -> list[float]:
    given = []
    for name in names:
        found = LENGTH.fullmatch(element.get(name, "0"))
        if found is None or found[2] not in ("", "px"):
            raise InputError(
                f"{where}: {name} '{one_line(element.get(name, ''), 20)}' is not a number; save it as plain SVG"
            )
        given.append(float(found[1]))
    return given


def _line(where: str, element: ElementTree.Element) -> Shape:
    yield [straight(np.array(_numbers(where, element, "x1", "y1", "x2", "y2")).reshape(2, 2))], False


def _polyline(where: str, element: ElementTree.Element) -> Shape:
    given = [float(x) for x in re.findall(NUMBER, element.get("points", ""))]
    if len(given) % 2:
        raise InputError(f"{where}: has {len(given)} coordinates, an odd number; draw it again")
    if len(given) >= 4:
        yield [straight(np.array(given).reshape(-1, 2))], str(element.tag).endswith("polygon")


def _rectangle(where: str, element: ElementTree.Element) -> Shape:
    x, y, wide, high, rx, ry = _numbers(where, element, "x", "y", "width", "height", "rx", "ry")
    if not (wide > 0.0 and high > 0.0):
        return
    rx, ry = min(rx or ry, wide / 2.0), min(ry or rx, high / 2.0)
    if not rx:
        yield [straight(np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high]]))], True
        return
    pieces: list[Curve] = []
    for k, (u, v) in enumerate(((wide, 0.0), (wide, high), (0.0, high), (0.0, 0.0))):
        centre = np.array([x + (u - rx if u else rx), y + (v - ry if v else ry)])
        pieces.append(_arc(centre, rx, ry, 0.0, (k - 1) * np.pi / 2.0, k * np.pi / 2.0))
    ends = [piece.corners(np.inf)[[0, -1]] for piece in pieces]
    joined = [straight(np.stack([one[1], other[0]])) for one, other in zip(ends, ends[1:] + ends[:1], strict=True)]
    yield [piece for pair in zip(pieces, joined, strict=True) for piece in pair], True


def _ellipse(where: str, element: ElementTree.Element) -> Shape:
    x, y = _numbers(where, element, "cx", "cy")
    round_ = element.get("r") is not None
    rx, ry = _numbers(where, element, *(("r", "r") if round_ else ("rx", "ry")))
    if rx > 0.0 and ry > 0.0:
        yield [_arc(np.array([x, y]), rx, ry, 0.0, 0.0, 2.0 * np.pi)], True


def _arc(centre: Floats, rx: float, ry: float, turn: float, start: float, end: float) -> Curve:
    """Arc of an ellipse that is turned by an angle (rad)."""
    sin, cos = np.sin(turn), np.cos(turn)
    return elliptic(centre, rx * np.array([cos, sin]), ry * np.array([-sin, cos]), start, end)


def _path(where: str, element: ElementTree.Element) -> Shape:
    """Subpaths of a path, each a line."""
    at = start = np.zeros(2)
    pieces: list[Curve] = []
    last, handle = "", at
    for letter, given in _commands(where, element.get("d", "")):
        kind = letter.upper()
        base = at if letter.islower() else np.zeros(2)
        if kind in "MZ":
            if kind == "Z" and pieces and np.any(at != start):
                pieces.append(straight(np.stack([at, start])))
            if pieces:
                yield pieces, kind == "Z"
            at = start = base + given if kind == "M" else start
            pieces, last = [], kind
            continue
        if kind in "HV":
            along, to = "HV".index(kind), at.copy()
            to[along] = given[0] + base[along]
            piece, handle = straight(np.stack([at, to])), to
        elif kind == "A":
            to = base + given[5:]
            piece, handle = _elliptical(at, to, given), to
        else:
            control = base + given.reshape(-1, 2)
            if kind in "ST":  # the first handle is the mirror image of the last one, if there was any
                mirrored = 2.0 * at - handle if last in ("CS" if kind == "S" else "QT") else at
                control = np.concatenate([[mirrored], control])
            to = control[-1]
            piece = straight(np.stack([at, to])) if kind == "L" else bezier(np.concatenate([[at], control]))
            handle = control[-2] if len(control) > 1 else to
        if kind == "A" or np.any(to != at) or kind in "CSQT":
            pieces.append(piece)
        at, last = to, kind
    if pieces:
        yield pieces, bool(np.all(at == start))


def _commands(where: str, text: str) -> Iterator[tuple[str, Floats]]:
    """Commands of a path and the numbers of each; one that goes on without its letter is repeated."""
    at, letter, begun = _past(text, 0), "", False
    while at < len(text):
        if text[at].isalpha():
            letter = text[at]
            at += 1
            if letter.upper() not in TAKES or not (begun or letter.upper() == "M"):
                raise InputError(f"{where}: its path has a wrong command '{letter}'; save it as plain SVG")
        given, begun, count = [], True, TAKES.get(letter.upper(), 0)
        for k in range(count):
            at = _past(text, at)
            found = (FLAG if count == 7 and k in (3, 4) else VALUE).match(text, at)
            given.append(found)
            at = found.end() if found else at
        if None in given or not letter:
            raise InputError(
                f"{where}: its path breaks off at '{one_line(text[max(at - 20, 0) : at + 10])}'; draw it again"
            )
        yield letter, np.array([float(found[0]) for found in given if found])
        letter = {"M": "L", "m": "l", "Z": "", "z": ""}.get(letter, letter)
        at = _past(text, at)


def _past(text: str, at: int) -> int:
    """The first place that is neither space nor comma."""
    found = GAP.match(text, at)
    return found.end() if found else at


def _elliptical(start: Floats, end: Floats, given: Floats) -> Curve:
    """Arc between two points: radii, turn (degrees), whether it is the larger one, and clockwise on the sheet."""
    (rx, ry), turn = np.abs(given[:2]), np.radians(given[2])
    if not (rx > 0.0 and ry > 0.0) or np.all(start == end):
        return straight(np.stack([start, end]))
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])  # rows: the axes of the ellipse
    half = axes @ (start - end) / 2.0 / (rx, ry)  # on the unit circle
    length = float(np.hypot(*half))
    rx, ry, half = (rx * length, ry * length, half / length) if length > 1.0 else (rx, ry, half)
    off = np.sqrt(max(1.0 / float(half @ half) - 1.0, 0.0)) * (-1.0 if given[3] == given[4] else 1.0)
    centre = off * np.array([half[1], -half[0]])
    first = np.arctan2(*(half - centre)[::-1])
    sweep = np.arctan2(*(-half - centre)[::-1]) - first
    sweep = sweep % (2.0 * np.pi) if given[4] else -(-sweep % (2.0 * np.pi))
    middle = (start + end) / 2.0 + axes.T @ (centre * (rx, ry))
    arc = _arc(middle, float(rx), float(ry), float(turn), float(first), float(first + sweep))
    return Curve(lambda far: np.concatenate([start[None], arc.corners(far)[1:-1], end[None]]))


SHAPES = {
    "line": _line, "polyline": _polyline, "polygon": _polyline, "rect": _rectangle, "circle": _ellipse,
    "ellipse": _ellipse, "path": _path,
}  # fmt: skip
