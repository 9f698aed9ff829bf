"""What every 3D scene is made with: a server, light, a camera, lines and dots."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.geometry import Polyhedra, following
from cyclopean.view.colours import rgb
from cyclopean.view.svg import View

if TYPE_CHECKING:
    from cyclopean.view.access import AccessControl  # loads a web server

SPAN = 4.0  # the model is drawn this large, whatever its size, so that clipping planes and lights suit it
FIELD = np.radians(14.0)  # vertical field of view: so narrow that upright edges stay as good as parallel
ASPECT = 1.5  # width over height for which the model is framed; the page's style sheet has the same


@contextmanager
def server(host: str = "127.0.0.1", port: int = 0, access: "AccessControl | None" = None) -> Iterator[Any]:
    """A viser server while the block lasts; port 0 = one that is free. Nobody gets in unless `access` lets them."""
    import viser

    from cyclopean.view.access import AccessControl

    running = (access or AccessControl(host)).guarded(lambda: viser.ViserServer(host=host, port=port, verbose=False))
    try:
        yield running
    finally:
        running.stop()


@contextmanager
def silent() -> Iterator[None]:
    """Keep viser from printing through rich's global console, and its server from logging; stdout is not touched."""
    import rich

    console, log = rich.get_console(), logging.getLogger("websockets")
    before, level = console.quiet, log.level
    console.quiet = True
    log.setLevel(logging.CRITICAL + 1)  # a visitor who leaves half-way is no news
    try:
        yield
    finally:
        console.quiet = before
        log.setLevel(level)


def fit(mesh: Polyhedra) -> tuple[Floats, float]:
    """Middle (3,) of a model (m), and the factor that makes it SPAN long."""
    if not len(mesh.vertex):
        return np.zeros(3), 1.0
    low, high = mesh.vertex.min(axis=0), mesh.vertex.max(axis=0)
    return (low + high) / 2.0, SPAN / max(float(np.linalg.norm(high - low)), 1e-300)


def light(scene: Any) -> None:
    """Even light from all sides with a little direction: colours must stay close to those of the legend."""
    scene.set_up_direction("+z")
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_ambient("/light/all round", intensity=2.2)
    scene.add_light_directional("/light/sun", intensity=1.5, position=(-3.0, -6.0, 8.0))


def contact_sides(contacts: Contacts) -> Floats:
    """(e, 2, 3) m: sides of all contact polygons."""
    return np.stack([contacts.point, contacts.point[following(contacts.start)]], 1)


def lines(scene: Any, name: str, segment: Any, colour: str, pixels: float, shown: bool = True) -> Any:
    """Line segments (e, 2, 3), so many pixels wide; None where there are none."""
    if not len(segment):
        return None
    return scene.add_line_segments(
        name, segment, rgb(colour), thickness=pixels, thickness_units="screen", visible=shown
    )


def dots(scene: Any, name: str, point: Any, colour: str, size: float) -> Any:
    """Points (k, 3) as discs that face the viewer; None where there are none."""
    if not len(point):
        return None
    return scene.add_point_cloud(
        name, point, rgb(colour), point_size=size, point_shape="circle", point_shading="flat", precision="float32"
    )


def gravity_arrow(gravity: Floats, mesh: Polyhedra, view: View) -> Floats:
    """(1, 2, 3) m: an arrow beside a model, along gravity (3,); (0, 2, 3) where there is none, or no model."""
    size = float(np.linalg.norm(gravity))
    if not (size > 0.0) or not len(mesh.vertex):
        return np.zeros((0, 2, 3))
    span = SPAN / fit(mesh)[1]
    along, depth, height = mesh.vertex @ view.right, mesh.vertex @ view.into, mesh.vertex[:, 2]
    half = 0.065 * span * gravity / size
    middle = (float(along.max()) + 0.07 * span) * view.right + float(depth.min()) * view.into
    middle = middle + np.array([0.0, 0.0, (float(height.min()) + float(height.max())) / 2.0])
    return np.stack([middle - half, middle + half])[None]


def camera(camera: Any, view: View, shown: Any, aspect: float = ASPECT) -> None:
    """Frame what is shown, from the front, a little from the right, and level but for a hint of the tops."""
    towards = 0.36 * view.right - view.into + np.array([0.0, 0.0, 0.13])
    towards /= np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    across, above = shown @ right, shown @ up
    target = (across.max() + across.min()) / 2.0 * right + (above.max() + above.min()) / 2.0 * up
    slope = np.tan(FIELD / 2.0)
    local = shown - target
    reach = np.maximum(np.abs(local @ right) / (slope * aspect), np.abs(local @ up) / slope)
    distance = 1.06 * float(np.max(reach + local @ towards, initial=0.5))
    camera.position = tuple((target + distance * towards).tolist())
    camera.look_at = tuple(target.tolist())
    camera.up = (0.0, 0.0, 1.0)
    camera.fov = float(FIELD)
