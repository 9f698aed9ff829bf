"""A rubble wall that is done: as a model with contacts, and measured."""

from typing import Any

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.assembly.patches import gathered
from cyclopean.design.rubble.hearting import Wedge
from cyclopean.design.rubble.site import Site, free_name
from cyclopean.design.rubble.wall import Measures, RubbleWall
from cyclopean.design.stones.inventory import Inventory
from cyclopean.geometry.solids import intersection, solid_of, solid_volume

__all__ = ["finished", "largest_overlap"]


def finished(site: Site, inventory: Inventory) -> RubbleWall:
    """The wall as a model with contacts, and its measures but for the time that it took."""
    bare = _assembly(site, inventory)
    wedge = np.array([isinstance(what, Wedge) for what in site.kind.values()])
    block = np.where(wedge, len(site.laid) + np.cumsum(wedge), np.cumsum(~wedge))
    contacts, patches = gathered(site.structure.meetings(dict(zip(site.kind, block.tolist(), strict=True))))
    whole = Assembly(bare.blocks, contacts, (), bare.name)
    return RubbleWall(
        tuple(site.laid),
        np.array(sorted(site.left + site.aside + site.small), np.int64),
        site.settings,
        _measures(site),
        whole,
        patches,
        int(np.count_nonzero(wedge)),
    )


def _assembly(site: Site, inventory: Inventory) -> Assembly:
    """Blocks of the wall, the ground first."""
    names = {s.id for s in inventory.stones} | {site.ground.id}
    stones: list[Block] = [site.ground]
    wedges: list[Block] = []
    for number, what in site.kind.items():
        mesh = site.stood[number]
        faces = tuple(map(tuple, mesh.triangles.tolist()))
        if isinstance(what, Wedge):
            name = free_name(f"wedge-{len(wedges) + 1}", names)
            wedges.append(Block(name, mesh.vertices, faces, None, False, "chinking"))
        else:
            stone = inventory.stones[what.stone]
            stones.append(Block(stone.id, mesh.vertices, faces, stone.density, False, f"course-{what.course}"))
    blocks = stones + wedges
    return Assembly(tuple(blocks), None, (), "rubble wall")


def _measures(site: Site) -> Measures:
    volume = sum(site.stones[laid.stone].volume for laid in site.laid)
    skyline = float(site.map.max(axis=1).sum()) * site.cell * site.map.shape[1] * site.cell
    return Measures(
        1.0 - volume / skyline,
        1.0 - volume / (float(site.map.sum()) * site.cell**2),
        sum(laid.stable for laid in site.laid) / len(site.stones),
        1 + max(laid.course for laid in site.laid),
        float(site.boxes[:, 1, 2].max()),
        *site.size,
        site.overlap,
        0.0,
    )


def largest_overlap(assembly: Assembly) -> tuple[float, tuple[str, str]]:
    """Largest volume that two blocks have in common, as share of the smaller one, and which two; by exact solids."""
    boxes = [(b.vertices.min(axis=0), b.vertices.max(axis=0)) for b in assembly.blocks]
    solids: list[Any] = [solid_of(b.vertices, b.faces, b.id) for b in assembly.blocks]
    low, high = (np.array([box[k] for box in boxes]) for k in (0, 1))
    worst: tuple[float, tuple[str, str]] = (0.0, ("", ""))
    for a in range(len(solids)):
        for b in (np.flatnonzero(((low[a + 1 :] < high[a]) & (high[a + 1 :] > low[a])).all(axis=1)) + a + 1).tolist():
            smaller = min(float(assembly.mass.volume[a]), float(assembly.mass.volume[b]))
            share = solid_volume(intersection(solids[a], solids[b])) / smaller
            if share > worst[0]:
                worst = share, (assembly.blocks[a].id, assembly.blocks[b].id)
    return worst
