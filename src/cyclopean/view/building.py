"""The page of a building sequence: stones that go from the yard to the wall, the order, and the verdict of each stage.

The drawing is oblique (cabinet): the front is seen true to shape, depth runs up to the right at half its length. So the
yard, which lies in front of the wall, is seen below it. It moves by SVG's own animation, at a click and without a
script; at rest, and in print, it shows the finished structure and where each stone waited.
"""

import heapq
from dataclasses import dataclass
from html import escape

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.construction.sequence import BuildSequence, Step
from cyclopean.geometry import face_normals, pack
from cyclopean.view.colours import ACCENT, GHOST, HATCH, INK, SUPPORT, shaded
from cyclopean.view.drawing import feature_edges
from cyclopean.view.figures import number
from cyclopean.view.markup import counts, document, key, section

__all__ = ["building_html", "building_svg"]

WIDTH, MARGIN = 1000.0, 30.0
TALLEST = 900.0  # drawing units
SLANT = 0.5 * np.array([np.cos(np.pi / 4.0), np.sin(np.pi / 4.0)])  # where a metre of depth goes: right, up
LIMIT = 1_500  # stones, beyond which nothing moves: the page would be too heavy
BENT = 0.1  # of a unit normal: facets that differ by less than this are one face that is bent
NUMBERED = 400  # stones up to which each shows its number
ROWS = 1_000  # of the table
BEAT, SHORTEST, LONGEST = 0.7, 6.0, 60.0  # s: for each stone, and for all
HATCHED = (
    '<defs><pattern id="hatch" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    f'<path d="M0 0V7" stroke="{HATCH}" stroke-width="3"/></pattern></defs>'
)
# Light and warm, far enough apart to be told by anyone; stones seldom need more than five.
STONES = ("#d9c9a3", "#b7c4c9", "#c99f7c", "#a9b78f", "#e6dfd0", "#b9a7bd", "#d3b3a5", "#94a8a0")


@dataclass(frozen=True, slots=True, eq=False)
class _Sheet:
    """From metres to drawing units, y down."""

    axes: Floats  # (3, 3) rows: right, into, up
    low: Floats  # (2,) m
    scale: float
    height: float

    def flat(self, point: Floats) -> Floats:
        """(..., 2) m, right and up."""
        local = point @ self.axes.T
        return np.asarray(local[..., [0, 2]] + local[..., 1:2] * SLANT)

    def of(self, point: Floats) -> Floats:
        """(..., 2) drawing units."""
        seen = (self.flat(point) - self.low) * self.scale
        return np.stack([MARGIN + seen[..., 0], self.height - MARGIN - seen[..., 1]], -1)

    def way(self, move: Floats) -> Floats:
        """(2,) drawing units that a (3,) m shift amounts to."""
        return np.asarray(self.of(move) - self.of(np.zeros(3)))

    @property
    def sight(self) -> Floats:
        """(3,) unit, world: away from the viewer."""
        line = np.array([-SLANT[0], 1.0, -SLANT[1]]) @ self.axes
        return np.asarray(line / np.linalg.norm(line))


def building_html(sequence: BuildSequence) -> str:
    """Write the page of a building sequence: self-contained, without a script."""
    first = sequence.first_unstable
    name = escape(sequence.assembly.name)
    accent = "stable" if first is None else sequence.steps[first].verdict
    body = (
        f"<header><h1>{name}</h1><span>cyclopean</span></header>{_headline(sequence)}",
        _pictures(sequence),
        section("Stones that rest on each other", _cycles(sequence), _CYCLES),
        section("Stage by stage", _table(sequence), _STAGES),
    )
    return document(f"{sequence.assembly.name}: how it is built", body, word=accent, style=_STYLE)


_STYLE = (
    "#building{cursor:pointer}.stages{max-height:32rem;overflow:auto}.stages thead th{position:sticky;top:0;"
    "background:var(--paper)}.word{font-weight:600}@media print{.stages{max-height:none;overflow:visible}}"
)
_CYCLES = (
    "Stones that rest on each other in a ring have no order of their own. The joint that carries least was set aside."
)
_STAGES = (
    "The verdict is of everything that stands once the stone is laid, without props. Every one that says stable or"
    " unstable carries a certificate that was checked in exact arithmetic."
)


def _headline(sequence: BuildSequence) -> str:
    steps, first = sequence.steps, sequence.first_unstable
    names = [block.id for block in sequence.assembly.blocks]
    if not steps:
        title, text = "Nothing to build", "Every block is a support."
    elif first is None:
        title, text = "Stands at every stage", f"All {len(steps)} stages were proved stable without props."
    else:
        step = steps[first]
        title = "Needs props" if any(s.propped == "stable" for s in steps) else "Does not stand while built"
        text = f"{step.verdict.capitalize()} from step {first + 1}, with stone {names[step.block]}."
        if step.props:
            least = "The fewest props that help there: hold" if step.smallest else "Props that help there: hold"
            text += f" {least} {', '.join(names[i] for i in step.props)}."
        if steps[-1].verdict == "stable":
            text += " Finished, it stands by itself."
    trapped = [names[s.block] for s in steps if s.free is None]
    if trapped:
        text += f" No straight way in for {', '.join(trapped[:6])}{' and more' if len(trapped) > 6 else ''}."
    figures = [("stones", len(steps)), ("layers", int(sequence.layer.max(initial=0)))]
    figures += [(f"stages {word}", sum(s.verdict == word for s in steps)) for word in ACCENT]
    shown = [(what, f"{count:,}") for what, count in figures if count]
    said = f'<div class="verdict"><strong>{title}</strong><p>{escape(text)}</p></div>'
    return said + counts(shown, f"method {sequence.method}")


def _pictures(sequence: BuildSequence) -> str:
    moves = 0 < len(sequence.steps) <= LIMIT
    note = "Click the drawing to see it built. " if moves else ""
    box = f'<rect width="32" height="16" fill="{SUPPORT}"/><path d="M2 18 18 0M12 18 28 0M22 18 38 0" stroke="{HATCH}"'
    keys = key(f'{box} stroke-width="3"/>', "support")
    keys += key(f'<path d="M2 3H30V13H2Z" fill="none" stroke="{GHOST}" stroke-dasharray="5 3"/>', "waits in the yard")
    keys += "".join(
        key(f'<rect y="4" width="32" height="8" fill="{colour}"/>', f"stage {word}")
        for word, colour in ACCENT.items()
        if any(step.verdict == word for step in sequence.steps)
    )
    return (
        f'<section><h2>How it is built</h2><div class="legend">{keys}</div><figure>{building_svg(sequence)}<figcaption>'
        f"{note}Numbers are the order. Stones that touch differ in colour. The bar shows the verdict of each stage."
        " Seen from the front, depth drawn up to the right at half its length.</figcaption></figure></section>"
    )


def building_svg(sequence: BuildSequence) -> str:
    """Draw the structure with its yard as one `<svg>` element, animated where it is not too large."""
    paper, normals = _sheet(sequence), _normals(sequence)
    moves = 0 < len(sequence.steps) <= LIMIT
    total = float(np.clip(BEAT * len(sequence.steps), SHORTEST, LONGEST))
    step_of = {step.block: k for k, step in enumerate(sequence.steps)}
    bodies = []
    for block in _painted(sequence, paper.sight):
        k = step_of.get(block)
        drawn = f'<g id="stone-{block}">{_body(sequence, paper, normals, block, k)}</g>'
        way = "" if k is None or not moves else _way(sequence.steps[k], k, sequence, paper, total)
        bodies.append(f"<g>{drawn}{way}</g>")
    waiting = "".join(_waits(step, k, sequence, paper, total) for k, step in enumerate(sequence.steps)) if moves else ""
    height = paper.height + 34.0
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" id="building" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img">'
        f"<title>{escape(sequence.assembly.name)}: how it is built</title>{HATCHED}{_waiting(sequence, paper)}"
        f'<g stroke="{INK}" stroke-width="0.8" stroke-linejoin="round">{"".join(bodies)}{waiting}</g>'
        f"{_bar(sequence, paper.height, total if moves else 0.0)}</svg>"
    )


def _sheet(sequence: BuildSequence) -> _Sheet:
    """Fit structure and yard."""
    axes = np.stack([sequence.along, np.cross(sequence.up, sequence.along), sequence.up])
    mesh = sequence.assembly.mesh
    bare = _Sheet(axes, np.zeros(2), 1.0, 0.0)
    seen = np.concatenate([bare.flat(mesh.vertex), bare.flat(mesh.vertex + sequence.yard[mesh.vertex_body])])
    low, high = seen.min(axis=0), seen.max(axis=0)
    span = np.maximum(high - low, 1e-9)
    scale = float(min((WIDTH - 2.0 * MARGIN) / span[0], TALLEST / span[1]))
    spare = (WIDTH - 2.0 * MARGIN) / scale - span[0]
    return _Sheet(axes, low - [spare / 2.0, 0.0], scale, float(span[1]) * scale + 2.0 * MARGIN)


def _painted(sequence: BuildSequence, sight: Floats) -> list[int]:
    """Blocks, the furthest first: where two touch, the joint says which hides the other; else the distance."""
    contacts, n = sequence.contacts, len(sequence.assembly)
    lean = contacts.frame[:, 0] @ sight if len(contacts) else np.zeros(0)
    far, near = np.where(lean > 0.0, contacts.b, contacts.a), np.where(lean > 0.0, contacts.a, contacts.b)
    pairs = set(zip(far[np.abs(lean) > 1e-9].tolist(), near[np.abs(lean) > 1e-9].tolist(), strict=True))
    waits = np.bincount([b for _, b in pairs], minlength=n) if pairs else np.zeros(n, int)
    hides: dict[int, list[int]] = {}
    for a, b in pairs:
        hides.setdefault(a, []).append(b)
    depth = sequence.assembly.mass.centroid @ sight
    queue = [(-depth[i], i) for i in np.flatnonzero(waits == 0).tolist()]
    heapq.heapify(queue)
    order: list[int] = []
    left = set(range(n))
    while left:
        if not queue:  # blocks that hide each other in a ring: the furthest is as good as any
            heapq.heappush(queue, min((-depth[i], i) for i in left))
        block = heapq.heappop(queue)[1]
        if block not in left:
            continue
        left.discard(block)
        order.append(block)
        for other in hides.get(block, ()):
            waits[other] -= 1
            if waits[other] == 0 and other in left:
                heapq.heappush(queue, (-depth[other], other))
    return order


def _path(points: Floats) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points.tolist()) + "Z"


def _body(sequence: BuildSequence, paper: _Sheet, normals: Floats, block: int, step: int | None) -> str:
    """The faces of one block that can be seen, the furthest first, and its number."""
    mesh = sequence.assembly.mesh
    faces = np.arange(mesh.face_start[block], mesh.face_start[block + 1])
    normal = normals[faces]
    seen = faces[normal @ paper.sight < -1e-6]
    colour = SUPPORT if step is None else STONES[int(sequence.colour[block]) % len(STONES)]
    rings = [mesh.vertex[mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]]] for f in seen]
    parts = []
    for k in np.argsort([-float((ring @ paper.sight).mean()) for ring in rings], kind="stable"):
        n = normals[seen[k]]
        light = float(np.clip(0.9 - 0.1 * (n @ paper.axes[0]) + 0.1 * (n @ paper.axes[2]), 0.6, 1.0))
        outline, tint = _path(paper.of(rings[k])), shaded(colour, light)
        parts.append(f'<path d="{outline}" fill="{tint}" stroke="{tint}"/>')
        if step is None:
            parts.append(f'<path d="{outline}" fill="url(#hatch)" stroke="none"/>')
    first = mesh.vertex_start[block]
    local = [(mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]] - first).tolist() for f in seen]
    edges = feature_edges(pack([(mesh.vertex[first : mesh.vertex_start[block + 1]], local)]))
    lines = [f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for a, b, c, d in paper.of(edges).reshape(-1, 4)]
    parts.append(f'<path d="{"".join(lines)}" fill="none"/>')
    if step is not None and len(sequence.steps) <= NUMBERED and rings:
        parts.append(_number(step + 1, rings, normal[normal @ paper.sight < -1e-6], paper))
    return "".join(parts)


def _normals(sequence: BuildSequence) -> Floats:
    normal = face_normals(sequence.assembly.mesh)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))


def _number(step: int, rings: list[Floats], normal: Floats, paper: _Sheet) -> str:
    """The number of a stone, in the middle of what looks most to the front: one face, or the facets of a bent one."""
    front = normal @ paper.axes[1]
    facets = [paper.of(rings[k]) for k in np.flatnonzero(front < front.min() + BENT)]
    x, y, width = _middle(facets[0] if len(facets) == 1 else _around(np.concatenate(facets)))
    size = float(np.clip(0.45 * width, 3.0, 17.0))
    return (
        f'<text x="{x:.1f}" y="{y + 0.35 * size:.1f}" font-size="{size:.1f}" text-anchor="middle" fill="{INK}"'
        f' stroke="none">{step}</text>'
    )


def _around(points: Floats) -> Floats:
    """Convex hull of points (k, 2), as a ring."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        ring: Floats = points[ConvexHull(points).vertices]
        return ring
    except QhullError:  # seen edge on
        return points


def _middle(ring: Floats) -> tuple[float, float, float]:
    """A point well within a (k, 2) polygon, which may have dents, and how much room there is: its widest level."""
    low, tall = float(ring[:, 1].min()), float(np.ptp(ring[:, 1]))
    best = float(ring[:, 0].mean()), float(ring[:, 1].mean()), 0.0
    for share in (0.5, 0.35, 0.65, 0.2, 0.8):
        level = low + share * tall
        a, b = ring, np.roll(ring, -1, axis=0)
        cut = (a[:, 1] > level) != (b[:, 1] > level)
        rise = b[cut, 1] - a[cut, 1]
        at = np.sort(a[cut, 0] + (level - a[cut, 1]) / rise * (b[cut, 0] - a[cut, 0]))
        for left, right in at[: len(at) // 2 * 2].reshape(-1, 2).tolist():
            room = min(right - left, tall)
            if room > 1.2 * best[2]:
                best = 0.5 * (left + right), level, room
    return best


def _way(step: Step, index: int, sequence: BuildSequence, paper: _Sheet, total: float) -> str:
    """Wait in the yard, up, over to the approach, into place."""
    frames, count = step.frames, len(sequence.steps)
    home = frames.place[:3, 3]
    lift = frames.yard[:3, 3] + 0.3 * (frames.lift[:3, 3] - frames.yard[:3, 3])  # as much as the sheet has room for
    stops = [frames.yard[:3, 3], frames.yard[:3, 3], lift, frames.approach[:3, 3], home, home]
    begins, span = _beat(index, count)
    times = [0.0, begins, begins + 0.25 * span, begins + 0.75 * span, begins + span, 1.0]
    values = ";".join(" ".join(f"{x:.1f}" for x in paper.way(stop - home).tolist()) for stop in stops)
    return (
        f'<set attributeName="visibility" to="hidden" begin="building.click" dur="{begins * total:.2f}s"/>'
        '<animateTransform attributeName="transform" type="translate" begin="building.click"'
        f' dur="{total:.1f}s" values="{values}" keyTimes="{";".join(f"{t:.5g}" for t in times)}"/>'
    )


def _waits(step: Step, index: int, sequence: BuildSequence, paper: _Sheet, total: float) -> str:
    """The stone in the yard, until it is fetched: in front of all that stands."""
    x, y = paper.way(step.frames.yard[:3, 3] - step.frames.place[:3, 3])
    begins, _ = _beat(index, len(sequence.steps))
    return (
        f'<use href="#stone-{step.block}" transform="translate({x:.1f} {y:.1f})" visibility="hidden">'
        f'<set attributeName="visibility" to="visible" begin="building.click" dur="{begins * total:.2f}s"/></use>'
    )


def _beat(index: int, count: int) -> tuple[float, float]:
    """When a stone is fetched and how long it takes, in shares of the whole."""
    span = 0.94 / count
    return 0.02 + index * span, span


def _waiting(sequence: BuildSequence, paper: _Sheet) -> str:
    """Where each stone waits: the box around its foot, dashed."""
    mesh = sequence.assembly.mesh
    lines = []
    for step in sequence.steps:
        i = step.block
        local = (mesh.vertex[mesh.vertex_start[i] : mesh.vertex_start[i + 1]] + sequence.yard[i]) @ paper.axes.T
        (x0, y0, z0), (x1, y1, _) = local.min(axis=0), local.max(axis=0)
        foot = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]]) @ paper.axes
        lines.append(_path(paper.of(foot)))
    return f'<path d="{"".join(lines)}" fill="none" stroke="{GHOST}" stroke-width="0.8" stroke-dasharray="4 3"/>'


def _bar(sequence: BuildSequence, top: float, total: float) -> str:
    """One cell a stage in the colour of its verdict, and a hand that runs along while it is built."""
    count = len(sequence.steps)
    if not count:
        return ""
    width = (WIDTH - 2.0 * MARGIN) / count
    runs: list[list[int]] = []
    for k, step in enumerate(sequence.steps):
        if runs and sequence.steps[runs[-1][0]].verdict == step.verdict:
            runs[-1][1] = k + 1
        else:
            runs.append([k, k + 1])
    cells = "".join(
        f'<rect x="{MARGIN + a * width:.1f}" y="{top:.1f}" width="{(b - a) * width:.1f}" height="12"'
        f' fill="{ACCENT[sequence.steps[a].verdict]}"/>'
        for a, b in runs
    )
    end = WIDTH - MARGIN
    hand = f'<path d="M{end:.1f} {top - 4:.1f}v20" stroke="{INK}" stroke-width="2.5">'
    if total:
        stops = f"{MARGIN - end:.1f} 0;{MARGIN - end:.1f} 0;0 0;0 0"
        hand += (
            f'<animateTransform attributeName="transform" type="translate" begin="building.click" dur="{total:.1f}s"'
            f' values="{stops}" keyTimes="0;.02;.96;1"/>'
        )
    return f"{cells}{hand}</path>"


def _cycles(sequence: BuildSequence) -> str:
    names = [escape(block.id) for block in sequence.assembly.blocks]
    rows = []
    for cycle in sequence.graph.cycles:
        broken = "; ".join(f"{names[e.upper]} on {names[e.lower]} ({number(e.support)} m²)" for e in cycle.broken)
        other = "; ".join(
            f"{names[e.upper]} on {names[e.lower]}: {', '.join(names[i] for i in order)}"
            for e, order in cycle.alternatives
        )
        rows.append(f"<tr><td>{', '.join(names[i] for i in cycle.blocks)}</td><td>{broken}</td><td>{other}</td></tr>")
    if not rows:
        return ""
    head = "<th>Stones</th><th>Set aside</th><th>Instead, and the order then</th>"
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'


def _table(sequence: BuildSequence) -> str:
    names = [escape(block.id) for block in sequence.assembly.blocks]
    rows = "".join(_row(k, step, names, sequence) for k, step in enumerate(sequence.steps[:ROWS], 1))
    head = "".join(
        f"<th{kind}>{title}</th>"
        for kind, title in (
            (' class="n"', "Step"),
            ("", "Stone"),
            (' class="n"', "Layer"),
            ("", "Rests on"),
            ("", "Comes in"),
            ("", "Stage"),
            ("", "Props"),
        )
    )
    more = f"<p>The first {ROWS:,} of {len(sequence.steps):,} stages.</p>" if len(sequence.steps) > ROWS else ""
    return f'{more}<div class="wide stages"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _row(k: int, step: Step, names: list[str], sequence: BuildSequence) -> str:
    props = ", ".join(names[i] for i in step.props)
    if step.props:
        props += f" ({'fewest; ' if step.smallest else ''}{step.propped} with them)"
    elif step.verdict != "stable":
        props = "none found"
    return (
        f'<tr><td class="n">{k}</td><th>{names[step.block]}</th><td class="n">{step.layer}</td>'
        f"<td>{', '.join(names[i] for i in step.rests_on)}</td><td>{_direction(step, names, sequence)}</td>"
        f'<td class="word" style="color:{ACCENT[step.verdict]}">{step.verdict}</td><td>{props}</td></tr>'
    )


def _direction(step: Step, names: list[str], sequence: BuildSequence) -> str:
    """In words where the stone comes from."""
    if step.free is None:
        return f"trapped by {', '.join(names[i] for i in step.blocked_by)}"
    axes = np.stack([sequence.along, np.cross(sequence.up, sequence.along), sequence.up])
    words = (("the right", "the left"), ("behind", "the front"), ("above", "below"))
    along = axes @ step.free
    said = [
        words[i][0 if along[i] > 0.0 else 1] for i in np.argsort(-np.abs(along), kind="stable") if abs(along[i]) > 0.2
    ]
    return "from " + " and ".join(said)
