"""The site set of a structure: sheets to build from, as PDF, SVG and DXF, templates, frames."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import sequenced
from cyclopean.api.inputs import Model, silent
from cyclopean.api.keywords import SiteKeywords, given_to, takes
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.errors import InputError
from cyclopean.options import check_options, first_said, option
from cyclopean.texts import first_few

if TYPE_CHECKING:
    from cyclopean.design.construction.sequence import BuildSequence
    from cyclopean.design.stones.stone import Stone
    from cyclopean.view.site.site_set import Stock

TEMPLATES = "templates"  # folder of those, in that of the set
WORK = "lay", "cut"  # what takes hours
DRAWN = "paper cards scale title date hours"  # options that say how sheets are drawn


@dataclass(frozen=True)
class SiteOptions:
    """Sheets for whoever builds: where they go, and how they are drawn."""

    site: str | None = option(
        None, "Folder for the site set: sheets to build from, PDF, SVG and DXF.", "text", metavar="DIR"
    )
    paper: str = option("A4", "With `site`: paper.", "text", choices=("A4", "A3"))
    cards: int = option(2, "With `site`: cards of stones on a page, 1 to 8.", "whole", metavar="N", least=1, most=8)
    scale: int | None = option(
        None, "With `site`: elevations 1 to N [the largest that fits].", "whole", metavar="N", least=1, most=1000
    )
    title: str = option("", "With `site`: name of the structure on the sheets [the model's].", "text", metavar="T")
    date: str = option("", "With `site`: date on the sheets [none].", "text", metavar="T")
    hours: tuple[tuple[str, float], ...] = option(
        (), "With `site`: of work, lay=H a tonne or cut=H a m2 of cut faces; repeatable.", "factors", metavar="WORK=H"
    )

    def __post_init__(self) -> None:
        check_options(self)
        if self.site is None and (idle := first_said(self, DRAWN)):
            raise InputError.of(idle, None, "no sheets are drawn; say where they go with `site` DIR")
        for work, rate in self.hours:
            if work not in WORK or not 0.0 <= rate < float("inf"):
                raise InputError.of("hours", f"{work}={rate:g}", "expected lay=H or cut=H, with H of at least 0 hours")


@dataclass(frozen=True, slots=True)
class SiteFiles:
    """What the set is made of, and what is to be said of it."""

    contents: Mapping[str, str | bytes | dict[str, Any]]  # by the name within the folder
    sheets: int
    notes: tuple[str, ...]


def site_folder(options: SiteOptions) -> None:
    """Look at where the set goes, before the work begins; the folder itself need not be there yet.

    Raises
    ------
    InputError
        It is a file, may not be written, or lies in a folder that is not there.
    """
    if options.site is None:
        return
    place = Path(options.site)
    if not options.site or options.site.startswith("-"):
        raise InputError(f"`site`: '{options.site}' is no folder name")
    if os.path.lexists(place) and not place.is_dir():
        raise InputError(f"`site` {place}: is not a folder; choose another name")
    there = place if place.is_dir() else place.parent
    if not there.is_dir():
        raise InputError(f"`site` {place}: the folder '{there}' does not exist; make it first")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"`site` {place}: no permission to write there")


@takes(SiteOptions, only=DRAWN)
def site_set(
    thing: Model,
    folder: str | os.PathLike[str],
    settings: Settings | None = None,
    *,
    stones: "Sequence[Stone]" = (),
    **options: Unpack[SiteKeywords],
) -> SiteFiles:
    """Write sheets to build from into a folder: PDF, SVG and DXF, templates of faces, frames of a robot.

    Parameters
    ----------
    thing : path, Assembly, BuildSequence, or what `match`, `carve`, `settle`, `polygonal_wall` gave
        The order of building is found where it is none; a match is carved.
    folder : path
        Made where it is not there; the one that it lies in must be.
    settings : Settings, optional
        By which the stages are checked.
    stones : sequence of Stone, optional
        Those that a wall was settled of, so that what is left over is told.
    **options

    Returns
    -------
    SiteFiles
        What was written, and `notes` of what there is to know.

    Raises
    ------
    InputError
        As `build_sequence`; the folder cannot be written, or the structure is too large for the paper.
    """
    (chosen,) = given_to(site_set, options, SiteOptions(site=os.fspath(folder)))
    site_folder(chosen)
    files = site_sheets(thing, chosen, settings, stones=stones)
    assert files is not None, folder
    return replace(files, notes=(*files.notes, *write_site(Path(folder), files)))


def site_sheets(
    thing: Model,
    options: SiteOptions,
    settings: Settings | None = None,
    progress: Callable[[str], None] = silent,
    stones: "Sequence[Stone]" = (),
) -> SiteFiles | None:
    """Compose the site set of whatever has a structure, nothing written yet; None where no folder is said.

    Raises
    ------
    InputError
        As `site_set`.
    """
    from cyclopean.api.site_stock import laid_order, stock_of
    from cyclopean.api.stones import StoneMatch, carve
    from cyclopean.design.construction.sequence import SECONDS, BuildSequence

    if options.site is None:
        return None
    thing = carve(thing, progress=progress) if isinstance(thing, StoneMatch) else thing
    if isinstance(thing, BuildSequence):
        return site_files(thing, options, None, progress)
    chosen = Settings(seconds=SECONDS) if settings is None else replace(settings, supports="")
    order = sequenced(thing, chosen, SequenceOptions(order=laid_order(thing)), progress)
    return site_files(order, options, stock_of(order, thing, stones), progress)


def site_files(
    sequence: "BuildSequence",
    options: SiteOptions,
    stock: "Stock | None" = None,
    progress: Callable[[str], None] = silent,
) -> SiteFiles:
    """Compose the site set of a structure in an order, nothing written yet.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    options : SiteOptions
        How the sheets are drawn.
    stock : Stock, optional
        Of what its stones are made, and what is left over.
    progress : callable
        Is told what begins.

    Raises
    ------
    InputError
        The structure is too large for the paper.
    """
    from cyclopean import io
    from cyclopean.design.construction.laying import laid_stones
    from cyclopean.io.pdf import pdf_bytes, unwritable
    from cyclopean.io.sequences import compas_frames, frames_dict
    from cyclopean.view.site.paper import Form, Title
    from cyclopean.view.site.site_set import Layout
    from cyclopean.view.site.site_set import site_set as sheets_of

    progress("drawing the sheets")
    form, title = Form(options.paper), Title(options.title or sequence.assembly.name, options.date)
    layout = Layout(form, title, options.cards, options.scale, dict(options.hours))
    made = sheets_of(sequence, layout, stock)
    notes = list(made.notes)
    if (shown := title.shown(form)) != title.name:
        notes.append(f"`title`: {len(title.name)} letters do not fit; the sheets say '{shown}'")
    every = made.sheets | {f"{TEMPLATES}/{name}": drawing for name, drawing in made.templates.items()}
    contents: dict[str, Any] = {f"{name}.svg": drawing for name, drawing in every.items()}
    contents["frames.json"] = frames_dict(sequence, laid_stones(sequence))
    contents["frames.compas.json"] = compas_frames(contents["frames.json"])
    if find_spec("reportlab") is None:
        notes.append("no PDF: it needs reportlab (pip install 'cyclopean[pdf]'); the sheets are there as SVG")
    else:
        progress("writing the PDF")
        outline = {f"{k}  {made.titles[name]}": drawing for k, (name, drawing) in enumerate(made.sheets.items(), 1)}
        contents["site.pdf"] = pdf_bytes(outline, shown)
        if missing := unwritable("".join((title.name, title.date, *(b.id for b in sequence.assembly.blocks)))):
            notes.append(f"the PDF shows ? for {missing[:12]}, which its letters lack; the SVG sheets have them")
    if find_spec("ezdxf") is None:
        notes.append("no DXF: it needs ezdxf (pip install 'cyclopean[dxf]'); the sheets are there as SVG")
    else:
        progress("writing DXF")
        contents |= {f"{name}.dxf": io.dxf_text(drawing) for name, drawing in every.items()}
    return SiteFiles(contents, len(made.sheets), tuple(notes))


def write_site(place: Path, files: SiteFiles) -> tuple[str, ...]:
    """Write a set into a folder, all of it or nothing.

    Returns
    -------
    tuple of str
        Notes on sheets that are there from an earlier run.
    """
    from cyclopean import io
    from cyclopean.api.saving import write_content

    folders = {place, *((place / name).parent for name in files.contents)}
    for folder in sorted(folders):
        folder.mkdir(exist_ok=True)
    with io.together():
        for name, content in files.contents.items():
            write_content(place / name, content)
    old = sorted(_others(place, files))
    return (
        (f"{place}: {first_few(old, 3)}: of an earlier run, not of this set; throw away before printing",)
        if old
        else ()
    )


def _others(place: Path, files: SiteFiles) -> Iterator[str]:
    """Sheets in a folder that are not of a set."""
    for ending in ("svg", "dxf", "pdf"):
        for path in (*place.glob(f"*.{ending}"), *(place / TEMPLATES).glob(f"*.{ending}")):
            if path.relative_to(place).as_posix() not in files.contents:
                yield path.relative_to(place).as_posix()
