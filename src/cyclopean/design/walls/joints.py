"""From a pattern on a surface to stones with exact joints: what is drawn is what is checked.

Every corner of the pattern becomes one normal of the surface with a front end F and a back end B, the rails. Both
stones beside an edge (e1, e2) build their side faces from the same two rails, and the joint between them is

    [F1, F2, B2, B1]

to the last bit, on any curvature, with nothing detected. Stones, ground and contacts share these floats.

On a plane the four corners lie in one plane. On a curved surface two normals seldom do, and a rigid contact must be
flat. The stones then get two triangles, along the shorter diagonal, the same in both. The contact gets those triangles
too; or, where the corners lie within `NEARLY` of their best plane (the one midway between the diagonals), the quad laid
into that plane: a fold of a hair's breadth would else be taken for a key that stops all sliding across it. How many
became which, and how far the corners were moved, is reported.

Fronts and backs that are not flat are fans of triangles about the point of the surface at the cell's centroid, or ears
of the polygon where the centroid does not see all corners.

The wall stands on one fixed block, the ground, whose top carries the lowest joints and a margin around them.

Source: one joint per shared edge of the drawn pattern instead of re-detection from meshes follows section 5.5 of the
chapter that this program was created from.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.design.options import not_negative, one_of
from cyclopean.design.walls.pattern import Pattern
from cyclopean.design.walls.surfaces import Surface, Thickness
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision, mesh_faults
from cyclopean.geometry.frames import cross_2d, unit
from cyclopean.geometry.polygon import ears

__all__ = ["JointReadout", "Masonry", "Warped", "base_edges", "jointed", "stone_ids", "with_open_joints"]

Warped = Literal["auto", "triangles", "plane"]  # a best plane if the corners nearly lie in one, else triangles
Face = tuple[int, ...]

FLAT = 1e-9  # of the wall's size: corners nearer to their plane than this lie in it
SHORT = 1e-6  # of the wall's size: an edge below it is a corner, and its joint bears nothing
NEARLY = 1e-3  # of the wall's size, a fifth of what a check accepts: a joint less warped than this passes for flat
MARGIN = 0.5  # of the depth: how far the ground reaches beyond the stones
HALVED = 6  # times that a bevel may be made narrower, where a stone is too narrow for it
FOOTING = 1.0  # of the depth: how far the ground goes down below the lowest stone


@dataclass(frozen=True, slots=True)
class Masonry:
    """What the stones of a wall are made of, and how their joints are."""

    density: float | None = None  # kg/m3 of every block; None = not said
    mu: float | None = None  # friction coefficient of every joint; None = not said
    warped: Warped = "auto"  # what a contact becomes whose corners lie in no plane

    def __post_init__(self) -> None:
        if self.mu is not None:
            object.__setattr__(self, "mu", not_negative("mu", self.mu))
        one_of("warped", self.warped, Warped)


@dataclass(frozen=True, slots=True)
class JointReadout:
    """What became of the edges."""

    joints: int  # edges that two stones, or a stone and the ground, share
    warped: int  # of these, joints whose four corners lie in no plane
    folded: int  # of those, joints that became two triangles; the others became best planes
    warp: float  # m; how far the corners of the worst of the warped lie from its best plane
    deviation: float  # m; how far a contact's corner was moved into a best plane at most
    short: int  # edges too short to bear anything, left out of the contacts


@dataclass(frozen=True, slots=True, eq=False)
class _Rails:
    """Both ends of every corner, and how the quad over every edge is cut."""

    front: Floats  # (V, 3) m
    back: Floats  # (V, 3) m
    edge: Ints  # (E, 2)
    off: Floats  # (E,) distance (m) of the quad's corners from its best plane
    warped: Bools  # (E,) quads that are two triangles
    from_first: Bools  # (E,) cut from the front of edge[0] to the back of edge[1], else from the front of edge[1]
    size: float  # m

    def cuts(self) -> dict[tuple[int, int], tuple[bool, bool]]:
        """Of each edge, either way along it: whether it is warped, and cut from the front of the first."""
        found = {}
        for (a, b), bent, first in zip(self.edge.tolist(), self.warped.tolist(), self.from_first.tolist(), strict=True):
            found[a, b], found[b, a] = (bent, first), (bent, not first)
        return found


def jointed(
    pattern: Pattern,
    surface: Surface,
    thickness: Thickness,
    masonry: Masonry,
    name: str = "polygonal wall",
) -> tuple[Assembly, JointReadout]:
    """Stones, ground and joints of a pattern laid on a surface.

    Parameters
    ----------
    pattern : Pattern
        Cells in (u, v), m.
    surface : Surface
        Where (u, v) lies in space; the face of the wall. The stones lie behind it, against its normal.
    thickness : Thickness
        Of the wall along the normal.
    masonry : Masonry
        Density, friction, and what becomes of warped joints.
    name : str
        Of the assembly.

    Returns
    -------
    assembly : Assembly
        Block 0 is the fixed ground, block k + 1 is cell k; contacts from the lower block number to the higher.
    readout : JointReadout

    Raises
    ------
    InputError
        A pattern that does not fit on the surface: stones turned inside out, a foot that faces up or down.
    """
    cells, density = pattern.subdivision, masonry.density
    rails = _rails(cells, surface, thickness)
    ids = stone_ids(pattern)
    blocks = [_ground(pattern, rails, thickness, density)]
    blocks += [
        Block(ids[k], vertices, faces, density, False, f"course-{pattern.course[k] + 1}")
        for k, (vertices, faces) in enumerate(_stones(cells, surface, thickness, rails))
    ]
    contacts, readout = _contacts(pattern, rails, masonry)
    assembly = Assembly(tuple(blocks), contacts, name=name)
    if bad := mesh_faults(assembly.mesh):
        block, what = bad[0]
        raise InputError(
            f"surface: block '{assembly.blocks[block].id}' {what}; bend the surface less, or make the stones smaller"
        )
    return assembly, readout


def stone_ids(pattern: Pattern) -> list[str]:
    """Name of each cell: `c03-b07` is the seventh from the left in the third course, both counted from 1."""
    u = pattern.subdivision.centroids()[:, 0]
    digits = [max(2, len(str(n))) for n in (int(pattern.course.max()) + 1, int(np.bincount(pattern.course).max()))]
    ids = [""] * len(u)
    number: dict[int, int] = {}
    for k in np.lexsort((u, pattern.course)).tolist():
        course = int(pattern.course[k]) + 1
        number[course] = number.get(course, 0) + 1
        ids[k] = f"c{course:0{digits[0]}d}-b{number[course]:0{digits[1]}d}"
    return ids


def base_edges(pattern: Pattern) -> Ints:
    """Edges on the ground, from left to right."""
    cells = pattern.subdivision
    u, v = cells.vertex.T
    ground = np.zeros(len(u)) if pattern.foot is None else np.interp(u, pattern.foot[:, 0], pattern.foot[:, 1])
    on = np.abs(v - ground) <= SHORT * _size(cells)
    both = on[cells.edge].all(axis=1) & (cells.side < 0).any(axis=1)
    found = np.flatnonzero(both & (u[cells.edge[:, 0]] != u[cells.edge[:, 1]]))
    return np.asarray(found[np.argsort(u[cells.edge[found]].min(axis=1), kind="stable")])


def with_open_joints(
    pattern: Pattern, surface: Surface, thickness: Thickness, *, gap: float = 0.01, chamfer: float = 0.0
) -> tuple[Block, ...]:
    """Stones set back from their joints, for pictures and for the shop; this is not the model that is checked.

    Parameters
    ----------
    pattern, surface, thickness
        As for `jointed`.
    gap : float
        Width (m) of the open joints; every stone gives half of it.
    chamfer : float
        Width and depth (m) of the bevel along the front edges; less on a stone that is too narrow for it.

    Returns
    -------
    tuple of Block
        One for each cell, with the ids of `jointed`, no ground.

    Raises
    ------
    InputError
        A stone that has nothing left.
    """
    not_negative("gap", gap)
    if not not_negative("chamfer", chamfer) < thickness.depth:
        raise InputError(f"chamfer: {chamfer:g} m is not less than the depth {thickness.depth:g} m")
    ids, cells = stone_ids(pattern), pattern.subdivision
    blocks = []
    for k, name in enumerate(ids):
        rings, bevel = _set_back(cells.ring(k), gap / 2.0, chamfer)
        if not rings:
            raise InputError(
                f"gap: {gap:g} m with a chamfer of {chamfer:g} m leaves nothing of stone '{name}'; give less"
            )
        front, back = thickness.rails(surface, rings[-1])
        levels = [front, back]
        if bevel:
            levels = [thickness.rails(surface, rings[0])[0], front + bevel * unit(back - front), back]
        vertices, faces = _lofted(rings[0], rings[-1], levels)
        blocks.append(Block(name, vertices, faces, group=f"course-{pattern.course[k] + 1}"))
    return tuple(blocks)


def _set_back(ring: Floats, by: float, chamfer: float) -> tuple[list[Floats], float]:
    """Ring of a stone with open joints, and before it, corner for corner, that within its bevel if it has one.

    An arm of a stone that is thinner than the gap is cut off; what is left begins a ring of its own. A bevel that does
    not fit is halved until it does; how wide it became is the second answer. No rings where nothing is left.
    """
    outer = _inset(ring, by)
    if len(outer) and not _is_simple(outer):
        ring, outer, by = (*(_largest_within(ring, by),) * 2, 0.0)
    if not len(outer):
        return [], 0.0
    if not chamfer:
        return [outer], 0.0
    for bevel in chamfer / 2.0 ** np.arange(HALVED):
        inner = _inset(ring, by + bevel)
        if len(inner) and _is_simple(inner):
            return [inner, outer], float(bevel)
    return [], 0.0


def _is_simple(ring: Floats) -> bool:
    """Whether a ring that may have corners on each other does not cross itself and runs counter-clockwise."""
    import shapely

    own = ring[np.any(ring != np.roll(ring, 1, axis=0), axis=1)]
    return len(own) >= 3 and bool(shapely.is_valid(shapely.polygons(own))) and bool(shapely.LinearRing(own).is_ccw)


def _largest_within(ring: Floats, by: float) -> Floats:
    """Largest piece of what lies at least so far (m) within a ring, (k, 2); empty where there is none."""
    import shapely

    part = shapely.get_parts(shapely.buffer(shapely.polygons(ring), -by, join_style="mitre", mitre_limit=1e3))
    if not len(part):
        return np.zeros((0, 2))
    edge = shapely.get_exterior_ring(part[int(shapely.area(part).argmax())])
    corner = np.asarray(shapely.get_coordinates(edge)[:-1])
    return corner if shapely.is_ccw(edge) else corner[::-1]


def _size(cells: Subdivision) -> float:
    return float(np.hypot(*np.ptp(cells.vertex, axis=0)))


def _rails(cells: Subdivision, surface: Surface, thickness: Thickness) -> _Rails:
    front, back = thickness.rails(surface, cells.vertex)
    first, second = cells.edge.T
    off, size = _off_plane(np.stack([front[first], front[second], back[second], back[first]], 1)), _size(cells)
    one, other = (
        np.linalg.norm(front[first] - back[second], axis=1),
        np.linalg.norm(front[second] - back[first], axis=1),
    )
    from_first: Bools = one <= other + FLAT * size  # on a cylinder they are equal: rounding must not choose
    return _Rails(front, back, cells.edge, off, ~(off <= FLAT * size), from_first, size)


def _off_plane(quad: Floats) -> Floats:
    """(q,) distance (m) of the corners of (q, 4, 3) from the plane midway between the diagonals: all four the same."""
    one, other = quad[:, 2] - quad[:, 0], quad[:, 3] - quad[:, 1]
    normal = np.cross(one, other)
    length = np.linalg.norm(normal, axis=1)
    apart = np.abs(((quad[:, 1] - quad[:, 0]) * normal).sum(1))
    return np.asarray(np.divide(apart, 2.0 * length, out=np.zeros(len(quad)), where=length > 0.0))


def _stones(
    cells: Subdivision, surface: Surface, thickness: Thickness, rails: _Rails
) -> list[tuple[Floats, tuple[Face, ...]]]:
    """Vertices and faces of every cell: fronts, then backs, then the centres of the two where they are fans."""
    cuts, centre = rails.cuts(), cells.centroids()
    middle = np.stack(thickness.rails(surface, centre), 1)
    stones = []
    for cell, ring in enumerate(cells.rings()):
        sides: list[Face] = []
        k = len(ring)
        for i in range(k):
            j = (i + 1) % k
            warped, from_first = cuts[ring[i], ring[j]]
            if not warped or from_first:
                sides += _cut((i, i + k, j + k, j), warped, True)
            else:
                sides += [(i, i + k, j), (j, i + k, j + k)]
        points = np.concatenate([rails.front[ring], rails.back[ring]])
        vertices, caps = _caps(cells.vertex[ring] - centre[cell], points, middle[cell], FLAT * rails.size)
        stones.append((vertices, (*caps, *sides)))
    return stones


def _caps(uv: Floats, points: Floats, middle: Floats, tolerance: float) -> tuple[Floats, tuple[Face, ...]]:
    """Front and back of one stone over its ring (k, 2) about the centroid; points are k fronts, then k backs."""
    k = len(uv)
    flat = [_flat(points[side], tolerance) for side in (slice(0, k), slice(k, 2 * k))]
    caps: list[Face] = []
    if all(flat):
        return points, (tuple(range(k)), tuple(range(2 * k - 1, k - 1, -1)))
    twice = cross_2d(uv, np.roll(uv, -1, axis=0))
    if np.all(twice > 1e-9 * np.abs(twice).sum()):  # the centroid sees every side from within
        points = np.concatenate([points, middle])
        caps = [(i, (i + 1) % k, 2 * k) for i in range(k)]
        caps += [((i + 1) % k + k, i + k, 2 * k + 1) for i in range(k)]
        return points, tuple(caps)
    triangles = ears(uv, range(k))
    return points, (*triangles, *((c + k, b + k, a + k) for a, b, c in triangles))


def _flat(point: Floats, tolerance: float) -> bool:
    """Whether all corners lie in the plane of their Newell normal."""
    here = point - point[0]
    normal = np.cross(here[1:-1], here[2:]).sum(0)
    length = float(np.linalg.norm(normal))
    return length > 0.0 and float(np.abs(here @ normal).max()) <= tolerance * length


def _contacts(pattern: Pattern, rails: _Rails, masonry: Masonry) -> tuple[Contacts, JointReadout]:
    """One flat polygon for each shared edge, or two triangles where it is warped."""
    cells = pattern.subdivision
    shared = (cells.side >= 0).all(axis=1) | np.isin(np.arange(len(cells.edge)), base_edges(pattern))
    length = np.linalg.norm(rails.front[cells.edge[:, 1]] - rails.front[cells.edge[:, 0]], axis=1)
    bears = shared & (length > SHORT * rails.size)
    edge = np.flatnonzero(bears)
    b, a = (cells.side[edge] + 1).T  # the normal of [F1, F2, B2, B1] points to the left of the edge
    order = np.lexsort((edge, np.maximum(a, b), np.minimum(a, b)))
    bent = rails.warped
    passing = {"auto": NEARLY * rails.size, "triangles": -1.0, "plane": np.inf}[masonry.warped]
    folded = bent & ~(rails.off <= passing)
    pairs: list[tuple[int, int]] = []
    polygons: list[Floats] = []
    for i in order.tolist():
        k = int(edge[i])
        first, second = cells.edge[k]
        quad = np.stack([rails.front[first], rails.front[second], rails.back[second], rails.back[first]])
        if bent[k] and not folded[k]:  # laid into the plane midway between its diagonals, equally far from all four
            normal = np.cross(quad[2] - quad[0], quad[3] - quad[1])
            normal /= np.linalg.norm(normal)
            quad = quad - ((quad - quad.mean(0)) @ normal)[:, None] * normal
        for piece in _cut((0, 1, 2, 3), bool(folded[k]), bool(rails.from_first[k])):
            pairs.append((int(min(a[i], b[i])), int(max(a[i], b[i]))))
            polygons.append(quad[list(piece[::-1] if a[i] > b[i] else piece)])
    friction = None if masonry.mu is None else [masonry.mu] * len(pairs)
    readout = JointReadout(
        joints=int(bears.sum()),
        warped=int(bent[edge].sum()),
        folded=int(folded[edge].sum()),
        warp=float(rails.off[edge][bent[edge]].max(initial=0.0)),
        deviation=float(rails.off[edge][(bent & ~folded)[edge]].max(initial=0.0)),
        short=int((shared & ~bears).sum()),
    )
    return Contacts.of(pairs, polygons, friction), readout


def _ground(pattern: Pattern, rails: _Rails, thickness: Thickness, density: float | None) -> Block:
    """The fixed block below: stations from left to right, each with a margin, front, back, margin and two feet.

    The outline of a station is M B F M' below which the feet lie; the strip between front and back carries the joints.
    """
    cells = pattern.subdivision
    base = base_edges(pattern)
    if not len(base):
        raise InputError("base: no stone stands on the ground; openings take its whole length")
    u = cells.vertex[:, 0]
    corner = np.unique(cells.edge[base])
    corner = corner[np.argsort(u[corner], kind="stable")]
    station = _stations(rails.front[corner], rails.back[corner], MARGIN * thickness.depth, FOOTING * thickness.depth)
    cuts, count = rails.cuts(), len(station)
    known = [None, *(cuts.get(ends) for ends in pairwise(corner.tolist())), None]  # of the strip that carries joints
    faces: list[Face] = [(0, 1, 2, 3, 4, 5), tuple(6 * (count - 1) + k for k in (5, 4, 3, 2, 1, 0))]
    for i in range(count - 1):
        for k in range(6):
            ring = (6 * i + k, 6 * (i + 1) + k, 6 * (i + 1) + (k + 1) % 6, 6 * i + (k + 1) % 6)
            off = float(_off_plane(station.reshape(-1, 3)[None, list(ring)])[0])
            faces += _cut(ring, *((k == 1 and known[i]) or (not off <= FLAT * rails.size, True)))
    return Block("ground", station.reshape(-1, 3), tuple(faces), density, True, "ground")


def _cut(ring: Face, warped: bool, from_first: bool) -> list[Face]:
    """A quad, or its two triangles: cut from its first corner, else from its second."""
    p, q, r, s = ring
    if not warped:
        return [ring]
    return [(p, q, r), (p, r, s)] if from_first else [(p, q, s), (q, r, s)]


def _stations(front: Floats, back: Floats, margin: float, footing: float) -> Floats:
    """(s, 6, 3): front margin, front, back, back margin, and the two feet below the margins, ends drawn out."""
    across = unit(back - front)
    level = np.linalg.norm(across[:, :2], axis=1)
    if not np.all(level > 0.1):
        raise InputError("surface: at its foot it faces almost straight up or down, and no wall can stand on that")
    if not np.all((np.diff(front, axis=0) * np.diff(back, axis=0)).sum(1) > 0.0):
        raise InputError("surface: the back of the wall folds into itself at its foot; bend it less or make it thinner")
    while True:
        top = np.stack([front - margin * across, front, back, back + margin * across], 1)
        along = np.diff(top, axis=0)
        if np.all((along * along[:, 1:2]).sum(-1) > 0.0):  # front and back do agree, so this ends
            break
        margin /= 2.0  # towards the centre of a tight curve there is less room
    ends = []
    for here, inward in ((0, 1), (-1, -2)):
        out = front[here] - front[inward] if len(front) > 1 else np.zeros(3)
        out[2] = 0.0
        ends.append(top[here] + margin * out / np.linalg.norm(out))
    top = np.concatenate([ends[:1], top, ends[1:]])
    feet = top[:, [3, 0]].copy()
    feet[:, :, 2] = top[:, :, 2].min() - footing
    return np.concatenate([top, feet], 1)


def _inset(ring: Floats, by: float) -> Floats:
    """The ring (k, 2) with every side moved inwards, corner for corner; empty where nothing is left.

    A side that shrinks to nothing is left out: its corners come to lie on each other, where its neighbours meet.
    """
    along = np.roll(ring, -1, axis=0) - ring
    along /= np.linalg.norm(along, axis=1)[:, None]
    inward = np.stack([-along[:, 1], along[:, 0]], 1)
    through = (ring * inward).sum(1) + by  # side i is inward[i] . x = through[i]
    live = list(range(len(ring)))
    while len(live) >= 3:
        before = live[-1:] + live[:-1]
        corner = np.stack([inward[before], inward[live]], 1)
        turn = np.linalg.det(corner)
        if not np.all(np.abs(turn) > 1e-6):  # two sides in one line: the corner moves straight inwards
            straight = np.abs(turn) <= 1e-6
            corner[straight, 0] = along[np.array(live)[straight]]
        want = np.stack([through[before], through[live]], 1)
        kept = ring[live] + by * inward[live]
        want[np.abs(turn) <= 1e-6, 0] = (along[live] * kept).sum(1)[np.abs(turn) <= 1e-6]
        moved = np.linalg.solve(corner, want[..., None])[..., 0]
        length = ((np.roll(moved, -1, axis=0) - moved) * along[live]).sum(1)
        if np.all(length > 0.0):
            place = np.searchsorted(live, np.arange(len(ring))) % len(live)  # the next side that is left
            return np.asarray(moved[place])
        del live[int(length.argmin())]
    return np.zeros((0, 2))


def _lofted(first: Floats, last: Floats, levels: Sequence[Floats]) -> tuple[Floats, tuple[Face, ...]]:
    """Body of triangles through levels of k corners each, front to back; `first` and `last` are the ends in (u, v)."""
    k = len(first)
    point = np.concatenate(list(levels))
    vertex, name = np.unique(point, axis=0, return_inverse=True)
    name = name.ravel()
    faces: list[Face] = []
    for ring, offset in ((first, 0), (last, k * (len(levels) - 1))):
        own = np.flatnonzero(np.any(ring != np.roll(ring, 1, axis=0), axis=1))
        cap = [tuple(int(own[i]) + offset for i in ear) for ear in ears(ring[own], range(len(own)))]
        faces += cap if not offset else [ear[::-1] for ear in cap]
    for low in range(0, k * (len(levels) - 1), k):
        for i in range(k):
            j = (i + 1) % k
            faces += [(low + i, low + i + k, low + j + k), (low + i, low + j + k, low + j)]
    named = [tuple(int(name[i]) for i in face) for face in faces]
    return np.asarray(vertex), tuple(face for face in named if len(set(face)) == 3)
