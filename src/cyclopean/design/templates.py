"""Parametric models with exact contacts: stacks, walls, arches, barrel vaults, domes.

Walls, arches, vaults and domes are one thing: bricks on a lattice of points P[v, u, w] with u along the course, v from
bed to bed and w from the inner side to the outer. Blocks and contacts both take their corners from the lattice, so a
contact lies on the faces of its two blocks to the last bit. A course is a row of edges on that lattice, and odd courses
are shifted by half a unit; every bed joint therefore falls into pieces one or two lattice steps wide. The quads of a
dome are planar too: four points at two meridians and two radii (bed), or two elevations (shell), are an isosceles
trapezoid.

By hand: a semicircular arch of n voussoirs with flat facets, radii r < R and depth d has the volume
n d (R^2 - r^2) sin(pi / n) / 2, against pi d (R^2 - r^2) / 2 of the true ring.

>>> from cyclopean.design import wall
>>> model = wall(10, 10)
>>> len(model), len(model.contacts)
(106, 285)
"""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Literal

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.design.options import at_least, finite, not_negative, one_of, positive
from cyclopean.errors import InputError

__all__ = ["arch", "brick_faces", "dome", "numbered", "stack", "vault", "wall"]

Faces = tuple[tuple[int, ...], ...]
Ground = Literal["slab", "course"]
Springers = Literal["wedges", "fixed"]

SPRINGER = np.radians(6.0)  # a springer is a wedge of at most this angle: enough to see and to bear on
SUPPORTS = ("ground", "springer-left", "springer-right", "ring")  # courses that are held


def stack(
    count: int,
    size: Sequence[float] = (1.0, 1.0, 1.0),
    *,
    offset: float | Sequence[float] = 0.0,
    slope: float = 0.0,
    ground: bool = True,
    density: float | None = None,
    mu: float | None = None,
) -> Assembly:
    """Cuboids on top of each other, each shifted along x over the one below.

    Parameters
    ----------
    count : int
        Number of cuboids.
    size : (3,) float
        Width, depth and height of each (m).
    offset : float or sequence of float
        Shift (m) of every block over the one below, or a list with one shift for each, the lowest included.
    slope : float
        The whole model is turned by this many degrees so that the ground falls towards +x.
    ground : bool
        Put a fixed slab `ground` below; otherwise the lowest block is the support.
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        `ground` and blocks `b01`... from below, with one contact between neighbours.

    Raises
    ------
    InputError
        A count, size or angle that cannot be built, or a shift after which two blocks would not touch.
    """
    at_least("count", count, 1 if ground else 2)
    if len(size) != 3:
        raise InputError(f"size: expected three numbers, got {len(size)}")
    width, depth, height = (positive("size", s) for s in size)
    angle = np.radians(_between("slope", slope, -90.0, 90.0))
    given = [0.0, *[offset] * (count - 1)] if isinstance(offset, int | float) else list(offset)
    if len(given) != count:
        raise InputError(f"offset: expected one shift or {count}, got {len(given)}")
    shift = np.array([finite("offset", s) for s in given])
    reach = np.array([2.0 * width if ground else np.inf] + [width] * (count - 1))
    if (bad := np.flatnonzero(~(np.abs(shift) < reach))).size:
        raise InputError(
            f"offset: block {bad[0] + 1} is shifted by {shift[bad[0]]:g} m and would not touch the one below"
        )
    left = np.cumsum(shift)
    low = np.stack([left, np.zeros(count), height * np.arange(count)], 1)
    high = np.stack([left + width, np.full(count, depth), height * np.arange(1, count + 1)], 1)
    names = numbered("b", count)
    if ground:
        low = np.concatenate([[[-width, -0.5 * depth, -0.5 * height]], low])
        high = np.concatenate([[[2.0 * width, 1.5 * depth, 0.0]], high])
        names = ["ground", *names]
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    turn = turn if angle else np.eye(3)  # exact where nothing turns
    a, b = np.maximum(low[:-1], low[1:]), np.minimum(high[:-1], high[1:])
    a[:, 2] = b[:, 2] = high[:-1, 2]
    quad = _boxes(a, b)[:, [0, 2, 6, 4]]  # counter-clockwise from above
    blocks = []
    for name, box in zip(names, _boxes(low, high), strict=True):
        group = "ground" if name == "ground" else "stack"
        blocks.append(Block(name, box @ turn.T, brick_faces(1, 1, False), density, name == names[0], group))
    pairs = np.arange(len(blocks) - 1)
    contacts = _quads(pairs, pairs + 1, quad @ turn.T, mu)
    return Assembly(tuple(blocks), contacts, name=f"stack of {count}")


def wall(
    columns: int,
    courses: int,
    *,
    length: float = 0.4,
    depth: float = 0.2,
    height: float = 0.2,
    ground: Ground = "slab",
    density: float | None = None,
    mu: float | None = None,
) -> Assembly:
    """Lay running bond: courses of equal blocks, odd ones shifted by half a block with a half block at each end.

    Parameters
    ----------
    columns : int
        Whole blocks in an even course.
    courses : int
        Number of free courses.
    length, depth, height : float
        Of a whole block (m), along x, y and z.
    ground : {"slab", "course"}
        The support: one slab under an even course, or a fixed even course, so that the lowest free one is odd.
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        Blocks `c03-b07`: course 3, seventh from -x, both counted from 1; `ground` or `ground-b07` are fixed.

    Raises
    ------
    InputError
        An option that cannot be built.
    """
    at_least("columns", columns, 1)
    at_least("courses", courses, 1)
    length, depth, height = positive("length", length), positive("depth", depth), positive("height", height)
    own = one_of("ground", ground, Ground) == "course"
    u = np.arange(2 * columns + 1) * (length / 2.0)
    z = np.arange(-1 if own else 0, courses + 1) * height
    lattice = np.zeros((len(z), len(u), 2, 3))
    lattice[..., 0], lattice[..., 1], lattice[..., 2] = u[:, None], [0.0, depth], z[:, None, None]
    labels = (["ground"] if own else []) + numbered("c", courses)
    edges = [_bond(columns, k % 2 == 1) for k in range(len(labels))]
    blocks, contacts = _lay(lattice, edges, labels, density, mu)
    name = f"wall of {columns} x {courses}"
    if own:
        return Assembly(tuple(blocks), contacts, name=name)
    margin = np.array([length / 2.0, depth, 0.0])
    low = -margin - [0.0, 0.0, height]
    high = np.array([u[-1], depth, 0.0]) + margin
    slab = Block("ground", _boxes(low[None], high[None])[0], brick_faces(1, 1, False), density, True, "ground")
    return Assembly((slab, *blocks), _stand_on_slab(lattice, edges[0], contacts, mu), name=name)


def arch(
    voussoirs: int,
    *,
    span: float | None = None,
    rise: float | None = None,
    radius: float | None = None,
    thickness: float = 0.8,
    depth: float = 1.0,
    springers: Springers = "wedges",
    facets: int = 1,
    density: float | None = None,
    mu: float | None = None,
) -> Assembly:
    """Turn a circular arch of equal voussoirs with radial joints, standing in the plane of x and z.

    Parameters
    ----------
    voussoirs : int
        Number of voussoirs, fixed ones included.
    span : float, optional
        Clear span (m) between the inner edges of the springing joints; 10 if neither it nor `radius` is given.
    rise : float, optional
        Height (m) of the inner crown above the springing; goes with `span`; half of it (a semicircle) if not given.
    radius : float, optional
        Radius of the centre line (m) of a semicircular arch, instead of `span`.
    thickness : float
        Radial thickness (m).
    depth : float
        Along y (m).
    springers : {"wedges", "fixed"}
        The supports: two thin fixed wedges below the springing joints, so that all voussoirs are free, or the first and
        the last voussoir themselves.
    facets : int
        Chords that stand for the curve of each voussoir. With k of them its weight and centroid approach those of the
        true annular sector as 1/k^2: the textbook minimum thickness needs about 32.
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        `springer-left`, voussoirs `v01`... from -x to +x, `springer-right`; the springing line is at z = 0.

    Raises
    ------
    InputError
        An option that cannot be built.
    """
    at_least("voussoirs", voussoirs, 3 if springers == "fixed" else 1)
    at_least("facets", facets, 1)
    thickness, depth = positive("thickness", thickness), positive("depth", depth)
    one_of("springers", springers, Springers)
    inner, half = _circle(span, rise, radius, thickness)
    if not 2.0 * half / (voussoirs * facets) < 0.9 * np.pi:
        raise InputError(
            f"voussoirs: {voussoirs} cannot span {np.degrees(2 * half):.0f} degrees; take more, or more facets"
        )
    labels = numbered("v", voussoirs)
    angle = np.linspace(-half, half, voussoirs * facets + 1)  # from the crown, clockwise seen from -y
    cosine = np.cos(half) if half < np.pi / 2.0 else 0.0
    if springers == "wedges":
        labels = ["springer-left", *labels, "springer-right"]
        angle = _with_springers(angle, 2.0 * half / voussoirs, facets)
    lattice = _barrel(angle, np.array([0.0, depth]), inner, thickness, base=inner * cosine)
    blocks, n = [], len(labels)
    faces = brick_faces(1, facets, True)
    for k, label in enumerate(labels):
        held = k in {0, n - 1}
        cut = lattice[k * facets : (k + 1) * facets + 1].reshape(-1, 3)
        blocks.append(Block(label, _frozen(cut), faces, density, held, "springers" if held else "arch"))
    joints = lattice[facets : facets * n : facets]
    pairs = np.arange(n - 1)
    contacts = _quads(pairs, pairs + 1, joints[:, [1, 1, 0, 0], [0, 1, 1, 0]], mu)
    return Assembly(tuple(blocks), contacts, name=f"arch of {voussoirs}")


def vault(
    voussoirs: int,
    columns: int,
    *,
    radius: float = 1.0,
    thickness: float = 0.2,
    length: float | None = None,
    density: float | None = None,
    mu: float | None = None,
) -> Assembly:
    """Semicircular barrel vault along y: rows of voussoirs with joints that break along the barrel.

    Parameters
    ----------
    voussoirs : int
        Free rows from springing to springing.
    columns : int
        Whole voussoirs in an even row; odd rows are shifted by half of one. With 1 there is no joint to break.
    radius : float
        Radius of the centre line (m).
    thickness : float
        Radial thickness (m).
    length : float, optional
        Of the barrel (m); by default voussoirs are twice as long as they are wide.
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        Rows of fixed springers `springer-left-b01`..., free voussoirs `r03-b07` (row 3 from -x, seventh along +y),
        `springer-right-b01`...; the springing line is at z = 0.

    Raises
    ------
    InputError
        An option that cannot be built.
    """
    at_least("voussoirs", voussoirs, 2)
    at_least("columns", columns, 1)
    radius, thickness = _ring(radius, thickness)
    whole = 2.0 * np.pi * radius / voussoirs * columns if length is None else positive("length", length)
    angle = _with_springers(np.linspace(-np.pi / 2.0, np.pi / 2.0, voussoirs + 1), np.pi / voussoirs, 1)
    along = np.linspace(0.0, whole, 2 * columns + 1)
    lattice = _barrel(angle, along, radius - thickness / 2.0, thickness, base=0.0)
    labels = ["springer-left", *numbered("r", voussoirs), "springer-right"]
    edges = [_bond(columns, k % 2 == 1 and columns > 1) for k in range(voussoirs + 2)]
    blocks, contacts = _lay(lattice, edges, labels, density, mu)
    return Assembly(tuple(blocks), contacts, name=f"vault of {voussoirs} x {columns}")


def dome(
    courses: int,
    segments: int,
    *,
    radius: float = 1.0,
    thickness: float = 0.15,
    oculus: float = 10.0,
    density: float | None = None,
    mu: float | None = None,
) -> Assembly:
    """Hemispherical dome: rings of equal blocks, each ring turned by half a block, on a fixed ring.

    Every block carries a meridian of vertices down its middle, where the joint of the next course falls, so that beds
    are flat pieces that both courses share.

    Parameters
    ----------
    courses : int
        Free rings from the springing to the oculus.
    segments : int
        Blocks in a ring, at least 3.
    radius : float
        Radius of the middle surface (m).
    thickness : float
        Radial thickness (m).
    oculus : float
        Half the opening angle at the top, in degrees from the axis: more than 0, less than 90.
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        Fixed `ring-b01`..., free blocks `c03-b07`: ring 3 from below, seventh block anticlockwise from +x.

    Raises
    ------
    InputError
        An option that cannot be built.
    """
    at_least("courses", courses, 1)
    at_least("segments", segments, 3)
    radius, thickness = _ring(radius, thickness)
    top = np.radians(90.0 - _between("oculus", oculus, 0.0, 90.0))
    rising = np.linspace(0.0, top, courses + 1)
    elevation = np.concatenate([[-min(rising[1], SPRINGER)], rising])
    azimuth = np.arange(2 * segments) * (np.pi / segments)
    shell = np.array([radius - thickness / 2.0, radius + thickness / 2.0])
    flat = np.cos(elevation)[:, None] * shell  # (levels, 2) distance from the axis
    lattice = np.zeros((courses + 2, 2 * segments, 2, 3))
    lattice[..., 0] = flat[:, None] * np.cos(azimuth)[:, None]
    lattice[..., 1] = flat[:, None] * np.sin(azimuth)[:, None]
    lattice[..., 2] = (np.sin(elevation)[:, None] * shell)[:, None]
    lattice = np.concatenate([lattice, lattice[:, :2]], 1)  # once round, to the last bit, and half a block further
    labels = ["ring", *numbered("c", courses)]
    edges = [np.arange(0, 2 * segments + 1, 2) + k % 2 for k in range(courses + 1)]
    blocks, contacts = _lay(lattice, edges, labels, density, mu, ring=2 * segments)
    return Assembly(tuple(blocks), contacts, name=f"dome of {courses} x {segments}")


# The lattice and the bricks on it.


@cache
def brick_faces(across: int, up: int, mirrored: bool) -> Faces:
    """Quads of a brick of `across` x `up` cells, vertex (v, u, w) at 2 (v (across + 1) + u) + w, outward.

    `mirrored` where the lattice is left-handed.
    """

    def at(v: int, u: int, w: int) -> int:
        return 2 * (v * (across + 1) + u) + w

    quads: list[tuple[int, ...]] = []
    for u in range(across):
        quads.append((at(0, u, 0), at(0, u + 1, 0), at(0, u + 1, 1), at(0, u, 1)))
        quads.append((at(up, u, 0), at(up, u, 1), at(up, u + 1, 1), at(up, u + 1, 0)))
    for v in range(up):
        quads.append((at(v, 0, 0), at(v, 0, 1), at(v + 1, 0, 1), at(v + 1, 0, 0)))
        quads.append((at(v, across, 0), at(v + 1, across, 0), at(v + 1, across, 1), at(v, across, 1)))
        for u in range(across):
            quads.append((at(v, u, 0), at(v + 1, u, 0), at(v + 1, u + 1, 0), at(v, u + 1, 0)))
            quads.append((at(v, u, 1), at(v, u + 1, 1), at(v + 1, u + 1, 1), at(v + 1, u, 1)))
    return tuple(q[::-1] for q in quads) if mirrored else tuple(quads)


def _lay(
    lattice: Floats,
    edges: Sequence[Ints],
    labels: Sequence[str],
    density: float | None,
    mu: float | None,
    ring: int = 0,
) -> tuple[list[Block], Contacts]:
    """Bricks and their joints: course k fills lattice levels k to k + 1 between its `edges`.

    `ring` is the number of lattice steps once round where courses close on themselves, and such courses are curved:
    their bricks take every lattice point; straight ones, on a left-handed lattice, only their corners.
    """
    count = [len(e) - 1 for e in edges]
    first = np.concatenate([[0], np.cumsum(count)])
    blocks: list[Block] = []
    a: list[Ints] = []
    b: list[Ints] = []
    quads: list[Floats] = []
    for k, edge in enumerate(edges):
        blocks += _course(lattice[k : k + 2], edge, labels[k], bool(ring), density)
        here = np.arange(count[k] if ring else count[k] - 1)
        a.append(first[k] + here)
        b.append(first[k] + (here + 1) % count[k])
        low, high, u = lattice[k], lattice[k + 1], edge[1:][here]
        quads.append(np.stack([low[u, 0], high[u, 0], high[u, 1], low[u, 1]], 1))  # towards +u, right-handed
        if k:
            below, above, from_, to = _overlaps(edges[k - 1], edge, ring)
            a.append(first[k - 1] + below)
            b.append(first[k] + above)
            quads.append(_bed(lattice[k], from_, to))
    quad = np.concatenate(quads)
    return blocks, _quads(np.concatenate(a), np.concatenate(b), quad if ring else quad[:, ::-1], mu)


def _course(levels: Floats, edge: Ints, label: str, curved: bool, density: float | None) -> list[Block]:
    """Bricks of one course from its two levels of lattice points, (2, points, 2, 3)."""
    digits = max(2, len(str(len(edge) - 1)))
    blocks = []
    for i, (u0, u1) in enumerate(pairwise(edge.tolist()), 1):
        step = 1 if curved else u1 - u0
        points = _frozen(levels[:, u0 : u1 + 1 : step].reshape(-1, 3))
        faces = brick_faces((u1 - u0) // step, 1, not curved)
        blocks.append(Block(f"{label}-b{i:0{digits}d}", points, faces, density, label in SUPPORTS, _group(label)))
    return blocks


def _bond(columns: int, shifted: bool) -> Ints:
    """Lattice edges of a course of running bond; a whole block is two steps wide."""
    whole = np.arange(0, 2 * columns + 1, 2)
    return np.concatenate([[0], whole[:-1] + 1, [2 * columns]]) if shifted else whole


def _overlaps(below: Ints, above: Ints, ring: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Pieces of a bed joint: block below, block above, and the lattice points where the piece begins and ends."""
    if not ring:
        cut = np.union1d(below, above)
        return np.searchsorted(below, cut[1:]) - 1, np.searchsorted(above, cut[1:]) - 1, cut[:-1], cut[1:]
    step = np.arange(ring)
    i = np.searchsorted(below, (step - below[0]) % ring + below[0], side="right") - 1
    j = np.searchsorted(above, (step - above[0]) % ring + above[0], side="right") - 1
    return i, j, step, step + 1


def _bed(level: Floats, from_: Ints, to: Ints) -> Floats:
    """(q, 4, 3) quads across a level, normal towards +v on a right-handed lattice."""
    return np.stack([level[from_, 0], level[from_, 1], level[to, 1], level[to, 0]], 1)


def _quads(a: Ints, b: Ints, quad: Floats, mu: float | None) -> Contacts:
    """Pack (q, 4, 3) quads, each from the lower block number to the higher, sorted by a, then b."""
    friction = np.nan if mu is None else not_negative("mu", mu)
    quad = np.where((a > b)[:, None, None], quad[:, ::-1], quad)  # the joint that closes a ring
    a, b = np.minimum(a, b), np.maximum(a, b)
    order = np.lexsort((b, a))
    q = len(quad)
    return Contacts(a[order], b[order], np.arange(0, 4 * q + 1, 4), quad[order].reshape(-1, 3), np.full(q, friction))


def _stand_on_slab(lattice: Floats, edge: Ints, contacts: Contacts, mu: float | None) -> Contacts:
    """Put a slab before all blocks and its contacts with the lowest course before all contacts."""
    feet = np.arange(len(edge) - 1)
    foot = _bed(lattice[0], edge[:-1], edge[1:])[:, ::-1]
    quad = np.concatenate([foot, contacts.point.reshape(-1, 4, 3)])
    return _quads(np.concatenate([0 * feet, contacts.a + 1]), np.concatenate([feet + 1, contacts.b + 1]), quad, mu)


def _boxes(low: Floats, high: Floats) -> Floats:
    """(n, 8, 3) corners of cuboids in the order of a brick with u = x, v = y, w = z."""
    corner = np.array([[u, v, w] for v in (0, 1) for u in (0, 1) for w in (0, 1)], bool)
    return _frozen(np.where(corner, high[:, None], low[:, None]))


def _barrel(angle: Floats, along: Floats, inner: float, thickness: float, base: float) -> Floats:
    """Lattice of a barrel along y: v = angle from the crown towards +x, u = y, w = inner, outer; left-handed."""
    shell = np.array([inner, inner + thickness])
    lattice = np.zeros((len(angle), len(along), 2, 3))
    lattice[..., 0] = (np.sin(angle)[:, None] * shell)[:, None]
    lattice[..., 1] = along[:, None]
    lattice[..., 2] = (np.cos(angle)[:, None] * shell)[:, None] - base
    # The springing of a semicircle is level; cos(pi / 2) is not quite zero.
    lattice[np.isclose(np.abs(angle), np.pi / 2.0, rtol=0.0, atol=1e-12), ..., 2] = -base
    return lattice + 0.0  # no negative zeros


def _with_springers(angle: Floats, voussoir: float, facets: int) -> Floats:
    """Add a thin wedge below either end, cut into as many facets as a voussoir."""
    step = min(voussoir, SPRINGER) / facets * np.arange(1, facets + 1)
    return np.concatenate([angle[0] - step[::-1], angle, angle[-1] + step])


def _circle(span: float | None, rise: float | None, radius: float | None, thickness: float) -> tuple[float, float]:
    """Inner radius (m) and half the angle of embrace (radians)."""
    if radius is not None:
        if span is not None or rise is not None:
            raise InputError("radius: give either radius, or span and rise")
        return _ring(radius, thickness)[0] - thickness / 2.0, np.pi / 2.0
    clear = positive("span", 10.0 if span is None else span)
    if rise is None:
        return clear / 2.0, np.pi / 2.0
    rise = positive("rise", rise)
    if rise > clear / 2.0:
        raise InputError(f"rise: {rise:g} m is more than half of the span {clear:g} m")
    return (clear * clear / 4.0 + rise * rise) / (2.0 * rise), 2.0 * float(np.arctan2(2.0 * rise, clear))


def numbered(letter: str, count: int) -> list[str]:
    """Names of so many things, from 1, of equal length."""
    return [f"{letter}{k:0{max(2, len(str(count)))}d}" for k in range(1, count + 1)]


def _group(label: str) -> str:
    """Group of a course: course-3 for c03, row-3 for r03, its own name for the rest."""
    word = {"c": "course", "r": "row"}.get(label[0])
    return f"{word}-{int(label[1:])}" if word and label[1:].isdigit() else label


def _frozen(array: Floats) -> Floats:
    """Mark as read-only an array of which this module holds the only reference; `sealed` then takes it as it is."""
    array.flags.writeable = False
    return array


# Refusals: each names the option.


def _between(name: str, value: float, low: float, high: float) -> float:
    if not low < finite(name, value) < high:
        raise InputError(f"{name}: must be between {low:g} and {high:g} degrees, got {value:g}")
    return float(value)


def _ring(radius: float, thickness: float) -> tuple[float, float]:
    radius, thickness = positive("radius", radius), positive("thickness", thickness)
    if not thickness < radius:
        raise InputError(f"thickness: {thickness:g} m must be less than the radius {radius:g} m")
    return radius, thickness
