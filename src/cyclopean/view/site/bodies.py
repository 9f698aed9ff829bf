"""Stones as they are drawn on sheets: outline, shading, edges, in mm of paper to the right, down, and to the viewer.

The outline hides what lies behind, in print by its paint and in DXF by cutting that away; shading is for print alone.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Block
from cyclopean.design.carving.cuts import planes_of
from cyclopean.errors import InputError
from cyclopean.geometry import pack
from cyclopean.geometry.solids import cross_section, fans, solid_of
from cyclopean.view.colours import INK
from cyclopean.view.drawing import feature_edges
from cyclopean.view.stone_faces import facing, stone_faces, stone_svg
from cyclopean.view.svg import Paper, View, closed, layer, project, segments

MANY = 400  # triangles beyond which a stone is a scan: its small faces are joined, and it has no edges
FINER = 10.0  # steps of shading in a mm
FINE = 3  # decimals of a mm
SLIT = 0.04  # mm: half of the widest slit that is rounding, less than any line is wide
SPECK = 1e-6  # mm2: a triangle below it is seen edge-on
PALE = 0.5  # light of the darkest shade on paper, on which numbers have to be read
RIM, EDGE = 0.35, 0.18  # mm, width of lines: ISO 128
CUT_RIM, HATCHED, HATCH_LINE = 0.5, 2.5, 0.1  # mm: rim of what is cut, between its hatch lines, and their width


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A stone in the structure's frame."""

    name: str
    vertices: Floats  # (v, 3) m
    triangles: Ints  # (t, 3) counter-clockwise from outside


@dataclass(frozen=True, eq=False)
class Body:
    """A stone that is seen from somewhere."""

    name: str
    corner: Floats  # (t, 3, 3) mm of paper: triangles that look at the viewer, the furthest first
    light: Floats  # (t,) 0 to 1
    edge: Floats  # (e, 2, 2) mm of paper

    @cached_property
    def outline(self) -> Any:
        """What it covers, as a geometry of shapely."""
        import shapely

        flat = shapely.polygons(self.corner[:, :, :2])
        whole = shapely.union_all(shapely.make_valid(flat[shapely.area(flat) > SPECK]))
        # slits between triangles that are seen almost edge-on are closed; corners stay where they are
        return whole.buffer(SLIT, join_style="mitre").buffer(-SLIT, join_style="mitre")

    def drawn(self, tint: str, window: Any = None) -> str:
        """The stone in a tint (#rrggbb); what lies outside a window, a geometry of shapely in mm, is left out."""
        shape = self.outline if window is None else self.outline.intersection(window)
        style = f'fill="{tint}" stroke="{INK}" stroke-width="{RIM}" stroke-linejoin="round"'
        if not (rim := covered(shape)):
            return ""
        whole = window is None or window.contains(self.outline)
        shade = stone_svg(self.name, self.corner * FINER, self.light, tint) if whole else ""
        again = f'<path d="{rim}" {style.replace(tint, "none")}/>'  # shading lies over half of the line
        lines = f'<path d="{segments(self.edge, FINE)}" fill="none" stroke="{INK}" stroke-width="{EDGE}"/>'
        return (
            f'<path d="{rim}" {style}/>'
            + layer("shading", [f'<g transform="scale({1.0 / FINER:g})">{shade}</g>', again] if shade else ())
            + (lines if whole and len(self.edge) else "")
        )


@dataclass(frozen=True, eq=False)
class Slice(Body):
    """A stone that is cut open."""

    shape: Any  # of shapely, mm of paper: what the cut shows

    @property
    def outline(self) -> Any:
        """What it covers, as a geometry of shapely."""
        return self.shape

    def drawn(self, tint: str, window: Any = None) -> str:
        """The cut in a tint, hatched, with a thick rim."""
        import shapely

        shape = self.shape if window is None else self.shape.intersection(window)
        if not (rim := covered(shape)):
            return ""
        left, top, right, foot = shape.bounds
        begin = np.arange(left - (foot - top), right, HATCHED)
        ends = np.stack([begin, np.full(len(begin), foot), begin + (foot - top), np.full(len(begin), top)], 1)
        lines = shapely.intersection(shapely.linestrings(ends.reshape(-1, 2, 2)), shape)
        parts = [p for p in shapely.get_parts(lines) if p.geom_type == "LineString" and not p.is_empty]
        edge = np.array([shapely.get_coordinates(p)[[0, -1]] for p in parts]).reshape(-1, 2, 2)
        style = f'fill="{tint}" stroke="{INK}" stroke-width="{CUT_RIM}" stroke-linejoin="round"'
        hatch = f'<path d="{segments(edge, FINE)}" fill="none" stroke="{INK}" stroke-width="{HATCH_LINE}"/>'
        return f'<path d="{rim}" {style}/>{hatch}'


def sliced(solid: Solid, paper: Paper, far: float) -> Body:
    """A stone cut open so far (m) away from the viewer."""
    import shapely

    flat, away = project(solid.vertices, paper.view)
    body = solid_of(np.column_stack([flat, -away]), solid.triangles, solid.name)
    rings = [shapely.Polygon(paper.of_flat(ring)) for ring in cross_section(body, -far)]
    shape = shapely.Polygon()
    for ring in sorted(rings, key=lambda one: -one.area):  # what lies within another is a hole
        shape = shape.symmetric_difference(shapely.make_valid(ring))
    none = np.zeros((0, 2, 2))
    return Slice(solid.name, np.zeros((0, 3, 3)), np.zeros(0), none, shape)


def covered(shape: Any, digits: int = FINE) -> str:
    """Path of what a geometry of shapely covers, holes too."""
    import shapely

    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]
    return "".join(closed(shapely.get_coordinates(r)[:-1], digits) for part in parts for r in shapely.get_rings(part))


def solid_of_block(block: Block) -> Solid:
    """A block of a structure; faces that are not convex are cut into triangles within themselves."""
    if all(len(face) == 3 for face in block.faces):
        return Solid(block.id, block.vertices, fans(block.faces))
    planes = planes_of(block, np.zeros(3))
    return Solid(block.id, planes.vertices, planes.triangles)


def on_paper(solid: Solid, paper: Paper) -> Body:
    """A stone as it is seen on paper, whose units are mm."""
    flat, far = project(solid.vertices, paper.view)
    point = np.column_stack([paper.of_flat(flat), -paper.scale * far])
    return Body(solid.name, *_faces(point, solid), paper.of(_edges(solid, paper.view)))


def _faces(point: Floats, solid: Solid) -> tuple[Floats, Floats]:
    """Triangles of a stone that are seen, and their light; those of a scan joined where no eye tells them apart."""
    if len(solid.triangles) > MANY:
        try:
            corner, light = stone_faces(point * FINER, solid.triangles, solid.name)
            return corner / FINER, PALE + (1.0 - PALE) * light
        except InputError:  # no closed solid: drawn as it is
            pass
    corner, light = facing(point, solid.triangles)
    order = np.argsort(corner[:, :, 2].mean(axis=1), kind="stable")
    return corner[order], PALE + (1.0 - PALE) * light[order]


def _edges(solid: Solid, view: View) -> Floats:
    """(e, 2, 3) m: edges of a stone that is no scan, those on its far side left out."""
    if len(solid.triangles) > MANY:
        return np.zeros((0, 2, 3))
    corner = solid.vertices[solid.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    seen = solid.triangles[normal @ view.sight < 0.0]
    return feature_edges(pack([(solid.vertices, seen)])) if len(seen) else np.zeros((0, 2, 3))
