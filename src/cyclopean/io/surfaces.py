"""A designer's surface from a file: one open mesh, or one face of a 3DM."""

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from cyclopean.design.walls.mapped import Mapped, mapped
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, welded_body
from cyclopean.io.files import PathLike, one_line, read_bytes
from cyclopean.io.formats import FORMATS, MESH_SUFFIXES, loaded
from cyclopean.io.line_work import SIZES
from cyclopean.io.units import ASSUMED, metres, stated_units

__all__ = ["SURFACE_SUFFIXES", "read_surface", "surface_of"]

SURFACE_SUFFIXES = (".3dm", *MESH_SUFFIXES)


def read_surface(path: PathLike, units: str | None = None) -> tuple[Mapped, tuple[str, ...]]:
    """Read the face of a wall and lay it flat.

    Parameters
    ----------
    path : path
        3DM (with the extra `rhino`) with one surface or one open mesh, or a mesh file with one open mesh.
    units : str, optional
        m, cm, mm, in or ft, where the file does not say it; metres are assumed, and told.

    Returns
    -------
    surface : Mapped
    notes : tuple of str
        What was assumed, its size, its stretch, and which way it looks.

    Raises
    ------
    InputError
        A file that cannot be read, none or several faces in it, or one that no wall can lie on; one line.
    """
    shown = one_line(path)
    suffix = PurePath(shown).suffix.lower()
    if suffix not in SURFACE_SUFFIXES:
        raise InputError(f"{shown}: is no surface by its ending; save it as {', '.join(SURFACE_SUFFIXES)}")
    data = read_bytes(path)
    if suffix == ".3dm":
        bodies, warnings = loaded("rhino.read_rhino_faces")(shown, data, units)
    else:
        unit, warnings = stated_units(shown, "m" if suffix == ".glb" else "", units)
        found = [body for body in loaded(FORMATS[suffix].bodies)(shown, data) if body.faces]
        bodies = [Body(body.name, metres(body.vertices, unit), body.faces) for body in found]
    made, notes = surface_of(shown, bodies)
    size = float(np.linalg.norm(np.ptp(made.vertex, axis=0)))
    if any(ASSUMED in line for line in warnings) and not SIZES[0] <= size <= SIZES[1]:
        raise InputError(f"{shown}: does not say its units, and in metres it is {size:.3g} m across; say `units`")
    return made, (*warnings, *notes)


def surface_of(name: str, bodies: Sequence[Body]) -> tuple[Mapped, tuple[str, ...]]:
    """The surface that a single open mesh (m) is, and what laying it flat costs; errors as `read_surface`."""
    if len(bodies) != 1:
        what = f"holds {len(bodies)} faces" if bodies else "holds no surface and no mesh"
        raise InputError(f"{name}: {what}; a wall lies on one: join them into one mesh, or save one by itself")
    body = welded_body(name, bodies[0])
    try:
        made = mapped(body.vertices, body.faces)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    x, y, z = made.normal.mean(axis=0).round(2) + 0.0
    return made, (f"{name}: {made.told}; its front looks along ({x:.2f}, {y:.2f}, {z:.2f})",)
