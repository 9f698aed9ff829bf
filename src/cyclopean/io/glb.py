"""GLB (binary glTF 2.0): a tree of named nodes. glTF is y up and in metres; here z is up.

Nodes carry in `extras` what the model says of their stone, the scene what it says of the whole, contacts included. glTF
draws triangles of single precision; the polygons stand beside them as a record (see `io.round_trip`).
"""

import json
import struct
from dataclasses import replace
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry.frames import affine
from cyclopean.io.bodies import Body, assembly_of
from cyclopean.io.fields import REACH, array, label, mapping, number, parsed, refuse_unfolded
from cyclopean.io.files import decoded
from cyclopean.io.findings import Findings
from cyclopean.io.palette import linear, stone_colours
from cyclopean.io.round_trip import carried, fan, model_rest, polygons, rebuilt, record_of, shaped, told, written_fields

__all__ = ["glb_bytes", "read_glb", "read_glb_model"]

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_WIDEST = 252  # bytes, the largest stride of glTF
_POINTS_PER = {"SCALAR": 1, "VEC3": 3}
_UNDERSTOOD = {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform"}
_Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # (x, y, z) of glTF is (x, -z, y) here


def read_glb(path: str, data: bytes) -> list[Body]:
    """Read one body for each node that has a mesh, moved to where the tree of nodes puts it.

    Raises
    ------
    InputError
        The container or the tree is damaged, or needs an extension such as a compression.
    """
    return [body for _, body in _opened(path, data).bodies()]


def read_glb_model(path: str, stem: str, data: bytes, _: str | None = None) -> tuple[Assembly, tuple[str, ...]]:
    """Read a model of one block for each such node; glTF is in metres whatever is said of units.

    A file that we wrote comes back as the model it was, but for the rounding to single precision. One that another
    program has changed since keeps what its nodes say; its contacts are left to be found.

    Raises
    ------
    InputError
        As `read_glb`, or what it carries of the model is not what a model file may say.
    """
    reader = _opened(path, data)
    bodies = reader.bodies()
    rest = reader.carried()
    if rest is None:
        assembly, warnings = assembly_of(path, stem, [body for _, body in bodies], "m")
        return assembly, tuple(warnings)
    rows = [_row(extras, body) for extras, body in bodies]
    untouched = [row for row in rows if row is not None]
    if len(untouched) == len(rows) == len({row["id"] for row in untouched}):
        contacts = array(rest.pop("contacts", None) or [], f"{path}: contacts")
        rest["contacts"] = rest.pop("listed", None) is True
        return rebuilt(path, stem, rest, untouched, contacts)
    named = [
        replace(body, fields=written_fields(f"{path}: node {label(body.name or '')}", extras))
        for extras, body in bodies
    ]
    assembly, warnings = assembly_of(path, stem, named, "m")
    lost = f"{path}: another program has changed its meshes; contacts and loads that were in it are left out"
    return assembly, (lost, *warnings)


def _opened(path: str, data: bytes) -> "_Reader":
    document, binary = _chunks(path, data)
    needs = set(map(str, array(document.get("extensionsRequired", []), f"{path}: extensionsRequired"))) - _UNDERSTOOD
    if needs:
        raise InputError(f"{path}: needs the extension {label(min(needs))}; export the GLB without compression")
    return _Reader(path, document, binary, len(data))


def _extras(node: dict[str, Any]) -> dict[str, Any]:
    extras = node.get("extras")
    return extras if isinstance(extras, dict) else {}


def _row(extras: dict[str, Any], body: Body) -> dict[str, Any] | None:
    """Row of the model document for a node, or None where it is not as we wrote it."""
    record = extras.get("faces")
    faces = tuple(body.faces) if record is None else polygons(record, body.faces)
    if faces is None or body.name != extras.get("id") or len(body.vertices) != extras.get("vertices"):
        return None
    return shaped(extras, body.vertices, faces)


def _chunks(path: str, data: bytes) -> tuple[dict[str, Any], bytes]:
    if len(data) < 20 or struct.unpack_from("<I", data)[0] != _MAGIC:
        raise InputError(f"{path}: is not a GLB file: it does not begin with 'glTF'")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise InputError(f"{path}: is glTF version {version}; export it as version 2")
    if length > len(data):
        raise InputError(f"{path}: GLB that says it is {length} bytes long, but has {len(data)}; is it cut off?")
    found: dict[int, bytes] = {}
    position = 12
    while position + 8 <= length:
        size, kind = struct.unpack_from("<II", data, position)
        if size > length - position - 8:
            raise InputError(f"{path}: a chunk of the GLB reaches beyond the end of the file; is it cut off?")
        found.setdefault(kind, data[position + 8 : position + 8 + size])
        position += 8 + size
    if _JSON not in found:
        raise InputError(f"{path}: GLB without its JSON chunk")
    return mapping(parsed(path, decoded(path, found[_JSON])), f"{path}: the JSON chunk"), found.get(_BIN, b"")


class _Reader:
    """One document and its binary chunk, with every index and length checked before it is used."""

    def __init__(self, path: str, document: dict[str, Any], binary: bytes, size: int) -> None:
        self.path = path
        self.document = document
        self.binary = binary
        self.size = size  # bytes of the file
        self.rows = 0  # vertices and corners so far; meshes may be shared by nodes

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """Entry `index` of the list `kind` of the document."""
        rows = array(self.document.get(kind, []), f"{self.path}: {kind}")
        if type(index) is not int or not 0 <= index < len(rows):
            raise InputError(f"{self.path}: the GLB refers to {kind}[{str(index)[:20]}], but there are {len(rows)}")
        return mapping(rows[index], f"{self.path}: {kind}[{index}]")

    def whole(self, row: dict[str, Any], key: str, default: int | None = None) -> int:
        """A whole number that is not negative."""
        value = row.get(key, default)
        if type(value) is not int or value < 0:
            raise InputError(f"{self.path}: '{key}' in the GLB must be a whole number")
        return value

    def carried(self) -> dict[str, Any] | None:
        """What the scene carries of the model, where we wrote it."""
        scenes = self.document.get("scenes")
        if not isinstance(scenes, list) or not scenes:
            return None
        rest = _extras(self.item("scenes", self.document.get("scene", 0))).get("cyclopean")
        return None if rest is None else model_rest(self.path, rest)

    def bodies(self) -> list[tuple[dict[str, Any], Body]]:
        """What each node with a mesh carries, and its body."""
        return [
            (_extras(node), body) for node, matrix in self.placed() if (body := self.body(node, matrix)) is not None
        ]

    def placed(self) -> list[tuple[dict[str, Any], Floats]]:
        """Every node with a mesh and the (4, 4) matrix that places it, in the order of the tree."""
        nodes = array(self.document.get("nodes", []), f"{self.path}: nodes")
        found: list[tuple[dict[str, Any], Floats]] = []
        stack = [(root, np.eye(4)) for root in reversed(self._roots(nodes))]
        seen: set[int] = set()
        while stack:
            index, above = stack.pop()
            node = self.item("nodes", index)
            if index in seen:
                raise InputError(f"{self.path}: nodes[{index}] hangs from two nodes; the nodes must form a tree")
            seen.add(index)
            matrix = above @ self._matrix(node, f"{self.path}: nodes[{index}]")
            if not (np.abs(matrix) <= 1e15).all():
                raise InputError(f"{self.path}: the transforms down to nodes[{index}] are too large; check the units")
            if "mesh" in node:
                found.append((node, matrix))
            children = array(node.get("children", []), f"{self.path}: nodes[{index}].children")
            stack.extend((child, matrix) for child in reversed(children))
        return found

    def _roots(self, nodes: list[Any]) -> list[Any]:
        if "scenes" in self.document:
            scene = self.item("scenes", self.document.get("scene", 0))
            return array(scene.get("nodes", []), f"{self.path}: scene nodes")
        held = [n.get("children") for n in nodes if isinstance(n, dict)]
        children = {c for row in held if isinstance(row, list) for c in row if type(c) is int}
        return [k for k in range(len(nodes)) if k not in children]

    def _matrix(self, node: dict[str, Any], where: str) -> Floats:
        from scipy.spatial.transform import Rotation

        if "matrix" in node:
            return self._floats(node["matrix"], 16, f"{where}.matrix").reshape(4, 4).T
        turn = self._floats(node.get("rotation", [0, 0, 0, 1]), 4, f"{where}.rotation")
        if not np.linalg.norm(turn) > 0.0:
            raise InputError(f"{where}.rotation is zero; a rotation is a unit quaternion")
        rotation = Rotation.from_quat(turn).as_matrix()
        scale = self._floats(node.get("scale", [1, 1, 1]), 3, f"{where}.scale")
        return affine(rotation * scale, self._floats(node.get("translation", [0, 0, 0]), 3, f"{where}.translation"))

    @staticmethod
    def _floats(value: Any, count: int, where: str) -> Floats:
        if len(array(value, where)) != count:
            raise InputError(f"{where} must have {count} numbers, found {len(value)}")
        return np.array([number(x, f"{where}[{k}]") for k, x in enumerate(value)])

    def body(self, node: dict[str, Any], matrix: Floats) -> Body | None:
        """All triangles of the node's mesh, in z-up world coordinates; None if it has none."""
        mesh = self.item("meshes", node["mesh"])
        points: list[Floats] = []
        corners: list[Ints] = []
        before = 0
        for value in array(mesh.get("primitives", []), f"{self.path}: primitives"):
            primitive = mapping(value, f"{self.path}: a primitive")
            mode = primitive.get("mode", 4)
            if mode not in (4, 5, 6):  # points and lines bound nothing
                continue
            attributes = mapping(primitive.get("attributes", {}), f"{self.path}: attributes")
            vertex = self._accessor(attributes.get("POSITION"), "VEC3")
            order = np.arange(len(vertex))
            if "indices" in primitive:
                order = self._accessor(primitive["indices"], "SCALAR")[:, 0].astype(np.int64)
            if not (np.abs(vertex) <= REACH).all():
                raise InputError(f"{self.path}: a vertex of a mesh is not finite or beyond 1e12")
            if not order.max(initial=-1) < len(vertex):
                raise InputError(f"{self.path}: a face names vertex {order.max()}, but its part has {len(vertex)}")
            corners.append(_triangles(order, mode) + before)
            points.append(vertex)
            before += len(vertex)
        faces = np.concatenate(corners or [np.zeros((0, 3), np.int64)])
        if not len(faces):
            return None
        moved = np.concatenate(points) @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirror turns every face inside out
            faces = faces[:, ::-1]
        solid = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
        name = node.get("name", mesh.get("name"))
        return Body(
            name if isinstance(name, str) else None, moved @ _Z_UP.T, [tuple(face) for face in faces[solid].tolist()]
        )

    def _accessor(self, index: Any, kind: str) -> Floats:
        """(count, 1 or 3) values, as doubles."""
        row = self.item("accessors", index)
        component = row.get("componentType")
        if row.get("type") != kind or type(component) is not int or component not in _COMPONENTS:
            raise InputError(f"{self.path}: accessors[{index}] is not {kind} of a known number type")
        if kind == "SCALAR" and _COMPONENTS[component][0] != "u":
            raise InputError(f"{self.path}: accessors[{index}] holds indices that are not whole numbers")
        if "sparse" in row or "bufferView" not in row:
            raise InputError(f"{self.path}: accessors[{index}] is sparse; export the GLB without sparse accessors")
        view = self.item("bufferViews", row["bufferView"])
        if self.whole(view, "buffer", 0) != 0 or "uri" in self.item("buffers", 0):
            raise InputError(f"{self.path}: keeps its data in another file; export it as one GLB")
        dtype = np.dtype("<" + _COMPONENTS[component])
        width = _POINTS_PER[kind] * dtype.itemsize
        stride = self.whole(view, "byteStride", 0) or width
        offset, count = self.whole(row, "byteOffset", 0), self.whole(row, "count")
        start, length = self.whole(view, "byteOffset", 0), self.whole(view, "byteLength")
        beyond = count and offset + (count - 1) * stride + width > length
        if start + length > len(self.binary) or beyond or not width <= stride <= _WIDEST:
            raise InputError(f"{self.path}: accessors[{index}] reaches beyond the data of the GLB; is it cut off?")
        self.rows += count
        refuse_unfolded(self.path, self.rows, self.size)
        if not count:
            return np.zeros((0, _POINTS_PER[kind]))
        rows = np.ndarray((count, _POINTS_PER[kind]), dtype, self.binary, start + offset, (stride, dtype.itemsize))
        with np.errstate(invalid="ignore"):  # a signalling NaN is refused later, by name
            values = rows.astype(np.float64)
        if row.get("normalized") is True and dtype.kind in "iu":
            values = np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values


def _triangles(order: Ints, mode: int) -> Ints:
    """(T, 3) corners from a list (4), a strip (5) or a fan (6) of triangles."""
    if mode == 4:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == 6:
        return np.stack([np.repeat(order[:1], len(order) - 2), order[1:-1], order[2:]], 1)
    strip = np.stack([order[:-2], order[1:-1], order[2:]], 1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip


def glb_bytes(assembly: Assembly, findings: Findings) -> bytes:
    """Return the assembly as GLB: one named node a block, faces as fans of triangles, y up.

    glTF holds single precision; each block is taken about the middle of its own box, which its node gives in full, so
    that a model far from the origin keeps its shape. Stones are coloured by utilisation, or else by group.
    """
    rest, rows, contacts = carried(assembly)
    touches = _neighbours(assembly)
    writer = _Writer(sorted(set(colours := stone_colours(assembly, findings))))
    for block, row, said, beside, colour in zip(
        assembly.blocks, rows, told(assembly, findings), touches, colours, strict=True
    ):
        record = record_of(block.faces, all(len(face) == 3 for face in block.faces))
        extras = {"id": block.id, "vertices": len(block.vertices)} | row | said | {"touches": beside} | record
        writer.add(block, extras, colour)
    scene = {key: value for key, value in rest.items() if key != "contacts"}
    if "contacts" in rest:
        scene |= {"listed": True, "contacts": contacts}
    if findings.model:
        scene["findings"] = dict(findings.model)
    return writer.finished(scene)


def _neighbours(assembly: Assembly) -> list[list[str]]:
    """Ids of the blocks that each block touches, as far as the model lists contacts."""
    touches: list[dict[str, None]] = [{} for _ in assembly.blocks]
    if assembly.contacts is not None:
        for a, b in zip(assembly.contacts.a.tolist(), assembly.contacts.b.tolist(), strict=True):
            touches[a][assembly.blocks[b].id] = touches[b][assembly.blocks[a].id] = None
    return [list(names) for names in touches]


class _Writer:
    """A document that grows by one node a block; all positions stand in one view, all indices in another."""

    def __init__(self, palette: list[tuple[float, float, float]]) -> None:
        self.material = {colour: k for k, colour in enumerate(palette)}
        self.nodes: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.positions, self.indices = bytearray(), bytearray()

    def add(self, block: Block, extras: dict[str, Any], colour: tuple[float, float, float]) -> None:
        """One node and, if it has faces, its mesh."""
        node: dict[str, Any] = {"name": block.id, "extras": extras}
        self.nodes.append(node)
        order = np.array([triangle for face in block.faces for triangle in fan(face)], "<u4")
        if not len(order):
            return
        middle = (block.vertices.min(0) + block.vertices.max(0)) / 2.0
        local = ((block.vertices - middle) @ _Z_UP).astype("<f4")
        node |= {"mesh": len(self.meshes), "translation": (middle @ _Z_UP).tolist()}
        box = {"min": local.min(0).tolist(), "max": local.max(0).tolist()}
        vertex = {"bufferView": 0, "byteOffset": len(self.positions), "componentType": 5126, "count": len(local)}
        index = {"bufferView": 1, "byteOffset": len(self.indices), "componentType": 5125, "count": order.size}
        self.accessors += [vertex | {"type": "VEC3"} | box, index | {"type": "SCALAR"}]
        last = len(self.accessors) - 1
        part = {"attributes": {"POSITION": last - 1}, "indices": last, "material": self.material[colour]}
        self.meshes.append({"name": block.id, "primitives": [part]})
        self.positions += local.tobytes()
        self.indices += order.tobytes()

    def finished(self, scene: dict[str, Any]) -> bytes:
        """The whole file; `scene` is what it carries of the model."""
        first, second = len(self.positions), len(self.indices)
        views = [
            {"buffer": 0, "byteOffset": 0, "byteLength": first, "byteStride": 12, "target": 34962},
            {"buffer": 0, "byteOffset": first, "byteLength": second, "target": 34963},
        ]
        rough = {"metallicFactor": 0.0, "roughnessFactor": 0.9}
        surfaces = [{"baseColorFactor": [*linear(colour), 1.0]} | rough for colour in self.material]
        document = {
            "asset": {"version": "2.0", "generator": "cyclopean"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self.nodes))), "extras": {"cyclopean": scene}}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": [{"pbrMetallicRoughness": surface} for surface in surfaces],
            "accessors": self.accessors,
            "bufferViews": views,
            "buffers": [{"byteLength": first + second}],
        }
        text, binary = json.dumps(document, allow_nan=False).encode(), self.positions + self.indices
        text += b" " * (-len(text) % 4)
        binary += b"\0" * (-len(binary) % 4)
        chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(binary), _BIN) + binary
        return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks
