"""Blocks from bodies of other libraries in memory: trimesh, COMPAS, or plain pairs of vertices and faces.

They are known by what they have, so that no such library is loaded here: `vertices` and `faces` that are arrays, a
method `to_vertices_and_faces`, or a `modelgeometry` of those. A COMPAS object that holds more than one body (a model,
an assembly, a problem) is read as the file that COMPAS writes of it.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, assembly_of
from cyclopean.io.fields import label
from cyclopean.io.models import read_json
from cyclopean.io.units import check_units

__all__ = ["read_bodies"]

KINDS = "a file, an Assembly, a wall, or bodies: meshes of trimesh or COMPAS, or pairs of vertices and faces"


def read_bodies(given: Any, units: str | None = None) -> tuple[Assembly, tuple[str, ...]]:
    """Make one block of each body of a list or table, or of the pieces of a single one.

    Parameters
    ----------
    given : sequence, mapping or body
        Names are those of a mapping; in a list b0, b1, ...
    units : str, optional
        Unit of their lengths; metres where not given.

    Raises
    ------
    InputError
        Something among them is no body, or names a vertex that is not there.
    """
    unit = check_units(units or "m", "`units`")
    compas = sys.modules.get("compas.data")  # is loaded where there are objects of it
    if _shape(given) is None and hasattr(given, "__jsondump__") and compas is not None:
        return read_json("model", "model", compas.json_dumps(given).encode(), unit)
    if isinstance(given, Mapping):
        rows: list[tuple[str | None, Any]] = [(str(name), one) for name, one in given.items()]
    elif isinstance(given, Sequence) and not isinstance(given, str | bytes) and _shape(given) is None:
        rows = [(None, one) for one in given]
    else:
        rows = [(None, given)]
    if not rows:
        raise InputError("model: holds no bodies; a model needs at least one closed mesh")
    bodies = [_body(_place(k, name, len(rows)), name, one) for k, (name, one) in enumerate(rows)]
    assembly, said = assembly_of("model", "model", bodies, unit)
    return assembly, tuple(said if len(assembly.blocks) != len(bodies) else said[1:])  # the first counts the blocks


def _place(number: int, name: str | None, count: int) -> str:
    if name is not None:
        return f"model: {label(name)}"
    return "model" if count == 1 else f"model[{number}]"


def _body(where: str, name: str | None, given: Any) -> Body:
    shape = _shape(given)
    if shape is None:
        raise InputError(f"{where}: expected {KINDS}; got {type(given).__name__}")
    vertices, faces = shape
    for k, face in enumerate(faces):
        if any(i != int(i) for i in face):
            raise InputError(f"{where}: face {k} names a vertex by {face[0]!r}; expected whole numbers")
    held = {"fixed": True} if getattr(given, "is_support", None) is True else {}
    return Body(name, vertices, [tuple(int(i) for i in face) for face in faces], fields=held)


def _shape(given: Any) -> tuple[Floats, list[Any]] | None:
    """Vertices (v, 3) and faces of a body; None where it is none."""
    given = getattr(given, "modelgeometry", given)
    if callable(getattr(given, "to_vertices_and_faces", None)):
        given = given.to_vertices_and_faces()
    elif not isinstance(given, Sequence):
        given = (getattr(given, "vertices", None), getattr(given, "faces", None))
    if not isinstance(given, Sequence) or isinstance(given, str | bytes) or len(given) != 2:
        return None
    try:
        vertices = np.array(given[0], np.float64)
        faces = [list(face) for face in given[1]]
        numbers = all(isinstance(i, int | float | np.number) and np.isfinite(i) for face in faces for i in face)
    except (TypeError, ValueError):
        return None
    return (vertices, faces) if vertices.ndim == 2 and vertices.shape[1] == 3 and numbers else None
