"""The 3D scene of a page: viser's own self-contained client with our geometry in it.

Viser writes a static page only from a running server, so one listens for a moment on 127.0.0.1, on a port that the
system picks, and is stopped before anything is returned. The layers (blocks, edges, forces ...) can be switched in the
scene tree of the page.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry import triangles
from cyclopean.view.colours import FORCE, GHOST, GRAVITY, HELD, INK, LOAD, PULL, RUB
from cyclopean.view.drawing import Picture
from cyclopean.view.layers import SPAN, camera, dots, fit, gravity_arrow, light, lines, server, silent
from cyclopean.view.solids import Layer, Layers, arrow_solids, stone_layers
from cyclopean.view.svg import front_view

APART = 0.4  # of its distance from the middle, that a stone moves in the exploded view
HEAVY = 200_000  # corners of faces beyond which there is no exploded view: the page would be too heavy
# Viser's own notices would tell the reader of a report about his graphics driver.
QUIET_STYLE = "<style>.mantine-Notifications-root{display:none!important}</style>"


def scene_html(drawn: Picture, joints: Floats | None = None, off: Iterable[tuple[Floats, Ints]] = ()) -> str:
    """A whole HTML page with a picture in 3D, that opens offline.

    `joints` (e, 2, 3), m, are outlines of contacts; `off` are parts cut off, vertices (v, 3), m, and triangles (t, 3),
    seen as ghosts. Of blocks without forces and motion there is an exploded view, switched off at first.
    """
    (centre, scale), view = fit(drawn.mesh), front_view(drawn.mesh.vertex)

    def place(point: Floats) -> Any:
        return ((point - centre) * scale).astype(np.float32)

    gravity = gravity_arrow(drawn.gravity, drawn.mesh, view)
    shown = place(drawn.mesh.vertex)
    with silent(), server() as running:
        scene = running.scene
        light(scene)
        layers = Layers(scene)
        for layer in (
            *stone_layers(drawn, *triangles(drawn.mesh), shown),
            *(_exploded(drawn, place) if drawn.quantity == "nothing" else ()),
            _cut_off(off, place),
            arrow_solids(drawn.arrow, place, "/contact forces", FORCE, 0.006 * SPAN),
            arrow_solids(drawn.rub, place, "/friction", RUB, 0.0035 * SPAN, 0.12),
            arrow_solids(drawn.load, place, "/loads", LOAD, 0.006 * SPAN),
            arrow_solids(gravity, place, "/gravity", GRAVITY, 0.003 * SPAN),
        ):
            layers.put(layer)
        lines(scene, "/edges", place(drawn.edge), INK, 1.2)
        if joints is not None:
            lines(scene, "/contacts", place(joints), FORCE, 2.4)
        lines(scene, "/where it stood", place(drawn.ghost), GHOST, 1.0)
        dots(scene, "/pressing points", place(drawn.press), FORCE, 0.005 * SPAN)
        dots(scene, "/hinges", place(drawn.hinge), LOAD, 0.012 * SPAN)
        dots(scene, "/joints that slide", place(drawn.slide), RUB, 0.012 * SPAN)
        dots(scene, "/points that would pull", place(drawn.pull), PULL, 0.010 * SPAN)
        lines(scene, "/virtual displacement", place(drawn.virtual_edge), RUB, 1.6, shown=False)
        if len(shown):
            beside = place(np.concatenate([gravity, drawn.load]).reshape(-1, 3))
            camera(running.initial_camera, view, np.concatenate([shown, beside]))
        html = str(running.get_scene_serializer().as_html())
    return html.replace("</head>", QUIET_STYLE + "</head>", 1)


def _exploded(drawn: Picture, place: Callable[[Floats], Any]) -> Iterator[Layer]:
    """The stones apart: each moved away from the middle of them all by a part of its distance."""
    mesh = drawn.mesh
    if not len(mesh.vertex) or len(mesh.corner) > HEAVY:
        return
    count = np.maximum(np.diff(mesh.vertex_start), 1)[:, None]
    middle = np.stack([np.bincount(mesh.vertex_body, axis, len(mesh)) for axis in mesh.vertex.T], -1) / count
    held = (drawn.group == HELD)[:, None]
    away = np.where(held, 0.0, APART * (middle - mesh.vertex.mean(axis=0)) + [0.0, 0.0, APART * np.ptp(middle[:, 2])])
    for layer in stone_layers(drawn, *triangles(mesh), place(mesh.vertex + away[mesh.vertex_body])):
        if layer.name.startswith("/stones"):
            yield replace(layer, name=f"/exploded view{layer.name.removeprefix('/stones')}", visible=False)


def _cut_off(parts: Iterable[tuple[Floats, Ints]], place: Callable[[Floats], Any]) -> Layer:
    """Parts that are cut off, see-through."""
    vertex, face, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for point, triangle in parts:
        vertex.append(point)
        face.append(triangle + count)
        count += len(point)
    return Layer(
        "/cut off", place(np.concatenate(vertex)), np.concatenate(face).astype(np.uint32), GHOST, 0.3, smooth=True
    )
