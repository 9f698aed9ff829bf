"""The page of a building sequence: stones that go from the yard to the wall, the order, and the verdict of each stage.

The drawing is oblique (cabinet): the front is seen true to shape, depth runs up to the right at half its length. So the
yard, which lies in front of the wall, is seen below it. It moves by SVG's own animation, at a click and without a
script; at rest, and in print, it shows the finished structure and where each stone waited.
"""

import heapq
from html import escape
from itertools import groupby

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.construction.laying import axes_of
from cyclopean.design.construction.ordering import Edge
from cyclopean.design.construction.sequence import BuildSequence, Step
from cyclopean.geometry import face_normals, pack
from cyclopean.geometry.frames import unit
from cyclopean.geometry.polygon import convex_hull
from cyclopean.texts import first_few
from cyclopean.view import markup
from cyclopean.view.colours import ACCENT, GHOST, INK, SUPPORT, shaded
from cyclopean.view.drawing import feature_edges, still
from cyclopean.view.figures import number
from cyclopean.view.svg import WIDTH, Paper, View, closed, fitted, hatch, layer, rect, segments, sheet, text, to_scale

MARGIN = 30.0  # drawing units, on every side
FINE = 3  # decimals: a hundredth of a millimetre where the sheet is 10 m wide
TALLEST = 900.0  # drawing units
BAR = 34.0  # height of the bar of verdicts below
SLANT = 0.5 * np.cos(np.pi / 4.0)  # where a metre of depth goes, m: so far to the right and as far up
LIMIT = 1_500  # stones, beyond which nothing moves: the page would be too heavy
BENT = 0.1  # of a unit normal: facets that differ by less than this are one face that is bent
NUMBERED = 400  # stones up to which each shows its number
ROWS = 1_000  # of the table
NAMED = 3  # props that the headline names
SHOWN = 6  # steps that it names
FINISHED = {
    "stable": "Stands when finished",
    "unstable": "Falls when finished",
    "undecided": "Not shown to stand when finished",
}
BEAT, SHORTEST, LONGEST = 0.7, 6.0, 60.0  # s: for each stone, and for all
# Light and warm, far enough apart to be told by anyone; stones seldom need more than five.
STONES = ("#d9c9a3", "#b7c4c9", "#c99f7c", "#a9b78f", "#e6dfd0", "#b9a7bd", "#d3b3a5", "#94a8a0")


def building_html(sequence: BuildSequence) -> str:
    """Write the page of a building sequence: self-contained."""
    body = (
        _headline(sequence),
        markup.section("How it is built", _pictures(sequence)),
        markup.section(
            "In space", markup.scene_figure(still(sequence.assembly, sequence.fixed), sequence.assembly.name)
        ),
        markup.section("Stones that rest on each other", _cycles(sequence), _CYCLES),
        markup.section("What holds it meanwhile", _props(sequence), _PROPS),
        markup.section("The order that was given", _given(sequence), _GIVEN),
        markup.section("Stage by stage", _stages(sequence), _STAGES),
    )
    return markup.document(
        f"{sequence.assembly.name}: how it is built", body, word=outcome(sequence)[2], style=_STYLE, may=markup.POLICY
    )


_STYLE = "#building{cursor:pointer}.word{font-weight:600}"
_CYCLES = (
    "Stones that rest on each other in a ring have no order of their own. The joint that carries least was set aside."
)
_PROPS = "Each stays from the step at which its first stone is laid until the stone that frees it is in."
_GIVEN = (
    "Stones that come before what they rest on, or when no way in is left. The nearest valid order moves the fewest."
)
_STAGES = (
    "The verdict is of everything that stands once the stone is laid, without props. Every one that says stable or"
    " unstable carries a certificate that was checked in exact arithmetic."
)


def outcome(sequence: BuildSequence) -> tuple[str, str, str]:
    """Whether it stands while it is built: in two or three words, in a sentence, and the verdict that this is."""
    steps, first = sequence.steps, sequence.first_unstable
    if not steps:
        return "Nothing to build", "Every block is a support.", "stable"
    if first is None:
        return "Stands at every stage", f"All {len(steps)} stages were proved stable without props.", "stable"
    names = [block.id for block in sequence.assembly.blocks]
    told = [f"a {prop.said(names)}" for prop in sequence.props[:NAMED]]
    if len(sequence.props) > NAMED:
        told.append(f"{len(sequence.props) - NAMED} more props")
    needs = [f"While it is built it needs {'; '.join(told)}."] if told else []
    bare = [str(k) for k, s in enumerate(steps, 1) if "stable" not in (s.verdict, s.propped)]
    if bare:
        after = first_few(bare, SHOWN)
        needs.append(f"It is not shown to stand after step {after}{', props and all' if told else ''}.")
    return FINISHED[steps[-1].verdict], " ".join(needs), steps[first if bare else -1].verdict


def _headline(sequence: BuildSequence) -> str:
    steps, first = sequence.steps, sequence.first_unstable
    names = [block.id for block in sequence.assembly.blocks]
    title, reason, _ = outcome(sequence)
    if first is not None:
        step = steps[first]
        reason += f" By itself it is {step.verdict} from step {first + 1}, with stone {names[step.block]}"
        reason += f": {names[step.moving[0]]} {step.how}." if step.how else "."
    if trapped := [names[s.block] for s in steps if s.free is None]:
        reason += f" No straight way in for {', '.join(trapped[:6])}{' and more' if len(trapped) > 6 else ''}."
    figures = [("stones", len(steps)), ("layers", int(sequence.layer.max(initial=0)))]
    figures += [(f"stages {word}", sum(s.verdict == word for s in steps)) for word in ACCENT]
    shown = [(what, count) for what, count in figures if count]
    return markup.headline(sequence.assembly.name, shown, f"method {sequence.method}", answer=(title, reason))


def _pictures(sequence: BuildSequence) -> str:
    note = "Click the drawing to see it built. " if _moves(sequence) else ""
    yard = f'<path d="M2 3H30V13H2Z" fill="none" stroke="{GHOST}" stroke-dasharray="5 3"/>'
    keys = [markup.key(markup.SUPPORTED, "support"), markup.key(yard, "waits in the yard")]
    for word, colour in ACCENT.items():
        if any(step.verdict == word for step in sequence.steps):
            keys.append(markup.key(rect(0.0, 4.0, 32.0, 8.0, f'fill="{colour}"'), f"stage {word}"))
    return markup.legend(keys) + markup.figure(building_svg(sequence), note + _CAPTION)


_CAPTION = (
    "Numbers are the order. Stones that touch differ in colour. The bar shows the verdict of each stage. Seen from the"
    " front, depth drawn up to the right at half its length."
)


def _moves(sequence: BuildSequence) -> bool:
    return 0 < len(sequence.steps) <= LIMIT


def building_svg(sequence: BuildSequence) -> str:
    """Draw the structure with its yard as one `<svg>` element, animated where it is not too large."""
    mesh = sequence.assembly.mesh
    view = View(sequence.along, np.cross(sequence.up, sequence.along), sequence.up, (SLANT, SLANT))
    seen = np.concatenate([mesh.vertex, mesh.vertex + sequence.yard[mesh.vertex_body]])
    paper = fitted(view, seen, TALLEST, (MARGIN,) * 4, wide=True)
    normals, moves = unit(face_normals(mesh)), _moves(sequence)
    total = float(np.clip(BEAT * len(sequence.steps), SHORTEST, LONGEST))
    step_of = {step.block: k for k, step in enumerate(sequence.steps)}
    bodies = []
    for block in painting_order(sequence, paper.view.sight):
        k = step_of.get(block)
        name = "supports" if k is None else "stones"
        drawn = f'<g id="stone-{block}" data-layer="{name}">{_body(sequence, paper, normals, block, k)}</g>'
        way = "" if k is None or not moves else _way(sequence.steps[k], k, sequence, paper, total)
        bodies.append(f"<g>{drawn}{way}</g>")
    waiting = "".join(_waits(step, k, sequence, paper, total) for k, step in enumerate(sequence.steps)) if moves else ""
    parts = [
        f"<defs>{hatch()}</defs>",
        layer("yard", [_waiting(sequence, paper)]),
        f'<g stroke="{INK}" stroke-width="0.8" stroke-linejoin="round">',
        layer("stones", bodies, solid=True),
        f"{waiting}</g>",
        layer("verdicts", [_bar(sequence, paper.height, total if moves else 0.0)]),
    ]
    title, more = f"{sequence.assembly.name}: how it is built", ' id="building"' + to_scale(paper.scale, paper.foot)
    return sheet((WIDTH, paper.height + BAR), title, parts, white=False, more=more)


def painting_order(sequence: BuildSequence, sight: Floats) -> list[int]:
    """Blocks, the furthest first along a sight (3,), unit.

    Where two touch, the joint says which hides the other; else the distance.
    """
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


def _body(sequence: BuildSequence, paper: Paper, normals: Floats, block: int, step: int | None) -> str:
    """The faces of one block that can be seen, the furthest first, and its number."""
    mesh, view = sequence.assembly.mesh, paper.view
    faces = np.arange(mesh.face_start[block], mesh.face_start[block + 1])
    seen = faces[normals[faces] @ view.sight < -1e-6]
    colour = SUPPORT if step is None else STONES[int(sequence.colour[block]) % len(STONES)]
    corners = [mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]] for f in seen]
    rings = [mesh.vertex[corner] for corner in corners]
    parts = []
    for k in np.argsort([-float((ring @ view.sight).mean()) for ring in rings], kind="stable"):
        n = normals[seen[k]]
        light = float(np.clip(0.9 - 0.1 * (n @ view.right) + 0.1 * (n @ view.up), 0.6, 1.0))
        outline, tint = closed(paper.of(rings[k]), FINE), shaded(colour, light)
        parts.append(f'<path d="{outline}" fill="{tint}" stroke="{tint}"/>')
        if step is None:
            parts.append(f'<path d="{outline}" fill="url(#hatch)" stroke="none"/>')
    first = mesh.vertex_start[block]
    local = [(corner - first).tolist() for corner in corners]
    edges = feature_edges(pack([(mesh.vertex[first : mesh.vertex_start[block + 1]], local)]))
    parts.append(f'<path d="{segments(paper.of(edges), FINE)}" fill="none"/>')
    if step is not None and len(sequence.steps) <= NUMBERED and rings:
        parts.append(_number(step + 1, rings, normals[seen], paper))
    return "".join(parts)


def _number(step: int, rings: list[Floats], normal: Floats, paper: Paper) -> str:
    """The number of a stone, in the middle of what looks most to the front: one face, or the facets of a bent one."""
    front = normal @ paper.view.into
    facets = [paper.of(rings[k]) for k in np.flatnonzero(front < front.min() + BENT)]
    x, y, width = middle_of(facets[0] if len(facets) == 1 else convex_hull(np.concatenate(facets)))
    size = float(np.clip(0.45 * width, 3.0, 17.0))
    style = f'font-size="{size:.1f}" text-anchor="middle" fill="{INK}" stroke="none" data-layer="numbers"'
    return text(x, y + 0.35 * size, str(step), style)


def middle_of(ring: Floats) -> tuple[float, float, float]:
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


def _way(step: Step, index: int, sequence: BuildSequence, paper: Paper, total: float) -> str:
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


def _waits(step: Step, index: int, sequence: BuildSequence, paper: Paper, total: float) -> str:
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


def _waiting(sequence: BuildSequence, paper: Paper) -> str:
    """Where each stone waits: the box around its foot, dashed."""
    mesh, view = sequence.assembly.mesh, paper.view
    axes = np.stack([view.right, view.into, view.up])
    lines = []
    for step in sequence.steps:
        i = step.block
        local = (mesh.vertex[mesh.vertex_start[i] : mesh.vertex_start[i + 1]] + sequence.yard[i]) @ axes.T
        (x0, y0, z0), (x1, y1, _) = local.min(axis=0), local.max(axis=0)
        box = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]]) @ axes
        lines.append(closed(paper.of(box), FINE))
    return f'<path d="{"".join(lines)}" fill="none" stroke="{GHOST}" stroke-width="0.8" stroke-dasharray="4 3"/>'


def _bar(sequence: BuildSequence, top: float, total: float) -> str:
    """One cell a stage in the colour of its verdict, and a hand that runs along while it is built."""
    count = len(sequence.steps)
    if not count:
        return ""
    width = (WIDTH - 2.0 * MARGIN) / count
    cells, begins = "", 0
    for word, run in groupby(step.verdict for step in sequence.steps):
        long = len(list(run))
        cells += rect(MARGIN + begins * width, top, long * width, 12.0, f'fill="{ACCENT[word]}"')
        begins += long
    end = WIDTH - MARGIN
    hand = f'<path d="M{end:.1f} {top - 4:.1f}v20" stroke="{INK}" stroke-width="2.5">'
    if total:
        stops = f"{MARGIN - end:.1f} 0;{MARGIN - end:.1f} 0;0 0;0 0"
        hand += (
            f'<animateTransform attributeName="transform" type="translate" begin="building.click" dur="{total:.1f}s"'
            f' values="{stops}" keyTimes="0;.02;.96;1"/>'
        )
    return f"{cells}{hand}</path>"


def _named(sequence: BuildSequence, *blocks: int) -> str:
    """Blocks by their ids, escaped."""
    return ", ".join(escape(sequence.assembly.blocks[i].id) for i in blocks)


def _cycles(sequence: BuildSequence) -> str:
    def on(edge: Edge) -> str:
        return f"{_named(sequence, edge.upper)} on {_named(sequence, edge.lower)}"

    rows = []
    for cycle in sequence.graph.cycles:
        broken = "; ".join(f"{on(e)} ({number(e.support)} m²)" for e in cycle.broken)
        other = "; ".join(f"{on(e)}: {_named(sequence, *order)}" for e, order in cycle.alternatives)
        rows.append((_named(sequence, *cycle.blocks), broken, other))
    return markup.table(["Stones", "Set aside", "Instead, and the order then"], rows)


def _props(sequence: BuildSequence) -> str:
    rows = []
    for prop in sequence.props:
        until = "for good" if prop.until is None else f"{'keystone ' * prop.keystone}{_named(sequence, prop.until)}"
        rows.append((prop.kind, _named(sequence, *prop.blocks), str(prop.first + 1), str(prop.last + 1), until))
    return markup.table(["Prop", "Stones", ">From step", ">To step", "Until"], rows, ROWS)


def _given(sequence: BuildSequence) -> str:
    if sequence.given is None or not sequence.given.faults:
        return ""
    nearest = sequence.given.nearest
    rows = [
        (str(f.step + 1), *(_named(sequence, *some) for some in ((f.block,), f.missing, f.trapped_by)))
        for f in sequence.given.faults
    ]
    place = {block: k for k, block in enumerate(nearest.order, 1)}
    moved = ", ".join(f"{_named(sequence, block)} to step {place[block]}" for block in nearest.moved)
    told = "" if len(nearest.moved) == nearest.least else f" At least {nearest.least} are needed."
    said = f"<p>The nearest valid order moves {len(nearest.moved)}: {moved}.{told}</p>"
    return markup.table([">Step", "Stone", "Before", "Trapped by"], rows, ROWS) + said


def _stages(sequence: BuildSequence) -> str:
    head, rows = [">Step", "Stone", ">Layer", "Rests on", "Comes in", "Stage", "Props"], []
    for k, step in enumerate(sequence.steps, 1):
        props = "" if step.verdict == "stable" else "none found"
        if step.props:
            props = f"{_named(sequence, *step.props)} ({step.propped} with them)"
        word = f'<span class="word" style="color:{ACCENT[step.verdict]}">{step.verdict}</span>'
        on, way = _named(sequence, *step.rests_on), _direction(step, sequence)
        rows.append((str(k), _named(sequence, step.block), str(step.layer), on, way, word, props))
    return markup.table(head, rows, ROWS)


def _direction(step: Step, sequence: BuildSequence) -> str:
    """In words where the stone comes from."""
    if step.free is None:
        return f"trapped by {_named(sequence, *step.blocked_by)}"
    axes = axes_of(sequence)
    words = (("the right", "the left"), ("behind", "the front"), ("above", "below"))
    along = axes @ step.free
    said = [
        words[i][0 if along[i] > 0.0 else 1] for i in np.argsort(-np.abs(along), kind="stable") if abs(along[i]) > 0.2
    ]
    return "from " + " and ".join(said)
