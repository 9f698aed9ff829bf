"""`ashlar` and `pack`: walls of sawn stones."""

import re
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args

from cyclopean.api import wall_options
from cyclopean.api.site import SiteOptions, site_folder, site_sheets
from cyclopean.cli.command import argument, command, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.site import written_site
from cyclopean.cli.terminal import long_work, warn
from cyclopean.design.ashlar.best_fit import LEAST_SCORE, Method, Slots
from cyclopean.design.ashlar.planning import AshlarSettings
from cyclopean.errors import InputError
from cyclopean.options import option
from cyclopean.texts import choice, number, whole
from cyclopean.texts import scores as read_scores

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly
    from cyclopean.design.ashlar.best_fit import Packed
    from cyclopean.design.ashlar.stock import Slab
    from cyclopean.design.ashlar.wall import AshlarWall

STONE = re.compile(r"(?P<length>[^x*]+)x(?P<height>[^x*]+)x(?P<depth>[^x*]+)(\*(?P<count>[^x*]+))?")
UNIT = "is --stone-length now; --units says what lengths are in"

Stones: TypeAlias = Annotated[
    str | None, argument("STONES", "Stock list (CSV), or a folder or file of sawn stones.", source=True)
]
Written: TypeAlias = Annotated[
    Files,
    written(
        "report",
        models="out",
        out=("MODEL", "Required: Model file to write."),
        cutlist=("F", "Write the cut list (CSV)."),
        left=("F", "Write what is left in store (CSV)."),
        drawing=("F", "Draw the face and the plans of two courses."),
        display=("MODEL", "Also write the stones as sawn, joints open."),
        json=("F|-", "Write placements and figures; - prints them and nothing else."),
    ),
]


@dataclass(frozen=True, slots=True)
class Sawn:
    """Stones beside those of a file, and what of the wall is said by a text of its own."""

    stone: tuple[str, ...] = option(
        (), "N stones of this length, height, depth (m); repeatable.", "texts", metavar="LxHxD[*N]"
    )
    course: str = option(
        "fixed", "One height (m) [that of most stones], or bins, the tallest below.", metavar="fixed[:H]|bins",
        word="courses",
    )  # fmt: skip
    openings: tuple[str, ...] = option(
        (), "Left jamb, sill, clear width and height (m), under a lintel; repeatable.", "texts", metavar="X,Z,W,H",
        word="opening",
    )  # fmt: skip
    units: str | None = option(None, "Unit of the lengths in mesh files, such as mm.", metavar="U")
    strict: bool = option(False, "A stone that cannot be used is an error.", "flag")


@dataclass(frozen=True, slots=True)
class Packing:
    """How stones are chosen by what fits."""

    method: str = option("best", "Slot by slot the best or first fit, or all together.", choices=get_args(Method))
    slots: str | None = option(
        None, "At the lengths of the stones, or of the bond [free, if it can be].", choices=get_args(Slots)
    )
    scores: str | None = option(
        None, "What each fit counts [length=0.4,depth=0.2,height=0.2,aspect=0.2].", metavar="NAME=W,..."
    )
    least_score: float = option(
        LEAST_SCORE, "Where no stone scores this, the first that fits is taken.", "number", metavar="S", least=0.0,
        most=1.0,
    )  # fmt: skip
    compare: bool = option(False, "Tell what the other methods make of the slots.", "flag")


@command(fields={"opening": "openings"}, unit=UNIT)
def ashlar(
    settings: AshlarSettings,
    stones: Stones = None,
    sawn: Sawn = Sawn(),
    site: SiteOptions = SiteOptions(),
    files: Written = Files({}),
) -> int:
    """Build a wall of sawn stones in a bond."""
    from cyclopean.design.ashlar import wall as room

    site_folder(site)
    settings = _asked(settings, sawn)
    with long_work("building a wall of sawn stones"):
        slabs, said = _slabs(stones, sawn)
        wall = room.ashlar(settings, slabs)
    return _end(wall, said, files, site, {"method": "first", "slots": "bond"}, [])


@command(fields={"opening": "openings"}, unit=UNIT, weights="is --scores now; weights are those of forces, as in check")
def pack(
    settings: AshlarSettings,
    stones: Stones = None,
    fit: Packing = Packing(),
    sawn: Sawn = Sawn(),
    site: SiteOptions = SiteOptions(),
    files: Written = Files({}),
) -> int:
    """Build a wall of the sawn stones that fit best."""
    from cyclopean.design.ashlar import best_fit as room

    site_folder(site)
    settings = _asked(settings, sawn)
    known = settings.bond != "running" or settings.through > 0 or fit.method == "global"
    where = fit.slots or ("bond" if known else "free")
    names = tuple(asdict(room.Weights()))
    weights = room.Weights(**({} if fit.scores is None else read_scores("`scores`", fit.scores, names)))
    with long_work("packing a wall of sawn stones") as stage:
        options: dict[str, Any] = {"weights": weights, "least_score": fit.least_score}
        slabs, said = _slabs(stones, sawn)
        done = room.pack(settings, slabs, method=fit.method, slots=where, **options)
        tried: list[Packed] = []
        for other in get_args(Method) if fit.compare else ():
            stage(other)
            tried.append(room.pack(settings, slabs, method=other, slots="bond", **options))
    asked = {
        "method": fit.method, "slots": where, "weights": tuple(asdict(weights).values()),
        "least_score": fit.least_score, "mean_score": done.mean, "poor": done.poor,
        "compare": [_compared(one) for one in tried],
    }  # fmt: skip
    lines = [f"  score    {done.mean:.3f} in the mean; {done.poor} of {len(done.wall.laid)} below {fit.least_score:g}"]
    lines += [f"  {one.method:<8} in the slots of the bond: {_told(one)}" for one in tried]
    return _end(done.wall, said, files, site, asked, lines)


def _asked(settings: AshlarSettings, sawn: Sawn) -> AshlarSettings:
    """The settings with heights of courses and openings as typed.

    Raises
    ------
    InputError
        Names the option.
    """
    kind, colon, high = sawn.course.partition(":")
    choice("`course`", kind, ("fixed", "bins"))
    if colon and kind == "bins":
        raise InputError(f"`course`: '{sawn.course}' should be fixed, fixed:H or bins")
    height = number("`course`", high) if colon else None
    parsed = tuple(wall_options.opening("`openings`", text) for text in sawn.openings)
    return replace(settings, course=height, bins=kind == "bins", openings=parsed)


def _slabs(stones: str | None, sawn: Sawn) -> "tuple[list[Slab], tuple[str, ...]]":
    """The stock, from wherever it is given, and what is to be said of it.

    Raises
    ------
    InputError
        There is none, it cannot be read, or nothing in it is a sawn stone.
    """
    from cyclopean import io
    from cyclopean.design.ashlar.stock import slabs_of
    from cyclopean.io.stocklist import MOST, read_stocklist

    table = stones is None or stones.lower().endswith(".csv")
    if table and sawn.units is not None:
        raise InputError.of("units", None, "a stock list and `stone` are in metres; leave it out")
    if stones is None and not sawn.stone:
        raise InputError("STONES: no stock given; name a stock list or stones, or use `stone`")
    found: list[Slab] = []
    warnings: tuple[str, ...] = ()
    if stones is not None and table:
        found += read_stocklist(stones)
    elif stones is not None:
        inventory, said = io.read_stones(stones, sawn.units, sawn.strict)
        boxes, notes = slabs_of(inventory.stones)
        if not boxes or (sawn.strict and notes):
            raise InputError(f"{stones}: {notes[0] if boxes else 'none of its stones is a box'}")
        warnings = (*said, *inventory.notes, *notes)
        found += boxes
    for text in sawn.stone:
        found += _typed(text, len(found))
        if len(found) > MOST:
            raise InputError(f"`stone`: more than {MOST:,} stones; give fewer")
    return found, warnings


def _typed(text: str, before: int) -> "list[Slab]":
    from cyclopean.io.stocklist import MOST, repeated

    parts = STONE.fullmatch(text)
    if parts is None:
        raise InputError(f"`stone`: '{text}' should be LxHxD or LxHxD*N, such as 0.3x0.15x0.2*30")
    length, high, deep = (number("`stone`", parts[name]) for name in ("length", "height", "depth"))
    count = 1 if parts["count"] is None else whole("`stone`", parts["count"])
    if not (min(length, high, deep) > 0.0 and 0 < count <= MOST):
        raise InputError(f"`stone`: '{text}' should have sizes above 0, and be 1 to {MOST:,} times")
    return repeated("", (length, deep, high), count, before)


def _compared(one: "Packed") -> dict[str, Any]:
    out = one.wall.readout
    used = sum(slab.volume for slab in one.wall.stock.slabs) - out.left
    return {
        "method": one.method, "mean_score": one.mean, "poor": one.poor, "blocks": out.blocks, "cuts": out.cuts,
        "coverage": out.coverage, "used": used, "offcuts": out.off, "lost": out.lost,
    }  # fmt: skip


def _told(one: "Packed") -> str:
    out = one.wall.readout
    return (
        f"score {one.mean:.3f}, {out.cuts} cuts, {len(one.wall.stock.slabs) - out.leftover} slabs used,"
        f" {1e3 * out.off:.1f} L of offcuts, {1e3 * out.lost:.1f} L lost"
    )


def _end(
    wall: "AshlarWall", said: tuple[str, ...], files: Files, site: SiteOptions, asked: dict[str, Any], lines: list[str]
) -> int:
    """Write everything, and say what came out."""
    from cyclopean import io
    from cyclopean.api.drawings import drawn, paged
    from cyclopean.io.stocklist import ashlar_cutlist_csv, ashlar_dict, left_csv

    data = ashlar_dict(wall, asked)
    with long_work("drawing sheets") as stage:
        sheets = site_sheets(wall, site, progress=stage)
    with io.together():
        files.write({
            "out": lambda: partial(io.write_model, assembly=wall.assembly),
            "cutlist": lambda: ashlar_cutlist_csv(wall),
            "left": lambda: left_csv(wall),
            "display": lambda: partial(io.write_exchange, assembly=_as_sawn(wall)),
            "json": lambda: data,
            **drawn(wall),
            **paged(wall, (*said, *wall.notes)),
        })  # fmt: skip
        site_line = written_site(site, sheets)
    for note in (*said, *wall.notes):
        warn(note)
    files.tell(data, [*_lines(wall), *lines, *site_line, *files.line()])
    return 0


def _as_sawn(wall: "AshlarWall") -> "Assembly":
    from cyclopean.assembly import Assembly, Contacts
    from cyclopean.design.ashlar.wall import open_stones

    return Assembly(open_stones(wall), Contacts.of([], []), name=f"{wall.assembly.name}, as sawn")


def _lines(wall: "AshlarWall") -> list[str]:
    """Say what came out."""
    out, settings = wall.readout, wall.settings
    contacts = 0 if wall.assembly.contacts is None else len(wall.assembly.contacts)
    through = f", {out.through} through the wall" if out.through else ""
    lap = "" if out.least_lap == float("inf") else f", joints {out.least_lap:.3g} m apart or more"
    return [
        f"{wall.assembly.name}: {out.courses} courses, {out.blocks} stones{through}, {contacts} contacts",
        f"  coverage {out.coverage:.6g} of the face{' less its openings' if settings.openings else ''}",
        f"  bond     J {out.score:.3f}, {out.aligned} aligned head joints{lap}",
        f"  sawing   {out.cuts} cuts, {out.cut} stones that are parts of slabs, {out.turned} turned",
        f"  stock    {1e3 * out.stock:.1f} L = {1e3 * out.placed:.1f} L laid + {1e3 * out.left:.1f} L in {out.leftover}"
        f" slabs left + {1e3 * out.off:.1f} L in {out.offcuts} offcuts + {1e3 * out.lost:.1f} L lost",
    ]
