"""Blocks as commands of 3DEC (Itasca; syntax of versions 7 to 9), for a distinct element model of the same stones.

One `block create polyhedron` a stone, each face with its corners clockwise seen from outside, as 3DEC wants them and
against the order here. Faces that are not flat become triangles. Names stand as groups in slots of their own, so that
ranges can pick stones, groups, supports and densities. The program only takes convex blocks, and the stiffness and
friction of joints are for its user to choose: the friction that the model gives stands in a comment.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from cyclopean.arrays import Bools
from cyclopean.assembly import Assembly, Block
from cyclopean.geometry import Polyhedra, convex_bodies, face_warp, planar_regions
from cyclopean.io.round_trip import fan

__all__ = ["blocklist_text", "flat", "not_convex"]

FLAT = 1e-7  # distance of a corner from its face, and of a corner beyond a face, in sizes of the block


def blocklist_text(assembly: Assembly) -> str:
    """Return the blocks as 3DEC commands, in metres, with every digit."""
    name = "".join(c if c.isprintable() else " " for c in assembly.name)
    lines = [
        f"; {name}: {len(assembly)} blocks, written by cyclopean in m and kg/m3, z up",
        *_friction(assembly),
        "model new",
    ]
    for block, even in zip(assembly.blocks, flat(assembly.mesh), strict=True):
        lines += _polyhedron(block, even)
    lines += _groups(assembly.blocks)
    return "\n".join(lines) + "\n"


def _friction(assembly: Assembly) -> list[str]:
    if assembly.contacts is None:
        return ["; the model lists no contacts and gives no friction"]
    given = sorted({mu for mu in assembly.contacts.mu.tolist() if not math.isnan(mu)})
    said = ", ".join(f"mu {mu:g} = {math.degrees(math.atan(mu)):.2f} degrees" for mu in given[:8]) or "not given"
    return [f"; friction of the {len(assembly.contacts)} contacts of the model: {said}"]


def _polyhedron(block: Block, even: Bools) -> list[str]:
    faces = [part for face, well in zip(block.faces, even, strict=True) for part in ([face] if well else fan(face))]
    corners = [f"{x!r},{y!r},{z!r}" for x, y, z in block.vertices.tolist()]
    lines = [f"block create polyhedron group {_quoted('stone ' + block.id)} slot 'stone' ..."]
    lines += ["  face " + " ".join(corners[i] for i in reversed(face)) + " ..." for face in faces]
    lines[-1] = lines[-1].removesuffix(" ...")
    return lines


def _groups(blocks: Sequence[Block]) -> Iterable[str]:
    """Commands that tell groups, supports and densities."""
    for block in blocks:
        here = f"range group {_quoted('stone ' + block.id)}"
        if block.group is not None:
            yield f"block group {_quoted('group ' + block.group)} slot 'group' {here}"
        if block.density is not None:
            yield f"block property density {block.density!r} {here}"
        if block.fixed:
            yield f"block group 'fixed' slot 'support' {here}"
    if any(block.fixed for block in blocks):
        yield "block fix range group 'fixed'"


def _quoted(name: str) -> str:
    """Quote a name; one that holds both kinds of quotes loses the double ones."""
    return f"'{name}'" if "'" not in name else '"' + name.replace('"', "'") + '"'


def flat(mesh: Polyhedra) -> list[Bools]:
    """For each body, whether its faces are flat: triangles, and polygons within `FLAT` sizes of it of one plane."""
    even = (np.diff(mesh.corner_start) == 3) | (face_warp(mesh) <= FLAT * mesh.diagonal[mesh.face_body])
    return np.split(even, mesh.face_start[1:-1])


def not_convex(assembly: Assembly) -> list[str]:
    """Ids of the blocks that are not closed, of one piece and convex."""
    convex = convex_bodies(planar_regions(assembly.mesh, FLAT * assembly.size))
    return [block.id for block, well in zip(assembly.blocks, convex.tolist(), strict=True) if not well]
