"""From the meshes of a file to blocks: welding, connected pieces, unique names.

A mesh file knows nothing of stones. A body that is closed as it stands is left alone; one that is not (every STL, a
GLB split along its normals) has its equal vertices welded. Where the file does not say which faces make a block, the
connected pieces do. Stones that touch share vertices and edges once they are welded, so pieces hang together by the
faces that bound the same solid round an edge, never by a mere common vertex.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry.mending import welded
from cyclopean.geometry.packed import numbered, offsets
from cyclopean.geometry.polyhedra import Polyhedra, compacted, pack, unpacked
from cyclopean.geometry.sides import open_bodies, parted, pieces
from cyclopean.io.fields import REACH, face_fault, label
from cyclopean.io.units import metres

__all__ = ["Body", "assembly_of", "joined", "part_of", "placed", "welded_body"]


Shape = tuple[Floats, Sequence[tuple[int, ...]]]  # vertices and faces


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Part of a mesh file; `name` None where the file gives none, `whole` where the file says that it is one block."""

    name: str | None
    vertices: Floats  # (v, 3) in the units of the file
    faces: list[tuple[int, ...]]
    whole: bool = True
    fields: Mapping[str, Any] = field(default_factory=dict)  # density, fixed, group of the blocks made of it


def assembly_of(path: str, stem: str, bodies: Sequence[Body], units: str) -> tuple[Assembly, list[str]]:
    """Make one block of each body, or of each connected piece where bodies are not `whole`.

    A file that holds one single body is split into its pieces in any case: that is how modellers export a wall.

    Returns
    -------
    assembly : Assembly
        In metres, without contacts; with the densities, supports and groups that the bodies have.
    warnings : list of str
        How many blocks were made and of what, faces dropped, names changed.

    Raises
    ------
    InputError
        There are no faces, a coordinate is not finite or a face is not one.
    """
    bodies = [body for body in bodies if body.faces]
    if not bodies:
        raise InputError(f"{path}: has no faces; a model needs at least one closed mesh")
    for body in bodies:
        _check(f"{path}: {label(body.name)}" if body.name else path, body)
    drawn = pack([(body.vertices, body.faces) for body in bodies])
    mesh = welded(drawn)
    dropped = len(drawn.corner_start) - len(mesh.corner_start)
    warnings = [f"{path}: {dropped} faces without area were dropped"] if dropped else []
    if not len(mesh.corner):
        raise InputError(f"{path}: has no faces with an area; a model needs at least one closed mesh")
    made, split = _split(path, bodies, mesh, warnings)
    how = "connected piece" if split else "named mesh" if any(part.name for part in made) else "mesh"
    count = f"{len(made)} blocks, one for each" if len(made) > 1 else "1 block, from the one"
    warnings.insert(0, f"{path}: made {count} {how}")
    ids = _unique([part.name for part in made], path, warnings)
    blocks = tuple(
        Block(name, metres(part.vertices, units), tuple(part.faces), **part.fields)
        for name, part in zip(ids, made, strict=True)
    )
    return Assembly(blocks, name=stem), warnings


def welded_body(where: str, body: Body) -> Body:
    """Return the body as it is if it is closed, else with its equal vertices welded.

    Raises
    ------
    InputError
        A coordinate is not finite or a face is not one.
    """
    _check(where, body)
    mesh = pack([(body.vertices, body.faces)])
    if not open_bodies(mesh).any():
        return body
    vertices, faces = unpacked(compacted(welded(mesh)))[0]
    return replace(body, vertices=vertices, faces=list(faces))


def _check(where: str, body: Body) -> None:
    bad = np.argwhere(~(np.abs(body.vertices) <= REACH))
    if len(bad):
        value = body.vertices[tuple(bad[0])]
        what = f"is {value:g}, beyond 1e12; check the units" if np.isfinite(value) else "is not a finite number"
        raise InputError(f"{where}: vertex {bad[0][0]}, coordinate {bad[0][1]} {what}")
    for k, face in enumerate(body.faces):
        if fault := face_fault(face, len(body.vertices)):
            raise InputError(f"{where}: face {k} {fault}")


def _split(path: str, bodies: Sequence[Body], mesh: Polyhedra, warnings: list[str]) -> tuple[list[Body], bool]:
    """Make a body of each body that stays whole and of each piece of the others."""
    piece, owner = pieces(mesh), mesh.face_body
    count = np.bincount(owner[np.unique(piece, return_index=True)[1]], minlength=len(bodies))
    loose = (count > 1) & np.array([body.whole and len(bodies) > 1 for body in bodies])
    part = numbered(np.where(loose[owner], len(piece) + owner, piece))
    made: list[Body] = []
    number = Counter[int]()
    whose = owner[np.unique(part, return_index=True)[1]].tolist()
    for k, (vertices, faces) in zip(whose, unpacked(parted(mesh, part)), strict=True):
        name = bodies[k].name
        if name is not None and count[k] > 1 and not loose[k]:
            name = f"{name}-{number[k]}"
            number[k] += 1
        made.append(Body(name, vertices, list(faces), fields=bodies[k].fields))
    if loose.any():
        more = f" (and {loose.sum() - 1} more)" if loose.sum() > 1 else ""
        first = bodies[int(np.argmax(loose))].name or "unnamed"
        warnings.append(f"{path}: block {label(first)} has separate pieces that move as one{more}")
    return made, bool(((count > 1) & ~loose).any())


def part_of(name: str | None, vertices: Floats, faces: list[tuple[int, ...]], **more: Any) -> Body:
    """Return the faces as a body, with only those of the vertices (v, 3) that they use, in the order they had."""
    used = sorted(set(chain.from_iterable(faces)))
    new = dict(zip(used, range(len(used)), strict=True))
    return Body(name, vertices[used], [tuple([new[i] for i in face]) for face in faces], **more)


def joined(shapes: Sequence[Shape]) -> tuple[Floats, list[tuple[int, ...]]]:
    """Several shapes (v, 3) as one."""
    first = offsets([len(vertices) for vertices, _ in shapes]).tolist()
    faces = [tuple(i + k for i in face) for k, (_, rings) in zip(first, shapes, strict=False) for face in rings]
    return np.concatenate([vertices for vertices, _ in shapes]), faces


def placed(
    matrix: Floats, vertices: Floats, faces: Sequence[tuple[int, ...]]
) -> tuple[Floats, tuple[tuple[int, ...], ...]]:
    """Vertices (v, 3) and faces where a (4, 4) matrix puts them; what it mirrors is turned outside again."""
    mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], tuple(face[::-1] if mirrored else face for face in faces)


def _unique(names: Sequence[str | None], path: str, warnings: list[str]) -> list[str]:
    """Give every block a name of its own: the file's where it can be, b0, b1 ... where there is none."""
    plain = [None if name is None else "".join(c if c.isprintable() else "_" for c in name) or None for name in names]
    wanted = [f"b{k}" if name is None else name for k, name in enumerate(plain)]
    count, taken = Counter(wanted), set(wanted)
    result: list[str] = []
    used: set[str] = set()
    suffix: Counter[str] = Counter()
    for name in wanted:
        fresh = name
        while fresh in used or (fresh != name and fresh in taken):
            suffix[name] += 1
            fresh = f"{name}-{suffix[name] + 1}"
        used.add(fresh)
        result.append(fresh)
    if twice := [name for name in count if count[name] > 1]:
        more = f", and {len(twice) - 1} other names too" if len(twice) > 1 else ""
        warnings.append(f"{path}: the name {label(twice[0])} stands {count[twice[0]]} times{more}; numbers were added")
    return result
