"""The page of a settled wall: what stands, how large, its pictures and measures, and its stones one by one."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.design.rubble.as_built import course_of
from cyclopean.texts import first_few
from cyclopean.view.drawing import still
from cyclopean.view.figures import number
from cyclopean.view.markup import POLICY, document, figure, headline, scene_figure, section, table
from cyclopean.view.masons_words import lines
from cyclopean.view.rubble_drawing import Profile, Told, courses_svg, rubble_svg

if TYPE_CHECKING:
    from cyclopean.design.rubble.wall import RubbleWall
    from cyclopean.design.stones.inventory import Inventory

LISTED = 6  # stones named one by one
SECTIONS = 3  # at equal steps along the wall
DENSITY = 2400.0  # kg/m3, where a stone has none


def settled_html(
    assembly: Assembly,
    answer: tuple[str, str],
    told: Told,
    measures: Mapping[str, str],
    aside: Sequence[tuple[str, str]] = (),
) -> str:
    """Write the page of a wall, its ground first: self-contained.

    Parameters
    ----------
    assembly : Assembly
        The wall; its stones in the order of laying.
    answer : tuple of str
        What stands, in large letters, and how large it is and what is missing, in a sentence.
    told : Told
        Numbers, roles and courses of the stones, and which do not stand by themselves.
    measures : mapping of str to str
        Their names, and what they came to.
    aside : sequence of tuple of str
        Stones that were put aside, each with the reason.

    Raises
    ------
    InputError
        There is no stone to draw.
    """
    figures = [("stones", len(assembly) - 1), ("courses", len(set(told.course.values()))), ("put aside", len(aside))]
    weight = f"{_mass(assembly)[1:].sum():,.0f}"
    body = (
        headline(assembly.name, [*figures, ("kg of stone", weight)], answer=answer),
        section("The wall", _pictures(assembly, told), _WALL),
        section("In space", scene_figure(still(assembly, np.arange(len(assembly)) == 0), assembly.name)),
        section("Course by course", figure(courses_svg(assembly, "Courses", told)) if told.course else "", _COURSES),
        section("Do not stand by themselves", _why(list(told.unsteady.items())), _UNSTEADY),
        section("Measures", table(("", ""), [(escape(name), escape(said)) for name, said in measures.items()])),
        section("Put aside", _why(aside), _ASIDE),
        section("Stone by stone", _stones(assembly, told), _STONES),
    )
    return document(f"{assembly.name}: {answer[0]}", body, word="undecided" if told.unsteady else "stable", may=POLICY)


_WALL = "Stones are numbered in the order in which they are laid. Letters mark the sections."
_COURSES = "From above, the front at the foot of each picture: the stones of a course on those below it, in pale."
_UNSTEADY = "These are outlined and hatched in red: they have to be held, pinned or bedded."
_ASIDE = "Stones that are not in the wall, by the reason."
_STONES = "In the order of laying. Sizes are of the stone as it lies: along the wall, through it, and in height."


def _pictures(assembly: Assembly, told: Told) -> str:
    """The front, the other sides, sections and the plan."""
    x = np.concatenate([block.vertices for block in assembly.blocks[1:]])[:, 0] if len(assembly) > 1 else np.zeros(1)
    cuts = np.linspace(x.min(), x.max(), SECTIONS + 2)[1:-1].round(3).tolist()
    shown = {"Front": ["front"], "Left end, back and right end": ["left", "back", "right"], "Sections": cuts}
    shown["Plan"] = ["above"]
    return "".join(
        figure(rubble_svg(assembly, f"{name} of {assembly.name}", (row,), told=told, cuts=cuts, keys="front" in row))
        for name, row in shown.items()
    )


def _why(stones: Sequence[tuple[str, str]]) -> str:
    """Stones by what is said of them, what is said of most first."""
    named: dict[str, list[str]] = {}
    for stone, why in stones:
        named.setdefault(why, []).append(stone)
    rows = [
        (escape(why), str(len(names)), escape(", ".join(names)))
        for why, names in sorted(named.items(), key=lambda one: -len(one[1]))
    ]
    return table(("Reason", ">Stones", "Which"), rows)


def _stones(assembly: Assembly, told: Told) -> str:
    """Number, id, course, mass, size and role of each stone."""
    mass = _mass(assembly)
    rows = [
        (
            str(k if told.number is None else told.number.get(block.id, "")),
            escape(block.id),
            str(told.course[block.id] + 1) if block.id in told.course else "",
            number(float(mass[k])),
            " × ".join(f"{1e3 * side:.0f}" for side in np.ptp(block.vertices, axis=0)),
            escape(told.role.get(block.id, "stone")),
        )
        for k, block in enumerate(assembly.blocks)
        if k
    ]
    return table(("No.", "Stone", ">Course", ">Mass (kg)", ">Size (mm)", "Role"), rows, elsewhere=" in the model")


def _mass(assembly: Assembly) -> Floats:
    """(n,) kg."""
    return np.asarray(assembly.densities(DENSITY) * np.abs(assembly.mass.volume))


def settled_page(wall: "RubbleWall", inventory: "Inventory") -> str:
    """Write the page of a settled wall of stones of this inventory."""
    what, missing = answer_of(wall, inventory)
    answer = what.replace(" x ", "\u00a0×\u00a0"), missing + stands_of(wall, inventory)  # lengths stay on one line
    measures = dict(said.split(": ", 1) for said in told_measures(wall))
    aside = [(inventory.stones[k].id, reason) for k, reason in wall.left_over]
    return settled_html(wall.assembly, answer, told_of(wall), measures, aside)


def told_measures(wall: "RubbleWall") -> list[str]:
    """What was measured, each as `name: figures`, in plain words."""
    m = wall.measures
    said = [] if m.masons is None else lines(m.masons)
    if m.masons is None:
        said.append(f"void: {m.void:.0%} between the faces, {m.void_tops:.0%} below the stones' own tops")
    said.append(f"overlap: at most {m.overlap:.1e} of a stone")
    if wall.settings.opening is not None and not any(laid.role == "lintel" for laid in wall.laid):
        said.append("opening: no lintel was laid, for its jambs did not both come up to its head; nothing bridges it")
    if wall.settings.dress:
        cuts = sum(len(laid.cuts) for laid in wall.laid)
        said.append(f"dressing: {cuts} cuts, Lambda {m.imposition:.3f} of the stone taken off")
    return said


def answer_of(wall: "RubbleWall", inventory: "Inventory") -> tuple[str, str]:
    """How large a wall how many stones make, and what is missing for what was asked: a sentence, or nothing."""
    m, asked = wall.measures, wall.settings
    before, falls = len(_stood(wall)), sum(not laid.stable for laid in wall.laid)
    level = m.level * m.length / m.covered  # m: in the mean over what stones cover
    height = level if asked.height is None else asked.height
    what = (
        f"{len(wall.laid)} of {len(inventory)} stones{f', on {before} that stood before,' if before else ''} make"
        f" {m.covered:.3g} x {m.thickness:.3g} x {level:.2f} m"
        + (f", but {falls} of them {'does' if falls == 1 else 'do'} not stand" if falls else "")
    )
    lengths = [f"{m.length:g} m of length"] if m.length - m.covered > m.stone / 2.0 else []
    lengths += [f"{height:g} m of height"] if height - level > m.stone / 2.0 else []
    if not lengths:
        return what, ""
    litres = (height - m.level) * m.length * m.thickness * (1.0 - m.void) * 1e3
    return what, f"For the {' and '.join(lengths)} asked about {litres:,.0f} more litres of stone are missing. "


def stands_of(wall: "RubbleWall", inventory: "Inventory") -> str:
    """Whether it stands while it is laid, and which stones do not."""
    asked = wall.settings
    falls = [inventory.stones[laid.stone].id for laid in wall.laid if not laid.stable]
    what = "It stands" if not falls else f"Without {first_few(falls, LISTED)}, which would fall, it stands"
    since = "at every stage from here on" if _stood(wall) else "at every stage"
    return f"{what} {since} with friction {asked.friction:g} and gravity leaning by {asked.lean:g} degrees."


def _stood(wall: "RubbleWall") -> list[str]:
    """Ids of the stones that stood before."""
    return [block.id for block in wall.assembly.blocks[1 : len(wall.assembly) - len(wall.laid)]]


def told_of(wall: "RubbleWall") -> Told:
    """What pictures tell of a settled wall."""
    settings = wall.settings
    ids = [block.id for block in wall.assembly.blocks[len(wall.assembly) - len(wall.laid) :]]
    stones = list(zip(ids, wall.laid, strict=True))
    course = {block.id: at for block in wall.assembly.blocks if (at := course_of(block)) is not None}
    role = {name: laid.role for name, laid in stones if laid.role != "stone"}
    unsteady = {name: laid.reason for name, laid in stones if not laid.stable}
    profile, shape = None, settings.shape()
    if settings.height is not None and not shape.corner:
        leans = shape.batter, shape.batter if shape.faces == 2 else 0.0
        profile = Profile(shape.length, shape.thickness, shape.height, leans)
    return Told(role=role, course=course, unsteady=unsteady, profile=profile)
