"""A static elevation as SVG: the picture in print, and where there is no WebGL.

Orthographic, upright axis z, seen along the horizontal direction in which the model is least deep. Faces that look away
are dropped, the rest are painted from the furthest to the nearest. A drawing of blocks that are moved, when it is not
too large, shows the way there at a click: SVG's own animation, without a script.
"""

from dataclasses import dataclass
from html import escape

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry import face_normals
from cyclopean.geometry.polygon import convex_hull
from cyclopean.view.colours import FORCE, GHOST, GRAVITY, HATCH, HELD, INK, PULL, RUB, THRUST, fill, shaded
from cyclopean.view.drawing import Picture
from cyclopean.view.figures import number

__all__ = ["View", "animated", "elevation_svg", "front_view", "project"]

WIDTH, HEIGHT, MARGIN = 1000.0, 640.0, 40.0
FACE_LIMIT = 20_000  # faces painted one by one; beyond it one silhouette a block
ARROW_LIMIT = 1_000
POINT_LIMIT = 5_000
ANIMATED_FACES = 1_500  # beyond it the two shapes of every face would make the page heavy


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """An orthographic view onto an upright plane."""

    right: Floats  # (3,) unit, horizontal: to the right of the drawing
    into: Floats  # (3,) unit, horizontal: away from the viewer


def front_view(point: Floats) -> View:
    """Look where the model is least deep, to a degree; along +y, with x to the right, unless another is better."""
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
    return np.stack([point @ view.right, point[..., 2]], -1), np.asarray(point @ view.into)


@dataclass(frozen=True, slots=True)
class _Paper:
    """From metres to drawing units; y runs down."""

    left: float
    top: float
    scale: float
    width: float
    height: float

    def of(self, flat: Floats) -> Floats:
        return np.stack([(flat[..., 0] - self.left) * self.scale, (self.top - flat[..., 1]) * self.scale], -1)


def elevation_svg(drawn: Picture, title: str, *, bare: bool = False) -> str:
    """Draw the picture as one `<svg>` element; `bare` leaves out arrows, scale and gravity, for a thumbnail."""
    view = front_view(drawn.mesh.vertex)
    paper = _paper(drawn, view)
    moves = not bare and animated(drawn)
    parts = [*_polygons(drawn, view, paper, moves)]
    if not bare:
        parts.append(_ghost(drawn, view, paper))
        parts.append(_thrust(drawn.thrust, view, paper))
        parts += _arrows(drawn.arrow, view, paper, FORCE)
        parts.append(_dots(drawn.press, np.full(len(drawn.press), 4.0), view, paper, FORCE))
        parts += _arrows(drawn.rub, view, paper, RUB)
        parts.append(_dots(drawn.pull, 4.0 + 9.0 * np.sqrt(drawn.pull_share), view, paper, PULL))
        parts += [*_gravity(drawn, view, paper), *_scale_bar(paper)]
    name = ' id="moving"' if moves else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {paper.width:.0f} {paper.height:.0f}" role="img"{name}>'
        f"<title>{escape(title)}</title>{_HATCH}{''.join(parts)}</svg>"
    )


def animated(drawn: Picture) -> bool:
    """Whether the elevation shows the motion at a click."""
    return drawn.rest is not None and len(drawn.mesh.corner_start) - 1 <= ANIMATED_FACES


_HATCH = (
    '<defs><pattern id="hatch" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    f'<path d="M0 0V7" stroke="{HATCH}" stroke-width="3"/></pattern></defs>'
)


def _paper(drawn: Picture, view: View) -> _Paper:
    """Fit everything shown into the sheet."""
    seen = np.concatenate([drawn.mesh.vertex, drawn.ghost.reshape(-1, 3)])
    if not len(seen):
        return _Paper(0.0, 0.0, 1.0, WIDTH, 120.0)
    flat, _ = project(seen, view)
    low, high = flat.min(axis=0), flat.max(axis=0)
    span = np.maximum(high - low, 1e-9 * max(float(np.max(high - low)), 1e-300))
    side, foot = 2.6 * MARGIN, MARGIN + 44.0  # room for gravity at the right, for the scale below
    scale = float(min((WIDTH - MARGIN - side) / span[0], (HEIGHT - MARGIN - foot) / span[1]))
    return _Paper(
        float(low[0]) - MARGIN / scale,
        float(high[1]) + MARGIN / scale,
        scale,
        float(span[0]) * scale + MARGIN + side,
        float(span[1]) * scale + MARGIN + foot,
    )


def _path(points: Floats) -> str:
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points.tolist()) + "Z"


def _polygons(drawn: Picture, view: View, paper: _Paper, moves: bool) -> list[str]:
    mesh = drawn.mesh
    if len(mesh.corner_start) - 1 > FACE_LIMIT:
        return _silhouettes(drawn, view, paper)
    flat, depth = project(mesh.vertex, view)
    sheet = paper.of(flat)
    normal = face_normals(mesh)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    facing = -(normal @ view.into)
    starts = mesh.corner_start[:-1]
    far = np.add.reduceat(depth[mesh.corner], starts) / np.diff(mesh.corner_start) if len(starts) else np.zeros(0)
    light = np.clip(0.86 + 0.14 * facing + 0.08 * normal[:, 2] - 0.04 * (normal @ view.right), 0.0, 1.0)
    body = mesh.face_body
    before = paper.of(project(drawn.rest, view)[0]) if moves and drawn.rest is not None else None
    painted = []
    for f in _painting_order(far, facing):
        corner = mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]]
        outline = _path(sheet[corner])
        way = "" if before is None or drawn.group[body[f]] == HELD else _way(_path(before[corner]), outline)
        painted.append(_paint(outline, int(drawn.group[body[f]]), float(light[f]), bool(len(drawn.edge)), way))
    return [f'<g stroke="{INK}" stroke-width="0.9" stroke-linejoin="round">', *painted, "</g>"]


def _painting_order(far: Floats, facing: Floats) -> Ints:
    """Faces that look at the viewer, the furthest first."""
    seen = np.flatnonzero(facing > 1e-6)
    return np.asarray(seen[np.argsort(-far[seen], kind="stable")])


def _way(rest: str, there: str) -> str:
    """From rest to where it is drawn, twice, at a click on the drawing."""
    return (
        f'<animate attributeName="d" begin="moving.click" dur="2.4s" repeatCount="2"'
        f' values="{rest};{rest};{there};{there}" keyTimes="0;.15;.75;1"/>'
    )


def _paint(outline: str, group: int, light: float, edged: bool, way: str = "") -> str:
    """One polygon; supports get a hatch over their colour, unedged faces a hairline of their own colour."""
    colour = shaded(fill(group), light)
    edge = "" if edged else f' stroke="{colour}"'
    hatch = f'<path d="{outline}" fill="url(#hatch)" stroke="none"/>' if group == HELD else ""
    end = f">{way}</path>" if way else "/>"
    return f'<path d="{outline}" fill="{colour}"{edge}{end}{hatch}'


def _silhouettes(drawn: Picture, view: View, paper: _Paper) -> list[str]:
    """One convex outline a block, the furthest first: for models with very many faces."""
    mesh = drawn.mesh
    flat, depth = project(mesh.vertex, view)
    middle = np.bincount(mesh.vertex_body, depth, len(mesh)) / np.maximum(np.diff(mesh.vertex_start), 1)
    sheet = paper.of(flat)
    painted = []
    for i in np.argsort(-middle, kind="stable"):
        outline = convex_hull(sheet[mesh.vertex_start[i] : mesh.vertex_start[i + 1]])
        painted.append(_paint(_path(outline), int(drawn.group[i]), 0.95, True))
    return [f'<g stroke="{INK}" stroke-width="0.5" stroke-linejoin="round">', *painted, "</g>"]


def _ghost(drawn: Picture, view: View, paper: _Paper) -> str:
    """Where the model stands, dashed, over the moved one."""
    if not len(drawn.ghost):
        return ""
    ends = paper.of(project(drawn.ghost, view)[0])
    lines = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in np.unique(ends.round(1), axis=0).tolist())
    return f'<path d="{lines}" fill="none" stroke="{GHOST}" stroke-width="1.1" stroke-dasharray="5 4"/>'


def _thrust(thrust: Floats, view: View, paper: _Paper) -> str:
    """The line of thrust: a white halo and a broad line."""
    if not len(thrust):
        return ""
    ends = paper.of(project(thrust, view)[0])
    path = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in ends.tolist())
    style = 'fill="none" stroke-linecap="round"'
    return (
        f'<path class="thrust" d="{path}" {style} stroke="#fff" stroke-width="6" stroke-opacity="0.7"/>'
        f'<path d="{path}" {style} stroke="{THRUST}" stroke-width="3.5"/>'
    )


def _arrows(arrow: Floats, view: View, paper: _Paper, colour: str) -> list[str]:
    """Forces: a white halo, the shaft, the head."""
    ends = paper.of(project(arrow[:ARROW_LIMIT], view)[0])
    shafts = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in ends.tolist())
    if not shafts:
        return []
    heads = "".join(_head(tail, tip, 9.0) for tail, tip in ends)
    return [
        f'<path d="{shafts}" stroke="#fff" stroke-width="4" stroke-opacity="0.7" fill="none"/>',
        f'<path d="{shafts}" stroke="{colour}" stroke-width="2" fill="none"/><path d="{heads}" fill="{colour}"/>',
    ]


def _dots(point: Floats, radius: Floats, view: View, paper: _Paper, colour: str) -> str:
    """Contact points, with a white rim; those that fall together on the sheet are drawn once, as the largest."""
    if not len(point):
        return ""
    at = paper.of(project(point[:POINT_LIMIT], view)[0]).round(1)
    drawn: dict[tuple[float, float], float] = {}
    for (x, y), r in zip(at.tolist(), radius.tolist(), strict=False):
        drawn[x, y] = max(r, drawn.get((x, y), 0.0))
    circles = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>' for (x, y), r in drawn.items())
    return f'<g fill="{colour}" stroke="#fff" stroke-width="1.2">{circles}</g>'


def _head(tail: Floats, tip: Floats, length: float) -> str:
    """A slim triangle at the tip, no longer than 60 % of the arrow."""
    along = tip - tail
    size = float(np.hypot(*along))
    if not (size > 0.05):
        return ""
    along = along / size
    across = np.array([-along[1], along[0]])
    reach = min(length, 0.6 * size)
    back = tip - reach * along
    return _path(np.stack([tip, back + 0.36 * reach * across, back - 0.36 * reach * across]))


def _gravity(drawn: Picture, view: View, paper: _Paper) -> list[str]:
    flat, _ = project(drawn.gravity, view)
    size = float(np.linalg.norm(drawn.gravity))
    if not (size > 0.0):
        return []
    down = 70.0 * np.array([flat[0], -flat[1]]) / size
    middle = np.array([paper.width - 44.0, paper.height / 2.0 - 30.0])
    tail, tip = middle - down / 2.0, middle + down / 2.0
    return [
        f'<path d="M{tail[0]:.1f} {tail[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}" stroke="{GRAVITY}" stroke-width="2.4"/>',
        f'<path d="{_head(tail, tip, 15.0)}" fill="{GRAVITY}"/>',
        f'<text x="{middle[0] + 14:.1f}" y="{middle[1] + 5:.1f}" font-size="17" font-style="italic" fill="{GRAVITY}">'
        "g</text>",
    ]


def _scale_bar(paper: _Paper) -> list[str]:
    """A bar of 1, 2 or 5 times a power of ten metres, about a fifth of the drawing."""
    wish = 0.22 * (paper.width - 2 * MARGIN) / paper.scale
    power = 10.0 ** np.floor(np.log10(wish))
    length = power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wish * (1 + 1e-9))
    right, y = MARGIN + length * paper.scale, paper.height - 34.0
    name = f"{number(length)} m" if length >= 1.0 else f"{number(1000.0 * length)} mm"
    return [
        f'<path d="M{MARGIN:.1f} {y - 5:.1f}V{y + 5:.1f}M{MARGIN:.1f} {y:.1f}H{right:.1f}M{right:.1f} {y - 5:.1f}'
        f'V{y + 5:.1f}" stroke="#444" stroke-width="1.5" fill="none"/>',
        f'<text x="{right + 10:.1f}" y="{y + 5:.1f}" font-size="16" fill="#444">{name}</text>',
    ]
