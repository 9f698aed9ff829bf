"""Solids in COMPAS JSON, wherever they stand: wrappers, meshes, polyhedra, boxes, frames and transformations.

COMPAS wraps every object as {"dtype" or "datatype": ..., "data" or "value": ...}. A solid is a mesh (tables "vertex"
and "face" by key), a polyhedron (lists "vertices" and "faces") or a box (a frame at its centre and three sizes).
Documents are gone through with a stack: how deeply a file may be nested is the parser's business.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, placed
from cyclopean.io.fields import Faces, array, face_fault, faces, found, label, mapping, number, points, vector
from cyclopean.io.model_json import SCHEMA

__all__ = [
    "Part",
    "contents",
    "is_solid",
    "kind_of",
    "name_of",
    "parts",
    "placement",
    "shape",
    "solids",
    "unwrapped",
]

_CORNERS = np.array([[x, y, z] for z in (-0.5, 0.5) for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))])
_SIDES: Faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
_SIZES = ("xsize", "ysize", "zsize")
_HOLDERS = frozenset({"geometry", "mesh", "shape", "block", "part", "data", "value"})  # keys that name no stone
_PLAIN = frozenset({"vertices", "faces", "name"})
_SUPPORTS = frozenset({"support", "supports"})


@dataclass(frozen=True, slots=True)
class Part:
    """An object of a document, out of its wrappers."""

    key: str | None  # under which it stands, None in a list
    path: tuple[str, ...]  # keys above it
    kind: str  # class that the wrapper names, "" without one
    name: str | None  # its own, where it is not that of its class
    data: Any


def unwrapped(value: Any) -> Any:
    """Take the data out of {"dtype": ..., "data": ...}, however often it is wrapped.

    What holds a table of nodes is data, whatever stands beside it: some old files have the keys of all their parts
    on top.
    """
    while isinstance(value, dict) and {"dtype", "datatype"} & value.keys() and "node" not in value:
        if "data" not in value and "value" not in value:
            break
        value = value["data"] if "data" in value else value["value"]
    return value


def kind_of(value: Any) -> str:
    """Class that the outermost wrapper names: Mesh, Block, ...; "" without a wrapper."""
    said = value.get("dtype", value.get("datatype")) if isinstance(value, dict) else None
    return said.rpartition("/")[2] if isinstance(said, str) else ""


def name_of(value: Any) -> str | None:
    """The name that an object says of itself; None where it is that of its class."""
    if not isinstance(value, dict):
        return None
    data = unwrapped(value)
    inner = data if isinstance(data, dict) else {}
    attributes = inner.get("attributes")
    said = (value.get("name"), inner.get("name"), attributes.get("name") if isinstance(attributes, dict) else None)
    kinds = {kind_of(value), "Mesh", "Block", "Part", "Box", "Polyhedron", ""}
    return next((name for name in said if isinstance(name, str) and name not in kinds and name.isprintable()), None)


def is_solid(part: Any, kind: str) -> bool:
    """Whether unwrapped data of a class say the faces of a solid; diagrams of forces are meshes too, but no solids."""
    if not isinstance(part, dict) or kind.endswith(("Diagram", "Brep")):
        return False
    tables = isinstance(part.get("vertex"), dict) and isinstance(part.get("face"), dict) and bool(part["face"])
    lists = isinstance(part.get("vertices"), list) and isinstance(part.get("faces"), list)
    lists = lists and (bool(kind) or part.keys() <= _PLAIN)  # what says more may say that it is held, or heavy
    return tables or lists or _is_box(part)


def _is_box(data: Mapping[str, Any]) -> bool:
    return "frame" in data and all(size in data for size in _SIZES)


def parts(data: Any, closed: Callable[[Part], bool] = lambda part: is_solid(part.data, part.kind)) -> Iterator[Part]:
    """Every object of a document in its order; what lies within one that is `closed`, as solids are, is left out."""
    stack: list[tuple[str | None, tuple[str, ...], Any]] = [(None, (), data)]
    while stack:
        key, above, value = stack.pop()
        if isinstance(value, dict):
            part = Part(key, above, kind_of(value), name_of(value), unwrapped(value))
            yield part
            if closed(part):
                continue
            value = part.data
        here = above if key is None else (*above, key)
        if isinstance(value, dict):
            stack.extend((name, here, item) for name, item in reversed(value.items()) if isinstance(item, dict | list))
        elif isinstance(value, list):
            stack.extend((None, here, item) for item in reversed(value) if isinstance(item, dict | list))


def solids(path: str, data: Any) -> tuple[list[Body], list[str]]:
    """Read every solid of a document as a body.

    What stands under "supports", or says that it is one, is a support.

    Raises
    ------
    InputError
        There is none; the line says what there is. Or one is damaged.
    """
    bodies: list[Body] = []
    passed: Counter[str] = Counter()
    held = 0
    for part in parts(data):
        if not is_solid(part.data, part.kind):
            passed[part.kind] += 1
            continue
        key = None if part.key is None or part.key.lower() in _HOLDERS | _SUPPORTS else part.key
        where = f"{path}: {part.kind or 'solid'} {label(part.name or key or str(len(bodies)))}"
        vertices, corners = shape(where, part.data)
        attributes = part.data.get("attributes")
        said = isinstance(attributes, dict) and attributes.get("is_support") is True
        fixed = said or any(name.lower() in _SUPPORTS for name in (*part.path, part.key or ""))
        held += fixed
        bodies.append(Body(part.name or key, vertices, list(corners), fields={"fixed": True} if fixed else {}))
    if not bodies:
        raise InputError(
            f'{path}: holds no blocks: it is {contents(data)}; expected COMPAS meshes, or "schema": "{SCHEMA}"'
        )
    left = [f"{count} {kind}" for kind, count in passed.items() if kind and kind not in ("Part", "Group")]
    notes = [f"{path}: {', '.join(left[:4])} {'and more ' if len(left) > 4 else ''}passed over; only solids are read"]
    return bodies, (notes if left else []) + ([] if held else [f"{path}: no block is marked as a support"])


def contents(data: Any) -> str:
    """Say what a document is that holds no solid: what it is made of, by classes or by keys.

    Examples
    --------
    >>> contents({"top": {"0": [0.0, 0.0, 1.0]}, "bars": [[0, 1], [1, 2]]})
    "an object with the keys 'top' and 'bars'"
    >>> contents({"dtype": "compas_tna.diagrams/FormDiagram", "data": {"vertex": {}, "face": {}, "edgedata": {}}})
    '1 FormDiagram, bars of thrust'
    """
    kinds = Counter(part.kind for part in parts(data, lambda part: bool(part.kind)) if part.kind)
    if kinds:
        first = list(kinds.items())[:4]
        words = [f"{count} {kind}{_about(kind)}" for kind, count in first]
        return " and ".join(words) + (" and more" if len(kinds) > 4 else "")
    if isinstance(data, dict):
        names = [label(key) for key in list(data)[:4]]
        more = " and more" if len(data) > 4 else ""
        return f"an object with the keys {' and '.join(names)}{more}" if names else "an empty object"
    return f"a list of {len(data)} items" if isinstance(data, list) else found(data)


def _about(kind: str) -> str:
    said = {"Graph": " of bars", "Network": " of bars", "CableMesh": " of cables", "Brep": ", give its mesh"}
    return said.get(kind, ", bars of thrust" if kind.endswith("Diagram") else "")


def shape(where: str, value: Any) -> tuple[Floats, Faces]:
    """Vertices (v, 3) in the units of the file and faces of a mesh, a polyhedron or a box, wrapped or not.

    Raises
    ------
    InputError
        It is none of these, or a vertex or face of it is wrong.
    """
    mesh = mapping(unwrapped(value), f"{where}: its mesh")
    if kind_of(value).endswith("Brep"):
        raise InputError(f"{where}: is a Brep; give its mesh")
    if "vertices" in mesh and "faces" in mesh:
        listed = [unwrapped(point) for point in array(mesh["vertices"], f"{where}: vertices")]
        vertices = points(listed, f"{where}: vertices")
        return vertices, faces(mesh["faces"], f"{where}: faces", len(vertices))
    if _is_box(mesh):
        sizes = [number(mesh[size], f"{where}: {size}") for size in _SIZES]
        if not min(sizes) > 0.0:
            raise InputError(f"{where}: a box of {sizes[0]:g} x {sizes[1]:g} x {sizes[2]:g} has no volume")
        return placed(placement(f"{where}: frame", mesh["frame"]), _CORNERS * sizes, _SIDES)
    if "vertex" not in mesh or "face" not in mesh:
        raise InputError(f"{where}: its mesh has no tables 'vertex' and 'face'; only meshes can be read")
    return _tables(where, mesh)


def _tables(where: str, mesh: Mapping[str, Any]) -> tuple[Floats, Faces]:
    """Shape of a mesh by its tables."""
    table = mapping(mesh["vertex"], f"{where}: vertex")
    default = mapping(mesh.get("default_vertex_attributes") or mesh.get("dva") or {}, f"{where}: default attributes")
    rows = []
    for key, value in table.items():
        place = f"{where}: vertex {label(key)}"
        at = default | mapping(value, place)
        rows.append([number(at.get(axis, 0.0), f"{place}.{axis}") for axis in "xyz"])
    index = {key: k for k, key in enumerate(table)}
    corners = [
        _face(f"{where}: face {label(key)}", face, index)
        for key, face in mapping(mesh["face"], f"{where}: face").items()
    ]
    return np.array(rows, np.float64).reshape(-1, 3), tuple(corners)


def _face(where: str, value: Any, index: dict[str, int]) -> tuple[int, ...]:
    corners = []
    for key in array(value, where):
        if type(key) not in (int, str) or str(key) not in index:
            raise InputError(f"{where} names vertex {found(key)}, which is not there")
        corners.append(index[str(key)])
    corners = [i for k, i in enumerate(corners) if i != corners[k - 1]]  # some close with the corner they began with
    if fault := face_fault(corners, len(index)):
        raise InputError(f"{where} {fault}")
    return tuple(corners)


def placement(where: str, value: Any) -> Floats:
    """(4, 4) matrix of a transformation or a frame, wrapped or not; lengths in the units of the file.

    Raises
    ------
    InputError
        It is neither, or flattens what it is applied to.
    """
    data = mapping(unwrapped(value), where)
    if "matrix" in data:
        rows = array(unwrapped(data["matrix"]), f"{where}: matrix")
        if len(rows) != 4 or not all(isinstance(row, list) and len(row) == 4 for row in rows):
            raise InputError(f"{where}: matrix must be four rows of four numbers")
        matrix = np.array([[number(x, f"{where}: matrix") for x in row] for row in rows])
        if (matrix[3] != [0.0, 0.0, 0.0, 1.0]).any() or np.linalg.det(matrix[:3, :3]) == 0.0:
            raise InputError(f"{where}: its matrix does not move, turn or scale a solid")
        return matrix
    axes = [vector(unwrapped(data.get(axis)), f"{where}: {axis}") for axis in ("xaxis", "yaxis")]
    x, z = axes[0], np.cross(axes[0], axes[1])
    if not (np.linalg.norm(x) > 0.0 and np.linalg.norm(z) > 0.0):
        raise InputError(f"{where}: its axes span no plane")
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 2] = x / np.linalg.norm(x), z / np.linalg.norm(z)
    matrix[:3, 1] = np.cross(matrix[:3, 2], matrix[:3, 0])
    matrix[:3, 3] = vector(unwrapped(data.get("point")), f"{where}: point")
    return matrix
