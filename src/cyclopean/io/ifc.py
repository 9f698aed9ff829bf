"""IFC4, with the extra `ifc` (ifcopenshell): one structure, and one building element part a stone.

A project holds a site, a building, a storey and in it the structure: an `IfcWall` where the model's name says so, else
an `IfcElementAssembly`, which is an arch, a vault or a dome by the same. It is made of an `IfcBuildingElementPart` a
stone, whose body is an `IfcPolygonalFaceSet` of double precision; faces that are not flat become triangles, with a
record of the polygons beside them (`io.round_trip`). The property set `Cyclopean_Stone` holds what the model says of a
stone and what was found out about it, `Cyclopean_Model` the rest, of which verdict, margins, Lambda, gap and J stand by
themselves, and an `IfcRelConnectsElements` each contact with its polygon. Global ids follow from the names, so that a
model written twice has the same ones. Metres, z up.
"""

import json
import re
import uuid
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.io.blocklist import flat
from cyclopean.io.bodies import Body, assembly_of, joined
from cyclopean.io.extras import extra
from cyclopean.io.fields import Faces, face_fault, parsed, refuse_unfolded
from cyclopean.io.files import one_line
from cyclopean.io.findings import Findings
from cyclopean.io.palette import stone_colours
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
)

__all__ = ["ifc_bytes", "read_ifc"]

STONE, MODEL, CONTACT = "Cyclopean_Stone", "Cyclopean_Model", "Cyclopean_Contact"
_NAMESPACE = uuid.UUID("7b0f5f0e-2f56-4c5c-9f0a-3c1b7c0d2a44")  # ours: global ids that stay the same
_NAMES = {  # in the property set: ours, theirs, type
    "id": ("Id", "IfcText"),
    "group": ("Group", "IfcText"),
    "order": ("BuildOrder", "IfcInteger"),
    "course": ("Course", "IfcInteger"),
    "lambda": ("Lambda", "IfcReal"),
    "gap": ("Gap", "IfcReal"),
    "utilisation": ("Utilisation", "IfcReal"),
    "density": ("Density", "IfcMassDensityMeasure"),
    "fixed": ("Fixed", "IfcBoolean"),
    "volume": ("Volume", "IfcVolumeMeasure"),
}
_OURS = {theirs: ours for ours, (theirs, _) in _NAMES.items()}
_INSTANCE = re.compile(r"^\s*#\d+\s*=", re.MULTILINE)
_DAMAGE = (
    RuntimeError,
    AttributeError,
    TypeError,
    ValueError,
    KeyError,
    IndexError,
    OverflowError,
)  # of ifcopenshell, on such files


def ifc_bytes(assembly: Assembly, findings: Findings) -> bytes:
    """Return the assembly as IFC4, with what was found out about it.

    Raises
    ------
    InputError
        ifcopenshell is not installed.
    """
    writer = _Writer(extra("ifc"), assembly)
    rest, rows, contacts = carried(assembly)
    structure = writer.frame()
    stones = writer.stones(rows, told(assembly, findings), stone_colours(assembly, findings))
    writer.root("IfcRelAggregates", "stones", RelatingObject=structure, RelatedObjects=stones)
    writer.materials(rows, stones)
    writer.contacts(contacts, stones, findings)
    text = json.dumps(rest | {"findings": dict(findings.model)}, ensure_ascii=False)
    said = {"Document": ("IfcText", text)} | {
        "".join(word[:1].upper() + word[1:] for word in key.split()): (
            ("IfcText", value) if isinstance(value, str) else ("IfcReal", value)
        )
        for key, value in findings.model.items()
    }
    writer.properties(MODEL, "model", structure, said)
    return bytes(writer.file.to_string(), "utf-8")


class _Writer:
    """An IFC file that grows."""

    def __init__(self, ifc: Any, assembly: Assembly) -> None:
        self.assembly = assembly
        self.compress = extra("ifc", ".guid").compress
        self.file = ifc.file(schema="IFC4")
        self.make = self.file.create_entity
        head = self.file.header
        head.file_description.description = ("ViewDefinition [ReferenceView_V1.2]",)
        head.file_name.name = "".join(c if c.isascii() and c.isprintable() else "_" for c in assembly.name)
        head.file_name.originating_system = "cyclopean"
        origin = self.make("IfcCartesianPoint", (0.0, 0.0, 0.0))
        self.origin = self.make("IfcAxis2Placement3D", origin)
        whole = self.make("IfcGeometricRepresentationContext", None, "Model", 3, 1e-6, self.origin)
        self.context = whole
        self.body = self.make(
            "IfcGeometricRepresentationSubContext",
            ContextIdentifier="Body",
            ContextType="Model",
            ParentContext=whole,
            TargetView="MODEL_VIEW",
        )
        self.place = self.make("IfcLocalPlacement", None, self.origin)

    def root(self, kind: str, name: str, **fields: Any) -> Any:
        """Make an entity with a global id that follows from the model's name, its kind and its own name."""
        identity = uuid.uuid5(_NAMESPACE, json.dumps([self.assembly.name, kind, name]))
        return self.make(kind, GlobalId=self.compress(identity.hex), **fields)

    def frame(self) -> Any:
        """Project, site, building, storey and the structure in it, which is returned."""
        name = _label(self.assembly.name)
        units = self.make("IfcUnitAssignment", self._units())
        project = self.root("IfcProject", "", Name=name, RepresentationContexts=(self.context,), UnitsInContext=units)
        above = project
        for kind in ("IfcSite", "IfcBuilding", "IfcBuildingStorey"):
            fields = {"Name": kind[3:], "ObjectPlacement": self.place, "CompositionType": "ELEMENT"}
            below = self.root(kind, "", **fields)
            self.root("IfcRelAggregates", kind, RelatingObject=above, RelatedObjects=(below,))
            above = below
        structure = self._structure(name)
        fields = {"RelatingStructure": above, "RelatedElements": (structure,)}
        self.root("IfcRelContainedInSpatialStructure", "structure", **fields)
        return structure

    def _units(self) -> list[Any]:
        single = {"LENGTHUNIT": "METRE", "AREAUNIT": "SQUARE_METRE", "VOLUMEUNIT": "CUBIC_METRE"}
        units = [self.make("IfcSIUnit", None, kind, None, name) for kind, name in single.items()]
        units += [self.make("IfcSIUnit", None, "PLANEANGLEUNIT", None, "RADIAN")]
        mass = self.make("IfcSIUnit", None, "MASSUNIT", "KILO", "GRAM")
        parts = [self.make("IfcDerivedUnitElement", mass, 1), self.make("IfcDerivedUnitElement", units[0], -3)]
        return [*units, mass, self.make("IfcDerivedUnit", parts, "MASSDENSITYUNIT", None)]

    def _structure(self, name: str) -> Any:
        words = self.assembly.name.lower()
        fields: dict[str, Any] = {
            "Name": name,
            "ObjectPlacement": self.make("IfcLocalPlacement", self.place, self.origin),
        }
        if "wall" in words:
            return self.root("IfcWall", "", PredefinedType="NOTDEFINED", **fields)
        kind = next((kind for kind in ("vault", "dome", "arch") if kind in words), "dry stone").upper()
        own = {"PredefinedType": "ARCH"} if kind == "ARCH" else {"PredefinedType": "USERDEFINED", "ObjectType": kind}
        return self.root("IfcElementAssembly", "", **own, **fields)

    def stones(
        self, rows: list[dict[str, Any]], said: list[dict[str, Any]], colours: list[tuple[float, float, float]]
    ) -> list[Any]:
        """One part a block, with its properties."""
        faulty = {body for body, _ in mesh_faults(self.assembly.mesh)}
        styles = {colour: self._style(colour) for colour in sorted(set(colours))}
        even = flat(self.assembly.mesh)
        parts = []
        for k, block in enumerate(self.assembly.blocks):
            body, record = self._face_set(block, even[k], closed=k not in faulty)
            self.make("IfcStyledItem", body, (styles[colours[k]],), None)
            shape = self.make("IfcShapeRepresentation", self.body, "Body", "Tessellation", (body,))
            part = self.root(
                "IfcBuildingElementPart",
                block.id,
                Name=_label(block.id),
                ObjectType="STONE",
                ObjectPlacement=self.place,
                Representation=self.make("IfcProductDefinitionShape", None, None, (shape,)),
                PredefinedType="USERDEFINED",
            )
            parts.append(part)
            self.properties(STONE, block.id, part, _typed({"id": block.id} | rows[k] | said[k] | record))
        return parts

    def _face_set(self, block: Block, even: Bools, closed: bool) -> tuple[Any, dict[str, str]]:
        """Body of a block, and the record of its polygons if some of them had to be cut up."""
        faces = [part for face, well in zip(block.faces, even, strict=True) for part in ([face] if well else fan(face))]
        points = self.make("IfcCartesianPointList3D", block.vertices.tolist())
        rows = [self.make("IfcIndexedPolygonalFace", [i + 1 for i in face]) for face in faces]
        return self.make("IfcPolygonalFaceSet", points, closed, rows, None), record_of(block.faces, bool(even.all()))

    def _style(self, colour: tuple[float, float, float]) -> Any:
        shade = self.make("IfcSurfaceStyleShading", self.make("IfcColourRgb", None, *colour), 0.0)
        return self.make("IfcSurfaceStyle", None, "BOTH", (shade,))

    def properties(self, kind: str, name: str, thing: Any, values: Mapping[str, tuple[str, Any]]) -> None:
        """Give a thing a set of single-valued properties."""
        rows = [
            self.make("IfcPropertySingleValue", key, None, self.make(type_, value), None)
            for key, (type_, value) in values.items()
        ]
        group = self.root("IfcPropertySet", f"{kind} {name}", Name=kind, HasProperties=rows)
        fields = {"RelatedObjects": (thing,), "RelatingPropertyDefinition": group}
        self.root("IfcRelDefinesByProperties", f"{kind} {name}", **fields)

    def materials(self, rows: list[dict[str, Any]], stones: list[Any]) -> None:
        """One material for each that the model tells apart, by name and density."""
        kinds: dict[tuple[str, float | None], list[Any]] = {}
        for row, stone in zip(rows, stones, strict=True):
            name = row.get("material")
            kinds.setdefault((name if isinstance(name, str) else "Stone", row.get("density")), []).append(stone)
        for (name, density), parts in kinds.items():
            full = name if density is None else f"{name}, {density:g} kg/m3"
            material = self.make("IfcMaterial", _label(full), None, "stone")
            if density is not None:
                value = self.make("IfcMassDensityMeasure", density)
                row = self.make("IfcPropertySingleValue", "MassDensity", None, value, None)
                self.make("IfcMaterialProperties", "Pset_MaterialCommon", None, (row,), material)
            key = json.dumps([name, density])
            self.root("IfcRelAssociatesMaterial", key, RelatedObjects=parts, RelatingMaterial=material)

    def contacts(self, contacts: list[dict[str, Any]], stones: list[Any], findings: Findings) -> None:
        """One connection a contact: its polygon as a surface, or its point, the rest as JSON in its description."""
        index = {block.id: stone for block, stone in zip(self.assembly.blocks, stones, strict=True)}
        for k, row in enumerate(contacts):
            words = {key: value for key, value in row.items() if key not in ("a", "b", "polygon")}
            words |= found_at(findings, k)
            self.root(
                "IfcRelConnectsElements",
                f"contact {k}",
                Name=CONTACT,
                Description=json.dumps(words, ensure_ascii=False),
                ConnectionGeometry=self.connection([self.make("IfcCartesianPoint", point) for point in row["polygon"]]),
                RelatingElement=index[row["a"]],
                RelatedElement=index[row["b"]],
            )

    def connection(self, corners: list[Any]) -> Any:
        """Where two elements touch: on a polygon or at a point."""
        if len(corners) == 1:
            return self.make("IfcConnectionPointGeometry", corners[0], None)
        bound = self.make("IfcFaceOuterBound", self.make("IfcPolyLoop", corners), True)
        patch = self.make("IfcConnectedFaceSet", (self.make("IfcFace", (bound,)),))
        return self.make("IfcConnectionSurfaceGeometry", self.make("IfcFaceBasedSurfaceModel", (patch,)), None)


def _label(name: str) -> str:
    """Clip a name to what an IfcLabel holds; the property set has it in full."""
    return name[:255]


def _typed(row: Mapping[str, Any]) -> dict[str, tuple[str, Any]]:
    """Names, types and values of properties; what has no type of its own is text."""
    typed: dict[str, tuple[str, Any]] = {}
    for key, value in row.items():
        name, kind = _NAMES.get(key, (key, "IfcText"))
        if value is not None:
            typed[name] = (kind, int(value) if kind == "IfcInteger" else value if key in _NAMES else shown(key, value))
    return typed


def read_ifc(path: str, stem: str, data: bytes, units: str | None) -> tuple[Assembly, tuple[str, ...]]:
    """Read one block for each element with a body of faces; of a file that we wrote, contacts and all the rest.

    Face sets, triangulated or polygonal, and faceted boundary representations are read, where placements put them.

    Raises
    ------
    InputError
        It is damaged, holds no such element, or says something that a model file may not say.
    """
    text = data.decode("utf-8", "replace")
    if not text.lstrip("\ufeff \t\r\n").startswith("ISO-10303-21"):
        raise InputError(f"{path}: is not an IFC file: it does not begin with 'ISO-10303-21'")
    if "END-ISO-10303-21" not in text[-200:]:
        raise InputError(f"{path}: the IFC file has no end (END-ISO-10303-21); is it cut off?")
    try:
        file = extra("ifc", where=f"{path}: ").file.from_string(text)
        if (lines := len(_INSTANCE.findall(text))) > (read := len(file.entity_names())):  # it stops without a word
            raise InputError(f"{path}: is a damaged IFC file: only {read} of its {lines} lines can be read")
        reader = _Reader(path, file, len(data))
        found = reader.elements()
    except _DAMAGE as error:
        raise InputError(f"{path}: is a damaged IFC file ({one_line(str(error), 80)})") from None
    if units is not None and found:
        raise InputError(f"{path}: an IFC file says its units; leave out `units` {units}")
    if not found:
        raise InputError(f"{path}: {_nothing(reader)}")
    warnings = [f"{path}: {_skipped(reader)} are passed over; only faces are read"] if reader.skipped else []
    if all("id" in row for _, row, _ in found):
        rows = [stone_row(path, body, row, row.get("faces")) for body, row, _ in found]
        names = {number: row["id"] for row, (_, _, number) in zip(rows, found, strict=True)}
        try:
            rest, contacts = reader.rest(), reader.contacts(names)
        except _DAMAGE as error:
            raise InputError(f"{path}: is a damaged IFC file ({one_line(str(error), 80)})") from None
        assembly, more = rebuilt(path, stem, rest, rows, contacts)
        return assembly, (*warnings, *more)
    assembly, made = assembly_of(path, stem, [body for body, _, _ in found], "m")
    return assembly, (*warnings, *made)


def _nothing(reader: "_Reader") -> str:
    if reader.skipped:
        return f"holds no stones with faces, but {_skipped(reader)}; export it with tessellated (faceted) geometry"
    return f"holds no building elements ({reader.schema}); a model needs at least one with a body of faces"


def _skipped(reader: "_Reader") -> str:
    return ", ".join(f"{count} {kind}" for kind, count in reader.skipped.most_common(4))


class _Reader:
    """One IFC file."""

    def __init__(self, path: str, file: Any, size: int) -> None:
        self.path = path
        self.file = file
        self.size = size  # bytes of the file
        self.rows = 0  # vertices and corners so far; bodies may be shared by elements
        self.schema = file.schema
        self.skipped: Counter[str] = Counter()
        self.psets = extra("ifc", ".util.element").get_psets
        self.placement = extra("ifc", ".util.placement").get_local_placement
        self.scale = 1.0
        if file.by_type("IfcProject"):
            self.scale = float(extra("ifc", ".util.unit").calculate_unit_scale(file))

    def elements(self) -> list[tuple[Body, dict[str, Any], int]]:
        """Body in metres, what its property set says, and number, of every element that has faces."""
        found = []
        for product in self.file.by_type("IfcElement"):
            body = self._body(product)
            if body is not None:
                said = self.psets(product).get(STONE, {})
                row = {
                    _OURS.get(key, key): value if key in _OURS else understood(key, str(value))
                    for key, value in said.items()
                    if key and key != "id"  # nameless, or the number of the set in the file
                }
                found.append((body, row, product.id()))
        return found

    def _body(self, product: Any) -> Body | None:
        shape = product.Representation
        if shape is None:
            return None
        shapes = []
        for item in _items(shape):
            drawn = _DRAWN.get(item.is_a())
            if drawn is None:
                self.skipped[item.is_a()] += 1
                continue
            vertices, corners = drawn(item)
            self.rows += len(vertices) + sum(map(len, corners))
            refuse_unfolded(self.path, self.rows, self.size)
            if fault := next((f for face in corners if (f := face_fault(face, len(vertices)))), ""):
                raise InputError(f"{self.path}: #{item.id()}: a face {fault}")
            shapes.append((vertices, corners))
        if not any(corners for _, corners in shapes):
            return None
        points, faces = joined(shapes)
        return Body(product.Name or None, self._placed(product, points), faces)

    def _placed(self, product: Any, vertices: Floats) -> Floats:
        matrix = np.eye(4)
        if product.ObjectPlacement is not None:
            matrix = np.asarray(self.placement(product.ObjectPlacement), np.float64)
        if not np.array_equal(matrix, np.eye(4)):  # else every digit stays
            vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        return vertices if self.scale == 1.0 else vertices * self.scale

    def rest(self) -> dict[str, Any]:
        """What our property set says of the model as a whole."""
        for kind in ("IfcWall", "IfcElementAssembly"):
            for thing in self.file.by_type(kind):
                document = self.psets(thing).get(MODEL, {}).get("Document")
                if isinstance(document, str):
                    return model_rest(self.path, parsed(self.path, document))
        return {}

    def contacts(self, names: Mapping[int, str]) -> list[dict[str, Any]]:
        """Rows of the model document for our connections between elements that are still there."""
        rows = []
        for relation in self.file.by_type("IfcRelConnectsElements"):
            ends = [names.get(end.id()) for end in (relation.RelatingElement, relation.RelatedElement)]
            if relation.Name != CONTACT or None in ends:
                continue
            words = parsed(self.path, relation.Description or "{}")
            where = relation.ConnectionGeometry
            if where.is_a("IfcConnectionPointGeometry"):
                loop = [where.PointOnRelatingElement]
            else:
                loop = where.SurfaceOnRelatingElement.FbsmFaces[0].CfsFaces[0].Bounds[0].Bound.Polygon
            polygon = np.array([point.Coordinates for point in loop], np.float64).reshape(-1, 3)
            kept = {key: value for key, value in dict(words).items() if key not in TOLD}
            rows.append(kept | {"a": ends[0], "b": ends[1], "polygon": (polygon * self.scale).tolist()})
        return rows


def _items(shape: Any) -> list[Any]:
    """Items of the body, or of whatever the element is drawn with."""
    all_ = [r for r in shape.Representations if r.is_a("IfcShapeRepresentation")]
    chosen = [r for r in all_ if r.RepresentationIdentifier == "Body"] or all_
    return [item for representation in chosen[:1] for item in representation.Items]


_Drawn = tuple[Floats, Faces]


def _points(rows: Sequence[Any]) -> Floats:
    return np.array(rows, np.float64).reshape(-1, 3)


def _face_set(item: Any) -> _Drawn:
    """Faces of a set of polygons or triangles."""
    rows = [face.CoordIndex for face in item.Faces] if item.is_a("IfcPolygonalFaceSet") else item.CoordIndex
    index = getattr(item, "PnIndex", None)
    faces = tuple(tuple(int(index[i - 1]) - 1 if index else int(i) - 1 for i in row) for row in rows)
    return _points(item.Coordinates.CoordList), faces


def _faceted(item: Any) -> _Drawn:
    """Faces of a boundary representation; corners are shared where the file shares their points."""
    number: dict[int, int] = {}
    points: list[Any] = []
    faces = []
    for face in item.Outer.CfsFaces:
        corners = []
        for point in face.Bounds[0].Bound.Polygon:
            if point.id() not in number:
                number[point.id()] = len(points)
                points.append(point.Coordinates)
            corners.append(number[point.id()])
        faces.append(tuple(corners if face.Bounds[0].Orientation else corners[::-1]))
    return _points(points), tuple(faces)


_DRAWN = {
    "IfcPolygonalFaceSet": _face_set,
    "IfcTriangulatedFaceSet": _face_set,
    "IfcFacetedBrep": _faceted,
}
