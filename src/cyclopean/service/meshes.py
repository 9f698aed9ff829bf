"""Meshes of a request as blocks of a model, or as stones; and back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block, Contacts, mended
from cyclopean.errors import InputError
from cyclopean.geometry.polyhedra import face_triangles
from cyclopean.io import json_text
from cyclopean.io.bodies import Body, assembly_of
from cyclopean.io.fields import first_repeat, label, mapping, parsed
from cyclopean.io.files import one_line
from cyclopean.io.model_json import SCHEMA, model_dict, read_document
from cyclopean.io.rhino_json import Pose
from cyclopean.service.parameters import Context, Input

SEEN = 1e-3  # m: so large is drawn what stands for a point
ROUND = np.array([[1.0, 0.0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]])

BLOCKS = (
    Input("Blocks", "B", "Mesh", "Closed meshes, one for each block.", "list", optional=True),
    Input("Names", "N", "Text", "Names of the blocks, in their order; b0, b1, ... where not given.", "list",
          optional=True),
    Input("Fixed", "F", "Boolean", "Which blocks are held, in their order; where not given, those that touch the"
          " lowest point.", "list", optional=True),
    Input("Model", "M", "Text", "A model in JSON instead of Blocks, as other components give it: its contacts are"
          " taken as they are.", optional=True),
)  # fmt: skip
STONES = Input("Stones", "S", "Mesh", "Found stones: closed meshes, wherever they lie.", "list", optional=True)
FOLDER = (
    Input("Folder", "D", "Text", "Folder of stones instead of Stones, if the server was started with --allow-folders.",
          optional=True),
    Input("Folder Units", "U", "Text", "Unit of the lengths in that folder: m, cm, mm, in or ft.", default="m"),
)  # fmt: skip

Given = Mapping[str, Any]


def model_of(given: Given) -> tuple[Assembly, tuple[str, ...]]:
    """The model that the inputs `BLOCKS` say, and what should be known of it.

    Raises
    ------
    InputError
        Neither meshes nor a model, or both; a list that is not as long as that of the blocks; a model that is none.
    """
    document = given["Model"]
    if document is None:
        return blocks_of("Blocks", given["Blocks"], given["Names"], given["Fixed"])
    for name in ("Blocks", "Names", "Fixed"):
        if given[name]:
            raise InputError(f"{name}: connect either {name} or Model; the model says it")
    return model_in("Model", document)


def model_in(name: str, text: str) -> tuple[Assembly, tuple[str, ...]]:
    """The model that a text says, and what should be known of it; `name` is the input's.

    Raises
    ------
    InputError
        A model that is none.
    """
    data = mapping(parsed(name, text), name)
    if data.get("schema") != SCHEMA:
        raise InputError(f'{name}: is not a model: expected "schema": "{SCHEMA}"')
    return read_document(name, "model", data, None)


def blocks_of(
    what: str, bodies: Sequence[Body], names: Sequence[str] = (), fixed: Sequence[bool] = ()
) -> tuple[Assembly, tuple[str, ...]]:
    """Blocks of meshes; one mesh alone may hold them all, in pieces.

    Meshes are mended.

    Returns
    -------
    assembly : Assembly
        Contacts are to be detected.
    warnings : tuple of str

    Raises
    ------
    InputError
        No mesh, or a list that does not fit.
    """
    if not bodies:
        raise InputError(f"{what}: nothing is connected; closed meshes are needed, one for each block")
    found, said = assembly_of(what, "model", bodies, "m")
    warnings = list(said if len(found) != len(bodies) else said[1:])  # the first one counts the blocks
    blocks = list(found.blocks)
    for name, values in (("Names", names), ("Fixed", fixed)):
        if values and len(values) != len(blocks):
            raise InputError(
                f"{name}: {len(values)} values for {len(blocks)} blocks; give one for each, in their order"
            )
    if fixed and not any(fixed):
        raise InputError("Fixed: no block is held; a structure stands on something")
    if twice := first_repeat(names):
        raise InputError(f"Names: {label(twice)} stands twice; blocks are told apart by their names")
    for k, name in enumerate(names):
        blocks[k] = replace(blocks[k], id=one_line(name) or f"b{k}")
    for k, held in enumerate(fixed):
        blocks[k] = replace(blocks[k], fixed=held)
    sound = mended(Assembly(tuple(blocks), name="model"))
    return sound.assembly, (*warnings, *(f"{what}: {line}" for line in sound.said))


def stones_of(given: Given, context: Context) -> Any:
    """The inventory that the inputs `STONES` and `FOLDER` say.

    Stones keep their places in the list: one that cannot be used is refused, not left out.

    Returns
    -------
    Inventory

    Raises
    ------
    InputError
        Neither stones nor a folder, or both; a mesh that is no solid; a folder that may not be read.
    """
    from cyclopean.design.stones.inventory import Inventory

    bodies, folder = given["Stones"], given.get("Folder")
    if bodies and folder:
        raise InputError("Folder: connect either Stones or Folder")
    if folder:
        return _from_folder(folder, given["Folder Units"], context.folder)
    if not bodies:
        raise InputError("Stones: nothing is connected; closed meshes are needed, one for each stone")
    notes: list[str] = []
    stones = tuple(_stone(f"Stones[{k}]", f"s{k}", body, notes) for k, body in enumerate(bodies))
    return Inventory(stones, tuple(notes))


def _stone(where: str, name: str, body: Body, notes: list[str]) -> Any:
    from cyclopean.design.stones.stone import stone_of
    from cyclopean.geometry.mesh_repair import repair

    corners = face_triangles(body.vertices, body.faces)
    if not (0 <= corners.min() and corners.max() < len(body.vertices)):
        raise InputError(f"{where}: a face names a vertex that is not there; there are {len(body.vertices)}")
    mended = repair(body.vertices, corners)
    if len(mended.pieces) != 1:
        count = len(mended.pieces)
        raise InputError(f"{where}: {f'is in {count} pieces; a stone is one' if count else mended.done[-1]}")
    piece = mended.pieces[0]
    if piece.fault:
        raise InputError(f"{where}: {piece.fault}; a stone is a closed mesh")
    own = [note for note in (*mended.done, *piece.done) if "weld" not in note]  # meshes of Rhino's are never welded
    notes += [f"{where}: {'; '.join(own)}"] if own else []
    return stone_of(name, piece.vertices, piece.triangles)


def _from_folder(text: str, units: str, allowed: Path | None) -> Any:
    from cyclopean.io.stones import read_stones
    from cyclopean.io.units import check_units

    if allowed is None:
        raise InputError("Folder: this server reads no folders; start it with --allow-folders DIR, or connect Stones")
    check_units(units, "Folder Units")
    root = allowed.resolve()
    try:
        place = (root / text).resolve()
    except (OSError, ValueError, RuntimeError):  # a null character, a loop of links
        raise InputError(f"Folder: '{one_line(text, 80)}' is no path") from None
    if not place.is_relative_to(root):
        raise InputError(f"Folder: '{one_line(text, 80)}' does not lie in the folder that this server may read")
    inventory, said = read_stones(place, units, within=root)
    return replace(inventory, notes=(*said, *inventory.notes))


def block_meshes(blocks: Sequence[Block]) -> list[tuple[Floats, Sequence[Sequence[int]]]]:
    """Vertices and faces of blocks, as outputs want them."""
    return [(block.vertices, block.faces) for block in blocks]


def moved(stone: Any, pose: Pose) -> tuple[Floats, list[tuple[int, ...]]]:
    """Vertices (m) and triangles of a stone where a pose carries it."""
    turn, shift = pose
    return stone.vertices @ turn.T + shift, [tuple(t) for t in stone.triangles.tolist()]


def contact_curves(contacts: Contacts) -> list[Floats]:
    """Corners (m) of each contact; of a point three about it, as a curve has a length."""
    frame = contacts.frame
    curves = [contacts.polygon(k) for k in range(len(contacts))]
    for k in np.flatnonzero(contacts.at_points).tolist():
        curves[k] = curves[k] + SEEN * ROUND @ frame[k, 1:]
    return curves


def contact_names(assembly: Assembly, contacts: Contacts) -> list[list[str]]:
    """Names of the two blocks of each contact."""
    ids = [block.id for block in assembly.blocks]
    return [[ids[a], ids[b]] for a, b in zip(contacts.a.tolist(), contacts.b.tolist(), strict=True)]


def model_text(assembly: Assembly) -> str:
    """A model as JSON text."""
    return json_text(model_dict(assembly)).strip()
