"""Notebooks: what these functions give shows itself, as a card with its verdict, its figures and a drawing.

`card(thing, scene=True)` has a scene in 3D to turn instead of the drawing.

The classes live in rooms that know nothing of drawing, so they are not given a method to draw themselves: IPython is
told, by their names, who draws them. Nothing is loaded for that until such a thing is shown. `import cyclopean` does it
where IPython runs; `%load_ext cyclopean` does it where that comes later. Elsewhere `card(thing)` gives the HTML.
"""

from typing import TYPE_CHECKING, Any

from cyclopean.api.inputs import HasAssembly
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.api.stones import StoneCarving, StoneMatch

# Where they are defined, and what they are to a person.
SHOWN = {
    ("cyclopean.analysis.limit_analysis.result", "LimitResult"): "",
    ("cyclopean.analysis.verdict", "Result"): "",
    ("cyclopean.api.stones", "StoneCarving"): "",
    ("cyclopean.api.stones", "StoneMatch"): "",
    ("cyclopean.assembly.blocks", "Assembly"): "structure",
    ("cyclopean.design.carving.carved_wall", "CarvedWall"): "wall of carved stones",
    ("cyclopean.design.construction.sequence", "BuildSequence"): "",
    ("cyclopean.design.rubble.wall", "RubbleWall"): "rubble wall",
    ("cyclopean.design.stones.inventory", "Inventory"): "",
    ("cyclopean.design.walls.polygonal", "PolygonalWall"): "polygonal wall",
}


def card(thing: Any, *, scene: bool = False) -> str:
    """Draw what one of these functions gave, as a piece of HTML.

    Parameters
    ----------
    thing : Assembly, wall, Result, LimitResult, BuildSequence, StoneMatch, StoneCarving or Inventory
        What to show.
    scene : bool
        With a scene in 3D to turn, of about 0.8 MB, instead of a drawing.

    Returns
    -------
    str
        HTML that holds all it shows, below 100 kB without a scene; a notebook shows it by `IPython.display.HTML`.

    Raises
    ------
    InputError
        It is nothing that this package gave.

    Examples
    --------
    >>> import cyclopean
    >>> "Stable" in card(cyclopean.check(cyclopean.stack(2)))
    True
    """
    from cyclopean.analysis import LimitResult, Result
    from cyclopean.api.stones import StoneCarving, StoneMatch
    from cyclopean.assembly import Assembly
    from cyclopean.design.construction.sequence import BuildSequence
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.view import notebook

    if isinstance(thing, Result):
        return notebook.result_card(thing, scene=scene)
    if isinstance(thing, LimitResult):
        return notebook.limit_card(thing, scene=scene)
    if isinstance(thing, BuildSequence):
        return notebook.sequence_card(thing, scene=scene)
    if isinstance(thing, StoneMatch):
        return _match_card(thing, scene)
    if isinstance(thing, StoneCarving):
        return _carving_card(thing, scene)
    if isinstance(thing, Inventory):
        return notebook.inventory_card(thing.stones, thing.source, (*thing.notes, *thing.refused))
    kind = SHOWN.get((type(thing).__module__, type(thing).__name__), "structure")
    if isinstance(thing, Assembly):
        return notebook.model_card(thing, kind, scene=scene)
    if isinstance(thing, HasAssembly):
        return notebook.model_card(thing.assembly, kind, scene=scene)
    raise InputError(f"card: a {type(thing).__name__} has none; give a structure, a wall or what a function found")


def _match_card(found: "StoneMatch", scene: bool) -> str:
    """Stones as they are placed, before any is carved."""
    from cyclopean.assembly import Block
    from cyclopean.view.notebook import Told, stones_card

    match, blocks = found.match, found.assembly.blocks
    laid = [(found.stones[p.stone], p) for p in match.placements]
    bodies = [
        Block(s.id, s.vertices @ p.rotation.T + p.shift, tuple(map(tuple, s.triangles.tolist()))) for s, p in laid
    ]
    figures = [
        ("Lambda: carved off", f"{match.imposition:.3f}"),
        ("gap: left empty", f"{match.gap:.3f}"),
        ("stones placed", f"{len(match):,} of {len(found.stones):,}"),
        ("cells without a stone", f"{len(match.empty):,}"),
    ]
    cells = {int(k) for k in found.cells.block}
    held = [block for k, block in enumerate(blocks) if k not in cells]
    title = f"Stones for {found.assembly.name}"
    said = Told(title, "as placed, not yet carved", figures, found.warnings)
    return stones_card(said, bodies, held=held, scene=scene)


def _carving_card(carving: "StoneCarving", scene: bool) -> str:
    from cyclopean.assembly import Block
    from cyclopean.view.notebook import Told, stones_card

    bodies = [Block(c.stone, c.vertices, tuple(map(tuple, c.triangles.tolist()))) for c in carving.carved]
    cuts = sum(not cut.dressing for c in carving.carved for cut in c.cuts)
    figures = [
        ("Lambda: carved off", f"{carving.total.imposition:.3f}"),
        ("gap: left empty", f"{carving.total.gap:.3f}"),
        ("stones", f"{len(carving.carved):,}"),
        ("cuts", f"{cuts:,}"),
        ("of the joints touch", f"{carving.built.touching_share:.0%}"),
    ]
    held = [b for b, fixed in zip(carving.drawn.blocks, carving.fixed.tolist(), strict=True) if fixed]
    title = f"{carving.drawn.name}, carved"
    said = Told(title, "as it will be built, not checked", figures, carving.warnings)
    return stones_card(said, bodies, held=held, scene=scene)


def load_ipython_extension(shell: Any) -> None:
    """Tell IPython who draws what; `%load_ext cyclopean` calls it.

    Parameters
    ----------
    shell : IPython.core.interactiveshell.InteractiveShell
        The running one.
    """
    formatters = shell.display_formatter.formatters
    for module, name in SHOWN:
        formatters["text/html"].for_type_by_name(module, name, card)
