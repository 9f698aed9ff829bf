"""What is drawn of a result, whoever draws it: bodies as shown, their colours, ghost lines, points and arrows."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from cyclopean.analysis import LimitResult, Result, moving_joints
from cyclopean.analysis.limit_analysis.live_load import STANDARD_GRAVITY
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.geometry import Polyhedra, face_normals, pack
from cyclopean.geometry.frames import unit
from cyclopean.view.colours import BLAMED, classes
from cyclopean.view.figures import (
    Pressing,
    Resultants,
    block_utilisation,
    force_text,
    needed_tension,
    pressing,
    resultants,
)
from cyclopean.view.motion import Motion, drawn_motion, moved
from cyclopean.view.thrust import thrust_line

FACE_LIMIT = 200_000  # triangles; beyond it blocks with many faces are drawn as their convex outlines
EDGE_LIMIT = 60_000  # line segments of one kind
ARROW_LIMIT = 2_000  # drawn in three dimensions; of more the largest, and it is said
SPECK = 0.04  # of the longest friction arrow: shorter ones would be all head
POINT_LIMIT = 20_000  # dots of one kind
BLOCK_LIMIT = 3_000  # beyond it neither arrows nor ghosts: they would be smaller than anyone can see
SHARP = np.cos(np.radians(20.0))  # faces that turn less than this share no drawn edge
ROUGH = 60  # faces of a body beyond which it is a found stone: only edges of more than 50 degrees are drawn
CRISP = np.cos(np.radians(50.0))  # see ROUGH

NOWHERE, NOTHING, NOBODY, NO_GRAVITY = np.zeros((0, 3)), np.zeros((0, 2, 3)), np.zeros(0), np.zeros(3)

Quantity = Literal["utilisation", "movement", "nothing"]


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One drawing of n blocks; lengths in metres, world axes."""

    mesh: Polyhedra  # as shown: moved along the mechanism when there is one
    group: Ints  # (n,) colour class
    quantity: Quantity  # what the colours mean
    edge: Floats  # (e, 2, 3)
    ghost: Floats  # (g, 2, 3) edges of the model where it stands, when it is shown moved
    arrow: Floats  # (m, 2, 3) tail and tip; largest force first
    largest: float  # N, the force of the longest arrow
    gravity: Floats  # (3,) m/s2
    motion: Motion | None
    notes: tuple[str, ...]  # what was left out or simplified, for the reader
    rest: Floats | None = None  # (V, 3) m, where the vertices stand, when the mesh is shown moved
    press: Floats = field(default_factory=NOWHERE.copy)  # (k, 3) m, points of a coupled state that press
    rub: Floats = field(default_factory=NOTHING.copy)  # (r, 2, 3) m, friction at them, largest first
    rubbing: float = 0.0  # N, the friction of the longest of these
    virtual: Motion | None = None  # of a coupled state, exaggerated
    virtual_edge: Floats = field(default_factory=NOTHING.copy)  # (e, 2, 3) m, edges of the blocks displaced by it
    pull: Floats = field(default_factory=NOWHERE.copy)  # (t, 3) m, where a joint would have to pull, the most first
    pull_share: Floats = field(default_factory=NOBODY.copy)  # (t,) of the largest tension
    thrust: Floats = field(default_factory=NOTHING.copy)  # (s, 2, 3) m, the line of thrust, where there is one
    given: Floats = field(default_factory=NOTHING.copy)  # (l, 2, 3) m, tail and tip of given loads on free blocks
    blamed: Floats = field(default_factory=NOWHERE.copy)  # (b, 3) m, middles of stones at which a search ends, in order
    load: Floats = field(default_factory=NOTHING.copy)  # (l, 2, 3) m, live loads, tail and tip, where they act
    load_text: tuple[str, ...] = ()  # what is written at each
    hinge: Floats = field(default_factory=NOWHERE.copy)  # (h, 3) m, where joints of a mechanism turn
    slide: Floats = field(default_factory=NOWHERE.copy)  # (s, 3) m, where they slide


def picture(result: Result) -> Picture:
    """Choose what to show of a result."""
    whole = result.assembly.mesh
    shown = outlines(whole, FACE_LIMIT)
    notes = [] if shown is whole else ["Blocks with many faces are drawn as their convex outlines."]
    motion = _motion(result, shown, result.mechanism)
    edge = feature_edges(shown)
    if len(edge) > EDGE_LIMIT:
        notes.append("Edges of blocks are left out: there are too many.")
    if motion is not None:
        mesh = replace(shown, vertex=motion.vertex)
        ghost, edge = edge, feature_edges(mesh)
    else:
        mesh, ghost = shown, NOTHING
    drawable, many = len(edge) <= EDGE_LIMIT, len(result.assembly) > BLOCK_LIMIT
    if many and (len(ghost) or result.force is not None):
        what = "the model where it stands" if len(ghost) else "the drawing of contact forces"
        notes.append(f"With more than {BLOCK_LIMIT:,} blocks, {what} would not be legible and is left out.")
        ghost = ghost[:0]
    quantity, value = _quantity(result, motion)
    arrow, largest = _arrows(result, None if many else resultants(result), notes)
    blamed = _blamed(result)
    given = NOTHING if many else _given(result, notes)
    group = classes(value, result.fixed)
    group[blamed] = BLAMED
    drawn = Picture(
        mesh,
        group,
        quantity,
        edge if drawable else edge[:0],
        ghost if drawable else ghost[:0],
        arrow,
        largest,
        result.gravity,
        motion,
        tuple(notes),
        None if motion is None else shown.vertex,
        thrust=NOTHING if many else thrust_line(result),
        given=given,
        blamed=result.assembly.mass.centroid[blamed],
    )
    return drawn if many else _with_points(drawn, result)


def _blamed(result: Result) -> list[int]:
    """Blocks at which an undecided search ends, the most blamed first."""
    if result.undecided is None:
        return []
    number = {block.id: i for i, block in enumerate(result.assembly.blocks)}
    return [number[fold.block] for fold in result.undecided.folds]


def picture_at_limit(result: LimitResult) -> Picture:
    """Of a limit analysis: the mechanism at the upper bound where there is one, else the forces at the lower one."""
    moves = result.mechanism is not None
    drawn = picture(
        Result(
            assembly=result.assembly,
            contacts=result.contacts,
            fixed=result.fixed,
            method=result.method,
            verdict="unstable" if moves else "stable",
            reason=result.reason,
            assumed=result.assumed,
            gravity=result.gravity,
            residuals={},
            force=None if moves else result.force,
            frame=result.frame,
            utilisation=None if moves else result.utilisation,
            mechanism=result.mechanism,
        )
    )
    return _with_loads(drawn, result)


def _with_loads(drawn: Picture, result: LimitResult) -> Picture:
    """Add the live loads at the limit, in newtons, hinges, and joints that slide; all move with their blocks.

    A push acts on every block: it is drawn as one arrow, at the middle of the mass. A tilt has no arrow.
    """
    block, force, point = _live(result)
    size = np.linalg.norm(force, axis=1)
    joints = [joint for joint in moving_joints(result) if joint.kind != "part"][:POINT_LIMIT]
    going = result.contacts.a[[joint.contact for joint in joints]] if joints else np.zeros(0, np.int64)
    at = np.array([*point, *(joint.point for joint in joints)]).reshape(-1, 3)
    who, slides = np.concatenate([block, going]).astype(np.int64), np.array([j.kind == "slide" for j in joints], bool)
    if drawn.motion is not None and result.mechanism is not None:
        known = np.where(who < 0, 0, who)
        there = moved(at, known, result.assembly.mass.centroid, result.mechanism, drawn.motion.time)
        at = np.where((who < 0)[:, None], at, there)
    tip = at[: len(block)]
    longest = 1.6 * float(np.cbrt(np.mean(np.abs(result.assembly.mass.volume)))) / float(np.max(size, initial=1e-300))
    return replace(
        drawn,
        load=np.stack([tip - longest * force, tip], 1),
        load_text=tuple(force_text(float(one)) for one in size),
        hinge=at[len(block) :][~slides],
        slide=at[len(block) :][slides],
    )


def _live(result: LimitResult) -> tuple[Ints, Floats, Floats]:
    """Block (-1: all of them), force (N) and point (m) of each live load, at the multiplier that is known best."""
    live, whole, multiplier = result.live, result.assembly, result.value
    number = {one.id: k for k, one in enumerate(whole.blocks)}
    if live.kind == "load" and np.isfinite(multiplier):
        block = np.array([number[one.block] for one in live.loads])
        point = [whole.mass.centroid[k] if p.point is None else p.point for k, p in zip(block, live.loads, strict=True)]
        return block, multiplier * np.array([one.force for one in live.loads]), np.array(point)
    mass = whole.densities(float(result.assumed.get("density", np.nan))) * np.abs(whole.mass.volume) * ~result.fixed
    if live.push is None or not np.isfinite(multiplier * mass.sum()):
        return np.zeros(0, np.int64), NOWHERE, NOWHERE
    push = multiplier * STANDARD_GRAVITY * mass.sum() * np.array(live.push)
    return np.array([-1]), push[None], (mass @ whole.mass.centroid / mass.sum())[None]


def still(assembly: Assembly, fixed: Bools, gravity: Floats = NO_GRAVITY) -> Picture:
    """Blocks at rest without forces; `fixed` (n,) are supports.

    Gravity (3,), m/s2, is drawn where it is not 0.
    """
    mesh = outlines(assembly.mesh, FACE_LIMIT)
    edge = feature_edges(mesh)
    group = classes(np.full(len(assembly), np.nan), fixed)
    edge = edge if len(edge) <= EDGE_LIMIT else NOTHING
    return Picture(mesh, group, "nothing", edge, NOTHING, NOTHING, 0.0, gravity, None, ())


def followed(result: LimitResult) -> Picture | None:
    """The blocks where a pushover ends, with their edges where they stood; None where none was asked for."""
    curve = result.pushover
    if curve is None:
        return None
    drawn = still(result.assembly, result.fixed, result.gravity)
    mesh = drawn.mesh
    body = np.repeat(np.arange(len(mesh)), np.diff(mesh.vertex_start))
    away = mesh.vertex - result.assembly.mass.centroid[body]
    vertex = curve.placed[body] + np.einsum("kij,kj->ki", curve.turned[body], away)
    gone = replace(mesh, vertex=vertex)
    return replace(drawn, mesh=gone, ghost=drawn.edge, edge=feature_edges(gone) if len(drawn.edge) else drawn.edge)


def settled(result: Result) -> Picture | None:
    """The blocks at the last state of rest of a settlement, with their edges where they stood; None without one."""
    if result.path is None or result.path.last is None:
        return None
    last, before = result.path.last, still(result.assembly, result.fixed, result.gravity)
    return replace(still(last.assembly, last.fixed, last.gravity), ghost=before.edge)


def displaced(drawn: Picture) -> Picture | None:
    """The same blocks displaced virtually, without the resultants; None where there is no coupled state."""
    if drawn.virtual is None:
        return None
    return replace(
        drawn,
        mesh=replace(drawn.mesh, vertex=drawn.virtual.vertex),
        rest=drawn.mesh.vertex,
        ghost=drawn.edge,
        edge=drawn.virtual_edge,
        arrow=NOTHING,
        thrust=NOTHING,
    )


def without_points(drawn: Picture) -> Picture:
    """The same without the points that press and their friction: a flat drawing of the resultants is full enough."""
    return replace(drawn, press=NOWHERE, rub=NOTHING)


def _with_points(drawn: Picture, result: Result) -> Picture:
    """Add what belongs to single points: where a coupled state presses and rubs, and where joints would pull."""
    found, needed = pressing(result), needed_tension(result)
    if found is not None:
        rub, rubbing = _friction(result, found)
        motion = _motion(result, drawn.mesh, result.displacement)
        edge = NOTHING if motion is None else feature_edges(replace(drawn.mesh, vertex=motion.vertex))
        drawn = replace(
            drawn,
            press=found.point[:POINT_LIMIT],
            rub=rub,
            rubbing=rubbing,
            virtual=motion,
            virtual_edge=edge if len(drawn.edge) else NOTHING,
        )
    if needed is not None and result.tension is not None:
        some = needed.point[:POINT_LIMIT]
        pull = result.tension[some]
        drawn = replace(drawn, pull=result.contacts.point[some], pull_share=pull / pull.max(initial=1e-300))
    return drawn


def _friction(result: Result, found: Pressing) -> tuple[Floats, float]:
    """Arrows from the points; the largest is half a block size long."""
    some = found.rubbing[:ARROW_LIMIT]
    if not len(some):
        return NOTHING, 0.0
    size = np.linalg.norm(found.friction[some], axis=1)
    some = some[size > SPECK * size[0]]
    step = 0.5 * _size(result) / float(size[0]) * found.friction[some]
    return np.stack([found.point[some], found.point[some] + step], 1), float(size[0])


def _size(result: Result) -> float:
    """Mean size (m) of a free block."""
    volume = np.abs(result.assembly.mass.volume)
    free = volume[~result.fixed] if not result.fixed.all() else volume
    return float(np.mean(free) ** (1.0 / 3.0))


def _motion(result: Result, mesh: Polyhedra, velocity: Floats | None) -> Motion | None:
    """Follow a motion so far that the largest displacement is a quarter of the mean size of a free block."""
    if velocity is None or not np.any(velocity):
        return None
    centroid = result.assembly.mass.centroid
    return drawn_motion(mesh.vertex, mesh.vertex_body, centroid, velocity, 0.25 * _size(result))


def _quantity(result: Result, motion: Motion | None) -> tuple[Quantity, Floats]:
    if motion is not None:
        return "movement", motion.travel / max(float(np.max(motion.travel, initial=0.0)), 1e-300)
    if result.utilisation is not None and len(result.utilisation):
        return "utilisation", block_utilisation(result)
    return "nothing", np.full(len(result.assembly), np.nan)


def _arrows(result: Result, found: Resultants | None, notes: list[str]) -> tuple[Floats, float]:
    """Resultants through the centres of pressure, along the way the load goes; the largest is 0.9 block sizes long."""
    if found is None or not len(found.loaded):
        return NOTHING, 0.0
    some = found.loaded[:ARROW_LIMIT]
    if len(found.loaded) > ARROW_LIMIT:
        notes.append(f"Arrows show the largest {ARROW_LIMIT:,} of {len(found.loaded):,} contact forces.")
    force = found.force[some]
    force = np.where((force @ result.gravity < 0.0)[:, None], -force, force)  # of action and reaction, the downward one
    largest = float(np.max(np.linalg.norm(force, axis=1)))
    volume = np.abs(result.assembly.mass.volume)
    length = 0.9 * float(np.mean(volume)) ** (1.0 / 3.0) / largest
    half = 0.5 * length * force
    return np.stack([found.centre[some] - half, found.centre[some] + half], 1), largest


def _given(result: Result, notes: list[str]) -> Floats:
    """Given loads on free blocks where they act on the model at rest; the largest is 0.9 block sizes long."""
    rows = [row for row in result.assembly.loads if not result.fixed[row.block]]
    if not rows:
        return NOTHING
    force, point = np.array([row.force for row in rows]), np.array([row.point for row in rows])
    size = np.linalg.norm(force, axis=1)
    some = np.argsort(-size, kind="stable")[:ARROW_LIMIT]
    notes.append(f"Black arrows are the given loads on the model at rest, the longest {force_text(size.max())}.")
    return np.stack([point[some] - 0.9 * _size(result) / size.max() * force[some], point[some]], 1)


def feature_edges(mesh: Polyhedra) -> Floats:
    """(e, 2, 3) m: edges where the surface turns by more than 20 degrees, each once."""
    if not len(mesh.corner):
        return NOTHING
    normal = unit(face_normals(mesh))
    here, there = mesh.corner, mesh.corner[mesh.next_corner]
    key = np.minimum(here, there) * len(mesh.vertex) + np.maximum(here, there)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    count = np.diff(np.append(first, len(order)))
    one, two = order[first], order[np.minimum(first + 1, len(order) - 1)]
    turn = np.einsum("ei,ei->e", normal[mesh.corner_face[one]], normal[mesh.corner_face[two]])
    rough = np.diff(mesh.face_start)[mesh.face_body[mesh.corner_face[one]]] > ROUGH
    keep = one[(count != 2) | (turn < np.where(rough, CRISP, SHARP))]
    return np.stack([mesh.vertex[here[keep]], mesh.vertex[there[keep]]], 1)


def outlines(mesh: Polyhedra, limit: int) -> Polyhedra:
    """The same mesh while it has at most `limit` triangles; beyond, blocks of many faces as convex outlines.

    An outline is the hull of the vertices that lie furthest in 64 directions, so it has at most 124 triangles.
    """
    count = np.diff(mesh.corner_start) - 2
    body_triangles = np.bincount(mesh.face_body, count, len(mesh))
    if body_triangles.sum() <= limit:
        return mesh
    from scipy.spatial import ConvexHull

    k = np.arange(64) + 0.5  # Fibonacci sphere
    height, angle = 1.0 - k / 32.0, np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - height**2)
    direction = np.stack([ring * np.cos(angle), ring * np.sin(angle), height])
    bodies: list[tuple[Floats, list[list[int]]]] = []
    for i in range(len(mesh)):
        low, high = mesh.vertex_start[i], mesh.vertex_start[i + 1]
        vertex = mesh.vertex[low:high]
        if body_triangles[i] > 124:
            vertex = vertex[np.unique(np.argmax((vertex - vertex[0]) @ direction, axis=0))]
            hull = ConvexHull(vertex)
            outward = np.linalg.det(vertex[hull.simplices] - vertex.mean(axis=0)) > 0.0
            bodies.append((vertex, np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1]).tolist()))
        else:
            spans = range(mesh.face_start[i], mesh.face_start[i + 1])
            faces = [mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]] - low for f in spans]
            bodies.append((vertex, [face.tolist() for face in faces]))
    return pack(bodies)
