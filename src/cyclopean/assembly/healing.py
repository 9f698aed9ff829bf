"""Drawings healed: faces that are meant to touch come to lie in one plane, by the least movement of vertices.

Which planes those are, `meant_planes` finds in the drawing; where the vertices go, `common_planes`. What is there
already stays to the last digit.
"""

from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.common_planes import largest, moved_into_planes
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.detection import detect
from cyclopean.assembly.meant_planes import MeantPlanes
from cyclopean.assembly.precision import length_tolerance, local_mesh
from cyclopean.errors import InputError
from cyclopean.geometry import face_normals, following, mesh_faults

__all__ = ["Healing", "heal"]

SHARE = 0.05  # of the thinnest block: what moves further is drawn anew, not healed
ROUNDING = 64.0  # units of rounding of the largest coordinate: a vertex so near its planes stays
MISSED = 0.1  # of the digits of the drawing: what vertices may be off their planes in the end
FURTHER = 1.01  # times what was too short is tried next
TRIES = 2  # lengths that are tried to say which would do


@dataclass(frozen=True, slots=True, eq=False)
class Healing:
    """A healed model, and what was done to its blocks (n)."""

    assembly: Assembly
    moved: Floats  # (n,) m: the largest movement of a vertex
    growth: Floats  # (n,) change of volume as a share of it
    matched: Ints  # (n,) planes of the block that are those of other blocks too
    warnings: tuple[str, ...]


def heal(assembly: Assembly, length: float) -> Healing:
    """Move vertices, each by no more than a length (m), so that faces that are meant to touch lie in one plane.

    Meant to touch are faces of two blocks that lie within the length of each other all over an overlap that is wider
    than the length; and the level ground is meant by lowest faces within it of the lowest point, where the model names
    no supports. Polygons that are flat within the length become flat. The sum of squares of movements is the least.
    Contacts of the model are found anew, with the friction of their pair of blocks.

    Raises
    ------
    InputError
        The length is not positive, or not small beside the thinnest block; a block is no closed solid; a vertex would
        have to move further, with the length that would do; or a face would turn over.
    """
    most = _longest(assembly, length)
    attempt = _attempt(assembly, length)
    if attempt.needed > length:
        raise InputError.of("heal", float(length), attempt.refusal(assembly, most))
    moved = attempt.vertex
    start = assembly.mesh.vertex_start
    blocks = tuple(
        replace(block, vertices=moved[i:j]) if (moved[i:j] != block.vertices).any() else block
        for block, i, j in zip(assembly.blocks, start[:-1], start[1:], strict=True)
    )
    healed = assembly
    if any(new is not old for new, old in zip(blocks, assembly.blocks, strict=True)):
        healed = replace(assembly, blocks=blocks, contacts=None)
        _refuse_damage(assembly, healed)
    found = detect(healed)
    said = list(attempt.warnings)
    if found.near is not None:  # strips beside an edge are not worth a word
        said += found.near.only(found.near.width > length).told([block.id for block in blocks])
    if healed is not assembly and assembly.contacts is not None:
        contacts, told = _anew(assembly.contacts, found.contacts, len(blocks))
        healed, said = replace(healed, contacts=contacts), [*said, told]
    growth = healed.mass.volume / assembly.mass.volume - 1.0
    return Healing(healed, attempt.moved, growth, attempt.matched, tuple(said))


def _longest(assembly: Assembly, length: float) -> float:
    """The length (m) that the thinnest block bears, thick as a box of its inertia; refusals as `heal`."""
    if not 0.0 < length < np.inf:
        raise InputError.of("heal", float(length), "expected a positive length in metres")
    if not len(assembly):
        raise InputError("the model has no blocks")
    if faults := mesh_faults(assembly.mesh):
        more = f" (and {len(faults) - 1} more blocks with faults)" if len(faults) > 1 else ""
        raise InputError(f"block '{assembly.blocks[faults[0][0]].id}' {faults[0][1]}{more}; mend its mesh")
    inertia, volume = assembly.mass.inertia, assembly.mass.volume
    spread = np.trace(inertia, axis1=1, axis2=2)[:, None, None] / 2.0 * np.eye(3) - inertia
    thickness = np.sqrt(12.0 * np.maximum(np.linalg.eigvalsh(spread)[:, 0], 0.0) / volume)
    k = int(np.argmin(thickness))
    most = SHARE * float(thickness[k])
    if not length < most:
        expected = (
            f"block '{assembly.blocks[k].id}' is {thickness[k]:.3g} m thick; expected a length below {most:.2g} m"
        )
        raise InputError.of("heal", float(length), expected)
    return most


@dataclass(frozen=True, slots=True, eq=False)
class _Attempt:
    """What comes of a length."""

    vertex: Floats  # (V, 3) m
    moved: Floats  # (n,) m
    needed: float  # m: the largest movement; infinite where vertices do not come to lie in their planes
    loose: int  # pairs of faces that cannot lie in one plane
    matched: Ints  # (n,)
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, assembly: Assembly, length: float, merging: bool) -> "_Attempt":
        """Try it."""
        mesh, _ = local_mesh(assembly)
        drawn = MeantPlanes.of(assembly, mesh, length, merging)
        planes = drawn.planes()
        still = ROUNDING * float(np.spacing(np.abs(assembly.mesh.vertex).max(initial=0.0)))
        vertex, needed, movement = assembly.mesh.vertex, 0.0, np.zeros((len(mesh.vertex), 3))
        if planes.furthest(mesh.vertex).max(initial=0.0) > still:
            after, planes = moved_into_planes(mesh.vertex, planes)
            needed = np.inf if planes.furthest(after).max() > MISSED * length_tolerance(assembly) else 0.0
            off = largest(planes.vertex, np.abs(planes.off(mesh.vertex)), len(mesh.vertex))[:, None]
            movement = np.where(off > still, after - mesh.vertex, 0.0)
            vertex = vertex + movement
        moved = largest(mesh.vertex_body, np.linalg.norm(movement, axis=1), len(mesh))
        needed = max(needed, float(moved.max()))
        told = drawn.told([block.id for block in assembly.blocks], length)
        return cls(vertex, moved, needed, len(drawn.loose), drawn.matched, told)

    def refusal(self, assembly: Assembly, most: float) -> str:
        """Say which block moves furthest, and which length below the most (m) would do."""
        k, needed = int(np.argmax(self.moved)), self.needed
        said = f"block '{assembly.blocks[k].id}' would have to move by {self.moved[k]:.3g} m"
        for _ in range(TRIES):
            if not (length := _up(FURTHER * needed)) < most:
                break
            needed = _attempt(assembly, length).needed
            if needed <= length:
                return f"{said}; {length:g} would do"
        return (
            f"{said}; no length below {most:.2g} m, which the thinnest block bears, was found to do;"
            " `tolerance` of check forgives"
        )


def _attempt(assembly: Assembly, length: float) -> _Attempt:
    """What comes of a length (m): of faces as they are drawn, or, if that leaves some apart, with faces merged."""
    plain = _Attempt.of(assembly, length, False)
    if plain.needed <= length and not plain.loose:
        return plain
    merged = _Attempt.of(assembly, length, True)
    return min(plain, merged, key=lambda one: (max(one.needed, length), one.loose))


def _up(value: float) -> float:
    """Rounded up to two digits."""
    if not np.isfinite(value):
        return value
    unit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / unit) * unit:.2g}")


def _refuse_damage(assembly: Assembly, healed: Assembly) -> None:
    """Refuse what has turned a face over, or left a block no solid."""
    old, new = face_normals(assembly.mesh), face_normals(healed.mesh)
    here, start = assembly.mesh.vertex[assembly.mesh.corner], assembly.mesh.corner_start
    side = np.linalg.norm(here[following(start)] - here, axis=1)
    thin = np.linalg.norm(old, axis=1) <= length_tolerance(assembly) * np.maximum.reduceat(side, start[:-1])
    over = np.flatnonzero(~(np.einsum("fi,fi->f", old, new) > 0.0) & ~thin)
    if len(over):
        block, place = int(assembly.mesh.face_body[over[0]]), here[start[over[0]] : start[over[0] + 1]].mean(axis=0)
        where = ", ".join(f"{x:.4g}" for x in place)
        raise InputError(
            f"block '{assembly.blocks[block].id}': a face at ({where}) m is so small that healing would turn it over;"
            " choose a smaller length, or remove the face"
        )
    if faults := mesh_faults(healed.mesh):
        name = assembly.blocks[faults[0][0]].id
        raise InputError(f"block '{name}': healed, it {faults[0][1]}; choose a smaller length")


def _anew(given: Contacts, found: Contacts, count: int) -> tuple[Contacts | None, str]:
    """Contacts found, with what the model said of their pairs of blocks, None where it said nothing; what is told."""
    if np.isnan([given.mu, given.strength_given]).all():
        return None, "the contacts of the model are dropped: they are found anew in what is healed"
    pair = np.minimum(found.a, found.b) * count + np.maximum(found.a, found.b)
    known = np.minimum(given.a, given.b) * count + np.maximum(given.a, given.b)
    key, place = np.unique(np.concatenate([known, pair]), return_inverse=True)
    said = []
    for value in (given.mu, given.strength_given):
        least = np.full(len(key), np.inf)
        np.fmin.at(least, place[: len(known)], value)
        said.append(np.where(np.isfinite(least), least, np.nan)[place[len(known) :]])
    new = int(np.count_nonzero(~np.isin(pair, known)))
    more = f"; {new} are of pairs of blocks of which nothing is said" if new else ""
    return replace(found, mu=said[0], tension=said[1]), (
        f"the {len(given)} contacts of the model are found anew, {len(found)} of them, with the least friction and"
        f" tension given for their pair of blocks{more}"
    )
