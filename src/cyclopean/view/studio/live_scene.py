"""The 3D scene of the live page: blocks by colour class, what acts on them, the chosen block and its handle to drag."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.assembly.rearranging import Arrangement, Pose
from cyclopean.geometry import pack, triangles
from cyclopean.view.colours import FORCE, GHOST, GRAVITY, INK, RUB
from cyclopean.view.drawing import EDGE_LIMIT, Picture, feature_edges, picture
from cyclopean.view.layers import SPAN, camera, contact_sides, dots, fit, gravity_arrow, light, lines
from cyclopean.view.motion import moved
from cyclopean.view.solids import Layer, Layers, arrow_solids, block_layers, once, wires
from cyclopean.view.studio.session import Snapshot
from cyclopean.view.svg import front_view

LABELS = 300  # blocks beyond which only the chosen one is labelled
NARROW = 0.82  # width over height beside the panel, for which the model is framed at first
CHOSEN = "#007a4d"
TOUCHING = 1e-5  # units of the drawing: edges that are drawn once where blocks meet
SEEN = 2e-3  # units of the drawing: half a pixel


@dataclass(frozen=True, slots=True)
class Look:
    """What is shown."""

    forces: bool = True
    points: bool = False  # that press, and friction at them
    contacts: bool = False
    labels: bool = False
    scale: float = 1.0  # of the mechanism: 1 = the largest movement is a quarter of a mean block
    handle: bool = False  # to drag the chosen block by


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """A snapshot with what is drawn of it."""

    snapshot: Snapshot
    drawn: Picture
    corner: Ints  # (T, 3) vertices of the triangles of its mesh
    face: Ints  # (T,) faces that they are of

    def at(self, share: float) -> Floats:
        """(V, 3) m: vertices after so much of the mechanism."""
        drawn, result = self.drawn, self.snapshot.result
        if drawn.motion is None or drawn.rest is None or result.mechanism is None:
            return drawn.mesh.vertex
        centroid, time = result.assembly.mass.centroid, share * drawn.motion.time
        return moved(drawn.rest, drawn.mesh.vertex_body, centroid, result.mechanism, time)


class LiveScene:
    """Draws snapshots in the scene of a viser server; may be called from several threads.

    The frame of the drawing stays that of the blocks at `home`, as the page opens. `chosen` is called with the block
    (of the model) that somebody clicks; `dragged` with a block, its pose, and whether the drag begins with this.
    """

    def __init__(
        self,
        server: Any,
        home: Arrangement,
        chosen: Callable[[int], None],
        dragged: Callable[[int, Pose, bool], None],
    ) -> None:
        self._server, self._scene, self._home = server, server.scene, home
        self._chosen, self._dragged = chosen, dragged
        self._lock = threading.RLock()
        self._layers = Layers(server.scene)
        self._nodes: dict[str, Any] = {}
        self._sent: dict[str, Any] = {}
        self._shown: _Shown | None = None
        self._vertex = np.zeros((0, 3))  # m, as the blocks are drawn
        self._look = Look()
        self._block: int | None = None
        self._handle: tuple[int, Any] | None = None  # and the block that it drags
        self._dragging = False
        self._centre, self._scale = np.zeros(3), 1.0
        self._view = front_view(home.model.mesh.vertex)
        light(self._scene)
        self._scene.on_click()(self._clicked)

    def place(self, point: Floats) -> Any:
        """A place in metres, in units of the drawing."""
        return ((point - self._centre) * self._scale).astype(np.float32)

    def show(self, snapshot: Snapshot) -> None:
        """Draw a snapshot."""
        with self._lock:
            drawn = picture(snapshot.result)
            if self._shown is None:  # fit model and camera; only once, so that nothing jumps when a block goes
                home = self._home.model.mesh
                self._centre, self._scale = fit(home)
                beside = gravity_arrow(drawn.gravity, home, self._view).reshape(-1, 3)
                shown = self.place(np.concatenate([home.vertex, beside]))
                camera(self._server.initial_camera, self._view, shown, NARROW)
            self._shown = _Shown(snapshot, drawn, *triangles(drawn.mesh))
            self._draw([*self._bodies(self._shown), *self._others(drawn)])

    def look(self, look: Look) -> None:
        """Show other things of the same snapshot."""
        with self._lock:
            self._look = look
            if self._shown is not None:
                self._draw([*self._bodies(self._shown), *self._others(self._shown.drawn)])

    def pose_mechanism(self, share: float) -> None:
        """Draw the blocks at this share of the mechanism as it is scaled."""
        with self._lock:
            if self._shown is not None and self.moves:
                self._draw(self._bodies(self._shown, share))

    @property
    def moves(self) -> bool:
        """Whether there is a mechanism to see."""
        shown = self._shown
        return shown is not None and shown.drawn.motion is not None

    @property
    def size(self) -> int:
        """Number of triangles that a frame of the motion draws."""
        return 0 if self._shown is None else len(self._shown.corner)

    def choose(self, block: int | None) -> None:
        """Mark a block of the model."""
        with self._lock:
            self._block = block
            self._draw([])

    def _draw(self, layers: list[Layer]) -> None:
        """Send what has changed; all in one, and nothing is worked out meanwhile, for it holds back all messages."""
        with self._server.atomic():
            for layer in layers:
                self._layers.put(layer)
            if self._shown is not None:
                self._details(self._shown)
                self._put_handle(self._shown.snapshot.state.arrangement)

    def _others(self, drawn: Picture) -> list[Layer]:
        """What stands still while a mechanism moves."""
        look, place = self._look, self.place
        arrow = drawn.arrow if look.forces else drawn.arrow[:0]
        rub = drawn.rub if look.points else drawn.rub[:0]
        gravity = gravity_arrow(drawn.gravity, self._home.model.mesh, self._view)  # stays while blocks move
        return [
            arrow_solids(arrow, place, "/contact forces", FORCE, 0.006 * SPAN),
            arrow_solids(rub, place, "/friction", RUB, 0.0035 * SPAN, 0.12),
            arrow_solids(gravity, place, "/gravity", GRAVITY, 0.003 * SPAN),
            wires(once(self._ghost(drawn), TOUCHING / self._scale), place, "/where it stands", GHOST),
        ]

    def _ghost(self, drawn: Picture) -> Floats:
        """(g, 2, 3) m: edges where blocks stand that move; of those that stay they would only hide the edges."""
        if drawn.ghost.shape != drawn.edge.shape:
            return drawn.ghost
        way = np.abs(drawn.edge - drawn.ghost).max(axis=(1, 2), initial=0.0)
        return np.asarray(drawn.ghost[way * self._scale > SEEN])

    def _bodies(self, shown: _Shown, share: float = 1.0) -> list[Layer]:
        """The blocks, and their edges, where the mechanism has them."""
        drawn, look = shown.drawn, self._look
        self._vertex = vertex = shown.at(share * look.scale)
        solid = drawn if look.forces else replace(drawn, arrow=drawn.arrow[:0])
        edge = feature_edges(replace(drawn.mesh, vertex=vertex))
        if not self.moves:
            edge = once(edge, TOUCHING / self._scale)
        edges = wires(edge if len(edge) <= EDGE_LIMIT else edge[:0], self.place, "/edges", INK)
        return [*block_layers(solid, shown.corner, shown.face, self.place(vertex)), edges]

    def _details(self, shown: _Shown) -> None:
        """Points, outlines of contacts, names, the mark of the chosen block: few, or only where asked for."""
        scene, look, drawn, result = self._scene, self._look, shown.drawn, shown.snapshot.result
        press = drawn.press if look.points else drawn.press[:0]
        self._put("/pressing points", press, lambda n, x: dots(scene, n, x, FORCE, 0.005 * SPAN))
        joints = contact_sides(result.contacts) if look.contacts else drawn.ghost[:0]
        self._put("/contacts", joints, lambda n, x: lines(scene, n, x, FORCE, 2.4))
        self._put("/chosen", self._chosen_edges(shown), lambda n, x: lines(scene, n, x, CHOSEN, 3.0))
        self._labels(result.assembly)

    def _put(self, name: str, data: Any, make: Callable[[str, Any], Any]) -> None:
        """Draw a layer of these points (m) anew, leave it as it is, or take it away where it is empty."""
        before, known = self._nodes.get(name), self._sent.get(name)
        if before is not None and known is not None and np.array_equal(known, data):
            return
        handle = make(name, self.place(data)) if len(data) else None
        if handle is not None:
            self._nodes[name], self._sent[name] = handle, data
        elif before is not None:
            self._nodes.pop(name).remove()
            self._sent.pop(name, None)

    def _labels(self, assembly: Assembly) -> None:
        """Names at the centroids, unless there are too many blocks."""
        wanted: dict[str, tuple[str, Any]] = {}
        if self._look.labels and len(assembly) <= LABELS:
            middle = self.place(assembly.mass.centroid)
            wanted = {f"/names/{k}": (b.id, middle[k]) for k, b in enumerate(assembly.blocks)}
        for name in [n for n in self._nodes if n.startswith("/names/") and n not in wanted]:
            self._nodes.pop(name).remove()
        for name, (text, point) in wanted.items():
            label = self._nodes.get(name)
            if label is None or label.text != text:
                self._nodes[name] = self._scene.add_label(name, text, position=point, font_screen_scale=0.8)
            elif not np.array_equal(label.position, point):
                label.position = point

    def _chosen_edges(self, shown: _Shown) -> Floats:
        """(e, 2, 3) m: edges of the chosen block; none where none is, or it is drawn as its outline."""
        at = None if self._block is None else shown.snapshot.state.arrangement.place(self._block)
        if at is None:
            return np.zeros((0, 2, 3))
        here = slice(shown.drawn.mesh.vertex_start[at], shown.drawn.mesh.vertex_start[at + 1])
        block = shown.snapshot.result.assembly.blocks[at]
        point = self._vertex[here]
        return feature_edges(pack([(point, block.faces)])) if len(point) == len(block.vertices) else np.zeros((0, 2, 3))

    def _put_handle(self, arrangement: Arrangement) -> None:
        """Show the handle at the chosen block, put it where the block is, or take it away."""
        block = self._block if self._look.handle else None
        if block is not None and arrangement.place(block) is None:
            block = None
        if self._handle is not None and self._handle[0] != block:
            self._handle[1].remove()
            self._handle, self._dragging = None, False
        if block is None or self._dragging:
            return
        pose = arrangement.poses.get(block, Pose(np.eye(3), np.zeros(3)))
        home = arrangement.model.mass.centroid[block]
        where, turn = self.place(home + pose.shift), np.roll(Rotation.from_matrix(pose.turn).as_quat(), 1)
        if self._handle is not None:
            self._handle[1].position, self._handle[1].wxyz = where, turn
            return
        size = 0.9 * self._scale * float(np.mean(np.abs(arrangement.model.mass.volume))) ** (1.0 / 3.0)
        gizmo = self._scene.add_transform_controls("/handle", scale=size, position=where, wxyz=turn, depth_test=False)
        self._handle = block, gizmo
        self._follow(gizmo, block, home)

    def _follow(self, gizmo: Any, block: int, home: Floats) -> None:
        """Move the block as its handle is dragged."""
        begins = [False]

        def follow(event: Any) -> None:
            if event.phase != "update":
                begins[0] = self._dragging = event.phase == "start"
                return
            shift = np.asarray(event.target.position, float) / self._scale + self._centre - home
            first, begins[0] = begins[0], False
            turn = Rotation.from_quat(np.roll(np.asarray(event.target.wxyz, float), -1)).as_matrix()
            self._dragged(block, Pose(turn, shift), first)

        gizmo.on_update(follow)

    def _clicked(self, event: Any) -> None:
        with self._lock:
            shown = self._shown
            if shown is None:
                return
            triangle = self.place(self._vertex)[shown.corner].astype(float)
            found = hit(triangle, np.asarray(event.ray_origin, float), np.asarray(event.ray_direction, float))
            if found is None:
                return
            block = shown.drawn.mesh.face_body[shown.face[found]]
        self._chosen(int(shown.snapshot.state.arrangement.index[block]))


def hit(triangle: Floats, origin: Floats, direction: Floats) -> int | None:
    """Which of (T, 3, 3) triangles a ray meets first; None where it meets none.

    Möller and Trumbore 1997, for all triangles at once.

    Examples
    --------
    >>> flat = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    >>> both = np.concatenate([flat, flat + [0, 0, 1]])
    >>> hit(both, np.array([0.2, 0.2, 5.0]), np.array([0.0, 0, -1]))
    1
    """
    one, two = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    across = np.cross(direction, two)
    volume = np.einsum("ti,ti->t", one, across)
    flat = np.abs(volume) <= 1e-300
    inverse = 1.0 / np.where(flat, 1.0, volume)
    away = origin - triangle[:, 0]
    u = np.einsum("ti,ti->t", away, across) * inverse
    turn = np.cross(away, one)
    v = turn @ direction * inverse
    along = np.einsum("ti,ti->t", two, turn) * inverse
    meets = ~flat & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (along > 0.0)
    return int(np.argmin(np.where(meets, along, np.inf))) if meets.any() else None
