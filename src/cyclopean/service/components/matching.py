"""Match: which found stone goes into which cell of a wall. Carve: what is cut off it there."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cyclopean.errors import InputError
from cyclopean.io.rhino_json import Pose
from cyclopean.service.meshes import FOLDER, STONES, blocks_of, model_text, moved, stones_of
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

Given = Mapping[str, Any]

CELLS = (
    Input("Cells", "C", "Mesh", "Blocks of the wall as drawn: closed meshes. What is held is no cell.", "list"),
    Input("Names", "N", "Text", "Names of these blocks, in their order.", "list", optional=True),
    Input("Fixed", "F", "Boolean", "Which of them are held; where not given, those that touch the lowest point.",
          "list", optional=True),
)  # fmt: skip


def _match(given: Given, context: Context) -> Answer:
    """Place stones in cells."""
    from cyclopean.assembly import supports
    from cyclopean.design.matching.cells import cells_of
    from cyclopean.design.matching.match import MatchSettings, match_stones

    gap = given["Gap"]
    if gap is not None and not 0.0 < gap < 1.0:
        raise InputError(f"Gap: {gap:g} is not between 0 and 1")
    if not 0.0 < given["Weight"] <= 1e6:
        raise InputError(f"Weight: {given['Weight']:g} is not between 0 and 1e6")
    if not 64 <= given["Points"] <= 8192:
        raise InputError(f"Points: {given['Points']} is not between 64 and 8192")
    settings = MatchSettings(weight=given["Weight"], gap=gap, points=given["Points"])
    wall, said = blocks_of("Cells", given["Cells"], given["Names"], given["Fixed"])
    inventory = stones_of(given, context)
    cells = cells_of(wall, supports(wall)[0])
    found = match_stones(inventory, cells, settings)
    stones = inventory.stones
    poses = [(placed.rotation, placed.shift) for placed in found.placements]
    values = {
        "Placed": [moved(stones[p.stone], pose) for p, pose in zip(found.placements, poses, strict=True)],
        "Planes": poses,
        "Stone": [p.stone for p in found.placements],
        "Cell": [int(cells.block[p.cell]) for p in found.placements],
        "Carved Share": [p.carved_share for p in found.placements],
        "Lambda": found.imposition,
        "Void": found.gap,
        "Unused": found.unused.tolist(),
        "Empty": cells.block[found.empty].tolist(),
    }
    return Answer(values, (*said, *inventory.notes, *found.notes))


MATCH = Component(
    "match",
    "Match",
    "Match",
    "Finds which found stone goes into which cell of a wall, so that as little as possible is cut off.",
    (
        STONES,
        *FOLDER,
        *CELLS,
        Input("Weight", "W", "Number", "Price of a litre of void, where a litre carved off costs 1.", default=1.0),
        Input("Gap", "G", "Number", "Share of the wall that may stay void; finds the weight.", optional=True),
        Input("Points", "P", "Integer", "Points in each stone that its place is found by.", default=1024),
    ),
    (
        Output("Placed", "S", "Mesh", "The stones where they go.", "list"),
        Output("Planes", "P", "Plane", "Where the xy plane of each stone goes: Orient from World XY.", "list"),
        Output("Stone", "I", "Integer", "Number of each placed stone, in the order they came in.", "list"),
        Output("Cell", "C", "Integer", "Number of the block that is its cell.", "list"),
        Output("Carved Share", "L", "Number", "Lambda of each placed stone: the share that is cut off.", "list"),
        Output("Lambda", "La", "Number", "Share of all placed stone that is cut off."),
        Output("Void", "V", "Number", "Share of the filled cells that stays void."),
        Output("Unused", "U", "Integer", "Stones that are left.", "list"),
        Output("Empty", "E", "Integer", "Blocks that no stone is left for.", "list"),
    ),
    _match,
)


def _carve(given: Given, _: Context) -> Answer:
    """Cut placed stones back to their cells, and find where they touch then."""
    from cyclopean.assembly import supports
    from cyclopean.design.carving.carve import carve_all, total
    from cyclopean.design.carving.carved_wall import carved_wall
    from cyclopean.io.cutlist import cuts_csv

    wall, said = blocks_of("Cells", given["Cells"], given["Names"], given["Fixed"])
    held = supports(wall)[0]
    stones = stones_of({"Stones": given["Placed"]}, Context()).stones
    number = _numbers(given["Cell"], [k for k in range(len(wall)) if not held[k]], len(stones), len(wall))
    if not 0.0 <= given["Least Cut"] <= 1e3:
        raise InputError(f"Least Cut: {given['Least Cut']:g} m is no depth")
    poses = given["Planes"] or [(np.eye(3), np.zeros(3))] * len(stones)
    if len(poses) != len(stones):
        raise InputError(f"Planes: {len(poses)} values for {len(stones)} stones; give one for each, in their order")
    own = [_taken_back(stone, pose) for stone, pose in zip(stones, poses, strict=True)]
    placed = ((s, wall.blocks[k], *pose) for s, k, pose in zip(own, number, poses, strict=True))
    carved = carve_all(placed, least=given["Least Cut"])
    built = carved_wall(wall, carved, fixed=held)
    whole = total(carved)
    values = {
        "Carved": [(c.vertices, _faces(c.triangles)) for c in carved if len(c.triangles)],
        "Offcuts": [[(p.vertices, _faces(p.triangles)) for p in c.offcuts if not p.dressing] for c in carved],
        "Lambda": whole.imposition,
        "Void": whole.gap,
        "Cut Area": [sum(cut.area for cut in c.cuts if not cut.dressing) for c in carved],
        "Touching": built.touching_share,
        "Cut List": cuts_csv(carved).splitlines(),
        "Model": model_text(built.assembly),
    }
    return Answer(values, (*said, *(note for c in carved for note in c.notes), *built.notes))


def _numbers(given: Sequence[int], free: Sequence[int], stones: int, blocks: int) -> Sequence[int]:
    """The block of each stone; the free ones in their order where nothing is said."""
    if given and len(given) != stones:
        raise InputError(f"Cell: {len(given)} values for {stones} stones; give one for each, in their order")
    if not given and stones > len(free):
        raise InputError(f"Cell: nothing is connected, and there are {stones} stones for {len(free)} cells")
    number = given or free[:stones]
    if outside := next((k for k in number if not 0 <= k < blocks), None):
        raise InputError(f"Cell: there is no block {outside}; they are numbered 0 to {blocks - 1}")
    return number


def _taken_back(stone: Any, pose: Pose) -> Any:
    """A placed stone in its own frame, so that cuts are told as whoever has the stone sees them."""
    from cyclopean.design.stones.stone import stone_of

    turn, shift = pose
    return stone_of(stone.id, (stone.vertices - shift) @ turn, stone.triangles)


def _faces(triangles: Any) -> list[tuple[int, ...]]:
    return [tuple(t) for t in triangles.tolist()]


CARVE = Component(
    "carve",
    "Carve",
    "Carve",
    "Cuts stones back to the cells they are placed in, by exact solids, and finds where they touch then.",
    (
        Input("Placed", "S", "Mesh", "Stones where they go, from Match.", "list"),
        Input("Cell", "I", "Integer", "Number of the block that is the cell of each; the free blocks in their"
              " order where not given.", "list", optional=True),
        *CELLS,
        Input("Planes", "P", "Plane", "From Match: cuts are then told in each stone's own frame.", "list",
              optional=True),
        Input("Least Cut", "L", "Number", "Depth (m) up to which a cut is left to the chisel.", default=0.002),
    ),
    (
        Output("Carved", "S", "Mesh", "The carved stones.", "list"),
        Output("Offcuts", "O", "Mesh", "What comes off; a branch a stone.", "tree"),
        Output("Lambda", "La", "Number", "Share of the stone that is cut off."),
        Output("Void", "V", "Number", "Share of the cells that stays void."),
        Output("Cut Area", "A", "Number", "m2 of the cuts of each stone.", "list"),
        Output("Touching", "T", "Number", "Share of the drawn joints over which carved stones touch."),
        Output("Cut List", "X", "Text", "A line of CSV for each cut, after a line of headings.", "list"),
        Output("Model", "M", "Text", "The wall as it will be built, for Check and Sequence."),
    ),
    _carve,
)  # fmt: skip
