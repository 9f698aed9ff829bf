"""Lines and arrows as plain meshes: one draw call each, however many there are.

Viser's own fat lines and arrows are instanced, one instance a line or an arrow. Where no graphics card draws them, each
instance costs as much as a draw call: 24,000 edges took a second a frame, as meshes they take a few hundredths.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.view.colours import BLAMED, HELD, STEPS, STONES, UNKNOWN, fill, rgb
from cyclopean.view.drawing import ROUGH, Picture

SUN = np.array([-3.0, -6.0, 8.0])  # where light comes from: lines are turned towards it, so that all are equally dark
THIN = 2e-5  # width of what stands for a line, in units of the drawing: far below a pixel, far above rounding
THROUGH = 0.6  # opacity of free blocks where forces are shown inside them
MANY = 200  # arrows beyond which they are drawn with fewer sides
HEAD, LONG = 2.6, 7.0  # radius and length of an arrow's head, in radii of its shaft


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """One mesh as it is to be shown; without triangles it is not shown."""

    name: str
    vertex: Any  # (V, 3) float32, units of the drawing
    face: Any  # (T, 3) uint32
    colour: str  # #rrggbb
    opacity: float | None = None
    wire: bool = False  # draw the sides of the triangles only, one pixel wide
    visible: bool = True  # at first; in the tree of the scene it can be switched
    smooth: bool = False  # shade across the sides of the triangles: found stones, not sawn ones


class Layers:
    """What of a scene has been sent, so that only what has changed is sent again."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._handle: dict[str, Any] = {}
        self._sent: dict[str, Layer] = {}

    def put(self, layer: Layer) -> None:
        """Show a mesh in place of what had its name."""
        handle, before = self._handle.get(layer.name), self._sent.get(layer.name)
        if not len(layer.face):
            if handle is not None:
                handle.visible = False  # cheaper than to take it away: it mostly comes back
            return
        if handle is None or before is None:
            self._handle[layer.name] = self._made(layer)
        else:
            if not np.array_equal(before.face, layer.face):
                handle.faces = layer.face
            if not np.array_equal(before.vertex, layer.vertex):
                handle.vertices = layer.vertex
            handle.opacity = layer.opacity
            handle.visible = True
        self._sent[layer.name] = layer

    def _made(self, layer: Layer) -> Any:
        return self._scene.add_mesh_simple(
            layer.name,
            layer.vertex,
            layer.face,
            color=rgb(layer.colour),
            opacity=layer.opacity,
            wireframe=layer.wire,
            flat_shading=not (layer.wire or layer.smooth),
            visible=layer.visible,
            cast_shadow=False,
            receive_shadow=False,
        )


NAMES = {HELD: "supports", UNKNOWN: "no value", BLAMED: "where the search ends"}


def stone_layers(drawn: Picture, corner: Ints, face: Ints, shown: Any) -> list[Layer]:
    """Blocks as stone, smooth where they have many faces; and, switched off, in the colours of what is to be feared.

    Of a mechanism its colours are seen at first, and the stone is switched off. Triangles `corner` (T, 3), their `face`
    (T,) and vertices `shown` (V, 3) as in `block_layers`.
    """
    special, feared = np.isin(drawn.group, (HELD, BLAMED)), drawn.quantity == "movement"
    tint = np.where(special, drawn.group, np.arange(len(drawn.group)) * 5 % len(STONES))
    rough = np.diff(drawn.mesh.face_start) > ROUGH
    layers = []
    for smooth in (False, True):
        for k in (HELD, BLAMED, *range(len(STONES))):
            vertex, local = _part((tint == k) & (rough == smooth), drawn, corner, face, shown)
            name = (f"/stones/{k + 1}" if k >= 0 else f"/{NAMES[k]}") + (", rough" if smooth else "")
            colour = STONES[k] if k >= 0 else fill(k)
            layers.append(Layer(name, vertex, local, colour, visible=k < 0 or not feared, smooth=smooth))
    if drawn.quantity != "nothing":
        solid = block_layers(replace(drawn, arrow=drawn.arrow[:0]), corner, face, shown)
        layers += [
            replace(one, name=one.name.replace("/blocks", f"/{drawn.quantity}"), visible=feared)
            for one in solid
            if one.colour not in {fill(HELD), fill(BLAMED)}
        ]
    return layers


def _part(some: Bools, drawn: Picture, corner: Ints, face: Ints, shown: Any) -> tuple[Any, Any]:
    """Vertices and triangles of some of the bodies (n,)."""
    mine = some[drawn.mesh.vertex_body]
    return shown[mine], (np.cumsum(mine) - 1)[corner[some[drawn.mesh.face_body[face]]]].astype(np.uint32)


def block_layers(drawn: Picture, corner: Ints, face: Ints, shown: Any) -> list[Layer]:
    """Blocks, one mesh a colour class, see-through where there are forces inside: few, however many blocks.

    Triangles `corner` (T, 3) are of the picture's mesh, each of a `face` (T,); its vertices are `shown` (V, 3),
    float32, in units of the drawing.
    """
    through = THROUGH if len(drawn.arrow) else None
    layers = []
    for k in (HELD, UNKNOWN, BLAMED, *range(STEPS)):
        vertex, local = _part(drawn.group == k, drawn, corner, face, shown)
        name = NAMES.get(k, f"{k / STEPS:.1f} to {(k + 1) / STEPS:.1f}")
        layers.append(Layer(f"/blocks/{name}", vertex, local, fill(k), None if k == HELD else through))
    return layers


def wires(segment: Floats, place: Callable[[Floats], Any], name: str, colour: str) -> Layer:
    """Line segments (e, 2, 3), m, as a wireframe of triangles too thin to see; `place` turns m into drawing units."""
    end = place(segment).astype(float).reshape(-1, 2, 3)
    along = end[:, 1] - end[:, 0]
    aside = np.cross(np.broadcast_to(SUN, along.shape), along)
    size = np.linalg.norm(aside, axis=1)
    aside[size <= 1e-9] = [THIN, 0.0, 0.0]  # it points at the sun, or has no length
    aside[size > 1e-9] *= THIN / size[size > 1e-9, None]
    vertex = np.concatenate([end, end[:, :1] + aside[:, None]], 1).reshape(-1, 3).astype(np.float32)
    return Layer(name, vertex, np.arange(len(vertex), dtype=np.uint32).reshape(-1, 3), colour, wire=True)


def once(segment: Floats, tolerance: float) -> Floats:
    """Line segments (e, 2, 3) without those that lie on another; of a wall of bricks, a third of all edges.

    Ends are compared by whole multiples of the tolerance, so that now and then one of two equal segments is kept.

    Examples
    --------
    >>> up = np.array([[0.0, 0, 0], [0, 0, 1]])
    >>> once(np.stack([up, up[::-1], up + [1, 0, 0]]), 1e-6).shape
    (2, 2, 3)
    """
    end = np.rint(segment / tolerance).astype(np.int64)
    weight = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    mixed = (end.astype(np.uint64) * weight).sum(axis=2, dtype=np.uint64)  # modulo 2^64, as any hash
    mixed ^= mixed >> np.uint64(31)
    key = (mixed * weight[0]).sum(axis=1, dtype=np.uint64)  # the same for both directions
    return segment[np.sort(np.unique(key, return_index=True)[1])]


def arrow_solids(
    arrow: Floats, place: Callable[[Floats], Any], name: str, colour: str, radius: float, slim: float = 0.05
) -> Layer:
    """Arrows (m, 2, 3), tail and tip in m, as one mesh of prisms with pyramids on them.

    `place` turns m into units of the drawing. Shafts have this radius, units of the drawing, or the share `slim` of the
    median length, if that is less.
    """
    end = place(arrow).astype(float).reshape(-1, 2, 3)
    along = end[:, 1] - end[:, 0]
    length = np.linalg.norm(along, axis=1)
    shaft = min(radius, slim * float(np.median(length))) if len(length) else 0.0
    towards = along / np.maximum(length, 1e-300)[:, None]
    neck = end[:, 1] - np.minimum(LONG * shaft, length)[:, None] * towards
    sides = 3 if len(arrow) > MANY else 8
    one, two = _across(towards)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.cos(angle)[:, None] * one[:, None] + np.sin(angle)[:, None] * two[:, None]  # (m, sides, 3)
    rings = [end[:, :1] + shaft * ring, neck[:, None] + shaft * ring, neck[:, None] + HEAD * shaft * ring, end[:, 1:]]
    vertex = np.concatenate(rings, 1)
    face = _arrow_faces(sides)[None] + vertex.shape[1] * np.arange(len(arrow))[:, None, None]
    return Layer(name, vertex.reshape(-1, 3).astype(np.float32), face.reshape(-1, 3).astype(np.uint32), colour)


def _across(towards: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (m, 3) that make a right-handed frame with each of these."""
    helper = np.eye(3)[np.argmin(np.abs(towards), axis=1)]
    one = np.cross(helper, towards)
    one /= np.maximum(np.linalg.norm(one, axis=1), 1e-300)[:, None]
    return one, np.cross(towards, one)


def _arrow_faces(sides: int) -> Ints:
    """Triangles of one arrow, outward: foot, shaft, underside of the head, head."""
    here = np.arange(sides)
    there = np.roll(here, -1)
    fan = np.stack([np.zeros(sides - 2, int), here[2:], here[1:-1]], 1)
    shaft = [np.stack([here, there, there + sides], 1), np.stack([here, there + sides, here + sides], 1)]
    head = np.stack([here + 2 * sides, there + 2 * sides, np.full(sides, 3 * sides)], 1)
    return np.concatenate([fan, *shaft, fan + 2 * sides, head])
