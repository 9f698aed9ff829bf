"""Pictures of the gallery: five polygonal walls, drawn by the same options as the commands on that page.

Run `python bench/gallery.py [--out docs/images]`; writes one SVG a wall and prints its stones, J and the verdict of
coupled analysis. Stones that touch never share a tint.
"""

import argparse
from collections.abc import Sequence
from graphlib import TopologicalSorter
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.analysis import Settings, check
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.design.construction.colouring import colouring
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.joints import with_open_joints
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import PolygonalWall, polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder
from cyclopean.view.colours import shaded
from cyclopean.view.wall_drawing import wall_svg

TINTS = ("#d9cfbd", "#c2b8a8", "#e6dfd1", "#cfc0a6", "#b9b5ac", "#dccab0", "#c9c6bf", "#bfae96")
GROUND, JOINT = "#b9b8ab", "#6f685c"
WIDTH, MARGIN = 1000.0, 24.0  # of the axonometric, in its own units
GAP, CHAMFER = 0.008, 0.012  # m; of the stones in it
TURN, TILT = np.radians(-20.0), np.radians(22.0)  # the viewer stands to the left, and looks down
LIGHT = np.array([-0.45, -0.6, 0.66])  # towards the sun

DOOR, WINDOW = Opening(0.8, 0.9, 1.45, 0.0, "arch"), Opening(2.45, 0.7, 0.65, 0.75)
PIERCED = {"width": 4.0, "height": 2.2, "columns": 11, "rows": 7, "courses": 7, "openings": (DOOR, WINDOW)}
DRESSED = {"quoins": Quoins(), "coping": Coping()}
WALLS: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "wall-irregular": ("Irregular", {"coursing": 0.0}, {}),
    "wall-default": ("Default", {}, {}),
    "wall-level": ("Level courses", {"coursing": 1.0}, {}),
    "wall-door": ("Arched door, window, quoins and coping", {**PIERCED, **DRESSED, "seed": 11}, {}),
    "wall-curved": (
        "On a cylinder, with batter",
        {"width": 4.5, "columns": 12},
        {"surface": Cylinder(3.0, 2.25), "depth": 0.4, "batter": 0.14},
    ),
}


def tints(assembly: Assembly) -> list[str]:
    """One for each block; blocks that touch differ."""
    if assembly.contacts is None:
        return [TINTS[0]] * len(assembly)
    return [TINTS[k % len(TINTS)] for k in colouring(assembly.contacts, len(assembly))]


def axonometric(made: PolygonalWall, title: str) -> str:
    """The wall on its ground, seen from above and from the left, with open joints, as one `<svg>` element."""
    stones = with_open_joints(made.pattern, made.surface, made.thickness, gap=GAP, chamfer=CHAMFER)
    right = np.array([np.cos(TURN), np.sin(TURN), 0.0])
    level = np.array([-np.sin(TURN), np.cos(TURN), 0.0])
    into = np.cos(TILT) * level - np.sin(TILT) * np.array([0.0, 0.0, 1.0])
    axes = np.stack([right, np.cross(right, into), into], 1)
    seen = np.concatenate([block.vertices for block in made.assembly.blocks]) @ axes
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale = (WIDTH - 2.0 * MARGIN) / (high[0] - low[0])
    height = (high[1] - low[1]) * scale + 2.0 * MARGIN
    ground, *solid = made.assembly.blocks
    tint = dict(zip((block.id for block in solid), tints(made.assembly)[1:], strict=True))
    order = [stones[k] for k in furthest_first(made.assembly, into)]
    drawn = [(ground, GROUND), *((block, JOINT) for block in solid), *((block, tint[block.id]) for block in order)]
    parts = []
    for block, colour in drawn:
        flat = MARGIN + (block.vertices @ axes[:, :2] * [1.0, -1.0] + [-low[0], high[1]]) * scale
        parts += painted(block, flat, into, colour)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img">'
        f'<title>{escape(title)}</title><rect width="100%" height="100%" fill="#fff"/>'
        f'<g stroke-width="0.8" stroke-linejoin="round">{"".join(parts)}</g></svg>'
    )


def furthest_first(assembly: Assembly, into: Floats) -> list[int]:
    """Numbers of the stones (ground not counted), so that none is painted over by one that it hides.

    The plane of a joint parts its two stones: the one on the viewer's side comes later.
    """
    behind: dict[int, set[int]] = {k: set() for k in range(len(assembly) - 1)}
    contacts = assembly.contacts
    if contacts is not None:
        for a, b, towards_b in zip(contacts.a.tolist(), contacts.b.tolist(), contacts.frame[:, 0], strict=True):
            if min(a, b) > 0:
                near, far = (a, b) if towards_b @ into > 0.0 else (b, a)
                behind[near - 1].add(far - 1)
    return list(TopologicalSorter(behind).static_order())


def painted(block: Block, flat: Floats, into: Floats, tint: str) -> list[str]:
    """Faces of one block that look at the viewer, as polygons on the sheet, lit by the sun."""
    sun = LIGHT / np.linalg.norm(LIGHT)
    shown = []
    for face in block.faces:
        corner = block.vertices[list(face)]
        normal = np.cross(corner, np.roll(corner, -1, axis=0)).sum(axis=0)
        normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
        if not (normal @ into < -1e-9):
            continue
        fill = shaded(tint, float(np.clip(0.72 + 0.32 * (normal @ sun), 0.0, 1.0)))
        ring = " ".join(f"{x:.1f},{y:.1f}" for x, y in flat[list(face)].tolist())
        shown.append(f'<polygon points="{ring}" fill="{fill}" stroke="{fill}"/>')
    return shown


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    chosen = parser.parse_args(given)
    for name, (title, pattern, options) in WALLS.items():
        made = polygonal_wall(PatternSettings(**pattern), **options)
        found = interlock(made.pattern, depth=made.thickness.depth)
        flat = "surface" not in options
        svg = wall_svg(made.pattern, found, title, tints=tints(made.assembly)[1:]) if flat else axonometric(made, title)
        (chosen.out / f"{name}.svg").write_text(svg + "\n", encoding="utf-8")
        verdict = check(made.assembly, Settings(method="cra")).verdict
        print(f"{name:>15}: cells {made.pattern.readout.cells}, J {found.score:.3f}, {verdict}, {len(svg):,} bytes")


if __name__ == "__main__":
    main()
