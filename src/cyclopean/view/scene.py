"""The 3D scene: viser's own self-contained client with our geometry in it.

Viser writes a static page only from a running server, so one listens for a moment on 127.0.0.1, on a port that the
system picks, and is stopped before anything is returned. The layers (blocks, edges, forces ...) can be switched in the
scene tree of the page.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.geometry import triangles
from cyclopean.view.colours import FORCE, GHOST, GRAVITY, HELD, INK, PULL, RUB, STEPS, UNKNOWN, fill, rgb
from cyclopean.view.drawing import Picture
from cyclopean.view.elevation import View, front_view

__all__ = ["scene_html"]

SPAN = 4.0  # the model is drawn this large, whatever its size, so that clipping planes and lights suit it
OPACITY = 0.6  # of free blocks where forces are shown inside them
FIELD = np.radians(32.0)  # vertical field of view
ASPECT = 1.5  # width over height for which the model is framed; the page's style sheet has the same
# Viser's own notices would tell the reader of a report about his graphics driver.
QUIET_STYLE = "<style>.mantine-Notifications-root{display:none!important}</style>"


def scene_html(drawn: Picture) -> str:
    """A complete HTML page with the scene; opens offline."""
    centre, scale = _fit(drawn)
    view = front_view(drawn.mesh.vertex)

    def place(point: Floats) -> Any:
        return ((point - centre) * scale).astype(np.float32)

    with _silent(), _server() as server:
        scene = server.scene
        _light(scene)
        _blocks(scene, drawn, place)
        _lines(scene, "/edges", place(drawn.edge), INK, 1.2)
        _lines(scene, "/where it stood", place(drawn.ghost), GHOST, 1.0)
        _arrows(scene, "/contact forces", place(drawn.arrow), FORCE, 0.006 * SPAN)
        _dots(scene, "/pressing points", place(drawn.press), FORCE, 0.005 * SPAN)
        _arrows(scene, "/friction", place(drawn.rub), RUB, 0.0035 * SPAN, 0.12)
        _dots(scene, "/points that would pull", place(drawn.pull), PULL, 0.010 * SPAN)
        _lines(scene, "/virtual displacement", place(drawn.virtual_edge), RUB, 1.6, shown=False)
        gravity = _gravity_arrow(drawn, view, place)
        _arrows(scene, "/gravity", gravity, GRAVITY, 0.003 * SPAN)
        shown = np.concatenate([place(drawn.mesh.vertex), gravity.reshape(-1, 3)])
        if len(shown):
            _camera(server.initial_camera, view, shown)
        html = str(server.get_scene_serializer().as_html())
    return html.replace("</head>", QUIET_STYLE + "</head>", 1)


@contextmanager
def _server() -> Iterator[Any]:
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def _silent() -> Iterator[None]:
    """Keep viser from printing through rich's global console, and only that: stdout itself is not touched."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


def _fit(drawn: Picture) -> tuple[Floats, float]:
    """Middle of the model and the factor that makes it SPAN long."""
    vertex = drawn.mesh.vertex
    if not len(vertex):
        return np.zeros(3), 1.0
    low, high = vertex.min(axis=0), vertex.max(axis=0)
    return (low + high) / 2.0, SPAN / max(float(np.linalg.norm(high - low)), 1e-300)


def _light(scene: Any) -> None:
    """Even light from all sides with a little direction: colours must stay close to those of the legend."""
    scene.set_up_direction("+z")
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_ambient("/light/all round", intensity=2.7)
    scene.add_light_directional("/light/sun", intensity=1.5, position=(-3.0, -6.0, 8.0))


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


def _lines(scene: Any, name: str, segment: Any, colour: str, pixels: float, shown: bool = True) -> None:
    if len(segment):
        scene.add_line_segments(name, segment, rgb(colour), thickness=pixels, thickness_units="screen", visible=shown)


def _dots(scene: Any, name: str, point: Any, colour: str, size: float) -> None:
    if len(point):
        scene.add_point_cloud(
            name, point, rgb(colour), point_size=size, point_shape="circle", point_shading="flat", precision="float32"
        )


def _arrows(scene: Any, name: str, arrow: Any, colour: str, radius: float, slim: float = 0.05) -> None:
    """Arrows; a short one gets no longer head than itself, so thickness follows the median length by `slim`."""
    if not len(arrow):
        return
    length = float(np.median(np.linalg.norm(arrow[:, 1] - arrow[:, 0], axis=1)))
    shaft = min(radius, slim * length)
    scene.add_arrows(
        name, arrow, _linear(colour), shaft_radius=shaft, head_radius=2.6 * shaft, head_length=min(7.0 * shaft, length)
    )


def _linear(colour: str) -> tuple[int, int, int]:
    """What viser must be told so that arrows, whose colours it takes for linear light, come out in this sRGB colour."""
    part = np.array(rgb(colour)) / 255.0
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    red, green, blue = np.rint(255.0 * light).astype(int).tolist()
    return red, green, blue


def _gravity_arrow(drawn: Picture, view: View, place: Any) -> Any:
    """One arrow beside the model, along gravity."""
    size = float(np.linalg.norm(drawn.gravity))
    if not (size > 0.0) or not len(drawn.mesh.vertex):
        return np.zeros((0, 2, 3), np.float32)
    vertex = place(drawn.mesh.vertex)
    along, depth, height = vertex @ view.right, vertex @ view.into, vertex[:, 2]
    half = 0.065 * SPAN * drawn.gravity / size
    middle = (float(along.max()) + 0.07 * SPAN) * view.right + float(depth.min()) * view.into
    middle = middle + np.array([0.0, 0.0, (float(height.min()) + float(height.max())) / 2.0])
    return np.stack([middle - half, middle + half])[None].astype(np.float32)


def _camera(camera: Any, view: View, shown: Any) -> None:
    """Frame what is shown, from the front, a little from the right and from above."""
    towards = 0.36 * view.right - view.into + np.array([0.0, 0.0, 0.30])
    towards /= np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    across, above = shown @ right, shown @ up
    target = (across.max() + across.min()) / 2.0 * right + (above.max() + above.min()) / 2.0 * up
    slope = np.tan(FIELD / 2.0)
    local = shown - target
    reach = np.maximum(np.abs(local @ right) / (slope * ASPECT), np.abs(local @ up) / slope)
    distance = 1.06 * float(np.max(reach + local @ towards, initial=0.5))
    camera.position = tuple((target + distance * towards).tolist())
    camera.look_at = tuple(target.tolist())
    camera.up = (0.0, 0.0, 1.0)
    camera.fov = float(FIELD)
