"""Triangle meshes as they come from a scanner made closed and outward, or told why they cannot be.

What is repaired leaves the stone as it is: it is mended as a block is (see `mending`), but for large flat holes, where
a scan was cut off, and wide cracks. What would have to be guessed is not: a large hole, a surface that crosses itself,
an edge with three faces.

A tetrahedron without one of its faces is open, and the hole is far too large to be closed:

>>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
>>> repair(corner, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2]])).pieces[0].fault
'is open: a hole 4.24 m round near (0.3333, 0.3333, 0.3333)'
>>> repair(corner, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 3, 2]])).pieces[0].done
('1 face was turned over',)
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.boxes import box_pairs
from cyclopean.geometry.crossing import crossing
from cyclopean.geometry.frames import solid_angles
from cyclopean.geometry.mending import Reach, Work, place_text, sewn, shaped
from cyclopean.geometry.polyhedra import Polyhedra, bodies_of, face_triangles, mass_properties, pack, unpacked
from cyclopean.geometry.shells import convex
from cyclopean.geometry.sides import parted
from cyclopean.geometry.sides import pieces as pieces_of

__all__ = ["Piece", "Repair", "repair", "self_crossings", "solid_angle"]

# A loose piece whose diagonal is below this share of the largest piece's is dust of the scan: 1/8000 of its volume.
DUST = 0.05
# Triangles that are looked at for crossings in a model: some ten seconds' worth.
MOST = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One connected piece of a mesh."""

    vertices: Floats  # (v, 3) m
    triangles: Ints  # (t, 3); counter-clockwise from outside where there is no fault
    done: tuple[str, ...] = ()  # what was repaired
    fault: str = ""  # why it is no solid; "" = closed, outward, of one piece, and does not cross itself


@dataclass(frozen=True, slots=True, eq=False)
class Repair:
    """All pieces of a mesh, in the order of their first faces."""

    pieces: tuple[Piece, ...]
    done: tuple[str, ...]  # what was repaired of the mesh as a whole


def repair(vertices: Floats, triangles: Ints, wedges: bool = False) -> Repair:
    """Clean a mesh, split it into its pieces, and mend each.

    Parameters
    ----------
    vertices : (v, 3) float
        m.
    triangles : (t, 3) int
        Index `vertices`.
    wedges : bool
        Where edges have more than two faces, as where stones touch that a file put into one mesh, pieces are told apart
        by which side of their faces is out; faces are not turned then.

    Returns
    -------
    Repair
        Pieces with a fault are left as they came. Shells inside another piece, and dust, are dropped.
    """
    work = sewn(Work.of(pack([(vertices, triangles)])), Reach())
    done = tuple(one.text for one in work.done[0])
    if not len(work.mesh.corner):
        return Repair((), (*done, "no face has an area"))
    shared = bool((work.sides.count > 2).any())
    parts = parted(work.mesh, pieces_of(work.mesh, wedges and shared))
    dust = parts.diagonal < DUST * parts.diagonal.max()
    if dust.any():
        done = (*done, f"{_many(int(dust.sum()), 'loose piece', 'loose pieces')} of dust dropped")
    pieces, inner = _without_inner(_mended(bodies_of(parts, np.flatnonzero(~dust)), not shared))
    return Repair(tuple(_apart(pieces)), (*done, *inner))


def _mended(parts: Polyhedra, turn: bool) -> list[Piece]:
    """Orient pieces, close their tiny holes, and say of each whether it is a solid then."""
    work = shaped(Work.of(parts), Reach(), turn)
    mass = mass_properties(work.mesh)
    found = []
    for k in range(len(parts)):
        vertices, triangles = _triangles(work.mesh, k)
        done = tuple(one.text for one in work.done[k])
        fault = work.fault.get(k) or _edge_fault(work, k)
        if not fault and not mass.volume[k] > 0.0:
            fault = "has no volume" if mass.volume[k] == 0.0 else "is inside out"
        if not fault and not _star_shaped(vertices, triangles, mass.centroid[k]):
            where = crossing(vertices, triangles)
            fault = "" if where is None else f"crosses itself near {place_text(where)}"
        found.append(Piece(*(_triangles(parts, k) if fault else (vertices, triangles)), done, fault))
    return found


def _triangles(mesh: Polyhedra, body: int) -> tuple[Floats, Ints]:
    """Vertices (v, 3), in m, and triangles (t, 3) of a body."""
    one = bodies_of(mesh, np.array([body]))
    if (np.diff(one.corner_start) == 3).all():
        return one.vertex, one.corner.reshape(-1, 3)
    return one.vertex, face_triangles(one.vertex, unpacked(one)[0][1])


def _edge_fault(work: Work, body: int) -> str:
    sides = work.sides
    here = work.mesh.face_body[sides.face] == body
    if many := len(np.unique(sides.edge[here & (sides.count[sides.edge] > 2)])):
        return f"has {_many(many, 'edge', 'edges')} with more than two faces"
    one, two = sides.pairs()
    if (sides.tail[one] == sides.tail[two])[here[one]].any():
        return "has faces that disagree about which side is out"
    return ""


def _star_shaped(vertices: Floats, triangles: Ints, centre: Floats) -> bool:
    """Whether every face is seen from inside at the centre, once.

    If no face is seen from behind or edge-on, the sphere of directions is covered as often as the solid angle says;
    once means that no two faces are in one direction, so they cannot cross. Most stones are so, and need no more.
    """
    p = vertices[triangles] - centre
    six = np.einsum("ti,ti->t", p[:, 0], np.cross(p[:, 1], p[:, 2]))
    scale = float(np.abs(p).max()) ** 3
    return bool((six > 1e-12 * scale).all()) and abs(solid_angle(vertices, triangles, centre) - 1.0) < 1e-6


def self_crossings(mesh: Polyhedra) -> list[tuple[int, Floats]]:
    """Bodies that cross themselves, and where, (3,) in m; convex and star-shaped ones are passed over at once.

    Bodies are looked at in their order until they have `MOST` triangles.
    """
    centre = mass_properties(mesh).centroid
    found: list[tuple[int, Floats]] = []
    left = MOST
    for body in np.flatnonzero(~convex(mesh)).tolist():
        vertices, corners = _triangles(mesh, body)
        if not _star_shaped(vertices, corners, centre[body]) and len(corners) <= left:
            left -= len(corners)
            where = crossing(vertices, corners)
            found += [] if where is None else [(body, where)]
    return found


def solid_angle(vertices: Floats, triangles: Ints, centre: Floats) -> float:
    """How often a closed mesh (v, 3), (t, 3) winds round a point (3,): 1 inside, 0 outside."""
    return float(solid_angles(vertices[triangles] - centre).sum())


def _without_inner(pieces: list[Piece]) -> tuple[list[Piece], list[str]]:
    """Drop shells inside another piece: a scan sees no cavity."""
    if len(pieces) < 2:
        return pieces, []
    low = np.array([p.vertices.min(axis=0) for p in pieces])
    high = np.array([p.vertices.max(axis=0) for p in pieces])
    within = (low[:, None] >= low).all(axis=2) & (high[:, None] <= high).all(axis=2)
    pairs = [(a, b) for a, b in np.argwhere(within).tolist() if a != b and not pieces[b].fault]
    inner = {a for a, b in pairs if _is_inside(pieces[a], pieces[b])}
    said = [f"{_many(len(inner), 'shell', 'shells')} inside the surface dropped"] if inner else []
    return [piece for k, piece in enumerate(pieces) if k not in inner], said


def _is_inside(a: Piece, b: Piece) -> bool:
    """Whether a lies inside b, neither crossing nor being crossed; they may touch."""
    some = a.triangles[:: max(1, len(a.triangles) // 8)]  # one may touch, and then says nothing
    seen = (solid_angle(b.vertices, b.triangles, point) for point in a.vertices[some].mean(axis=1))
    return any(winding > 0.9 for winding in seen) and crossing(*_together(a, b)) is None


def _apart(pieces: list[Piece]) -> list[Piece]:
    """Refuse sound pieces that cross each other: they are one surface that was folded, not two stones."""
    if len(pieces) < 2:
        return pieces
    low = np.array([p.vertices.min(axis=0) for p in pieces])
    high = np.array([p.vertices.max(axis=0) for p in pieces])
    fault = [piece.fault for piece in pieces]
    for a, b in zip(*(side.tolist() for side in box_pairs(low, high, 0.0)), strict=True):
        if not pieces[a].fault and not pieces[b].fault:
            where = crossing(*_together(pieces[a], pieces[b]))
            if where is not None:
                fault[a] = fault[b] = f"crosses another piece near {place_text(where)}"
    return [Piece(p.vertices, p.triangles, p.done, said) for p, said in zip(pieces, fault, strict=True)]


def _together(a: Piece, b: Piece) -> tuple[Floats, Ints]:
    return np.concatenate([a.vertices, b.vertices]), np.concatenate([a.triangles, b.triangles + len(a.vertices)])


def _many(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"
