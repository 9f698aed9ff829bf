"""Pictures of the gallery: an arch, a barrel vault and a dome, as `make` draws them.

Run `python bench/gallery_arches.py [--out docs/images]`; writes one SVG each and prints its stones and the verdict of
coupled analysis. Stones that touch never share a tint.
"""

import argparse
import re
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
from gallery import GROUND, JOINT, LIGHT, MARGIN, TINTS, WIDTH, painted

from cyclopean.analysis import Settings, check
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.design import arch, dome, vault
from cyclopean.design.construction.colouring import colouring

FLAT = 1e-6  # m: a joint whose corners are nearer to the plane of a face lies in it
MODELS: dict[str, tuple[str, Assembly, float, float]] = {  # picture -> title, model, turn and tilt (degrees)
    "arch": ("Arch of 12 voussoirs", arch(12, span=3.0, thickness=0.3), -28.0, 18.0),
    "vault": ("Barrel vault of 8 rings of 9", vault(9, 8), -35.0, 28.0),
    "dome": ("Dome of 6 courses with an oculus", dome(6, 14), -20.0, 38.0),
}


def axes_of(turn: float, tilt: float) -> Floats:
    """Columns: right and up on the sheet, and into it."""
    angle, lean = np.radians(turn), np.radians(tilt)
    right = np.array([np.cos(angle), np.sin(angle), 0.0])
    level = np.array([-np.sin(angle), np.cos(angle), 0.0])
    into = np.cos(lean) * level - np.sin(lean) * np.array([0.0, 0.0, 1.0])
    return np.stack([right, np.cross(right, into), into], 1)


def free_faces(assembly: Assembly, k: int) -> list[tuple[int, ...]]:
    """The faces of block k that lie in no joint of it."""
    block, joints = assembly.blocks[k], assembly.contacts
    touched = [joints.polygon(c) for c in np.flatnonzero((joints.a == k) | (joints.b == k))]

    def in_a_joint(face: tuple[int, ...]) -> bool:
        a, b, c = block.vertices[list(face[:3])]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        return any(np.abs((polygon - a) @ normal).max() < FLAT for polygon in touched)

    return [face for face in block.faces if not in_a_joint(face)]


def picture(title: str, assembly: Assembly, turn: float, tilt: float) -> str:
    """Faces that look at the viewer, as one `<svg>`: those in joints, then the others, each from the furthest on."""
    axes = axes_of(turn, tilt)
    seen = np.concatenate([block.vertices for block in assembly.blocks]) @ axes
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale = (WIDTH - 2.0 * MARGIN) / max(high[0] - low[0], high[1] - low[1])
    wide, height = (high[:2] - low[:2]) * scale + 2.0 * MARGIN
    tint = [TINTS[k % len(TINTS)] for k in colouring(assembly.contacts, len(assembly))]
    faces = []
    for k, (block, colour) in enumerate(zip(assembly.blocks, tint, strict=True)):
        sheet = MARGIN + (block.vertices @ axes[:, :2] * [1.0, -1.0] + [-low[0], high[1]]) * scale
        inner = np.zeros(len(sheet), dtype=bool)
        shade = GROUND if block.fixed else colour
        for last, shown in ((False, block), (True, replace(block, faces=tuple(free_faces(assembly, k))))):
            faces += [(last, far, drawn) for _, far, drawn in painted(shown, sheet, inner, axes[:, 2], shade, LIGHT)]
    ordered = sorted(faces, key=lambda face: (face[0], -face[1]))
    drawn = re.sub(r'stroke="#\w+"', f'stroke="{JOINT}"', "".join(polygon for _, _, polygon in ordered))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:.0f} {height:.0f}" role="img">'
        f'<title>{escape(title)}</title><rect width="100%" height="100%" fill="#fff"/>'
        f'<g stroke-width="0.8" stroke-linejoin="round">{drawn}</g></svg>'
    )


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    out = parser.parse_args(given).out
    for name, (title, assembly, turn, tilt) in MODELS.items():
        svg = picture(title, assembly, turn, tilt)
        (out / f"{name}.svg").write_text(svg + "\n", encoding="utf-8")
        verdict = check(assembly, Settings(method="cra")).verdict
        print(f"{name:>6}: {len(assembly)} blocks, {verdict}, {len(svg):,} bytes")


if __name__ == "__main__":
    main()
