"""`save`: whatever a function gave, into one file; the ending decides the form."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from cyclopean.api.drawings import composer, drawn
from cyclopean.api.inputs import HasAssembly, Path
from cyclopean.api.stones import StoneCarving, StoneMatch, StoneTradeoff
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly
    from cyclopean.design.construction.sequence import BuildSequence


def save(thing: "Assembly | HasAssembly | BuildSequence | Mapping[str, Any]", path: Path) -> None:
    """Write what another function gave; a file is written whole or not at all.

    ==================  ==========================================================================
    What                Endings
    ==================  ==========================================================================
    structure, wall     .json (model file); .obj, .stl, .ply, .glb (meshes)
    Result              .json (result file), .html (report)
    LimitResult         .json, .html (page)
    certificate (dict)  .json
    BuildSequence       .json, .html (page), .dot (graph)
    StoneMatch          .json (match file; stones.obj and wall.json go beside it), .html (page)
    StoneTradeoff       .json (walls and what they come to), .html (page), .svg (curve)
    StoneCarving        .csv (cut list), .json (wall as it will be built), meshes
    what has a drawing  .svg, .dxf (extra `dxf`), 1:1 in millimetres
    ==================  ==========================================================================

    Walls that were drawn, laid or settled, results, sequences, matches and carvings have a drawing.

    Parameters
    ----------
    thing : as above
        From `check`, `read_model`, `polygonal_wall`, `match`, ...
    path : path
        The file; its folder must exist.

    Raises
    ------
    InputError
        The ending is none of these, there is nothing to write, or the place cannot be written.

    Examples
    --------
    >>> import cyclopean, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(cyclopean.stack(2), pathlib.Path(folder) / "stack.json")
    ...     cyclopean.check(pathlib.Path(folder) / "stack.json").verdict
    'stable'
    """
    file = FilePath(path)
    contents = _contents(thing)
    if composer(thing) is not None:
        contents |= {f".{ending}": made for ending, made in drawn(thing).items()}
    ending = file.suffix.lower()
    if ending not in contents:
        raise InputError(f"{file}: a {type(thing).__name__} is written as {', '.join(sorted(contents))}")
    write_content(file, contents[ending]())


def write_content(file: FilePath, content: Any) -> None:
    """Write text, bytes, plain data as JSON, or what writes itself to a path."""
    from cyclopean.io.files import write_bytes, write_json, write_text

    if callable(content):
        content(file)
    elif isinstance(content, str):
        write_text(file, content)
    elif isinstance(content, bytes):
        write_bytes(file, content)
    else:
        write_json(file, content)


def _contents(thing: Any) -> dict[str, Callable[[], Any]]:
    """What is written of a thing, by ending, but for its drawing.

    Raises
    ------
    InputError
        It is nothing that this package gave.
    """
    from cyclopean import io, view
    from cyclopean.analysis import LimitResult, Result
    from cyclopean.assembly import Assembly
    from cyclopean.design.construction.sequence import BuildSequence, dot_text
    from cyclopean.io.cutlist import carved_meshes, cutlist_csv
    from cyclopean.io.matches import tradeoff_dict
    from cyclopean.view.limit_page import limit_html
    from cyclopean.view.match_page import match_html
    from cyclopean.view.tradeoff_page import tradeoff_html, tradeoff_svg

    if isinstance(thing, Result):
        return {".json": lambda: io.result_dict(thing), ".html": lambda: view.report_html(thing)}
    if isinstance(thing, LimitResult):
        return {".json": lambda: io.limit_dict(thing), ".html": lambda: limit_html(thing)}
    if isinstance(thing, BuildSequence):
        graph = dot_text(thing)
        told = {".json": lambda: io.sequence_dict(thing, graph), ".html": lambda: view.building_html(thing)}
        return told | {".dot": lambda: graph}
    if isinstance(thing, StoneMatch):
        page = thing.match, thing.stones, thing.cells, thing.rounds, thing.misfits
        return {".json": lambda: partial(_write_match, found=thing), ".html": lambda: match_html(*page)}
    if isinstance(thing, StoneTradeoff):
        found = thing.tradeoff
        told = {".json": lambda: tradeoff_dict(found), ".html": lambda: tradeoff_html(found)}
        return told | {".svg": lambda: tradeoff_svg(found)}
    if isinstance(thing, StoneCarving):
        model = _of_model(thing.assembly, lambda: carved_meshes(thing.carved))
        return {**model, ".csv": lambda: cutlist_csv(thing.carved)}
    if isinstance(thing, Assembly):
        return _of_model(thing)
    if isinstance(thing, HasAssembly):
        return _of_model(thing.assembly, wall=thing)
    if isinstance(thing, Mapping):
        return {".json": lambda: thing}
    raise InputError(f"save: a {type(thing).__name__} cannot be written; see help(cyclopean.save)")


def _of_model(
    model: "Assembly", bodies: "Callable[[], Assembly] | None" = None, wall: HasAssembly | None = None
) -> dict[str, Callable[[], Any]]:
    """A model file, with how a wall was drawn; meshes of it, or of other bodies."""
    from cyclopean import io
    from cyclopean.design.walls.polygonal import PolygonalWall

    drawing = io.drawing_dict(wall) if isinstance(wall, PolygonalWall) else None
    meshes = dict.fromkeys(io.MESH_SUFFIXES, lambda: partial(io.write_mesh, assembly=bodies() if bodies else model))
    return {".json": lambda: partial(io.write_model, assembly=model, drawing=drawing), **meshes}


def _write_match(file: FilePath, found: StoneMatch) -> None:
    """Match file, and the stones and the wall that it names, so that `carve` can read all of it again."""
    from cyclopean import io
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.io.matches import MatchFiles, match_dict

    stones, wall = file.with_name("stones.obj"), file.with_name("wall.json")
    if wall == file:
        raise InputError(f"{file}: the wall is written there; give the match another name")
    rounds = [{"Lambda": r.imposition, "gap": r.gap, "seconds": r.seconds} for r in found.rounds]
    asked = {"weight": found.match.weight, "supports": found.supports or None}
    files = MatchFiles(stones.name, wall.name, "m")
    data = match_dict(found.match, found.stones, found.cells, files, rounds, asked)
    drawing = None if found.drawn is None else io.drawing_dict(found.drawn)
    with io.together():
        io.write_stones(stones, Inventory(found.stones))
        io.write_model(wall, found.assembly, drawing=drawing)
        io.write_json(file, data)
