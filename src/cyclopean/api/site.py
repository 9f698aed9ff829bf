"""The site set of a structure: sheets to build from, as PDF, SVG and DXF, templates, frames."""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopean.errors import InputError
from cyclopean.options import check_options, option

if TYPE_CHECKING:
    from cyclopean.api.stones import StoneCarving
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["SiteFiles", "SiteOptions", "site_files", "site_folder", "write_site"]

TEMPLATES = "templates"  # folder of those, in that of the set


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

    def __post_init__(self) -> None:
        check_options(self)
        usual = (("paper", "A4"), ("cards", 2), ("scale", None), ("title", ""), ("date", ""))
        idle = next((name for name, value in usual if getattr(self, name) != value), None)
        if self.site is None and idle:
            raise InputError.of(idle, None, "no sheets are drawn; say where they go with `site` DIR")


@dataclass(frozen=True, slots=True)
class SiteFiles:
    """What the set is made of, and what is to be said of it."""

    contents: Mapping[str, str | bytes | dict[str, Any]]  # by the name within the folder
    sheets: int
    notes: tuple[str, ...]


def site_folder(options: SiteOptions) -> Path | None:
    """Where the set goes, if anywhere; the folder itself need not be there yet.

    Raises
    ------
    InputError
        It is a file, may not be written, or lies in a folder that is not there.
    """
    if options.site is None:
        return None
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
    return place


def site_files(
    sequence: "BuildSequence",
    options: SiteOptions,
    carving: "StoneCarving | None" = None,
    progress: Callable[[str], None] = lambda _: None,
) -> SiteFiles:
    """Compose the site set of a structure, nothing written yet.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    options : SiteOptions
        How the sheets are drawn.
    carving : StoneCarving, optional
        The stones that are cut for it.
    progress : callable
        Is told what begins.

    Raises
    ------
    InputError
        The structure is too large for the paper.
    """
    from cyclopean import io
    from cyclopean.design.construction.laying import laid_stones
    from cyclopean.io.frames import frames_dict
    from cyclopean.io.pdf import pdf_bytes, unwritable
    from cyclopean.view.site.paper import Form, Title
    from cyclopean.view.site.site_set import site_set

    progress("drawing the sheets")
    form, title = Form(options.paper), Title(options.title or sequence.assembly.name, options.date)
    cut = {} if carving is None else _cut(sequence, carving)
    made = site_set(sequence, form, title, options.cards, options.scale, cut)
    notes = list(made.notes)
    if (shown := title.shown(form)) != title.name:
        notes.append(f"`title`: {len(title.name)} letters do not fit; the sheets say '{shown}'")
    every = made.sheets | {f"{TEMPLATES}/{name}": drawing for name, drawing in made.templates.items()}
    contents: dict[str, Any] = {f"{name}.svg": drawing for name, drawing in every.items()}
    contents["frames.json"] = frames_dict(sequence, laid_stones(sequence))
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


def _cut(sequence: "BuildSequence", carving: "StoneCarving") -> dict[int, Any]:
    """Stones with their cuts, by block."""
    from cyclopean.view.site.cuts import cut_stone

    block = {one.id: k for k, one in enumerate(sequence.assembly.blocks)}
    stones = {stone.id: stone for stone in carving.stones}
    return {block[c.cell]: cut_stone(c, stones[c.stone]) for c in carving.carved if c.cell in block and c.cuts}


def write_site(place: Path, files: SiteFiles) -> tuple[str, ...]:
    """Write a set into a folder, all of it or nothing.

    Returns
    -------
    tuple of str
        Notes on sheets that are there from an earlier run.
    """
    from cyclopean import io
    from cyclopean.io.files import write_bytes

    folders = {place, *((place / name).parent for name in files.contents)}
    for folder in sorted(folders):
        folder.mkdir(exist_ok=True)
    with io.together():
        for name, content in files.contents.items():
            if isinstance(content, bytes):
                write_bytes(place / name, content)
            elif isinstance(content, str):
                io.write_text(place / name, content)
            else:
                io.write_json(place / name, content)
    old = sorted(_others(place, files))
    some = ", ".join(old[:3]) + (f" and {len(old) - 3} more" if len(old) > 3 else "")
    return (f"{place}: {some}: of an earlier run, not of this set; throw away before printing",) if old else ()


def _others(place: Path, files: SiteFiles) -> Iterator[str]:
    """Sheets in a folder that are not of a set."""
    for ending in ("svg", "dxf", "pdf"):
        for path in (*place.glob(f"*.{ending}"), *(place / TEMPLATES).glob(f"*.{ending}")):
            if path.relative_to(place).as_posix() not in files.contents:
                yield path.relative_to(place).as_posix()
