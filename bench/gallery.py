"""Pictures of the gallery: polygonal walls, drawn by the same options as the commands on that page.

Run `python bench/gallery.py [--out docs/images]`; writes one SVG a wall and prints its stones, J and the verdict of
coupled analysis. Stones that touch never share a tint.
"""

import argparse
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.analysis import Settings, check
from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.design.construction.colouring import colouring
from cyclopean.design.walls.corner import corner_wall, corner_with_open_joints, joint_score
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.joints import with_open_joints
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder
from cyclopean.view.colours import shaded
from cyclopean.view.wall_drawing import corner_svg, wall_svg

TINTS = ("#d9cfbd", "#c2b8a8", "#e6dfd1", "#cfc0a6", "#b9b5ac", "#dccab0", "#c9c6bf", "#bfae96")
GROUND, JOINT = "#b9b8ab", "#6f685c"
WIDTH, MARGIN = 1000.0, 24.0  # of the axonometric, in its own units
GAP, CHAMFER = 0.008, 0.012  # m; of the stones in it
TURN, TILT = -20.0, 22.0  # degrees: the viewer stands to the left, and looks down
ROUND = 40.0  # degrees, to the right: from there both faces of a corner are seen
LIGHT = np.array([-0.45, -0.6, 0.66])  # towards the sun

Outer = Callable[[Floats], Bools]  # whether points (m) lie on an outer face, or on the bevel round it

DOOR, WINDOW = Opening(0.8, 0.9, 1.45, 0.0, "arch"), Opening(2.45, 0.7, 0.65, 0.75)
WINDOW_BY_A_CORNER = Opening(1.05, 0.6, 0.6, 0.6)
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
CORNER = ("wall-corner", "Two walls that meet at a corner", {"coping": Coping(), "openings": (WINDOW_BY_A_CORNER,)})
RETURN = 2.0  # m; length of the second wall


def tints(assembly: Assembly) -> list[str]:
    """One for each block; blocks that touch differ."""
    if assembly.contacts is None:
        return [TINTS[0]] * len(assembly)
    return [TINTS[k % len(TINTS)] for k in colouring(assembly.contacts, len(assembly))]


def axonometric(
    assembly: Assembly,
    stones: Sequence[Block],
    title: str,
    turn: float = TURN,
    outer: Outer = lambda p: p[:, 0] > np.inf,
) -> str:
    """Stones with open joints on the ground of their wall, seen from above and from one side, as one `<svg>`.

    Faces are painted from the furthest to the nearest, and last those whose corners are all `outer`. That is right for
    a wall seen from its outer side: fronts do not hide fronts, and the sides of a joint lie deeper.
    """
    angle, tilt = np.radians(turn), np.radians(TILT)
    right = np.array([np.cos(angle), np.sin(angle), 0.0])
    level = np.array([-np.sin(angle), np.cos(angle), 0.0])
    into = np.cos(tilt) * level - np.sin(tilt) * np.array([0.0, 0.0, 1.0])
    axes = np.stack([right, np.cross(right, into), into], 1)
    seen = np.concatenate([block.vertices for block in assembly.blocks]) @ axes
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale = (WIDTH - 2.0 * MARGIN) / (high[0] - low[0])
    height = (high[1] - low[1]) * scale + 2.0 * MARGIN
    ground, *solid = assembly.blocks
    tint = dict(zip((block.id for block in solid), tints(assembly)[1:], strict=True))
    sun = LIGHT * ([1.0, 1.0, 1.0] if turn < 0.0 else [-1.0, 1.0, 1.0])

    def on_sheet(block: Block) -> Floats:
        return MARGIN + (block.vertices @ axes[:, :2] * [1.0, -1.0] + [-low[0], high[1]]) * scale

    parts = []
    for layer in ([(ground, GROUND)], [(b, JOINT) for b in solid], [(b, tint[b.id]) for b in stones]):
        faces = [face for b, colour in layer for face in painted(b, on_sheet(b), outer(b.vertices), into, colour, sun)]
        parts += [drawn for *_, drawn in sorted(faces, key=lambda face: (face[0], -face[1]))]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img">'
        f'<title>{escape(title)}</title><rect width="100%" height="100%" fill="#fff"/>'
        f'<g stroke-width="0.8" stroke-linejoin="round">{"".join(parts)}</g></svg>'
    )


def painted(
    block: Block, flat: Floats, outer: Bools, into: Floats, tint: str, light: Floats
) -> list[tuple[bool, float, str]]:
    """Faces of one block that look at the viewer: if outer, how far (m), and as polygons on the sheet, in the sun."""
    sun = light / np.linalg.norm(light)
    shown = []
    for face in block.faces:
        corner = block.vertices[list(face)]
        normal = np.cross(corner, np.roll(corner, -1, axis=0)).sum(axis=0)
        normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
        if not (normal @ into < -1e-9):
            continue
        fill = shaded(tint, float(np.clip(0.72 + 0.32 * (normal @ sun), 0.0, 1.0)))
        ring = " ".join(f"{x:.1f},{y:.1f}" for x, y in flat[list(face)].tolist())
        far = float((corner @ into).mean())
        shown.append((bool(outer[list(face)].all()), far, f'<polygon points="{ring}" fill="{fill}" stroke="{fill}"/>'))
    return shown


def flat_or_curved(title: str, pattern: dict[str, Any], options: dict[str, Any]) -> tuple[str, Assembly, float]:
    """Picture, model and J of one wall: face on where it is flat, else as it stands."""
    made = polygonal_wall(PatternSettings(**pattern), **options)
    found = interlock(made.pattern, depth=made.thickness.depth)
    if "surface" not in options:
        return wall_svg(made.pattern, found, title, tints=tints(made.assembly)[1:]), made.assembly, found.score
    stones = with_open_joints(made.pattern, made.surface, made.thickness, gap=GAP, chamfer=CHAMFER)
    return axonometric(made.assembly, stones, title), made.assembly, found.score


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    chosen = parser.parse_args(given)
    pictures = {name: flat_or_curved(*wall) for name, wall in WALLS.items()}
    name, title, pattern = CORNER
    made = corner_wall(PatternSettings(**pattern), RETURN)
    stones = corner_with_open_joints(made, gap=GAP, chamfer=CHAMFER)
    width = made.patterns[0].settings.width
    svg = axonometric(
        made.assembly, stones, title, ROUND, lambda p: (p[:, 1] < 1.01 * CHAMFER) | (p[:, 0] > width - 1.01 * CHAMFER)
    )
    pictures[name] = svg, made.assembly, joint_score(made)
    faces = corner_svg(made, f"{title}, face on", tints=tints(made.assembly))
    pictures[f"{name}-faces"] = faces, made.assembly, joint_score(made)
    for name, (svg, assembly, score) in pictures.items():
        (chosen.out / f"{name}.svg").write_text(svg + "\n", encoding="utf-8")
        verdict = check(assembly, Settings(method="cra")).verdict
        print(f"{name:>17}: cells {len(assembly) - 1}, J {score:.3f}, {verdict}, {len(svg):,} bytes")


if __name__ == "__main__":
    main()
