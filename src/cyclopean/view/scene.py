"""The 3D scene of a page: viser's own self-contained client with our geometry in it.

Viser writes a static page only from a running server, so one listens for a moment on 127.0.0.1, on a port that the
system picks, and is stopped before anything is returned. The layers (blocks, edges, forces ...) can be switched in the
scene tree of the page.
"""

from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.geometry import triangles
from cyclopean.view.colours import FORCE, GHOST, GRAVITY, INK, LOAD, PULL, RUB
from cyclopean.view.drawing import Picture
from cyclopean.view.layers import SPAN, camera, dots, fit, gravity_arrow, light, lines, server, silent
from cyclopean.view.solids import Layers, arrow_solids, stone_layers
from cyclopean.view.svg import front_view

__all__ = ["scene_html"]

# Viser's own notices would tell the reader of a report about his graphics driver.
QUIET_STYLE = "<style>.mantine-Notifications-root{display:none!important}</style>"


def scene_html(drawn: Picture, joints: Floats | None = None) -> str:
    """A whole HTML page with a picture in 3D, that opens offline; `joints` (e, 2, 3), m, are outlines of contacts."""
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
        dots(scene, "/points that would pull", place(drawn.pull), PULL, 0.010 * SPAN)
        lines(scene, "/virtual displacement", place(drawn.virtual_edge), RUB, 1.6, shown=False)
        if len(shown):
            beside = place(np.concatenate([gravity, drawn.load]).reshape(-1, 3))
            camera(running.initial_camera, view, np.concatenate([shown, beside]))
        html = str(running.get_scene_serializer().as_html())
    return html.replace("</head>", QUIET_STYLE + "</head>", 1)
