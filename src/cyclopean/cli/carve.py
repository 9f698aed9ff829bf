"""`carve`: from a match to stones that can be cut, and does the wall stand as it will be built?"""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.check import METHODS, write_result
from cyclopean.cli.model_options import Density, Mu, Supports
from cyclopean.cli.outputs import STANDARD_OUTPUT, folder, planned
from cyclopean.cli.terminal import long_work, say, say_json, warn
from cyclopean.cli.values import choice, optional_number

if TYPE_CHECKING:
    from cyclopean.analysis import Result
    from cyclopean.arrays import Bools
    from cyclopean.assembly import Assembly
    from cyclopean.design.carving.carve import Carved
    from cyclopean.design.carving.carved_wall import CarvedWall
    from cyclopean.io.matches import StoredMatch

__all__ = ["carve"]

NAMES = (
    "cutlist.csv", "cuts.csv", "placements.json", "carved.glb", "offcuts.glb", "before.svg", "after.svg", "carved.json",
    "result.json", "certificate.json",
)  # fmt: skip


def carve(
    match: Annotated[
        str, typer.Argument(metavar="MATCH", show_default=False, help="Match file, or the folder it lies in.")
    ],
    out: Annotated[str, typer.Option(metavar="DIR", show_default=False, help="Folder to write to.")],
    least_cut: Annotated[
        str | None,
        typer.Option("--least-cut", metavar="L", help="Depth (m) up to which a cut is left to the chisel [0.002]."),
    ] = None,
    method: Annotated[
        str, typer.Option(metavar="|".join(METHODS), help="How the carved wall is checked: coupled, or equilibrium.")
    ] = "cra",
    mu: Mu = None,
    density: Density = None,
    supports: Supports = "",
    seconds: Annotated[str | None, typer.Option(metavar="S", help="cra: time for the search [60].")] = None,
    json: Annotated[
        str | None, typer.Option(metavar="F|-", help="Write all figures as JSON; - prints them and nothing else.")
    ] = None,
    report: Annotated[str | None, typer.Option(metavar="F", help="Write a page to read in a browser.")] = None,
) -> int:
    """Cut matched stones back to their cells, write the cut list, and check the wall as it will be built.

    Exit status: 0 done, whatever the verdict is; 2 bad input.
    """
    least = optional_number("--least-cut", least_cut, least=0.0)
    budget = optional_number("--seconds", seconds, above=0.0)
    wanted: dict[str, Any] = {
        "method": choice("--method", method, METHODS),
        "mu": optional_number("--mu", mu, least=0.0),
        "density": optional_number("--density", density, above=0.0),
        "supports": supports,
        **({} if budget is None else {"seconds": budget}),
    }
    place = folder("--out", out, out)

    from cyclopean.io.matches import read_match, read_matched

    stored = read_match(match)
    outputs = {f"--out {name}": str(place / name) for name in NAMES} | {"--json": json, "--report": report}
    files = planned(outputs, keep=str(stored.file))
    for given in (stored.wall, stored.stones):
        planned(outputs, keep=str(given))

    from cyclopean import analysis
    from cyclopean.assembly import supports as held_blocks
    from cyclopean.design.carving.carve import LEAST, carve_all
    from cyclopean.design.carving.carved_wall import carved_wall

    depth = LEAST if least is None else least
    settings = analysis.Settings(**wanted | {"supports": ""})  # of the drawn wall; the carved one says what is held
    with long_work(f"carving {stored.file}") as stage:
        wall, placed = read_matched(stored)
        carved = carve_all(placed, least=depth, progress=stage)
        fixed, _ = held_blocks(wall, supports or stored.supports or "")
        stage("joints")
        built = carved_wall(wall, carved, fixed=fixed)
        result = analysis.check(built.assembly, settings, stage)
    for warning in (*(note for c in carved for note in c.notes), *built.notes, *result.warnings):
        warn(warning)
    if budget is not None and method == "rbe":
        warn("--seconds: no effect, for only coupled analysis has it (--method cra)")
    data = _written(files, stored, wall, fixed, carved, built, result, depth)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join(_lines(data, result, place, files)))
    return 0


def _written(
    files: dict[str, Path],
    stored: "StoredMatch",
    wall: "Assembly",
    fixed: "Bools",
    carved: "tuple[Carved, ...]",
    built: "CarvedWall",
    result: "Result",
    least: float,
) -> dict[str, Any]:
    """Compose everything, then write it; return the figures."""
    from cyclopean import io
    from cyclopean.design.carving.carve import total
    from cyclopean.io.cutlist import carved_meshes, carving_dict, cutlist_csv, cuts_csv, offcut_meshes, placements_dict
    from cyclopean.view.carving_drawing import carving_html, carving_svg

    to = {name: files[f"--out {name}"] for name in NAMES}
    whole, name = total(carved), wall.name
    verdict = {"verdict": result.verdict, "reason": result.reason, "method": result.method}
    data = carving_dict(carved, whole, built, least, verdict)
    before = carving_svg(wall, fixed, carved, f"{name} before carving", "before")
    after = carving_svg(wall, fixed, carved, f"{name} after carving", "after")
    texts = {"cutlist.csv": cutlist_csv(carved), "cuts.csv": cuts_csv(carved), "before.svg": before, "after.svg": after}
    page = None
    if "--report" in files:
        there = files["--report"]
        proof = os.path.relpath(to["certificate.json"], there.parent) if result.certificate is not None else None
        page = carving_html(
            carved, whole, built, result, before=before, after=after, least=least, certificate_file=proof
        )
    with io.together():
        for file, text in texts.items():
            io.write_text(to[file], text)
        io.write_json(to["placements.json"], placements_dict(carved, str(stored.wall)))
        _write_meshes({to["carved.glb"]: carved_meshes(carved), to["offcuts.glb"]: offcut_meshes(carved)})
        io.write_model(to["carved.json"], built.assembly)
        write_result(
            result, {"--json": to["result.json"], "--certificate": to["certificate.json"]}, str(to["carved.json"])
        )
        if page is not None:
            io.write_text(files["--report"], page)
        if "--json" in files:
            io.write_json(files["--json"], data)
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


def _lines(data: dict[str, Any], result: "Result", place: Path, files: dict[str, Path]) -> list[str]:
    """Say what came out."""
    stones, joints = data["stones"], data["joints"]
    cuts = [cut for row in stones for cut in row["cuts"]]
    volumes = data["volumes"]
    dressed = sum(cut["dressing"] for cut in cuts)
    others = [str(path) for option, path in files.items() if not option.startswith("--out ")]
    return [
        f"carved: {len(stones)} stones, Lambda {data['Lambda']:.4f}, gap {data['gap']:.4f}",
        f"  volumes  {1e3 * volumes['stones']:.1f} L of stone, {1e3 * volumes['carved']:.1f} L stay,"
        f" {1e3 * (volumes['stones'] - volumes['carved']):.1f} L come off; they add up within {data['imbalance']:.0e}",
        f"  cuts     {len(cuts) - dressed} cuts, {sum(c['area'] for c in cuts if not c['dressing']):.2f} m2,"
        f" and {dressed} faces to dress",
        f"  joints   {joints['touching']} of {joints['drawn']} touch,"
        f" over {joints['touching_share']:.0%} of the area that was drawn",
        f"{result.verdict} as it will be built: {result.reason}",
        f"  written  {', '.join([str(place), *others])}",
    ]
