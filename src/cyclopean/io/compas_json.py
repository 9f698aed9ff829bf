"""Assemblies of COMPAS (compas_assembly, compas_cra) as plain JSON, in and out, without COMPAS; dumps of interfaces.

COMPAS wraps every object as {"dtype" or "datatype": ..., "data" or "value": ...} and has moved things about:

- a graph with "node" and "edge" tables, bare, under "graph", or beside "blocks" under "assembly";
- a node holds its mesh as "block" (or "blocks" does, by the same key), and perhaps "is_support";
- edge u -> v holds "interfaces", "contacts", "interface", or "interface_points" and "interface_uvw"; a frame is an x
  and a y axis, its normal x cross y.

Models of elements and problems posed of them are read in `io.compas_elements`, what is no model but holds solids in
`io.compas_solids`.

A dump holds "blocks" [{id, fixed, density, vertices, faces}] and "interfaces" [{a, b, polygon, frame {n}}], one `mu`
and one `density` for the whole file.

Polygons there may wind against the normal of their frame: they are turned to wind about it.

What is written is a `compas.datastructures/Assembly`, which COMPAS 2 opens: a part a stone, its mesh as `block` of the
node, interfaces with frames on the edges. Nodes and interfaces carry what the model says of them under its own names
(see `io.round_trip`), the attributes carry the rest, and all of it is read again.
"""

import ast
import uuid
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry import newell_normals
from cyclopean.io.bodies import assembly_of
from cyclopean.io.compas_elements import Elements, is_model, is_problem, read_elements
from cyclopean.io.compas_solids import is_solid, parts, shape, solids, unwrapped
from cyclopean.io.fields import (
    array,
    label,
    mapping,
    not_negative,
    number,
    optional,
    points,
    text,
    vector,
)
from cyclopean.io.findings import ContactState, Findings
from cyclopean.io.round_trip import TOLD, carried, model_rest, rebuilt, shaped, told
from cyclopean.io.units import metres

__all__ = ["compas_dict", "is_dump", "is_ours", "read_compas", "read_dump"]

_NAMESPACE = uuid.UUID("1c9a2f6b-2d43-4f62-8a53-0f9d7c1e5b76")  # ours: ids that stay the same
_WORLD = {"point": [0.0, 0.0, 0.0], "xaxis": [1.0, 0.0, 0.0], "yaxis": [0.0, 1.0, 0.0]}
_NODE = frozenset({"block", "part", "is_support", "x", "y", "z"})  # keys that are COMPAS's own
_INTERFACE = frozenset({"points", "frame", "size", "forces", "index"})


_Interface = tuple[str, str, str, Floats, Floats | None]  # place, blocks a and b, polygon (m, 3), normal from a into b


def is_dump(data: Any) -> bool:
    """Tell whether parsed JSON looks like a dump of blocks and interfaces."""
    return isinstance(data, dict) and "blocks" in data and "interfaces" in data


def is_ours(data: Any) -> bool:
    """Tell whether parsed COMPAS JSON carries a model as `compas_dict` writes it; it is in metres then."""
    outer = unwrapped(data)
    attributes = outer.get("attributes") if isinstance(outer, dict) else None
    return isinstance(attributes, dict) and isinstance(attributes.get("cyclopean"), dict)


def read_compas(path: str, stem: str, data: Any, units: str) -> tuple[Assembly, list[str]]:
    """Read an assembly, a model of elements or a problem; where there is none of them, every solid of the document.

    Contacts are those of the interfaces, without mu unless a problem says one; where no edge has one they are left to
    be detected. Where no node is a support, nothing is said of supports. A file that we wrote says all that its model
    said.

    Raises
    ------
    InputError
        Names the node or edge and what is wrong with it, or says what the document is that holds no solid.
    """
    structure, beside = _structure(path, data)
    if structure is None:
        bodies, notes = solids(path, data)
        assembly, made = assembly_of(path, stem, bodies, units)
        return assembly, [*notes, *made]
    if is_ours(data):
        return _ours(path, stem, data)
    if is_model(structure) or is_problem(structure):
        found = read_elements(path, structure, 1.0 / float(metres(np.ones(1), units)[0]))
    else:
        found = _nodes_as_elements(path, structure)
    interfaces = [i for u, v, edge in found.edges for i in _interfaces(path, u, v, edge)]
    contacts, warnings = _joints(interfaces, found.mu)
    if not any(row.get("fixed") for row in found.rows.values()) and not found.rest.get("supports"):
        warnings.append(f"{path}: no block is marked as a support")
    rest = {"contacts": bool(interfaces)} | {key: rows for key, rows in found.rest.items() if rows}
    assembly, more = rebuilt(path, stem, rest, list(found.rows.values()), contacts, units)
    return assembly, [*beside, *warnings, *found.notes, *more]


def _structure(path: str, data: Any) -> tuple[Any, list[str]]:
    """The one assembly, model or problem of a document, out of its wrappers, and what stands beside it; or None."""
    every = list(parts(data, lambda part: _is_structure(part.data) or is_solid(part.data, part.kind)))
    structures = [part for part in every if _is_structure(part.data)]
    if not structures:
        return None, []
    if len(structures) > 1:
        keys = ", ".join(label("/".join((*part.path, part.key or str(k)))) for k, part in enumerate(structures[:4]))
        raise InputError(f"{path}: holds {len(structures)} models, at {keys}; save each in a file of its own")
    beside = sum(not _is_structure(part.data) and is_solid(part.data, part.kind) for part in every)
    return structures[0].data, [f"{path}: {beside} solids beside the model are passed over"] if beside else []


def _is_structure(data: Any) -> bool:
    """Whether unwrapped data are an assembly whose nodes have blocks, a model of elements or a problem."""
    if is_model(data) or is_problem(data):
        return True
    graph = _graph(data) or {}
    nodes = graph.get("node", graph.get("vertex"))
    if not isinstance(nodes, dict) or not nodes:
        return False
    return bool(data.get("blocks")) or any(isinstance(row, dict) and row.get("block") for row in nodes.values())


def _ours(path: str, stem: str, data: Any) -> tuple[Assembly, list[str]]:
    """A model that we wrote, with all that it said."""
    meshes, edges, nodes = _tables(path, unwrapped(data))
    rest = model_rest(path, unwrapped(data)["attributes"]["cyclopean"])
    rows = [_row(f"{path}: block {label(key)}", key, meshes[key], nodes[key]) for key in meshes]
    assembly, more = rebuilt(path, stem, rest, rows, _contact_rows(path, edges))
    return assembly, list(more)


def _nodes_as_elements(path: str, outer: dict[str, Any]) -> Elements:
    """Blocks of an assembly, whose nodes hold their meshes."""
    meshes, edges, nodes = _tables(path, outer)
    support = {key for key, node in nodes.items() if node.get("is_support") is True}
    found = Elements(edges=edges)
    for key, mesh in meshes.items():
        vertices, corners = shape(f"{path}: block {label(key)}", mesh)
        found.rows[key] = shaped({"id": key, "fixed": key in support if support else None}, vertices, corners)
    return found


_Tables = tuple[dict[str, Any], list[tuple[str, str, Any]], dict[str, dict[str, Any]]]


def _key(key: str) -> str:
    """Name of a node: COMPAS 2 writes names that are text as Python text, in quotes.

    Examples
    --------
    >>> _key("'a'"), _key("0"), _key("'"), _key("(1, 2)")
    ('a', '0', "'", '(1, 2)')
    """
    if key[:1] not in ("'", '"'):
        return key
    try:
        name = ast.literal_eval(key)
    except (SyntaxError, ValueError):
        return key
    return name if isinstance(name, str) else key


def _graph(outer: Any) -> dict[str, Any] | None:
    """The graph of an assembly, with its table of nodes."""
    if not isinstance(outer, dict):
        return None
    graph = unwrapped(next((outer[key] for key in ("graph", "assembly") if key in outer), outer))
    if not isinstance(graph, dict):
        return None
    if "node" not in graph and ("vertex" not in graph or "face" in graph):
        return None
    return graph


def _tables(path: str, outer: dict[str, Any]) -> _Tables:
    """Find the mesh of each node, the edges, and what the nodes say."""
    graph = _graph(outer) or {}
    nodes = mapping(graph.get("node", graph.get("vertex")), f"{path}: the table of nodes")
    beside = mapping(outer.get("blocks") or {}, f"{path}: blocks")
    meshes, said = {}, {}
    for written, value in nodes.items():
        key = _key(written)
        node = mapping({} if value is None else value, f"{path}: node {label(key)}")
        mesh = beside.get(written, node.get("block"))
        if mesh is None:
            raise InputError(f"{path}: node {label(key)} has no block")
        if key in meshes:
            raise InputError(f"{path}: node {label(key)} stands twice, as text and as a number; rename one")
        meshes[text(key, f"{path}: the key of a node")] = mesh
        said[key] = node
    return meshes, list(_edges(path, graph.get("edge") or {}, meshes)), said


def _edges(path: str, table: Any, meshes: dict[str, Any]) -> Iterator[tuple[str, str, Any]]:
    for tail, row in mapping(table, f"{path}: the table of edges").items():
        u = _key(tail)
        for head, edge in mapping({} if row is None else row, f"{path}: the edges of node {label(u)}").items():
            v = _key(head)
            for key in (u, v):
                if key not in meshes:
                    raise InputError(f"{path}: edge {label(u)} to {label(v)}: there is no node {label(key)}")
            if u == v:
                raise InputError(f"{path}: edge {label(u)} to {label(v)}: joins a block to itself")
            if edge is not None:
                yield u, v, mapping(edge, f"{path}: edge {label(u)} to {label(v)}")


def _interfaces(path: str, u: str, v: str, edge: dict[str, Any]) -> Iterator[_Interface]:
    where = f"{path}: edge {label(u)} to {label(v)}"
    several = edge.get("interfaces", edge.get("contacts"))
    rows = array(several, f"{where}: interfaces") if several is not None else []
    if not rows and edge.get("interface") is not None:
        rows = [edge["interface"]]
    if not rows and edge.get("interface_points") is not None:
        rows = [{"points": edge["interface_points"], "uvw": edge.get("interface_uvw")}]
    for k, value in enumerate(rows):
        place = f"{where}: interface {k}"
        row = mapping(unwrapped(value), place)
        polygon = [unwrapped(p) for p in array(unwrapped(row.get("points")), f"{place}: points")]
        polygon = [[p.get(c) for c in "xyz"] if isinstance(p, dict) else p for p in polygon]
        yield place, u, v, points(polygon, f"{place}: points"), _frame_normal(place, row)


def _frame_normal(where: str, row: dict[str, Any]) -> Floats | None:
    uvw = row.get("uvw")
    frame = unwrapped(row.get("frame"))
    if isinstance(uvw, list) and len(uvw) >= 2:
        x, y = vector(uvw[0], f"{where}: u"), vector(uvw[1], f"{where}: v")
    elif isinstance(frame, dict) and "xaxis" in frame and "yaxis" in frame:
        x = vector(unwrapped(frame["xaxis"]), f"{where}: xaxis")
        y = vector(unwrapped(frame["yaxis"]), f"{where}: yaxis")
    else:
        return None
    return np.cross(x, y)


def _joints(interfaces: list[_Interface], mu: float | None) -> tuple[list[dict[str, Any]], list[str]]:
    """Rows of the model document, polygons turned to wind about their normals; and a line on those without area."""
    rows, empty = [], []
    for where, a, b, polygon, normal in interfaces:
        double = newell_normals(polygon, np.array([0, len(polygon)]))[0] if len(polygon) >= 3 else np.zeros(3)
        reach = float(np.abs(polygon - polygon[:1]).max(initial=0.0))
        if not np.linalg.norm(double) > 1e-12 * reach**2:
            empty.append(where)
            continue
        if normal is not None and double @ normal < 0.0:
            polygon = np.concatenate([polygon[:1], polygon[:0:-1]])  # the first point stays
        rows.append({"a": a, "b": b, "polygon": polygon.tolist(), "mu": mu})
    more = f", and {len(empty) - 1} more," if len(empty) > 1 else ""
    return rows, [f"{empty[0]}{more} has no area and was left out"] if empty else []


def _row(where: str, key: str, mesh: Any, node: Mapping[str, Any]) -> dict[str, Any]:
    """Row of the model document for a node that we wrote; whether it is a support is what COMPAS says now."""
    vertices, corners = shape(where, mesh)
    row = {name: value for name, value in node.items() if name not in _NODE} | {"id": key}
    if isinstance(node.get("is_support"), bool) and node["is_support"] != (row.get("fixed") is True):
        row["fixed"] = node["is_support"]
    return shaped(row, vertices, corners)


def _contact_rows(path: str, edges: list[tuple[str, str, Any]]) -> list[dict[str, Any]]:
    """Rows of the model document for interfaces that we wrote, in the order they had."""
    found: list[tuple[int, dict[str, Any]]] = []
    for u, v, edge in edges:
        where = f"{path}: edge {label(u)} to {label(v)}"
        for k, value in enumerate(array(edge.get("interfaces") or [], f"{where}: interfaces")):
            row = mapping(unwrapped(value), f"{where}: interface {k}")
            kept = {name: item for name, item in row.items() if name not in _INTERFACE | TOLD}
            order = row.get("index")
            place = order if type(order) is int else len(found)
            found.append((place, kept | {"a": u, "b": v, "polygon": row.get("points")}))
    return [row for _, row in sorted(found, key=lambda item: item[0])]


def compas_dict(assembly: Assembly, findings: Findings) -> dict[str, Any]:
    """Return the assembly as a COMPAS 2 document, in metres, with what was found out about it.

    Forces stand on the interfaces as compas_assembly has them, in the frame of their interface.
    """
    rest, rows, contacts = carried(assembly)
    said, centre = told(assembly, findings), assembly.mass.centroid.tolist()
    node: dict[str, Any] = {}
    for block, row, more, (x, y, z) in zip(assembly.blocks, rows, said, centre, strict=True):
        own = {"x": x, "y": y, "z": z, "is_support": block.fixed is True}
        about = {"attributes": {"name": block.id}, "key": block.id, "frame": _WORLD, "features": []}
        part = _wrapped(assembly, "compas.datastructures/Part", block.id, about)
        shapes = {"block": _mesh_dict(assembly, block), "part": part}
        node[repr(block.id)] = own | shapes | row | more
    edge: dict[str, Any] = {key: {} for key in node}
    for contact, interface in zip(contacts, _interface_dicts(assembly, contacts, findings), strict=True):
        between = edge[repr(contact["a"])].setdefault(repr(contact["b"]), {"interfaces": []})
        between["interfaces"].append(interface)
    graph = {
        "attributes": {},
        "default_node_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
        "default_edge_attributes": {},
        "node": node,
        "edge": edge,
        "max_node": -1,
    }
    attributes = {"name": assembly.name, "cyclopean": rest | {"findings": dict(findings.model)}}
    return _wrapped(assembly, "compas.datastructures/Assembly", "", {"graph": graph, "attributes": attributes})


def _wrapped(assembly: Assembly, kind: str, name: str, data: dict[str, Any]) -> dict[str, Any]:
    identity = uuid.uuid5(_NAMESPACE, "\0".join((assembly.name, kind, name)))
    return {"dtype": kind, "data": data, "guid": str(identity)}


def _mesh_dict(assembly: Assembly, block: Block) -> dict[str, Any]:
    data = {
        "attributes": {"name": block.id},
        "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
        "default_edge_attributes": {},
        "default_face_attributes": {},
        "vertex": {str(k): {"x": x, "y": y, "z": z} for k, (x, y, z) in enumerate(block.vertices.tolist())},
        "face": {str(k): list(face) for k, face in enumerate(block.faces)},
        "facedata": {},
        "edgedata": {},
        "max_vertex": len(block.vertices) - 1,
        "max_face": len(block.faces) - 1,
    }
    return _wrapped(assembly, "compas.datastructures/Mesh", block.id, data)


def _interface_dicts(
    assembly: Assembly, contacts: list[dict[str, Any]], findings: Findings
) -> Iterator[dict[str, Any]]:
    joined = assembly.contacts
    if joined is None:
        return
    states: Sequence[ContactState | None] = findings.contact or [None] * len(joined)
    frames, areas = joined.frame, joined.area.tolist()
    for k, (contact, state) in enumerate(zip(contacts, states, strict=True)):
        _, u, v = frames[k] if state is None else state.frame
        middle = joined.polygon(k).mean(axis=0).tolist()
        words = {key: value for key, value in contact.items() if key not in ("a", "b", "polygon")}
        row = {"index": k, "points": contact["polygon"], "size": areas[k]} | words
        axes = {"point": middle, "xaxis": u.tolist(), "yaxis": v.tolist()}
        row["frame"] = _wrapped(assembly, "compas.geometry/Frame", str(k), axes)
        if state is not None:
            row["utilisation"] = state.utilisation
            row["forces"] = [{"c_np": n, "c_nn": 0.0, "c_u": t, "c_v": w} for n, t, w in state.local.tolist()]
        yield row


def read_dump(path: str, stem: str, data: Any, units: str) -> tuple[Assembly, list[str]]:
    """Read a dump of blocks and interfaces.

    Whole-number ids become text; a block whose density is null has the file's; every contact has the file's mu.

    Raises
    ------
    InputError
        Names the block or interface and what is wrong with it.
    """
    shared = optional(data.get("density"), f"{path}: density", number)
    mu = optional(data.get("mu"), f"{path}: mu", not_negative)
    rows = []
    for k, value in enumerate(array(data["blocks"], f"{path}: blocks")):
        row = mapping(value, f"{path}: blocks[{k}]")
        said = {key: row.get(key) for key in ("vertices", "faces", "density", "fixed")}
        said["density"] = shared if said["density"] is None else said["density"]
        rows.append(said | {"id": _dump_id(row.get("id"), f"{path}: blocks[{k}].id")})
    listed = array(data["interfaces"], f"{path}: interfaces")
    interfaces = [_dump_interface(f"{path}: interface {k}", row) for k, row in enumerate(listed)]
    contacts, warnings = _joints(interfaces, mu)
    rest = {"contacts": True, "name": data.get("name")}
    assembly, more = rebuilt(path, stem, rest, rows, contacts, units)
    return assembly, [*warnings, *more]


def _dump_id(value: Any, where: str) -> str:
    return str(value) if type(value) is int else text(value, where)


def _dump_interface(where: str, value: Any) -> _Interface:
    row = mapping(value, where)
    a, b = (_dump_id(row.get(key), f"{where}: {key}") for key in "ab")
    frame = mapping({} if row.get("frame") is None else row["frame"], f"{where}: frame")
    normal = vector(frame["n"], f"{where}: frame.n") if "n" in frame else None
    return where, a, b, points(row.get("polygon"), f"{where}: polygon"), normal
