"""Blocks of a model mended where their meshes are no closed, outward solids, and what was done told.

What can be mended without a guess is (see `geometry.mending`). One guess is made, where it changes no verdict and what
was meant is plain: a flat sheet drawn for the ground becomes a slab below it, for a support bears and nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly.blocks import Assembly, Block
from cyclopean.assembly.loads import SurfaceLoad
from cyclopean.errors import InputError
from cyclopean.geometry.mending import FLAT, KINDS, Done
from cyclopean.geometry.mending import Mended as Meshes
from cyclopean.geometry.mending import mended as mended_meshes
from cyclopean.geometry.polyhedra import face_normals, pack, unpacked
from cyclopean.geometry.sides import Sides

__all__ = ["MendedAssembly", "mended"]

SLAB = 0.1  # of the square root of its area: how thick a sheet of ground is made
SHAPING = ("crack", "tiny", "flat", "inner", "slab")  # kinds that change the shape, however little
REMEDY = {
    "is open": "draw the faces that are missing, or leave the block out",
    "is a sheet": "draw it with a thickness, or leave it out",
}


@dataclass(frozen=True, slots=True, eq=False)
class MendedAssembly:
    """A model after mending; blocks with a fault are as they came."""

    assembly: Assembly
    done: tuple[tuple[str, tuple[Done, ...]], ...]  # block id and what was done to it, of those mended
    faults: tuple[tuple[str, str], ...]  # block id, and what is wrong, where (m), and what to do

    @property
    def said(self) -> tuple[str, ...]:
        """What a user should know: a line that sums up, and one for each kind of mending that changes the shape."""
        if not self.done:
            return ()
        lines = [f"{self._summed}; the command info lists them, `strict` refuses"]
        for kind in SHAPING:
            told = [(name, one.text) for name, done in self.done for one in done if one.kind == kind]
            more = f" (and {len(told) - 1} more blocks alike)" if len(told) > 1 else ""
            lines += [f"block '{told[0][0]}' mended: {told[0][1]}{more}"] if told else []
        return tuple(lines)

    @property
    def _summed(self) -> str:
        count = dict.fromkeys(KINDS, 0)
        for _, done in self.done:
            for one in done:
                count[one.kind] += one.count
        words = ", ".join(Done(kind, n).text for kind, n in count.items() if n)
        return f"mended {len(self.done)} of {len(self.assembly)} blocks: {words}"

    def refused(self, shown: str) -> "MendedAssembly":
        """The same, if nothing had to be done.

        Raises
        ------
        InputError
            A block had to be mended; `shown` is the file, or what else the model came from.
        """
        if self.done:
            summed = self._summed.replace("mended", "would mend", 1)
            raise InputError(f"{shown}: {summed}; mend the file, or leave out `strict`")
        return self


def mended(assembly: Assembly) -> MendedAssembly:
    """Mend every block that is no closed, outward solid; all else stays as it is.

    Contacts that the model gives stay. Loads on a face of a mended block go with that face.

    Raises
    ------
    InputError
        A load is on a face that mending dropped.
    """
    found = mended_meshes(assembly.mesh)
    changed = [k for k, done in enumerate(found.done) if done]
    shape = unpacked(found.mesh) if changed else []
    blocks, done = list(assembly.blocks), dict(enumerate(found.done))
    for k in changed:
        blocks[k] = replace(blocks[k], vertices=shape[k][0], faces=shape[k][1])
    left = []
    for k, fault in found.fault:
        slab = _ground(assembly, k) if fault.startswith("is a sheet") else None
        if slab is None:
            remedy = next((said for start, said in REMEDY.items() if fault.startswith(start)), "mend its mesh")
            left.append((blocks[k].id, f"{fault}; {remedy}"))
        else:
            blocks[k], done[k] = slab
    told = tuple((blocks[k].id, what) for k, what in sorted(done.items()) if what)
    if not told:
        return MendedAssembly(assembly, (), tuple(left))
    actions = tuple(_moved(one, assembly, found) if isinstance(one, SurfaceLoad) else one for one in assembly.actions)
    return MendedAssembly(replace(assembly, blocks=tuple(blocks), actions=actions), told, tuple(left))


def _moved(load: SurfaceLoad, assembly: Assembly, found: Meshes) -> SurfaceLoad:
    """A load on a face by its number after mending."""
    if load.face is None or not found.done[load.block]:
        return load
    first, last = found.mesh.face_start[load.block : load.block + 2]
    here = np.flatnonzero(found.origin[first:last] == load.face)
    if not len(here):
        name = assembly.blocks[load.block].id
        raise InputError(f"loads: face {load.face} of block '{name}' was dropped in mending; load another face")
    return replace(load, face=int(here[0]))


def _ground(assembly: Assembly, k: int) -> tuple[Block, tuple[Done, ...]] | None:
    """A sheet as a slab, if it can only be what the rest stands on: a support, or level and below all else.

    All other blocks are on one side of it; it grows to the other.
    """
    block = assembly.blocks[k]
    normal = face_normals(pack([(block.vertices, block.faces)])).sum(axis=0)
    twice = float(np.linalg.norm(normal))
    others = assembly.mesh.vertex[assembly.mesh.vertex_body != k]
    said = any(b.fixed is not None or b.held for b in assembly.blocks)
    if not twice > 0.0 or not len(others) or (said and block.fixed is not True):
        return None
    normal /= twice
    slack = FLAT * float(np.linalg.norm(np.ptp(block.vertices, axis=0)))
    height = (others - block.vertices[0]) @ normal
    away = -1.0 if height.min() >= -slack else 1.0 if height.max() <= slack else 0.0
    level = abs(normal[2]) >= 1.0 - FLAT and away * normal[2] < 0.0
    if not away or not (level or block.fixed is True):
        return None
    thick = SLAB * (twice / 2.0) ** 0.5
    made = _slab(block.vertices, block.faces, away * thick * normal)
    return replace(block, vertices=made[0], faces=made[1]), (Done("slab", 1, f"{thick:.3g} m thick"),)


def _slab(
    vertices: Floats, faces: Sequence[tuple[int, ...]], shift: Floats
) -> tuple[Floats, tuple[tuple[int, ...], ...]]:
    """What a sheet (v, 3) sweeps over when it moves by `shift` (3,), in m."""
    mesh = pack([(vertices, faces)])
    if float(face_normals(mesh).sum(axis=0) @ shift) > 0.0:
        faces = [face[::-1] for face in faces]
        mesh = pack([(vertices, faces)])
    sides, n = Sides.of(mesh.corner, mesh.corner_start), len(vertices)
    around = [(b, a, a + n, b + n) for a, b in sides.rim.tolist()]
    below = [tuple(i + n for i in reversed(face)) for face in faces]
    return np.concatenate([vertices, vertices + shift]), tuple([*map(tuple, faces), *below, *around])
