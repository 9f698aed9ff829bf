"""How a polygonal wall was drawn, kept in its model file so that it can be drawn again with its seeds moved.

The optional key "drawing" of `cyclopean.model/1` holds what `design.walls` makes the blocks from: the settings of the
pattern, the seeds as they were in the end (relaxed, improved, negotiated), the surface, the thickness, and how joints
that are not flat were treated. Lengths in it are metres, whatever the units of the model:

    {"schema": "cyclopean.drawing/1",
     "settings": {"width": 3.0, "height": 1.8, ..., "openings": [{...}], "quoins": {...}, "coping": {...},
                  "base": [[u, v], ...], "outline": [[u, v], ...]},
     "seeds": {"point": [[i, j], ...], "weight": [...]},              // in spacings of the grid, and mean cells
     "surface": {"kind": "cylinder", "radius": 5.0, "middle": 1.5},
     "depth": 0.2, "batter": 0.0, "density": null, "mu": null, "warped": "auto"}

A wall that was read from a drawing of its joints has no seeds but

     "cells": {"vertex": [[u, v], ...], "rings": [[0, 1, 2], ...], "foot": [[u, v], ...]},

with the corners of each stone, counter-clockwise, and the line of the ground where that is not level; of its settings
the courses count, and stones lie as they are drawn.

A surface that was read from a file is the mesh that was laid flat, with the place of each corner in the plane:

     "surface": {"kind": "mesh", "vertex": [[x, y, z], ...], "normal": [[x, y, z], ...], "triangle": [[0, 1, 2], ...],
                 "uv": [[u, v], ...], "boundary": [0, 1, ...]}

A key that is absent has its default. Ground that is a function of u is written as the points of its line. Surfaces made
of functions cannot be written; such a wall has no drawing.

The drawing describes the blocks beside it. Where it does not any more, because the file was edited, it is stale.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.design.walls.dressing import Coping, Quoins, foot_line
from cyclopean.design.walls.joints import Masonry
from cyclopean.design.walls.line_work import pattern_of_cells
from cyclopean.design.walls.mapped import Mapped
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings, Seeds, draw_from
from cyclopean.design.walls.polygonal import PolygonalWall, laid_wall
from cyclopean.design.walls.surfaces import (
    Cone,
    Cylinder,
    HeightGrid,
    Plane,
    Sphere,
    Surface,
    Thickness,
    Twist,
    refuse_folds,
)
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision, subdivide
from cyclopean.io.fields import array, density, faces, found, label, mapping, number, optional, read_json, text
from cyclopean.io.files import PathLike, one_line, picked, plain
from cyclopean.io.model_json import SCHEMA, read_document

__all__ = ["DRAWING", "drawing_dict", "read_drawing", "wall_of"]

Made = TypeVar("Made")

DRAWING = "cyclopean.drawing/1"
SAME = 1e-9  # of the model's size: corners that are nearer than this to those of the drawing are as drawn
MOST = 50_000  # seeds, courses, columns, voussoirs: more are not drawn

_SURFACES: dict[str, Callable[..., Surface]] = {
    "cone": Cone,
    "cylinder": Cylinder,
    "heights": HeightGrid,
    "mesh": Mapped,
    "plane": Plane,
    "sphere": Sphere,
    "twist": Twist,
}
_DRAWING = ("batter", "cells", "density", "depth", "mu", "schema", "seeds", "settings", "surface", "warped")


def drawing_dict(wall: PolygonalWall) -> dict[str, Any] | None:
    """Return how a wall was drawn, as the "drawing" of a model file; None where that cannot be written.

    That is so where the surface is made of functions.
    """
    seeds, settings = wall.pattern.seeds, wall.pattern.settings
    kind = next((kind for kind, made in _SURFACES.items() if type(wall.surface) is made), None)
    if kind is None:
        return None
    base = settings.base
    if callable(base):
        ground = foot_line(base, None, settings.width, max(8, 3 * settings.columns))
        base = None if ground is None else ground.tolist()
    if seeds is not None:
        grown: dict[str, Any] = {"seeds": {"point": seeds.point.tolist(), "weight": seeds.weight.tolist()}}
    else:
        cells, foot = wall.pattern.subdivision, plain(wall.pattern.foot)
        grown = {"cells": {"vertex": cells.vertex.tolist(), "rings": cells.rings(), "foot": foot}}
    return {
        "schema": DRAWING,
        "settings": _fields(settings) | {"base": plain(base)} | ({"max_bed": 90.0} if seeds is None else {}),
        **grown,
        "surface": {"kind": kind, **_fields(wall.surface)},
        "depth": float(wall.thickness.depth),
        "batter": float(wall.thickness.batter),
        "density": wall.assembly.blocks[0].density,
        "mu": wall.masonry.mu,
        "warped": wall.masonry.warped,
    }


def read_drawing(path: PathLike) -> tuple[PolygonalWall | None, tuple[str, ...]]:
    """Draw the wall of a model file again, from its "drawing".

    Parameters
    ----------
    path : path
        A `cyclopean.model/1` file.

    Returns
    -------
    wall : PolygonalWall or None
        None where the file says nothing of how it was drawn, or where its blocks are not those of the drawing.
    warnings : tuple of str
        Why there is none though the file has a drawing, and what of the file is not in the drawing.

    Raises
    ------
    InputError
        The file cannot be read, or its drawing is not one.
    """
    shown = one_line(path)
    if os.path.splitext(os.fspath(path))[1].lower() not in ("", ".json", ".tmp", ".txt"):
        return None, ()
    document = read_json(path)
    if not isinstance(document, dict) or document.get("schema") != SCHEMA or document.get("drawing") is None:
        return None, ()
    model, _ = read_document(shown, "model", document, None if "units" in document else "m")
    wall = wall_of(document["drawing"], f"{shown}: drawing")
    if (changed := _changed(model, wall.assembly)) is not None:
        return None, (f"{shown}: its drawing is stale: {changed}; draw the wall again (make polygonal)",)
    left = f"{shown}: the drawing holds no loads; a wall that is drawn again has none"
    return wall, (left,) if model.loads else ()


def wall_of(value: Any, where: str = "drawing") -> PolygonalWall:
    """Draw the wall that a parsed "drawing" describes.

    Raises
    ------
    InputError
        It is not a `cyclopean.drawing/1`, or describes a wall that cannot be drawn.
    """
    row = _known(mapping(value, where), _DRAWING, where)
    if row.get("schema") != DRAWING:
        raise InputError(f'{where}: its schema is {found(row.get("schema"))}; expected "{DRAWING}"')
    for key in ("settings", "cells" if "cells" in row else "seeds", "surface"):
        if key not in row:
            raise InputError(f'{where}: has no "{key}"')
    heavy = optional(row.get("density"), f"{where}: density", density)
    mu = optional(row.get("mu"), f"{where}: mu", number)
    settings = _settings(row["settings"], f"{where}: settings")
    grown = _cells(row["cells"], f"{where}: cells") if "cells" in row else _seeds(row["seeds"], f"{where}: seeds")
    surface = _surface(row["surface"], f"{where}: surface")
    depth, batter = (number(row.get(key, usual), f"{where}: {key}") for key, usual in (("depth", 0.2), ("batter", 0.0)))
    try:
        thickness = Thickness(depth, batter)
        refuse_folds(surface, thickness, settings.width, settings.height)
        if isinstance(grown, Seeds):
            pattern = draw_from(grown, settings)
        else:
            pattern = pattern_of_cells(*grown, settings.courses, settings.max_bed)
        return laid_wall(pattern, surface, thickness, Masonry(heavy, mu, row.get("warped", "auto")))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _fields(thing: Any) -> dict[str, Any]:
    """What a dataclass is made from, ready for JSON; functions are left out."""
    return picked(thing, *(f.name for f in fields(thing) if f.init and not callable(getattr(thing, f.name))))


def _known(row: dict[str, Any], names: tuple[str, ...], where: str) -> dict[str, Any]:
    """The row, if it has no other keys: one that is not understood would draw another wall."""
    for key in row:
        if key not in names:
            raise InputError(f"{where}: unknown key {label(key)}; expected {', '.join(names)}")
    return row


def _built(made: Callable[..., Made], row: Mapping[str, Any], where: str) -> Made:
    """The dataclass of these fields, each a number, true or false, a text or null."""
    names = tuple(f.name for f in fields(made) if f.init)  # type: ignore[arg-type]
    known = _known(dict(row), names, where)
    for key, value in known.items():
        if isinstance(value, int | float) and not isinstance(value, bool):
            number(value, f"{where}: {key}")
        if isinstance(value, int) and not value <= MOST:
            raise InputError(f"{where}: {key} = {value} is more than {MOST:,}; ask for fewer")
    try:
        return made(**known)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    except TypeError:  # a number is missing, or is text
        raise InputError(f"{where}: needs numbers for {', '.join(names)}") from None


def _settings(value: Any, where: str) -> PatternSettings:
    row = {"max_bed": 90.0} | dict(mapping(value, where))  # of files from before there was one: as drawn
    openings = array(row.get("openings", []), f"{where}: openings")
    row["openings"] = tuple(
        _built(Opening, mapping(opening, f"{where}: openings[{k}]"), f"{where}: openings[{k}]")
        for k, opening in enumerate(openings)
    )
    for key, made in (("quoins", Quoins), ("coping", Coping)):
        if row.get(key) is not None:
            row[key] = _built(made, mapping(row[key], f"{where}: {key}"), f"{where}: {key}")
    for key in ("base", "outline"):
        if row.get(key) is not None:
            row[key] = tuple((u, v) for u, v in _numbers(row[key], f"{where}: {key}", 2))
    return _built(PatternSettings, row, where)


def _seeds(value: Any, where: str) -> Seeds:
    row = _known(mapping(value, where), ("point", "weight"), where)
    point = _numbers(row.get("point"), f"{where}: point", 2)
    weight = [number(w, f"{where}: weight[{k}]") for k, w in enumerate(array(row.get("weight"), f"{where}: weight"))]
    if not 0 < len(point) <= MOST:
        raise InputError(f"{where}: {len(point)} of them; a wall is drawn from 1 to {MOST:,}")
    if len(weight) != len(point):
        raise InputError(f"{where}: {len(point)} points but {len(weight)} weights; give one to each")
    return Seeds(np.array(point), np.array(weight))


def _cells(value: Any, where: str) -> tuple[Subdivision, Floats | None]:
    """Cells, and the line of the ground where that is not level."""
    row = _known(mapping(value, where), ("vertex", "rings", "foot"), where)
    vertex = np.array(_numbers(row.get("vertex"), f"{where}: vertex", 2)).reshape(-1, 2)
    rings = faces(row.get("rings"), f"{where}: rings", len(vertex))
    if not 0 < len(rings) <= MOST:
        raise InputError(f"{where}: {len(rings)} of them; a wall is drawn with 1 to {MOST:,}")
    foot = None if row.get("foot") is None else np.array(_numbers(row["foot"], f"{where}: foot", 2))
    cells = subdivide(vertex, rings)
    if foot is not None and not (len(foot) > 1 and np.all(np.diff(foot[:, 0]) > 0.0)):
        raise InputError(f"{where}: foot: its points must be at least two, each to the right of the last")
    if not np.all(cells.areas() > 0.0):
        raise InputError(f"{where}: rings: a ring runs clockwise, or encloses nothing")
    return cells, foot


def _surface(value: Any, where: str) -> Surface:
    row = dict(mapping(value, where))
    kind = text(row.pop("kind", None), f"{where}: kind")
    if kind not in _SURFACES:
        raise InputError(f"{where}: kind: expected {', '.join(_SURFACES)}, found {label(kind)}")
    if kind == "heights":
        relief = array(row.get("relief"), f"{where}: relief")
        row["relief"] = np.array(_numbers(relief, f"{where}: relief", len(relief[0]) if relief else 0))
    if kind == "mesh":
        for key, width in (("vertex", 3), ("normal", 3), ("uv", 2), ("triangle", 3)):
            row[key] = np.array(_numbers(row.get(key), f"{where}: {key}", width)).reshape(-1, width)
        ring = array(row.get("boundary"), f"{where}: boundary")
        row["boundary"] = [number(x, f"{where}: boundary[{k}]") for k, x in enumerate(ring)]
    return _built(_SURFACES[kind], row, where)


def _numbers(value: Any, where: str, width: int) -> list[list[float]]:
    """Rows of `width` numbers."""
    rows = []
    for k, row in enumerate(array(value, where)):
        if len(array(row, f"{where}[{k}]")) != width:
            raise InputError(f"{where}[{k}] must hold {width} numbers, found {len(row)}")
        rows.append([number(x, f"{where}[{k}][{m}]") for m, x in enumerate(row)])
    return rows


def _changed(model: Assembly, drawn: Assembly) -> str | None:
    """What of a model is not as drawn; None where everything is."""
    if len(model) != len(drawn):
        return f"it has {len(model)} blocks, and the drawing makes {len(drawn)}"
    reach = SAME * float(np.linalg.norm(np.ptp(drawn.mesh.vertex, axis=0)))
    for one, other in zip(model.blocks, drawn.blocks, strict=True):
        if (one.id, one.faces, one.vertices.shape) != (other.id, other.faces, other.vertices.shape):
            return f"block {label(one.id)} is not as drawn"
        if not np.all(np.abs(one.vertices - other.vertices) <= reach):
            return f"block {label(one.id)} has other corners than drawn"
        if one.density != other.density or one.fixed != other.fixed:
            return f"block {label(one.id)} has another density or support than drawn"
    joints, wanted = model.contacts, drawn.contacts
    if joints is not None and wanted is not None:
        same = len(joints) == len(wanted) and np.array_equal(joints.mu, wanted.mu, equal_nan=True)
        if not (same and np.array_equal(joints.a, wanted.a) and np.array_equal(joints.b, wanted.b)):
            return "its contacts are not as drawn"
    return None
