"""A static elevation as SVG: the picture in print, and where there is no WebGL.

Orthographic, upright axis z, seen along the horizontal direction in which the model is least deep. Faces that look away
are dropped, the rest are painted from the furthest to the nearest. A drawing of blocks that are moved, when it is not
too large, shows the way there at a click: SVG's own animation, without a script.
"""

from collections.abc import Iterator

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.geometry import Polyhedra, face_normals
from cyclopean.geometry.frames import unit
from cyclopean.geometry.polygon import convex_hull
from cyclopean.view.colours import (
    BLAMED,
    FORCE,
    GHOST,
    GRAVITY,
    HELD,
    INK,
    LOAD,
    PULL,
    RUB,
    THRUST,
    fill,
    shaded,
    stone,
)
from cyclopean.view.drawing import Picture
from cyclopean.view.svg import (
    Paper,
    View,
    closed,
    fitted,
    front_view,
    grain,
    hatch,
    layer,
    project,
    scale_bar,
    segments,
    sheet,
    text,
    to_scale,
)

HEIGHT, MARGIN = 640.0, 40.0
SIDE, FOOT = 2.6 * MARGIN, MARGIN + 44.0  # room for gravity at the right, for the scale below
FACE_LIMIT = 20_000  # faces painted one by one; beyond it one silhouette a block
ARROW_LIMIT = 1_000  # drawn; of more the largest
ACROSS = 0.5  # of the loads: a share that is not seen from the front
STRAYS = 0.6  # of the depth of a block: middles that stray further are of a model that is not in one plane
POINT_LIMIT = 5_000  # dots of one kind
ANIMATED_FACES = 1_500  # beyond it the two shapes of every face would make the page heavy
FINE = 3  # decimals: a hundredth of a millimetre where the sheet is 10 m wide; faces are many, and pages heavy
HALO = 'stroke="#fff" stroke-opacity="0.7"'
DASHED = f'stroke="{GHOST}" stroke-width="1.1" stroke-dasharray="5 4"'
THRUST_LINE = (
    f'class="thrust" stroke-linecap="round" {HALO} stroke-width="6"',
    f'stroke-linecap="round" stroke="{THRUST}" stroke-width="3.5"',
)
NOTHING = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.05]])  # what paper is cut to where nothing is shown


def elevation_svg(drawn: Picture, title: str, view: View | None = None, *, faces: int = FACE_LIMIT) -> str:
    """Draw the picture as one `<svg>` element, from the front unless another view is given.

    Of more `faces` only the silhouette of each block is drawn.
    """
    seen = np.concatenate([part.reshape(-1, 3) for part in (drawn.mesh.vertex, drawn.ghost, drawn.load, drawn.given)])
    paper = fitted(
        front_view(drawn.mesh.vertex) if view is None else view,
        seen if len(seen) else NOTHING,
        HEIGHT - MARGIN - FOOT,
        (MARGIN, MARGIN, SIDE, FOOT),
    )
    moves, full = animated(drawn), np.full(len(drawn.press), 4.0)
    parts = [
        f"<defs>{hatch()}{grain()}</defs>",
        layer("stones", _polygons(drawn, paper, moves, faces), solid=True),
        layer("at-rest", [_lines(np.unique(paper.of(drawn.ghost).round(FINE), axis=0), DASHED)]),
        layer("thrust", [_lines(paper.of(drawn.thrust), *THRUST_LINE)]),
        layer("forces", [_arrows(drawn.arrow, paper, FORCE), _dots(drawn.press, full, paper, FORCE)]),
        layer("given-loads", [_arrows(drawn.given, paper, GRAVITY)]),
        layer("friction", [_arrows(drawn.rub, paper, RUB)]),
        layer("tension", [_dots(drawn.pull, 4.0 + 9.0 * np.sqrt(drawn.pull_share), paper, PULL)]),
        layer("hinges", [_dots(drawn.hinge, np.full(len(drawn.hinge), 6.0), paper, LOAD)]),
        layer("joints that slide", [_dots(drawn.slide, np.full(len(drawn.slide), 6.0), paper, "#fff", LOAD)]),
        layer("loads", [_arrows(drawn.load, paper, LOAD), *_load_texts(drawn, paper)]),
        layer("numbers", _numbers(drawn.blamed, paper)),
        layer("gravity", [_gravity(drawn, paper)]),
        scale_bar(MARGIN, paper.height - 34.0, paper.scale, 0.22 * (paper.width - 2.0 * MARGIN)) if len(seen) else "",
    ]
    more = to_scale(paper.scale, paper.foot) + (' id="moving"' if moves else "")
    return sheet((paper.width, paper.height), title, parts, letters=16.0, white=False, more=more)


def sides(mesh: Polyhedra, load: Floats = NOTHING) -> list[tuple[str, View]]:
    """Views that show all of a model, named: of a wall in one plane one elevation, of others two and the plan.

    It is in one plane while the middles of its blocks stray by less than a block is deep; where most of what loads it,
    arrows (l, 2, 3), acts across that plane, as earth does, it is shown from the side too. Of others the elevations go
    by the directions of upright faces, and look from where most of the model is near.
    """
    front = front_view(mesh.vertex)
    depth, first = project(mesh.vertex, front)[1], mesh.vertex_start[:-1]
    if not len(mesh) or not (np.diff(mesh.vertex_start) > 0).all():
        return [("Elevation", front)]
    far, near = np.maximum.reduceat(depth, first), np.minimum.reduceat(depth, first)
    if not float(np.std(far + near)) > 2.0 * STRAYS * float(np.median(far - near)):
        push = load[:, 1] - load[:, 0]
        across = np.abs(push @ front.into).sum() > ACROSS * np.linalg.norm(push, axis=1).sum()
        return [("Elevation", front), *([("Elevation from the side", _level(front.right))] if across else [])]
    normal = face_normals(mesh)
    normal = normal[np.abs(normal[:, 2]) < 0.1 * np.linalg.norm(normal, axis=1)]
    turn = np.rint(np.degrees(np.arctan2(normal[:, 1], normal[:, 0]))).astype(int) % 90
    best = np.radians(np.bincount(turn, np.linalg.norm(normal, axis=1), 90).argmax())
    middle = (mesh.vertex.max(axis=0) + mesh.vertex.min(axis=0)) / 2.0 - mesh.vertex.mean(axis=0)
    views = []
    for angle in (best, best + np.pi / 2.0):
        into = np.array([-np.sin(angle), np.cos(angle), 0.0])
        into *= 1.0 if into @ middle >= 0.0 else -1.0
        views.append(_level(into))
    plan = View(views[0].right, np.array([0.0, 0.0, -1.0]), views[0].into)
    return [("Elevation", views[0]), ("Elevation from the side", views[1]), ("Plan, from above", plan)]


def _level(into: Floats) -> View:
    """The view that looks level along this."""
    return View(np.array([into[1], -into[0], 0.0]), into)


def animated(drawn: Picture) -> bool:
    """Whether the elevation shows the motion at a click."""
    return drawn.rest is not None and len(drawn.mesh.corner_start) - 1 <= ANIMATED_FACES


def _polygons(drawn: Picture, paper: Paper, moves: bool, faces: int) -> list[str]:
    mesh, view = drawn.mesh, paper.view
    if len(mesh.corner_start) - 1 > faces:
        return _silhouettes(drawn, paper)
    point, depth = paper.of(mesh.vertex), project(mesh.vertex, view)[1]
    normal = unit(face_normals(mesh))
    facing = -(normal @ view.into)
    starts = mesh.corner_start[:-1]
    far = np.add.reduceat(depth[mesh.corner], starts) / np.diff(mesh.corner_start) if len(starts) else np.zeros(0)
    light = np.clip(0.86 + 0.14 * facing + 0.08 * normal[:, 2] - 0.04 * (normal @ view.right), 0.0, 1.0)
    before = paper.of(drawn.rest) if moves and drawn.rest is not None else None
    painted = []
    seen = np.flatnonzero(facing > 1e-6)
    for f in seen[np.argsort(-far[seen], kind="stable")]:  # those that look at the viewer, the furthest first
        corner, body = mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]], int(mesh.face_body[f])
        group = int(drawn.group[body])
        outline = closed(point[corner], FINE)
        way = "" if before is None or group == HELD else _way(closed(before[corner], FINE), outline)
        painted.append(_paint(outline, (group, body), float(light[f]), bool(len(drawn.edge)), way))
    return [f'<g class="grain" stroke="{INK}" stroke-width="0.9" stroke-linejoin="round">', *painted, "</g>"]


def _way(rest: str, there: str) -> str:
    """From rest to where it is drawn, twice, at a click on the drawing."""
    return (
        f'<animate attributeName="d" begin="moving.click" dur="2.4s" repeatCount="2"'
        f' values="{rest};{rest};{there};{there}" keyTimes="0;.15;.75;1"/>'
    )


def _paint(outline: str, which: tuple[int, int], light: float, edged: bool, way: str = "") -> str:
    """One polygon of a colour class and a body, in the colour of stone; the class is named, for pages to colour it by.

    Supports get a hatch over their colour, unedged faces a hairline of their own colour.
    """
    group, body = which
    colour = shaded(fill(group) if group in {HELD, BLAMED} else stone(body), light)
    edge = "" if edged else f' stroke="{colour}"'
    edge += f' class="u{group}"' if group >= 0 else ""
    edge += ' data-layer="supports"' if group == HELD else ""
    lines = f'<path d="{outline}" fill="url(#hatch)" stroke="none"/>' if group == HELD else ""
    end = f">{way}</path>" if way else "/>"
    return f'<path d="{outline}" fill="{colour}"{edge}{end}{lines}'


def _silhouettes(drawn: Picture, paper: Paper) -> list[str]:
    """One convex outline a block, the furthest first: for models with very many faces."""
    mesh = drawn.mesh
    point, depth = paper.of(mesh.vertex), project(mesh.vertex, paper.view)[1]
    middle = np.bincount(mesh.vertex_body, depth, len(mesh)) / np.maximum(np.diff(mesh.vertex_start), 1)
    painted = []
    for i in np.argsort(-middle, kind="stable"):
        outline = closed(convex_hull(point[mesh.vertex_start[i] : mesh.vertex_start[i + 1]]), FINE)
        painted.append(_paint(outline, (int(drawn.group[i]), int(i)), 0.95, True))
    return [f'<g class="grain" stroke="{INK}" stroke-width="0.5" stroke-linejoin="round">', *painted, "</g>"]


def _lines(ends: Floats, *styles: str) -> str:
    """Segments (e, 2, 2) of the sheet, once in each style; nothing where there are none."""
    path = segments(ends, FINE)
    return "".join(f'<path d="{path}" fill="none" {style}/>' for style in styles if path)


def _arrows(arrow: Floats, paper: Paper, colour: str) -> str:
    """Forces: a white halo, the shaft, the head."""
    ends = paper.of(arrow[:ARROW_LIMIT])
    shafts = _lines(ends, f'{HALO} stroke-width="4"', f'stroke="{colour}" stroke-width="2"')
    heads = "".join(_head(tail, tip, 9.0) for tail, tip in ends)
    return f'{shafts}<path d="{heads}" fill="{colour}"/>' if shafts else ""


def _dots(point: Floats, radius: Floats, paper: Paper, colour: str, rim: str = "#fff") -> str:
    """Contact points, with a rim; those that fall together on the sheet are drawn once, as the largest."""
    if not len(point):
        return ""
    drawn: dict[tuple[float, float], float] = {}
    for (x, y), r in zip(paper.of(point[:POINT_LIMIT]).round(1).tolist(), radius.tolist(), strict=False):
        drawn[x, y] = max(r, drawn.get((x, y), 0.0))
    circles = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>' for (x, y), r in drawn.items())
    return f'<g fill="{colour}" stroke="{rim}" stroke-width="{1.2 if rim == "#fff" else 2.4}">{circles}</g>'


def _numbers(point: Floats, paper: Paper) -> Iterator[str]:
    """The number of each of some stones, in a disc at its middle."""
    style = 'text-anchor="middle" font-weight="700" font-size="15"'
    for k, (x, y) in enumerate(paper.of(point).tolist(), 1):
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="11" fill="#fff" stroke="{INK}" stroke-width="1.2"/>'
        yield text(x, y + 5.3, str(k), style)


def _load_texts(drawn: Picture, paper: Paper) -> Iterator[str]:
    """What each load comes to, at its tail, with a halo."""
    style = f'text-anchor="middle" font-weight="700" fill="{LOAD}" stroke="#fff" stroke-width="4" paint-order="stroke"'
    for (x, y), words in zip(paper.of(drawn.load[:, 0]).tolist(), drawn.load_text, strict=True):
        yield text(x, y - 8.0, words, style)


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
    return closed(np.stack([tip, back + 0.36 * reach * across, back - 0.36 * reach * across]), FINE)


def _gravity(drawn: Picture, paper: Paper) -> str:
    size = float(np.linalg.norm(drawn.gravity))
    if not (size > 0.0):
        return ""
    if abs(float(drawn.gravity @ paper.view.into)) > 0.9 * size:
        return ""  # seen along gravity
    down = 70.0 / size / paper.scale * paper.way(drawn.gravity)
    middle = np.array([paper.width - 44.0, paper.height / 2.0 - 30.0])
    tail, tip = middle - down / 2.0, middle + down / 2.0
    return (
        f'<path d="{segments(np.stack([tail, tip])[None])}" stroke="{GRAVITY}" stroke-width="2.4"/>'
        f'<path d="{_head(tail, tip, 15.0)}" fill="{GRAVITY}"/>'
        + text(middle[0] + 14.0, middle[1] + 5.0, "g", f'font-size="17" font-style="italic" fill="{GRAVITY}"')
    )
