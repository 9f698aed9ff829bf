"""DXF, with the extra `dxf` (ezdxf): solids that are drawn as meshes or by their faces, wherever inserts put them.

A stone is a MESH, a polyface POLYLINE, or what hangs together of the 3DFACEs on a layer, in a group or in an insert.
Layers are the groups of stones, names of inserted blocks and of groups theirs; a stone that has a layer to itself is
called after it. Solids of ACIS (3DSOLID, BODY, ...) are closed books, and outlines in a plane have no thickness.
"""

import logging
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, assembly_of
from cyclopean.io.extras import extra
from cyclopean.io.fields import label, refuse_unfolded
from cyclopean.io.files import one_line
from cyclopean.io.units import stated_units

__all__ = ["opened", "parts", "read_dxf", "said_unit"]

_UNITS = {0: "", 1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m"}  # $INSUNITS
_OTHER = {3: "miles", 7: "kilometres", 8: "microinches", 9: "mils", 10: "yards", 13: "microns", 14: "decimetres"}
_ACIS = frozenset(
    "3DSOLID BODY REGION SURFACE EXTRUDEDSURFACE LOFTEDSURFACE REVOLVEDSURFACE SWEPTSURFACE PLANESURFACE".split()
)
_OUTLINES = frozenset({"LWPOLYLINE", "POLYLINE", "HATCH", "CIRCLE", "SOLID", "TRACE"})
logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # what it mends in a drawing is not for the terminal
# what the library lets out where a file is not as it expects
_DAMAGE = (ArithmeticError, AssertionError, AttributeError, LookupError, OSError, RuntimeError, StopIteration)
_Shape = tuple[list[Any], list[tuple[int, ...]]]  # points and faces


@contextmanager
def opened(path: str, data: bytes) -> Iterator[Any]:
    """The drawing, to be read meanwhile.

    Raises
    ------
    InputError
        It is damaged, found out at once or in reading it; one line.
    """
    library, place = extra("dxf", where=f"{path}: "), Path()
    try:
        with tempfile.TemporaryDirectory() as folder:  # the library tells text from binary in files only
            place = Path(folder) / "drawing.dxf"
            place.write_bytes(data)
            drawing = library.readfile(place)
        yield drawing
    except (library.DXFError, TypeError, ValueError, *_DAMAGE) as error:
        said_so = one_line(str(error).replace(str(place), path), 80) or type(error).__name__
        raise InputError(f"{path}: is a damaged DXF file ({said_so}); save it again") from None


def said_unit(drawing: Any) -> str:
    """Unit that a drawing says, "" where it says none."""
    said = int(drawing.header.get("$INSUNITS", 0))
    return _UNITS.get(said, _OTHER.get(said, f"number {said}"))


def parts(path: str, size: int, drawing: Any) -> Iterator[tuple[Any, str, str, int]]:
    """Entities of the model space, those of inserts in their stead, with name, layer and number of the insert.

    Raises
    ------
    InputError
        A file of `size` bytes that unfolds to far more.
    """
    groups = _group_names(drawing)
    stack: list[tuple[Any, str, str, int]] = [(one, "", "", 0) for one in reversed(list(drawing.modelspace()))]
    inserts = rows = 0
    while stack:
        entity, name, layer, owner = stack.pop()
        name = name or groups.get(entity.dxf.handle, "")
        layer = layer if layer and entity.dxf.layer == "0" else entity.dxf.layer
        if entity.dxftype() != "INSERT":
            yield entity, name, layer, owner
            continue
        for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
            inserts += 1
            inner = list(one.virtual_entities())
            rows += 1 + len(inner)
            refuse_unfolded(path, rows, size)
            called = name or (one.dxf.name if not one.dxf.name.startswith("*") else "")
            stack.extend((part, called, layer, owner or inserts) for part in reversed(inner))


def read_dxf(path: str, stem: str, data: bytes, units: str | None) -> tuple[Assembly, tuple[str, ...]]:
    """Read one block for each mesh, polyface, or connected piece of 3D faces, in metres.

    Raises
    ------
    InputError
        It is damaged, or holds no such thing; the line then says what it holds instead.
    """
    found = _Drawing(path, len(data))
    with opened(path, data) as drawing:
        found.gather(drawing)
        said = said_unit(drawing)
    unit, warnings = stated_units(path, said, units)
    bodies = found.bodies()
    if not bodies:
        raise InputError(f"{path}: {found.without_solids()}")
    assembly, made = assembly_of(path, stem, bodies, unit)
    return assembly, (*warnings, *found.notes(), *made)


def _group_names(drawing: Any) -> dict[str, str]:
    """Name of the group of each entity that has one with a name, by handle."""
    named = [(name, group) for name, group in drawing.groups if not name.startswith("*")]
    return {handle: name for name, group in named for handle in group.handles()}


@dataclass(slots=True)
class _Drawing:
    """What a drawing holds: shapes by who owns them, and a count of all else."""

    path: str
    size: int  # bytes of the file
    shapes: list[tuple[str, str, _Shape]] = field(default_factory=list)  # name, layer, mesh
    soups: dict[tuple[str, str, int], _Shape] = field(default_factory=dict)  # name, layer, insert: loose faces
    passed: Counter[str] = field(default_factory=Counter)
    smooth: int = 0
    rows: int = 0  # vertices and corners so far

    def gather(self, drawing: Any) -> None:
        """Go through the entities of the model space."""
        for entity, name, layer, owner in parts(self.path, self.size, drawing):
            kind = entity.dxftype()
            if kind == "3DFACE":
                self._face(entity, (name, layer, owner))
            elif shape := self._mesh(entity, kind):
                self._count(len(shape[0]) + sum(map(len, shape[1])))
                self.shapes.append((name, layer, shape))
            else:
                self.passed[kind] += 1

    def _count(self, rows: int) -> None:
        self.rows += rows
        refuse_unfolded(self.path, self.rows, self.size)

    def _face(self, entity: Any, owner: tuple[str, str, int]) -> None:
        points, faces = self.soups.setdefault(owner, ([], []))
        ring = entity.wcs_vertices()
        first = len(points)
        points.extend(ring)
        faces.append(tuple(range(first, first + len(ring))))
        self._count(2 * len(ring))

    def _mesh(self, entity: Any, kind: str) -> _Shape | None:
        if kind == "MESH":
            self.smooth += entity.dxf.subdivision_levels > 0
            return list(entity.vertices), [tuple(face) for face in entity.faces]
        if kind == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh):
            builder = extra("dxf", ".render").MeshBuilder.from_polyface(entity)
            return list(builder.vertices), [tuple(face) for face in builder.faces]
        return None

    def bodies(self) -> list[Body]:
        """One body for each mesh, one to be split for the loose faces of each owner."""
        rows = [(name, layer, shape, True) for name, layer, shape in self.shapes]
        rows += [(name, layer, shape, False) for (name, layer, _), shape in self.soups.items()]
        alone = Counter(layer for _, layer, _, _ in rows)
        made = []
        for name, layer, (points, faces), whole in rows:
            own = layer not in ("0", "")
            called = name or (layer if own and alone[layer] == 1 else None)
            vertices = np.array([(p[0], p[1], p[2]) for p in points], np.float64).reshape(-1, 3)
            kept = [tuple(i for k, i in enumerate(face) if i != face[k - 1]) for face in faces]
            rings = [face for face in kept if len(face) >= 3]
            made.append(Body(called, vertices, rings, whole, {"group": layer} if own and layer.isprintable() else {}))
        return made

    def without_solids(self) -> str:
        """Say what a drawing is that holds no solids, and what to give instead."""
        acis = sum(count for kind, count in self.passed.items() if kind in _ACIS)
        flat = sum(count for kind, count in self.passed.items() if kind in _OUTLINES)
        if acis:
            return f"holds {acis} ACIS solids, which only their own program opens; export meshes (MESHSMOOTH, or OBJ)"
        if flat:
            way = "extrude them and export meshes, or make a wall of them (make polygonal `drawing`)"
            return f"holds {flat} outlines in a plane and no solids; {way}"
        kinds = ", ".join(f"{count} {kind}" for kind, count in list(self.passed.items())[:4])
        return f"holds no meshes and no 3D faces{f', but {label(kinds)[1:-1]}' if kinds else ''}; export meshes"

    def notes(self) -> list[str]:
        """What is passed over, and meshes whose rounding is."""
        left = [f"{count} {kind}" for kind, count in self.passed.items()]
        more = " and more" if len(left) > 4 else ""
        lines = (
            [f"{self.path}: {', '.join(left[:4])}{more} passed over; only meshes and 3D faces are read"] if left else []
        )
        if self.smooth:
            lines.append(f"{self.path}: {self.smooth} smoothed meshes are read by the faces that they were made of")
        return lines
