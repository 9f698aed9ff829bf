"""Models of elements in COMPAS JSON: `compas_model`, and the `BlockModel` and `Problem` of `compas_dem`.

A model holds "elements" (by guid, or a list of older ones), "materials", a "tree" of which element belongs to which,
and a "graph", whose nodes stand for elements and whose edges hold "contacts". The shape of an element lies in its own
coordinates: the transformations (older files: frames) of the element, of those above it and of the model carry it to
where it stands. Contacts lie there already.

A problem holds such a model, boundary conditions that name blocks by their nodes, and one law for all contacts.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import DIRECTIONS
from cyclopean.assembly.loading import area_resultant
from cyclopean.errors import InputError
from cyclopean.io.bodies import placed
from cyclopean.io.compas_solids import contents, kind_of, name_of, placement, shape, unwrapped
from cyclopean.io.fields import array, found, label, mapping, not_negative, number, points, vector
from cyclopean.io.round_trip import shaped

__all__ = ["Elements", "is_model", "is_problem", "read_elements"]

GRAVITY = 9.81  # m/s2, what a problem says where nobody chose another


@dataclass(slots=True)
class Elements:
    """Rows of the model document that a file of elements says."""

    rows: dict[str, dict[str, Any]] = field(default_factory=dict)  # blocks by id
    nodes: dict[str, str] = field(default_factory=dict)  # id of the block of each node of the graph
    edges: list[tuple[str, str, Any]] = field(default_factory=list)  # id, id and what the edge says
    rest: dict[str, Any] = field(default_factory=dict)  # loads, partial supports, settlements, friction
    mu: float | None = None  # of all contacts
    notes: list[str] = field(default_factory=list)


def is_model(data: Any) -> bool:
    """Whether unwrapped data are a model of elements."""
    return isinstance(data, dict) and "elements" in data and bool({"tree", "graph"} & data.keys())


def is_problem(data: Any) -> bool:
    """Whether unwrapped data are a problem posed of such a model."""
    asked = isinstance(data, dict) and bool({"boundary_conditions", "contact_properties"} & data.keys())
    return asked and is_model(unwrapped(data.get("model")))


def read_elements(path: str, data: dict[str, Any], metre: float) -> Elements:
    """Read a model of elements, or a problem with its supports, loads and friction.

    Parameters
    ----------
    path : str
        What messages call the file.
    data : dict
        Out of its wrappers; `is_model` or `is_problem`.
    metre : float
        Length of a metre in the units of the file.

    Raises
    ------
    InputError
        Names the element, the load or the displacement and what is wrong with it.
    """
    model = unwrapped(data["model"]) if is_problem(data) else data
    made = _blocks(path, model)
    made.edges = list(_edges(path, model, made.nodes))
    if is_problem(data):
        conditions = mapping(unwrapped(data.get("boundary_conditions") or {}), f"{path}: boundary conditions")
        _displacements(path, conditions, made)
        made.rest["loads"] = _loads(path, conditions, made, metre)
        _gravity(path, conditions, made)
        _law(path, unwrapped(data.get("contact_properties") or {}), made)
    if any(row.get("fixed") for row in made.rows.values()):
        for row in made.rows.values():
            row.setdefault("fixed", False)
    return made


def _by_guid(value: Any, where: str) -> dict[str, Any]:
    """Objects by guid, from a table or an older list."""
    if isinstance(value, dict):
        return value
    rows = [mapping(item, f"{where}[{k}]") for k, item in enumerate(array(value or [], where))]
    return {str(row.get("guid", k)): row for k, row in enumerate(rows)}


def _blocks(path: str, model: dict[str, Any]) -> Elements:
    """One block an element, where its transformations put it; groups only carry others."""
    elements = _by_guid(model["elements"], f"{path}: elements")
    above, carriers = _tree(path, model)
    nodes = _nodes(path, model, elements)
    names = {guid: name_of(element) for guid, element in elements.items()}
    said = [names[guid] for guid in elements if guid not in carriers]
    own = None not in said and len(set(said)) == len(said)
    made = Elements()
    for guid, element in elements.items():
        block = (names[guid] if own else nodes.get(guid, guid)) or guid
        where = f"{path}: element {label(block)}"
        data = mapping(unwrapped(element), where)
        geometry = next((data[key] for key in ("geometry", "shape") if data.get(key) is not None), None)
        if geometry is None:
            if guid in carriers or kind_of(element) == "Group":
                continue
            raise InputError(f"{where}: is {contents(element)}, which has no mesh; give its mesh as a Block")
        if data.get("features"):
            made.notes.append(f"{where}: its features are not cut; save it with them cut")
        matrix = _placed(path, guid, elements, above, model)
        vertices, corners = placed(matrix, *shape(where, geometry))
        row = {"id": block} | _said(where, guid, data, model)
        if group := names.get(above.get(guid, "")):
            row["group"] = group
        if data.get("is_support") is True:
            row["fixed"] = True
        made.rows[block] = shaped(row, vertices, corners)
        made.nodes[nodes.get(guid, guid)] = block
    if not made.rows:
        raise InputError(f"{path}: the model has no elements that are blocks")
    return made


def _said(where: str, guid: str, data: Mapping[str, Any], model: Mapping[str, Any]) -> dict[str, Any]:
    """Density (kg/m3) and name of the material of an element."""
    known = data.get("material") or mapping(model.get("element_material") or {}, f"{where}: materials").get(guid)
    if known is None:
        return {}
    materials = _by_guid(model.get("materials") or {}, f"{where}: materials")
    if not isinstance(known, str) or known not in materials:
        raise InputError(f"{where}: its material {found(known)} is not in the file")
    material = mapping(unwrapped(materials[known]), f"{where}: material")
    name = material.get("name")
    row = {"density": material.get("density"), "material": name if isinstance(name, str) and name else None}
    return {key: value for key, value in row.items() if value is not None}


def _tree(path: str, model: dict[str, Any]) -> tuple[dict[str, str], set[str]]:
    """Which element belongs to which, by guid; and those to which others do."""
    tree = mapping(unwrapped(model.get("tree") or {}), f"{path}: the tree of elements")
    above: dict[str, str] = {}
    stack: list[tuple[Any, Any]] = [(None, tree.get("root") or {})]
    while stack:
        parent, value = stack.pop()
        node = mapping(value, f"{path}: the tree of elements: a node")
        own = node.get("element")
        if isinstance(own, str) and isinstance(parent, str):
            if own in above:
                raise InputError(f"{path}: the tree of elements: {label(own)} stands twice")
            above[own] = parent
        for child in array(node.get("children") or [], f"{path}: the tree of elements: children"):
            stack.append((own if isinstance(own, str) else parent, child))
    return above, set(above.values())


def _placed(path: str, guid: str, elements: dict[str, Any], above: dict[str, str], model: dict[str, Any]) -> Floats:
    """(4, 4) matrix that carries an element from its own coordinates to the world's.

    Older elements stand in a frame, and those above them hand down their frames only.
    """
    matrix = np.eye(4)
    here: str | None = guid
    while here is not None:
        data = mapping(unwrapped(elements.get(here) or {}), f"{path}: element {label(here)}")
        keys = [key for key in ("frame", "transformation") if data.get(key) is not None]
        for key in reversed(keys if here == guid else keys[:1]):
            matrix = placement(f"{path}: element {label(here)}: {key}", data[key]) @ matrix
        here = above.get(here)
    for key in ("transformation", "frame"):
        if model.get(key) is not None:
            matrix = placement(f"{path}: the {key} of the model", model[key]) @ matrix
    return matrix


def _nodes(path: str, model: dict[str, Any], elements: dict[str, Any]) -> dict[str, str]:
    """Key of the node of the graph that stands for each element, by guid."""
    graph = mapping(unwrapped(model.get("graph") or {}), f"{path}: the graph")
    keys: dict[str, str] = {}
    for key, value in mapping(graph.get("node") or {}, f"{path}: the table of nodes").items():
        guid = mapping(value or {}, f"{path}: node {label(key)}").get("element")
        if not isinstance(guid, str) or guid not in elements:
            raise InputError(f"{path}: node {label(key)}: there is no element {found(guid)}")
        keys[guid] = key
    return keys


def _edges(path: str, model: dict[str, Any], nodes: dict[str, str]) -> list[tuple[str, str, Any]]:
    graph = mapping(unwrapped(model.get("graph") or {}), f"{path}: the graph")
    edges = []
    for u, row in mapping(graph.get("edge") or {}, f"{path}: the table of edges").items():
        for v, value in mapping(row or {}, f"{path}: the edges of node {label(u)}").items():
            where = f"{path}: edge {label(u)} to {label(v)}"
            edge = mapping(value or {}, where)
            if edge.get("modifiers"):
                raise InputError(f"{where}: has modifiers that cut the blocks; save the model with them applied")
            if wrong := [key for key in (u, v) if edge.get("contacts") and key not in nodes]:
                raise InputError(f"{where}: node {label(wrong[0])} is no block")
            if u in nodes and v in nodes:
                edges.append((nodes[u], nodes[v], edge))
    return edges


def _block_of(where: str, row: dict[str, Any], made: Elements) -> str:
    key = row.get("block_index")
    if type(key) is not int or str(key) not in made.nodes:
        raise InputError(f"{where}: there is no block {found(key)}")
    return made.nodes[str(key)]


def _listed(path: str, conditions: dict[str, Any], key: str) -> list[tuple[str, dict[str, Any]]]:
    rows = array(conditions.get(key) or [], f"{path}: {key}")
    return [(f"{path}: {key} {k}", mapping(row, f"{path}: {key} {k}")) for k, row in enumerate(rows)]


def _displacements(path: str, conditions: dict[str, Any], made: Elements) -> None:
    """What is held makes supports, whole or partial; what is moved is the settlement of a support."""
    motions: dict[str, list[float | None]] = {}
    for where, row in _listed(path, conditions, "displacements"):
        motion = motions.setdefault(_block_of(where, row, made), [None] * len(DIRECTIONS))
        for first, key in ((0, "translation"), (3, "rotation")):
            values = array([None] * 3 if row.get(key) is None else row[key], f"{where}: {key}")
            if len(values) != 3:
                raise InputError(f"{where}: {key} must be three numbers, found {len(values)}")
            for m, value in enumerate(values):
                motion[first + m] = motion[first + m] if value is None else number(value, f"{where}: {key}[{m}]")
    supports, settlements = [], []
    for block, motion in motions.items():
        held = [name for name, value in zip(DIRECTIONS, motion, strict=True) if value is not None]
        if len(held) == len(DIRECTIONS):
            made.rows[block]["fixed"] = True
            settlements += [{"block": block, "motion": motion}] if any(motion) else []
        elif any(motion):
            raise InputError(f"{path}: block {label(block)}: is moved but not held; say all six displacements")
        elif held:
            supports.append({"block": block, "held": held})
    made.rest |= {"supports": supports, "settlements": settlements}


def _loads(path: str, conditions: dict[str, Any], made: Elements, metre: float) -> list[dict[str, Any]]:
    """Rows of the model document for the loads; a moment becomes two opposite forces."""
    loads: list[dict[str, Any]] = []
    for k, value in enumerate(array(conditions.get("body_forces") or [], f"{path}: body_forces")):
        loads.append({"acceleration": vector(value, f"{path}: body_forces {k}").tolist()})
    for where, row in _listed(path, conditions, "point_loads"):
        block = _block_of(where, row, made)
        force = vector(unwrapped(row.get("force")), f"{where}: force").tolist()
        at = row.get("point")
        load = {"block": block, "force": force}
        loads.append(load if at is None else load | {"point": vector(unwrapped(at), f"{where}: point").tolist()})
        if row.get("moment") is not None:
            moment = vector(unwrapped(row["moment"]), f"{where}: moment")
            loads += _couple(block, moment, np.mean(made.rows[block]["vertices"], axis=0), metre)
    for where, row in _listed(path, conditions, "surface_loads"):
        block = _block_of(where, row, made)
        loads.append({"block": block} | _spread(where, row, metre))
    return loads


def _spread(where: str, row: dict[str, Any], metre: float) -> dict[str, Any]:
    """Force (N) of a load (Pa) on a polygon, at its centroid: along its direction, else along the polygon's normal."""
    polygon = mapping(unwrapped(row.get("polygon")), f"{where}: polygon").get("points")
    corners = points([unwrapped(p) for p in array(polygon, f"{where}: polygon")], f"{where}: polygon")
    if len(corners) < 3:
        raise InputError(f"{where}: polygon has {len(corners)} points; it needs at least 3")
    try:
        area, centre = area_resultant(corners)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    size, said = float(np.linalg.norm(area)), row.get("direction")
    along = area / size if said is None else vector(unwrapped(said), f"{where}: direction")
    force = number(row.get("magnitude"), f"{where}: magnitude") * size / metre**2 * along
    return {"force": force.tolist(), "point": centre.tolist()}


def _couple(block: str, moment: Floats, middle: Floats, metre: float) -> list[dict[str, Any]]:
    """Two opposite forces (N) a metre apart that turn as a moment (N m) does."""
    if not moment.any():
        return []
    arm = np.cross(moment, np.eye(3)[np.argmin(np.abs(moment))])
    arm /= np.linalg.norm(arm)
    force = np.cross(moment, arm)
    return [
        {"block": block, "force": (side * force).tolist(), "point": (middle + 0.5 * side * metre * arm).tolist()}
        for side in (1.0, -1.0)
    ]


def _gravity(path: str, conditions: dict[str, Any], made: Elements) -> None:
    """Weight is not the model's to say; what a problem says otherwise is told."""
    if conditions.get("gravity") is False:
        made.notes.append(f"{path}: its problem does not ask for weight; blocks have theirs here (`gravity`)")
    if (g := number(conditions.get("g", GRAVITY), f"{path}: g")) != GRAVITY:
        made.notes.append(f"{path}: its g of {g:g} m/s2 is not taken over; give it as `gravity`")


def _law(path: str, properties: Any, made: Elements) -> None:
    """Friction of the law of contacts; where the model lists no contacts, it goes by materials."""
    law = mapping(unwrapped(mapping(properties, f"{path}: contact properties").get("contact_model") or {}), path)
    if law.get("phi") is not None:  # degrees; the library goes by it where `mu` stands beside it
        phi = not_negative(law["phi"], f"{path}: contact model: phi")
        if not phi < 90.0:
            raise InputError(f"{path}: contact model: phi {phi:g} must be below 90 degrees")
        made.mu = math.tan(math.radians(phi))
    elif law.get("mu") is not None:
        made.mu = not_negative(law["mu"], f"{path}: contact model: mu")
    for key, option in (("c", "cohesion"), ("t_c", "tension")):
        if law.get(key):
            made.notes.append(f"{path}: contact model: {key} = {found(law[key])} is not taken over; see `{option}`")
    if made.mu is None or any(edge.get("contacts") for _, _, edge in made.edges):
        return
    for row in made.rows.values():
        row.setdefault("material", "stone")
    names = sorted({str(row["material"]) for row in made.rows.values()})
    made.rest["friction"] = [{"pair": [a, b], "mu": made.mu} for k, a in enumerate(names) for b in names[k:]]
