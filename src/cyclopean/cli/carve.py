"""`carve`: from a match to stones that can be cut, and does the wall stand as it will be built?"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.analysis.answers import answer
from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import CheckOptions, examined
from cyclopean.api.inputs import Reading
from cyclopean.api.site import SiteOptions, site_folder, site_sheets
from cyclopean.cli.check import write_result
from cyclopean.cli.command import argument, command, some, written
from cyclopean.cli.outputs import Files, folder, seen_from
from cyclopean.cli.site import written_site
from cyclopean.cli.terminal import long_work, warn
from cyclopean.options import Option, option

if TYPE_CHECKING:
    from cyclopean.analysis import Result
    from cyclopean.api.stones import StoneCarving
    from cyclopean.assembly import Assembly

NAMES = (
    "cutlist.csv", "cuts.csv", "placements.json", "carved.glb", "offcuts.glb", "before.svg", "after.svg", "carved.json",
    "result.json", "certificate.json",
)  # fmt: skip
CAD = ("before.dxf", "after.dxf")


@dataclass(frozen=True)
class Carving:
    """How stones are carved, and what is drawn."""

    least: float = option(
        0.002, "Depth (m) up to which a cut is left to the chisel.", "number", metavar="L", least=0.0, word="least_cut"
    )
    dxf: bool = option(False, "Write before.dxf and after.dxf too, for CAD (extra dxf).", "flag")


@command()
def carve(
    match: Annotated[str, argument("MATCH", "Match file, or the folder it lies in.")],
    out: Annotated[str, Option("Folder to write to.", metavar="DIR")],
    settings: Annotated[
        Settings,
        some(
            "method mu density supports seconds",
            method="How the carved wall is checked: coupled, or equilibrium [cra].",
        ),
    ] = Settings(),
    options: Carving = Carving(),
    site: SiteOptions = SiteOptions(),
    files: Annotated[Files, written("json", "report")] = Files({}),
) -> int:
    """Cut matched stones back to their cells, write the cut list, and check the wall as it will be built.

    Exit status: 0 done, whatever the verdict is; 2 bad input.
    """
    from dataclasses import replace

    from cyclopean import api, io
    from cyclopean.io.extras import extra
    from cyclopean.io.matches import read_match

    if options.dxf:
        extra("dxf", where="`dxf`: ")
    place = folder("--out", out, out)
    site_folder(site)
    stored = read_match(match)
    files = files.within(
        place, (*NAMES, *(CAD if options.dxf else ())), (str(stored.file), str(stored.wall), str(stored.stones))
    )
    with long_work(f"carving {stored.file}") as stage:
        made = api.carve(stored.file, least=options.least, supports=settings.supports, progress=stage)
        # supports are those of the drawn wall; the carved one says what is held
        result = examined(made, replace(settings, supports=""), Reading(), CheckOptions(margins=False), stage)
        sheets = site_sheets(made, site, settings, stage)
    for warning in (*made.warnings, *result.warnings):
        warn(warning)
    with io.together():
        data = _written(files, str(stored.wall), made, result, options.least)
        site_line = written_site(site, sheets)
    files.tell(data, [*_lines(data, result, place, files), *site_line])
    return 0


def _written(files: Files, wall: str, made: "StoneCarving", result: "Result", least: float) -> dict[str, Any]:
    """Compose everything, then write it; return the figures."""
    from cyclopean import io
    from cyclopean.api.drawings import as_files
    from cyclopean.io.cutlist import carved_meshes, carving_dict, cutlist_csv, cuts_csv, offcut_meshes, placements_dict
    from cyclopean.view.carving_drawing import carving_html, carving_svg

    carved, name, to = made.carved, made.drawn.name, files.to
    verdict = {"verdict": result.verdict, "reason": result.reason, "method": result.method}
    data = carving_dict(carved, made.total, made.built, least, verdict)
    before = carving_svg(made.drawn, made.fixed, carved, f"{name} before carving", "before", made.built.sawn)
    after = carving_svg(made.drawn, made.fixed, carved, f"{name} after carving", "after", made.built.sawn)
    proof = seen_from(to.get("report"), to["certificate.json"] if result.certificate is not None else None)
    shown: dict[str, Any] = {"drawings": (before, after), "least": least, "certificate_file": proof}
    with io.together():
        files.write({
            "cutlist.csv": lambda: cutlist_csv(carved),
            "cuts.csv": lambda: cuts_csv(carved),
            **{f"before.{ending}": made for ending, made in as_files(lambda: before).items()},
            **{f"after.{ending}": made for ending, made in as_files(lambda: after).items()},
            "placements.json": lambda: placements_dict(carved, wall),
            "report": lambda: carving_html(carved, made.built, result, **shown),
            "json": lambda: data,
        })  # fmt: skip
        _write_meshes({to["carved.glb"]: carved_meshes(carved), to["offcuts.glb"]: offcut_meshes(carved)})
        io.write_model(to["carved.json"], made.assembly)
        proved = Files({"json": to["result.json"], "certificate": to["certificate.json"]})
        write_result(result, proved, str(to["carved.json"]))
    return data


def _write_meshes(meshes: "dict[Path, Assembly]") -> None:
    """Write meshes, those that there are."""
    from cyclopean import io

    for file, assembly in meshes.items():
        if len(assembly):
            io.write_mesh(file, assembly)
        else:
            old = "; the file that is there is of an earlier run" if file.is_file() else ""
            warn(f"{file}: there is nothing to write in it{old}")


def _lines(data: dict[str, Any], result: "Result", place: Path, files: Files) -> list[str]:
    """Say what came out."""
    stones, joints = data["stones"], data["joints"]
    cuts = [cut for row in stones for cut in row["cuts"]]
    volumes, (word, said) = data["volumes"], answer(result)
    dressed = sum(cut["dressing"] for cut in cuts)
    others = [str(path) for name, path in files.to.items() if name not in (*NAMES, *CAD)]
    return [
        f"As it will be built: {word.lower()}. {said}",
        f"  carved   {len(stones)} stones, Lambda {data['Lambda']:.4f}, gap {data['gap']:.4f}",
        f"  volumes  {1e3 * volumes['stones']:.1f} L of stone, {1e3 * volumes['carved']:.1f} L stay,"
        f" {1e3 * (volumes['stones'] - volumes['carved']):.1f} L come off; they add up within {data['imbalance']:.0e}",
        f"  cuts     {len(cuts) - dressed} cuts, {sum(c['area'] for c in cuts if not c['dressing']):.2f} m2,"
        f" and {dressed} faces to dress",
        f"  joints   {joints['touching']} of {joints['drawn']} touch,"
        f" over {joints['touching_share']:.0%} of the area that was drawn",
        f"  verdict  {result.verdict}, by {result.method}",
        f"  written  {', '.join([str(place), *others])}",
    ]
