"""`save`: whatever a function gave, into one file; the ending decides the form."""

from collections.abc import Callable, Mapping
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from cyclopean.api.inputs import HasAssembly, Path
from cyclopean.api.stones import StoneCarving, StoneMatch, StoneTradeoff
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Result
    from cyclopean.assembly import Assembly
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["save"]

Writer = Callable[[FilePath], None]


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
    writers = _writers(thing) | _drawings(thing)
    ending = file.suffix.lower()
    if ending not in writers:
        raise InputError(f"{file}: a {type(thing).__name__} is written as {', '.join(sorted(writers))}")
    writers[ending](file)


def _writers(thing: Any) -> dict[str, Writer]:
    """How a thing is written, by ending.

    Raises
    ------
    InputError
        It is nothing that this package gave.
    """
    from cyclopean.analysis import LimitResult, Result
    from cyclopean.assembly import Assembly
    from cyclopean.design.construction.sequence import BuildSequence

    if isinstance(thing, Result):
        return _of_result(thing)
    if isinstance(thing, LimitResult):
        return _of_limit(thing)
    if isinstance(thing, BuildSequence):
        return _of_sequence(thing)
    if isinstance(thing, StoneMatch):
        return {".json": lambda file: _write_match(file, thing), ".html": lambda file: _write_match_page(file, thing)}
    if isinstance(thing, StoneTradeoff):
        return _of_tradeoff(thing)
    if isinstance(thing, StoneCarving):
        return _of_carving(thing)
    if isinstance(thing, Assembly):
        return _of_model(thing, None)
    if isinstance(thing, HasAssembly):
        return _of_model(thing.assembly, thing)
    if isinstance(thing, Mapping):
        from cyclopean.io import write_json

        return {".json": lambda file: write_json(file, thing)}
    raise InputError(f"save: a {type(thing).__name__} cannot be written; see help(cyclopean.save)")


def _drawings(thing: Any) -> dict[str, Writer]:
    from cyclopean.api.drawings import as_files, composer
    from cyclopean.io import write_text

    drawing = composer(thing)

    def writer(compose: Callable[[], str]) -> Writer:
        return lambda file: write_text(file, compose())

    return {} if drawing is None else {f".{ending}": writer(made) for ending, made in as_files(drawing).items()}


def _of_model(assembly: "Assembly", wall: HasAssembly | None) -> dict[str, Writer]:
    from cyclopean import io
    from cyclopean.design.walls.polygonal import PolygonalWall

    drawing = io.drawing_dict(wall) if isinstance(wall, PolygonalWall) else None
    meshes: dict[str, Writer] = {ending: lambda file: io.write_mesh(file, assembly) for ending in io.MESH_SUFFIXES}
    return {".json": lambda file: io.write_model(file, assembly, drawing=drawing), **meshes}


def _of_result(result: "Result") -> dict[str, Writer]:
    from cyclopean import io, view

    return {
        ".json": lambda file: io.write_json(file, io.result_dict(result)),
        ".html": lambda file: io.write_text(file, view.report_html(result)),
    }


def _of_limit(result: "LimitResult") -> dict[str, Writer]:
    from cyclopean import io
    from cyclopean.view.limit_page import limit_html

    return {
        ".json": lambda file: io.write_json(file, io.limit_dict(result)),
        ".html": lambda file: io.write_text(file, limit_html(result)),
    }


def _of_sequence(sequence: "BuildSequence") -> dict[str, Writer]:
    from cyclopean import io, view
    from cyclopean.design.construction.sequence import dot_text

    return {
        ".json": lambda file: io.write_json(file, io.sequence_dict(sequence, dot_text(sequence))),
        ".html": lambda file: io.write_text(file, view.building_html(sequence)),
        ".dot": lambda file: io.write_text(file, dot_text(sequence)),
    }


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


def _write_match_page(file: FilePath, found: StoneMatch) -> None:
    from cyclopean.io import write_text
    from cyclopean.view.match_page import match_html

    write_text(file, match_html(found.match, found.stones, found.cells, found.rounds, found.misfits))


def _of_tradeoff(found: StoneTradeoff) -> dict[str, Writer]:
    from cyclopean import io
    from cyclopean.io.matches import tradeoff_dict
    from cyclopean.view.tradeoff_page import tradeoff_html, tradeoff_svg

    return {
        ".json": lambda file: io.write_json(file, tradeoff_dict(found.tradeoff)),
        ".html": lambda file: io.write_text(file, tradeoff_html(found.tradeoff)),
        ".svg": lambda file: io.write_text(file, tradeoff_svg(found.tradeoff)),
    }


def _of_carving(carving: StoneCarving) -> dict[str, Writer]:
    from cyclopean import io
    from cyclopean.io.cutlist import carved_meshes, cutlist_csv

    meshes: dict[str, Writer] = {
        ending: lambda file: io.write_mesh(file, carved_meshes(carving.carved)) for ending in io.MESH_SUFFIXES
    }
    return {
        ".csv": lambda file: io.write_text(file, cutlist_csv(carving.carved)),
        ".json": lambda file: io.write_model(file, carving.assembly),
        **meshes,
    }
