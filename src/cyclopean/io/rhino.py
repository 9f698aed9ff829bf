"""Rhino 3DM, with the extra `rhino` (rhino3dm): stones as meshes, contacts, loads and forces as curves.

Meshes hold double precision, triangles and quads as they are, other polygons as fans of triangles with a record beside
them (see `io.round_trip`). What the model says stands in user text under its own name; the user text `cyclopean` says
what an object is. Stones lie on layers by their group, below `Stones`. The file is in metres; one in another unit is
converted. Of files without meshes, Breps and extrusions are read, in place of instances what they stand for.
"""

import json
import tempfile
import uuid
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.archives import refuse_damaged
from cyclopean.io.bodies import Body, assembly_of, joined, placed
from cyclopean.io.extras import extra
from cyclopean.io.fields import array, label, parsed, refuse_unfolded
from cyclopean.io.findings import Findings
from cyclopean.io.palette import stone_colours
from cyclopean.io.rhino_faces import face_bodies
from cyclopean.io.rhino_json import coordinates, mesh_shape, rhino_mesh
from cyclopean.io.round_trip import (
    TOLD,
    carried,
    fan,
    found_at,
    model_rest,
    rebuilt,
    record_of,
    shown,
    stone_row,
    told,
    understood,
    written_fields,
)
from cyclopean.io.units import metres, stated_units

__all__ = ["read_rhino", "read_rhino_faces", "rhino_bytes"]

KIND = "cyclopean"  # user text: stone, contact, load or force
STONES, CONTACTS, LOADS, FORCES = "Stones", "Contacts", "Loads", "Forces"
VERSION = 7  # of the archive: Rhino 7 and newer open it
LONGEST = 0.4  # length of the longest force that is drawn, in mean sizes of a stone
_NAMESPACE = uuid.UUID("5d0c1c7e-7a5e-4f0b-9f2e-6a1d6c7f3b11")  # ours: object ids that stay the same
_UNITS = {"Meters": "m", "Centimeters": "cm", "Millimeters": "mm", "Inches": "in", "Feet": "ft"}
_UNSAID = {"None", "Unset", "CustomUnits"}
_SOLIDS = {"Brep": "polysurfaces", "Extrusion": "extrusions", "SubD": "SubDs", "Surface": "surfaces"}


def rhino_bytes(assembly: Assembly, findings: Findings) -> bytes:
    """Return the assembly as a 3DM archive, with what was found out about it.

    Raises
    ------
    InputError
        rhino3dm is not installed, or refuses to write.
    """
    writer = _Writer(extra("rhino"), assembly)
    rest, rows, contacts = carried(assembly)
    writer.stones(rows, told(assembly, findings), stone_colours(assembly, findings))
    writer.contacts(contacts, findings)
    loads = rest.pop("loads", [])
    drawn = [row for row in loads if "force" in row and "point" in row]
    writer.loads(drawn)
    if len(drawn) < len(loads):
        rest["loads"] = [row for row in loads if "force" not in row or "point" not in row]
    writer.forces(contacts, findings)
    writer.file.Strings[KIND] = json.dumps(rest | {"findings": dict(findings.model)}, ensure_ascii=False)
    with tempfile.TemporaryDirectory() as folder:  # the library writes to paths only
        place = Path(folder) / "model.3dm"
        if not writer.file.Write(str(place), VERSION):
            raise InputError("rhino3dm could not write the 3DM archive")
        return place.read_bytes()


class _Writer:
    """A Rhino file that grows."""

    def __init__(self, rhino: Any, assembly: Assembly) -> None:
        self.rhino = rhino
        self.assembly = assembly
        self.file = rhino.File3dm()
        self.file.Settings.ModelUnitSystem = rhino.UnitSystem.Meters
        self.file.Settings.PageUnitSystem = rhino.UnitSystem.Millimeters
        self.file.Settings.ModelAbsoluteTolerance = 1e-6
        self.file.ApplicationName = "cyclopean"
        self.layers: dict[str | None, int] = {}
        self.top = self._layer(STONES, (150, 145, 135))
        self.layers[None] = self.top

    def _layer(self, name: str, colour: tuple[int, int, int], parent: int | None = None) -> int:
        layer = self.rhino.Layer()
        layer.Name = name
        layer.Color = (*colour, 255)
        if parent is not None:
            layer.ParentLayerId = self.file.Layers[parent].Id
        return int(self.file.Layers.Add(layer))

    def _attributes(self, kind: str, number: int, layer: int, row: Mapping[str, Any]) -> Any:
        attributes = self.rhino.ObjectAttributes()
        attributes.Id = uuid.uuid5(_NAMESPACE, f"{self.assembly.name}/{kind}/{number}")
        attributes.LayerIndex = layer
        attributes.SetUserString(KIND, kind)
        for key, value in row.items():
            if value is not None:
                attributes.SetUserString(key, shown(key, value))
        return attributes

    def stones(
        self, rows: list[dict[str, Any]], said: list[dict[str, Any]], colours: list[tuple[float, float, float]]
    ) -> None:
        """One mesh a block."""
        for k, block in enumerate(self.assembly.blocks):
            colour = tuple(round(255 * x) for x in colours[k])
            if block.group not in self.layers:
                self.layers[block.group] = self._layer(_layer_name(block.group or ""), (150, 145, 135), self.top)
            record = record_of(block.faces, all(len(face) <= 4 for face in block.faces))
            row = {"id": block.id} | rows[k] | said[k] | record
            attributes = self._attributes("stone", k, self.layers[block.group], row)
            attributes.Name = block.id
            attributes.ObjectColor = (*colour, 255)
            attributes.ColorSource = self.rhino.ObjectColorSource.ColorFromObject
            rings = [ring for face in block.faces for ring in ([face] if len(face) == 4 else fan(face))]
            self.file.Objects.AddMesh(rhino_mesh(block.vertices, rings), attributes)

    def contacts(self, contacts: list[dict[str, Any]], findings: Findings) -> None:
        """One closed polyline a contact, or a point."""
        layer = self._layer(CONTACTS, (30, 90, 160))
        for k, row in enumerate(contacts):
            words = {key: value for key, value in row.items() if key != "polygon"}
            words |= found_at(findings, k)
            corners = [self.rhino.Point3d(*p) for p in row["polygon"]]
            attributes = self._attributes("contact", k, layer, words)
            if len(corners) == 1:
                self.file.Objects.AddPoint(corners[0], attributes)
            else:
                self.file.Objects.AddPolyline([*corners, corners[0]], attributes)

    def loads(self, loads: list[dict[str, Any]]) -> None:
        """One line a load, from the point where it acts along its force."""
        if not loads:
            return
        layer = self._layer(LOADS, (200, 120, 20))
        scale = self._scale([float(np.linalg.norm(row["force"])) for row in loads])
        for k, row in enumerate(loads):
            words = {key: value for key, value in row.items() if key != "point"}
            self._line(row["point"], scale * np.array(row["force"]), self._attributes("load", k, layer, words))

    def forces(self, contacts: list[dict[str, Any]], findings: Findings) -> None:
        """One line for each corner that presses: the force on b, from the corner."""
        if not findings.contact:
            return
        layer = self._layer(FORCES, (190, 50, 40))
        scale = self._scale([float(np.linalg.norm(state.force, axis=1).max(initial=0.0)) for state in findings.contact])
        number = 0
        for row, state in zip(contacts, findings.contact, strict=True):
            for point, local, force in zip(state.point, state.local, state.force, strict=True):
                if not np.linalg.norm(force) > 0.0:
                    continue
                words = {"a": row["a"], "b": row["b"], "N": float(local[0]), "T": float(np.hypot(*local[1:]))}
                attributes = self._attributes("force", number, layer, words | {"force": force.tolist()})
                self._line(point.tolist(), scale * force, attributes)
                number += 1

    def _scale(self, sizes: list[float]) -> float:
        """Metres a newton."""
        boxes = [float(np.linalg.norm(np.ptp(block.vertices, axis=0))) for block in self.assembly.blocks]
        largest = max(sizes, default=0.0)
        return LONGEST * float(np.mean(boxes)) / largest if largest > 0.0 else 0.0

    def _line(self, point: list[float], along: Floats, attributes: Any) -> None:
        end = np.array(point) + along
        if not np.linalg.norm(along) > 0.0:  # a line needs a length; its user text says the force
            end[2] += 1e-3
        self.file.Objects.AddLine(self.rhino.Point3d(*point), self.rhino.Point3d(*end.tolist()), attributes)


def _layer_name(group: str) -> str:
    """Rhino joins the names of nested layers with two colons, trims blanks and wants no bracket to begin with."""
    name = group.replace("::", ": :").strip()
    return name if name[:1].isalnum() else f"group {name}".strip()


def _same_layer(name: str, group: str) -> bool:
    def plain(text: str) -> str:
        return "".join(c for c in text.casefold() if c.isalnum())

    return plain(name) == plain(_layer_name(group))


@dataclass(slots=True)
class _Found:
    """What a Rhino file holds that can be read, and a count of what cannot."""

    meshes: list[tuple[Body, dict[str, str]]] = field(default_factory=list)
    solids: list[tuple[Body, dict[str, str]]] = field(default_factory=list)  # polysurfaces and extrusions
    contacts: list[dict[str, Any]] = field(default_factory=list)
    loads: list[dict[str, Any]] = field(default_factory=list)
    kinds: Counter[str] = field(default_factory=Counter)  # of the solids that are read
    curved: Counter[str] = field(default_factory=Counter)  # those for which their render meshes stand
    shapeless: Counter[str] = field(default_factory=Counter)  # those that have no such meshes
    layers: dict[str, None] = field(default_factory=dict)  # that these lie on
    ours: bool = False

    @property
    def stones(self) -> list[tuple[Body, dict[str, str]]]:
        """Meshes; where there are none, solids: people mesh a solid and leave it in the drawing."""
        return self.meshes or self.solids


def read_rhino(path: str, stem: str, data: bytes, units: str | None) -> tuple[Assembly, tuple[str, ...]]:
    """Read one block for each mesh, in metres; of a file that we wrote, contacts, loads and all the rest.

    Without meshes, polysurfaces and extrusions are read: exactly where their faces are flat polygons, else by their
    render meshes. Block instances stand where they are put.

    Raises
    ------
    InputError
        It is damaged, holds no solid, is in a unit that is not known, or says something that a model file may not say.
    """
    with _opened(path, data, units) as (file, unit, warnings):
        found = _found(path, file, unit, len(data))
        rest = file.Strings[KIND]
    if not found.stones:
        raise InputError(f"{path}: {_no_meshes(found)}")
    warnings += _passed_over(path, found)
    carries = model_rest(path, parsed(path, rest)) if rest else {}
    rows = _rows(path, found)
    if rows is not None:
        loads = found.loads + array(carries.get("loads") or [], f"{path}: loads")
        assembly, more = rebuilt(path, stem, carries | {"loads": loads}, rows, found.contacts)
        return assembly, (*warnings, *more)
    assembly, made = assembly_of(path, stem, [_named(path, body, text) for body, text in found.stones], "m")
    if found.contacts or found.loads:
        warnings.append(f"{path}: some meshes have no id of their own; contacts and loads in it are left out")
    return assembly, (*warnings, *made)


def read_rhino_faces(path: str, data: bytes, units: str | None) -> tuple[list[Body], list[str]]:
    """Read every mesh and every face of a surface or polysurface, in metres: those of surfaces as they are sampled.

    Raises
    ------
    InputError
        It is damaged, in a unit that is not known, or a face can neither be sampled nor has it a render mesh.
    """
    bodies: list[Body] = []
    with _opened(path, data, units) as (file, unit, warnings):
        for geometry, _, called, matrix in _placed(path, file, len(data)):
            for body in face_bodies(f"{path}: {label(called)}" if called else path, geometry):
                vertices, faces = placed(matrix, body.vertices, body.faces)
                bodies.append(Body(called or None, metres(vertices, unit), list(faces)))
    return bodies, warnings


@contextmanager
def _opened(path: str, data: bytes, units: str | None) -> Iterator[tuple[Any, str, list[str]]]:
    """The archive, its unit, and what was assumed; what the library cannot read in it is damage."""
    rhino = extra("rhino", where=f"{path}: ")
    refuse_damaged(path, data)
    try:
        file = rhino.File3dm.FromByteArray(data)
        if file is None:
            raise InputError(f"{path}: is a damaged 3DM file, or is cut off; save it again in Rhino")
        said = str(file.Settings.ModelUnitSystem).rpartition(".")[2]
        yield file, *stated_units(path, "" if said in _UNSAID else _UNITS.get(said, said), units)
    except (RuntimeError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{path}: is a damaged 3DM file ({type(error).__name__}); save it again in Rhino") from None


def _counted(kinds: Counter[str]) -> str:
    return " and ".join(f"{count} {kind}" for kind, count in kinds.items())


def _no_meshes(found: _Found) -> str:
    if not found.shapeless:
        return "holds no meshes and no solids; a model needs at least one closed mesh"
    layers = ", ".join(label(name) for name in list(found.layers)[:4]) + (" ..." if len(found.layers) > 4 else "")
    return (
        f"holds no meshes, but {_counted(found.shapeless)} on layers {layers}, with curved faces and no render meshes;"
        " select them in Rhino, run the command Mesh (in scripts _-Mesh), and save the meshes"
    )


def _passed_over(path: str, found: _Found) -> list[str]:
    left = found.shapeless + found.kinds + found.curved if found.meshes else found.shapeless
    lines = [f"{path}: {_counted(left)} are passed over; only meshes are read where there are any"] if left else []
    if found.curved and not found.meshes:
        lines.append(f"{path}: {_counted(found.curved)} with curved faces are read by their render meshes")
    return lines


def _found(path: str, file: Any, unit: str, size: int) -> _Found:
    """Go through the objects of a file of so many bytes; lengths become metres."""
    names = {layer.Index: (layer.Name, layer.FullPath) for layer in file.Layers}
    found = _Found()
    for geometry, attributes, called, matrix in _placed(path, file, size):
        name, full = names.get(attributes.LayerIndex, ("", ""))
        text = {key: value for key, value in attributes.GetUserStrings()}
        kind = str(geometry.ObjectType).rpartition(".")[2]
        found.ours |= text.get(KIND) in ("stone", "contact", "load")
        if kind == "Mesh" or kind in _SOLIDS:
            shape = mesh_shape(geometry) if kind == "Mesh" else _solid_shape(geometry, kind, found)
            if shape is None:
                found.layers[full or name] = None
                continue
            vertices, faces = placed(matrix, *shape)
            whole = bool(called or text.get("id"))
            body = Body(called or None, metres(vertices, unit), list(faces), whole)
            (found.meshes if kind == "Mesh" else found.solids).append((body, text | {"layer": name, "path": full}))
        elif kind in ("Curve", "Point") and text.get(KIND) == "contact":
            corners = _corners(geometry) if kind == "Curve" else coordinates([geometry.Location])
            found.contacts.append(_words(text) | {"polygon": metres(corners, unit).tolist()})
        elif kind == "Curve" and text.get(KIND) == "load":
            point = metres(coordinates([geometry.PointAtStart]), unit)[0]
            found.loads.append(_words(text) | {"point": point.tolist()})
    return found


def _placed(path: str, file: Any, size: int) -> Iterator[tuple[Any, Any, str, Floats]]:
    """Geometry, attributes, name and (4, 4) place of every object, those of block instances in their stead.

    An instance is a stone like others: its attributes count, and its name or that of its definition.
    """
    definitions = {str(one.Id): one for one in file.InstanceDefinitions}
    items = {str(item.Attributes.Id): item for item in file.Objects if item.Attributes is not None}
    stack = [(item, item.Attributes, "", np.eye(4)) for item in file.Objects if item.Attributes is not None]
    stack = [row for row in stack if not row[1].IsInstanceDefinitionObject][::-1]
    rows = 0
    while stack:
        item, attributes, name, matrix = stack.pop()
        geometry = item.Geometry
        if geometry is None:
            continue
        if "InstanceReference" not in str(geometry.ObjectType):
            yield geometry, attributes, name or item.Attributes.Name, matrix
            if attributes is not item.Attributes and hasattr(geometry, "Vertices"):
                rows += len(geometry.Vertices) + 4 * len(geometry.Faces)
                refuse_unfolded(path, rows, size)
            continue
        definition = definitions.get(str(geometry.ParentIdefId))
        inner = [items[str(one)] for one in definition.GetObjectIds() if str(one) in items] if definition else []
        rows += 1 + len(inner)
        refuse_unfolded(path, rows, size)  # also where instances hold each other
        # its own array of them is of single precision
        own = [[getattr(geometry.Xform, f"M{row}{column}") for column in range(4)] for row in range(4)]
        place = matrix @ np.array(own)
        called = name or item.Attributes.Name or (definition.Name if definition else "")
        for k, one in reversed(list(enumerate(inner))):
            part = one.Attributes.Name or str(k)
            stack.append((one, attributes, called if len(inner) == 1 else f"{called}/{part}", place))


def _solid_shape(geometry: Any, kind: str, found: _Found) -> tuple[Floats, list[tuple[int, ...]]] | None:
    """Vertices and faces of a Brep or an extrusion: its own where they are flat polygons, else its render meshes."""
    rhino = extra("rhino")
    brep = geometry.ToBrep(True) if kind == "Extrusion" else geometry
    exact = _polygons(brep) if kind in ("Brep", "Extrusion") and brep is not None else None
    if exact is not None:
        found.kinds[_SOLIDS[kind]] += 1
        return exact
    meshes = []
    if kind in ("Brep", "Extrusion"):
        parts = [geometry] if kind == "Extrusion" else list(geometry.Faces)
        meshes = [part.GetMesh(rhino.MeshType.Any) for part in parts]
    if not meshes or any(mesh is None or not len(mesh.Faces) for mesh in meshes):
        found.shapeless[_SOLIDS[kind]] += 1
        return None
    found.curved[_SOLIDS[kind]] += 1
    return joined([mesh_shape(mesh) for mesh in meshes])


def _polygons(brep: Any) -> tuple[Floats, list[tuple[int, ...]]] | None:
    """Vertices and faces of a Brep all of whose faces are flat polygons without holes; None for others."""
    vertices = coordinates(v.Location for v in brep.Vertices)
    flat = 1e-9 * float(np.ptp(vertices, axis=0).max(initial=0.0))  # double precision of a drawing's coordinates
    edges = [edge.IsLinear(max(flat, 1e-12)) for edge in brep.Edges]
    faces = []
    for face in brep.Faces:
        loop = face.OuterLoop
        if loop is None or len(face.Loops) != 1 or not face.IsPlanar(max(flat, 1e-12)):
            return None
        trims = [loop.Trims[k] for k in range(len(loop.Trims))]
        if not all(trim.EdgeIndex >= 0 and edges[trim.EdgeIndex] for trim in trims):
            return None
        ring = tuple(trim.StartVertexIndex for trim in trims)
        faces.append(ring[::-1] if face.OrientationIsReversed else ring)
    return (vertices, faces) if faces else None


def _words(text: Mapping[str, str]) -> dict[str, Any]:
    """What user text says, but for results."""
    passed = TOLD | {KIND, "layer", "path", "faces"}
    return {key: understood(key, value) for key, value in text.items() if key not in passed}


def _corners(curve: Any) -> Floats:
    """(m, 3) corners of a closed polyline, the last that closes it left out."""
    polyline = curve.TryGetPolyline()
    count = 0 if polyline is None else len(polyline)
    corners = coordinates(polyline[k] for k in range(count))
    return corners[:-1] if count > 1 and (corners[0] == corners[-1]).all() else corners


def _group(text: Mapping[str, str]) -> str | None:
    """Group of a stone: its user text while it lies on the layer of that name, else the layer."""
    layer, said = text["layer"], text.get("group")
    group = None if said is None else str(understood("group", said))
    if text.get(KIND) != "stone":
        return group or (layer if layer not in ("", "Default") else None)
    if group is not None and _same_layer(layer, group):
        return group
    return None if layer == STONES else layer


def _rows(path: str, found: _Found) -> list[dict[str, Any]] | None:
    """Rows of the model document for meshes that all have an id of their own, as in a file of ours; else None."""
    ids = [text.get("id") for _, text in found.stones]
    if not found.ours or None in ids or len(set(ids)) < len(ids):
        return None
    rows = [(stone_row(path, body, _words(text), text.get("faces")), _group(text)) for body, text in found.stones]
    return [row | {"group": group} for row, group in rows]


def _named(path: str, body: Body, text: Mapping[str, str]) -> Body:
    """Return a body with what its user text and its layer say of the block."""
    name = str(understood("id", text["id"])) if text.get("id") else body.name
    row = {key: understood(key, text[key]) for key in ("density", "fixed") if key in text}
    fields = written_fields(f"{path}: {label(name or 'a mesh without a name')}", row | {"group": _group(text)})
    return Body(name, body.vertices, body.faces, body.whole, fields)
