"""One page for a wall from drawing to building site: does it stand, which stones make it, in what order."""

from collections.abc import Mapping, Sequence
from html import escape
from urllib.parse import quote

from cyclopean.analysis import Result
from cyclopean.analysis.answers import BALANCED, answer
from cyclopean.design.carving.carve import Carved, Total
from cyclopean.design.carving.carved_wall import CarvedWall
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.design.stones.stone import Stone
from cyclopean.view.building import building_svg, outcome
from cyclopean.view.carving_drawing import DATUM, MEANT
from cyclopean.view.markup import document, figure, headline, section
from cyclopean.view.stone_sheet import stone_sheet_svg

_STYLE = "ul.files{columns:2;padding-left:1.1rem}ul.files li{break-inside:avoid}"
_AS_BUILT = "Finished means as carved, with the gaps that are left; the stages are those of the wall as {}."
SHOWN = 24  # stones of the inventory


def overall(built: Result, sequence: BuildSequence) -> tuple[str, str]:
    """Whether the wall stands when it is finished, in a few words, and what it needs until then, in sentences.

    `built` is what `check` says of the finished wall, which is what is built; the sequence says it of its last stage.
    """
    (word, said), (title, needs, _) = answer(built), outcome(sequence)
    if word != "Stands":
        return f"{word} when finished.", said
    return f"{title}.", needs if said in BALANCED.values() else f"{needs} {said}"


def overview_html(
    drawn: Result,
    stones: Sequence[Stone],
    carved: tuple[Sequence[Carved], Total, str, str],
    built: tuple[CarvedWall, Result],
    sequence: BuildSequence,
    files: Mapping[str, str],
) -> str:
    """Write the page: self-contained, without a script.

    `drawn` is what `check` says of the wall as drawn, `built` the wall as it will be built and what `check` says of
    that; `carved` are the stones in their cells, what they come to, and the drawings before and after. `stones` is
    the inventory; `files` names what lies beside the page, and what each file holds.
    """
    cuts, whole, before, after = carved
    (wall, result), (title, said) = built, overall(built[1], sequence)
    shown = "drawn" if sequence.assembly is drawn.assembly else "carved"
    figures = [
        ("stones", len(cuts)),
        ("Lambda: carved off", f"{whole.imposition:.3f}"),
        ("gap: left empty", f"{whole.gap:.3f}"),
        ("stages", len(sequence.steps)),
    ]
    stock = (
        f"{len(stones)} stones of {1e3 * sum(s.volume for s in stones):,.0f} litres were at hand, {len(cuts)} of them"
    )
    links = "".join(
        f'<li><a href="{quote(file, safe="/")}">{escape(file)}</a>: {escape(what)}</li>' for file, what in files.items()
    )
    body = (
        headline(drawn.assembly.name, figures, answer=(title.removesuffix("."), f"{said} {_AS_BUILT.format(shown)}")),
        section("Which stones", figure(stone_sheet_svg(stones, most=SHOWN)), f"{stock} are used."),
        section("Where they go", figure(before) + figure(after), _carving(whole, wall)),
        section("How it is built", figure(building_svg(sequence)), _building(sequence)),
        section("Files beside this page", f'<ul class="files">{links}</ul>'),
    )
    return document(drawn.assembly.name, body, word=result.verdict, style=_STYLE)


def _carving(whole: Total, wall: CarvedWall) -> str:
    return (
        f"{MEANT} Above as placed, hatched what comes off; below as carved:"
        f" {1e3 * (whole.stone_volume - whole.volume):,.0f} of {1e3 * whole.stone_volume:,.0f} litres. Clifford and"
        f" McGee measured about {DATUM:g} on their Cyclopean Cannibalism wall (ACADIA 2018). The stones touch over"
        f" {100.0 * wall.touching_share:.0f} % of the joints."
    )


def _building(sequence: BuildSequence) -> str:
    count = len(sequence.steps)
    held = sum(step.verdict != "stable" and step.propped == "stable" for step in sequence.steps)
    stable = sum(step.verdict == "stable" for step in sequence.steps)
    props = f", {held} more with props" if held else ""
    return f"{stable} of {count} stages are stable{props}; each verdict has a certificate of its own."
