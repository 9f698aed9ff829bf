"""The 3D scene: viser's own self-contained client with our geometry in it.

Viser writes a static page only from a running server, so one listens for a moment on 127.0.0.1, on a port that the
system picks, and is stopped before anything is returned. The layers (blocks, edges, forces ...) can be switched in the
scene tree of the page.
"""

from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.geometry import triangles
from cyclopean.view.colours import FORCE, GHOST, GRAVITY, HELD, INK, PULL, RUB, STEPS, UNKNOWN, fill, rgb
from cyclopean.view.drawing import Picture
from cyclopean.view.elevation import front_view
from cyclopean.view.layers import SPAN, arrows, camera, dots, fit, gravity_arrow, light, lines, server, silent

__all__ = ["scene_html"]

OPACITY = 0.6  # of free blocks where forces are shown inside them
# Viser's own notices would tell the reader of a report about his graphics driver.
QUIET_STYLE = "<style>.mantine-Notifications-root{display:none!important}</style>"


def scene_html(drawn: Picture, joints: Floats | None = None) -> str:
    """A complete HTML page with the scene; opens offline.

    Parameters
    ----------
    drawn : Picture
        What is drawn.
    joints : (e, 2, 3), optional
        m, outlines of the contacts.
    """
    centre, scale = fit(drawn)
    view = front_view(drawn.mesh.vertex)

    def place(point: Floats) -> Any:
        return ((point - centre) * scale).astype(np.float32)

    with silent(), server() as running:
        scene = running.scene
        light(scene)
        _blocks(scene, drawn, place)
        lines(scene, "/edges", place(drawn.edge), INK, 1.2)
        if joints is not None:
            lines(scene, "/contacts", place(joints), FORCE, 2.4)
        lines(scene, "/where it stood", place(drawn.ghost), GHOST, 1.0)
        arrows(scene, "/contact forces", place(drawn.arrow), FORCE, 0.006 * SPAN)
        dots(scene, "/pressing points", place(drawn.press), FORCE, 0.005 * SPAN)
        arrows(scene, "/friction", place(drawn.rub), RUB, 0.0035 * SPAN, 0.12)
        dots(scene, "/points that would pull", place(drawn.pull), PULL, 0.010 * SPAN)
        lines(scene, "/virtual displacement", place(drawn.virtual_edge), RUB, 1.6, shown=False)
        gravity = gravity_arrow(drawn, view, place)
        arrows(scene, "/gravity", gravity, GRAVITY, 0.003 * SPAN)
        shown = np.concatenate([place(drawn.mesh.vertex), gravity.reshape(-1, 3)])
        if len(shown):
            camera(running.initial_camera, view, shown)
        html = str(running.get_scene_serializer().as_html())
    return html.replace("</head>", QUIET_STYLE + "</head>", 1)


def _blocks(scene: Any, drawn: Picture, place: Any) -> None:
    """One mesh a colour class: a few big meshes however many blocks there are."""
    corner, face = triangles(drawn.mesh)
    group = drawn.group[drawn.mesh.face_body[face]] if len(face) else np.zeros(0, np.int64)
    vertex = place(drawn.mesh.vertex)
    through = OPACITY if len(drawn.arrow) else None
    for k in (HELD, UNKNOWN, *range(STEPS)):
        used, local = np.unique(corner[group == k], return_inverse=True)
        if not len(used):
            continue
        name = "supports" if k == HELD else "no value" if k == UNKNOWN else f"{k / STEPS:.1f} to {(k + 1) / STEPS:.1f}"
        scene.add_mesh_simple(
            f"/blocks/{name}",
            vertex[used],
            local.reshape(-1, 3),
            color=rgb(fill(k)),
            opacity=None if k == HELD else through,
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )
