"""Geometry as JSON between Rhino and other programs, as Rhino.Compute, Hops and rhino3dm write it; metres inside.

Meshes and curves are an openNURBS archive in base64, {"version", "archive3dm", "opennurbs", "data"}; points, vectors
and planes are plain numbers: {"X", "Y", "Z"}, and {"Origin", "XAxis", "YAxis"}. A transform, {"M00" .. "M33"}, is read
where a plane is wanted, if it is rigid. Lengths are in the units of Rhino's document, which the request names.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.geometry import newell_normals
from cyclopean.geometry.curves import Curve, sampled, straight
from cyclopean.geometry.polygon import triangulated
from cyclopean.io.bodies import Body
from cyclopean.io.extras import extra
from cyclopean.io.fields import REACH
from cyclopean.io.files import one_line
from cyclopean.io.round_trip import fan
from cyclopean.io.units import Units, metres

__all__ = [
    "RHINO_UNITS",
    "Pose",
    "Units",
    "coordinates",
    "curve_pieces",
    "decoded",
    "in_metres",
    "mesh_body",
    "mesh_json",
    "mesh_shape",
    "plane_json",
    "plane_of",
    "point_json",
    "point_of",
    "polyline_json",
    "rhino_mesh",
    "units_of",
    "vector_json",
    "vector_of",
]

Pose = tuple[Floats, Floats]  # (3, 3) rotation and (3,) shift, m: from a stone's frame to the world

RHINO_UNITS: dict[str, Units] = {
    "millimeters": (1, 1000), "centimeters": (1, 100), "decimeters": (1, 10), "meters": (1, 1), "dekameters": (10, 1),
    "hectometers": (100, 1), "kilometers": (1000, 1), "microns": (1, 1_000_000), "inches": (127, 5000),
    "feet": (381, 1250), "yards": (1143, 1250), "miles": (201_168, 125),
}  # fmt: skip
UNSAID = ("", "none", "unset")  # a document without units
STRAIGHT = 1e-6  # departure from a rotation: Rhino's own tolerance for axes


def units_of(name: str) -> Units | None:
    """Unit of length by the name of Rhino's `UnitSystem`; None where the document has none.

    Raises
    ------
    InputError
        Another unit: nobody builds in parsecs.

    Examples
    --------
    >>> units_of("Millimeters"), units_of("None")
    ((1, 1000), None)
    """
    key = name.strip().lower()
    if key in UNSAID:
        return None
    if key not in RHINO_UNITS:
        raise InputError(
            f"modelunits: '{one_line(name, 30)}' cannot be used; set the document to metres or millimetres"
        )
    return RHINO_UNITS[key]


def mesh_body(where: str, data: object, units: Units) -> Body:
    """Read a mesh; quads stay quads.

    Parameters
    ----------
    where : str
        What a refusal calls the mesh.
    data : object
        The parsed JSON.
    units : Units
        Of the document.

    Returns
    -------
    Body
        Vertices in m, not named, one block.

    Raises
    ------
    InputError
        It is no mesh, or the archive is cut off.
    """
    corner, faces = mesh_shape(decoded(where, data, "Mesh"))
    if not faces:
        raise InputError(f"{where}: has no faces; a stone is a closed mesh")
    return Body(None, in_metres(where, corner, units), faces)


def curve_pieces(where: str, data: object, units: Units) -> tuple[Curve, ...]:
    """Read a curve, in m, as pieces end to end; errors as `mesh_body`."""
    return tuple(_piece(where, part, units) for part in _simple(decoded(where, data, "Curve")))


def _simple(curve: Any) -> list[Any]:
    """The curve, or those that it is joined of."""
    if not hasattr(curve, "SegmentCurve"):
        return [curve]
    return [part for k in range(curve.SegmentCount) for part in _simple(curve.SegmentCurve(k))]


def _piece(where: str, curve: Any, units: Units) -> Curve:
    corners = curve.TryGetPolyline()
    if corners is not None:
        return straight(in_metres(where, coordinates(corners[k] for k in range(corners.Count)), units))
    ends = curve.Domain.T0, curve.Domain.T1
    return sampled(lambda t: in_metres(where, coordinates(map(curve.PointAt, t.tolist())), units), *ends)


def coordinates(points: Iterable[Any]) -> Floats:
    """(n, 3) of points of the library."""
    return np.array([(p.X, p.Y, p.Z) for p in points], np.float64).reshape(-1, 3)


def decoded(where: str, data: object, kind: str) -> Any:
    """The object of a kind that JSON holds.

    Raises
    ------
    InputError
        It is another one, or the archive is cut off.
    """
    library, archive = extra("rhino"), _archive(where, data)
    try:
        found = library.CommonObject.Decode(archive)
    except (KeyError, TypeError, ValueError, RuntimeError):
        found = None
    if not isinstance(found, getattr(library, kind)):
        said = f"is a {type(found).__name__}, not a {kind.lower()}"
        raise InputError(f"{where}: {'cannot be read; is it cut off?' if found is None else said}")
    return found


def _archive(where: str, data: object) -> dict[str, str | int]:
    """The four entries as openNURBS reads them; whole numbers may come as text."""
    keys = ("version", "archive3dm", "opennurbs")
    if not isinstance(data, Mapping) or not isinstance(data.get("data"), str) or not data["data"]:
        raise InputError(f"{where}: is no Rhino geometry: expected an object with {', '.join(keys)} and data")
    said = [str(data.get(key)) for key in keys]
    if not all(word.removeprefix("-").isdecimal() and word.isascii() and len(word) < 12 for word in said):
        raise InputError(f"{where}: is no Rhino geometry: {', '.join(keys)} are whole numbers")
    numbers = [int(word) for word in said]
    if not all(-(2**31) <= number < 2**31 for number in numbers):
        raise InputError(f"{where}: is no Rhino geometry: one of {', '.join(keys)} is too large")
    return {**dict(zip(keys, numbers, strict=True)), "data": data["data"]}


def mesh_shape(mesh: Any) -> tuple[Floats, list[tuple[int, ...]]]:
    """Vertices (v, 3), in the mesh's units, and faces; Rhino's triangles have their third corner twice."""
    corner = coordinates(mesh.Vertices.ToPoint3dArray())
    faces = [tuple(mesh.Faces[k]) for k in range(len(mesh.Faces))]
    return corner, [face[:3] if face[2] == face[3] else face for face in faces]


def rhino_mesh(vertices: Floats, rings: Iterable[Sequence[int]]) -> Any:
    """A mesh of double precision: vertices (v, 3) in its own units, triangles and quads."""
    mesh = extra("rhino").Mesh()
    mesh.Vertices.UseDoublePrecisionVertices = True
    for x, y, z in vertices.tolist():
        mesh.Vertices.AddPoint3d(x, y, z)
    for ring in rings:
        mesh.Faces.AddFace(*ring)
    return mesh


def in_metres(where: str, values: Floats, units: Units) -> Floats:
    """Coordinates (n, 3) of the document in m; what is not finite or far too large is refused."""
    found = metres(values, units)
    if not (np.abs(found) <= REACH).all():
        raise InputError(f"{where}: a coordinate is not a finite number below 1e12 m; check the units")
    return found


def _lengths(values: Floats, units: Units) -> Floats:
    """From metres to the units of the document."""
    times, over = units
    return values if times == over else values * over / times


def mesh_json(vertices: Floats, faces: Sequence[Sequence[int]], units: Units) -> dict[str, str | int]:
    """Write a mesh in double precision; faces of more than four corners, and quads that are not convex, as triangles.

    Parameters
    ----------
    vertices : (v, 3) float
        m.
    faces : sequence of sequence of int
        Corners counter-clockwise from outside.
    units : Units
        Of the document.
    """
    rings = (ring for face in faces for ring in _rings(vertices, face))
    return dict(rhino_mesh(_lengths(np.asarray(vertices, float), units), rings).Encode())


def _rings(vertices: Floats, face: Sequence[int]) -> list[tuple[int, ...]]:
    """One face as faces that Rhino's meshes can hold."""
    if len(face) == 3:
        return [tuple(face)]
    point = vertices[list(face)]
    turn = np.cross(point - np.roll(point, 1, axis=0), np.roll(point, -1, axis=0) - point)
    convex = bool((turn @ newell_normals(point, np.array([0, len(point)]))[0] >= 0.0).all())
    if convex and len(face) == 4:
        return [tuple(face)]
    ears = None if convex else triangulated(point)
    if ears is None:
        return list(fan(face))
    return [(face[a], face[b], face[c]) for a, b, c in ears.tolist()]


def polyline_json(points: Floats, units: Units) -> dict[str, str | int]:
    """Write a closed polyline through points (n, 3) in m."""
    rhino = extra("rhino")
    ring = [rhino.Point3d(x, y, z) for x, y, z in _lengths(np.asarray(points, float), units).tolist()]
    line = rhino.Polyline.CreateFromPoints([*ring, ring[0]])
    return dict(line.ToPolylineCurve().Encode())


def point_of(where: str, data: object, units: Units) -> Floats:
    """Read a point (3,), in m; errors as `vector_of`."""
    return in_metres(where, vector_of(where, data), units)


def vector_of(where: str, data: object) -> Floats:
    """Read a vector (3,), which has no units.

    Raises
    ------
    InputError
        Not X, Y and Z, all finite.
    """
    values = [data.get(key) for key in "XYZ"] if isinstance(data, Mapping) else []
    if len(values) != 3 or not all(_finite(value) for value in values):
        raise InputError(f"{where}: expected X, Y and Z, three finite numbers")
    return np.array(values, np.float64)


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def plane_of(where: str, data: object, units: Units) -> Pose:
    """Read a plane, or a rigid transform, as what carries a body from the world's axes there.

    Raises
    ------
    InputError
        Axes that are not of length one and square to each other, or a transform that scales, shears or mirrors.
    """
    if isinstance(data, Mapping) and "M00" in data:
        rows = [[data.get(f"M{i}{k}") for k in range(4)] for i in range(4)]
        if not all(_finite(value) for row in rows for value in row):
            raise InputError(f"{where}: expected M00 .. M33, sixteen finite numbers")
        matrix = np.array(rows, np.float64)
        turn, shift = matrix[:3, :3], matrix[:3, 3]
    elif isinstance(data, Mapping):
        x, y = (vector_of(f"{where} {key}", data.get(key)) for key in ("XAxis", "YAxis"))
        turn = np.stack([x, y, np.cross(x, y)], axis=1)
        shift = vector_of(f"{where} Origin", data.get("Origin"))
    else:
        raise InputError(f"{where}: expected a plane")
    if not (np.abs(turn @ turn.T - np.eye(3)).max() <= STRAIGHT and np.linalg.det(turn) > 0.0):
        raise InputError(f"{where}: its axes are not of length one and square to each other: a stone keeps its shape")
    left, _, right = np.linalg.svd(turn)  # the nearest rotation: the digits of a document are not all there are
    return left @ right, in_metres(where, shift, units)


def plane_json(pose: Pose, units: Units) -> dict[str, dict[str, float]]:
    """Write the plane to which a pose carries the world's xy plane: what Grasshopper's Orient takes as target."""
    turn, shift = pose
    axes = {f"{name}Axis": vector_json(turn[:, k]) for k, name in enumerate("XYZ")}
    return {"Origin": point_json(shift, units), **axes}


def point_json(point: Floats, units: Units) -> dict[str, float]:
    """Write a point (3,) in m."""
    return vector_json(_lengths(np.asarray(point, float), units))


def vector_json(vector: Floats) -> dict[str, float]:
    """Write a vector (3,) as it is."""
    x, y, z = (float(value) + 0.0 for value in vector)  # no minus before a zero
    return {"X": x, "Y": y, "Z": z}
