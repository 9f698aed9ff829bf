"""`demo`: the main job, from nothing to a wall of found stones that is proved to stand."""

from typing import TYPE_CHECKING, Annotated

from cyclopean.api.site import SiteOptions, site_files, site_folder
from cyclopean.api.site_stock import stock_of
from cyclopean.cli.check import write_result
from cyclopean.cli.command import command
from cyclopean.cli.outputs import Files, folder
from cyclopean.cli.site import written_site
from cyclopean.cli.terminal import long_work, say, typed, warn
from cyclopean.options import Option

if TYPE_CHECKING:
    from pathlib import Path

    from cyclopean.analysis import Result
    from cyclopean.api.stones import StoneCarving, StoneMatch
    from cyclopean.design.construction.sequence import BuildSequence
    from cyclopean.design.walls.polygonal import PolygonalWall

STOCK = 300  # stones at hand, ten a cell: a quarry, not a heap
SPAN = 0.9, 2.0  # least and largest stone, in mean cells: what comes off is stone, so that a stone has to be the larger
GAPS = 0.05, 0.04, 0.03  # share of the cells that may stay void, the next where joints that are left do not bear
TURNS = 6  # of negotiation
SAWN = "voussoirs"  # no boulder is like one

FILES = {
    "model.json": "the wall as drawn, negotiated with the stones",
    "result.json": "its verdict",
    "certificate.json": "the proof of that",
    "check.html": "the forces in its joints",
    "stones.obj": "the stones at hand",
    "match.json": "which stone goes where",
    "match.html": "the same to look at",
    "carved.json": "the wall as it will be built",
    "carved.result.json": "its verdict",
    "carved.certificate.json": "the proof of that",
    "cutlist.csv": "every stone: what is cut off",
    "cuts.csv": "every cut: where it lies on the stone",
    "wall.glb": "the carved stones",
    "sequence.json": "the order of building, and the verdict of every stage",
    "building.html": "how it is built, stage by stage",
}


@command()
def demo(
    out: Annotated[str | None, Option("Folder to write to [demo, made if it is not there].", metavar="DIR")] = None,
    site: SiteOptions = SiteOptions(),
) -> int:
    """Draw a wall, find it stones, carve them, prove that it stands, and plan how it is built.

    A wall of polygonal stones on a gently curved face, around an arched door; its cells are negotiated with the stones
    of a synthetic quarry, and the arch is sawn.
    """
    site_folder(site)
    place = folder("--out", out, "demo")

    from cyclopean import analysis, api, io, view
    from cyclopean.design.construction.sequence import build_sequence, dot_text
    from cyclopean.design.matching.cells import cells_of
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.stones.quarry import quarry
    from cyclopean.proof import verify_file
    from cyclopean.view.overview import overall, overview_html

    with long_work("demo") as stage:
        drawn = _curved_wall()
        sawn = _sawn(drawn)
        mean = float(cells_of(drawn.assembly, None, sawn).volume.mean())
        stones = quarry(STOCK, seed=1, volume=(SPAN[0] * mean, SPAN[1] * mean), detail=2)
        for gap in GAPS:
            stage("negotiating and carving")
            found = api.match(Inventory(stones), drawn, gap=gap, negotiate=1.0, rounds=TURNS, sawn=SAWN)
            made = api.carve(found)
            final = analysis.check(made.assembly)
            if final.verdict == "stable":
                break
        wall, built, whole = made.drawn, made.built, made.total
        assert found.drawn is not None
        stage("checking")
        result = analysis.check(wall)
        stage("sequencing")
        # the stages of carved stones take three times as long: they are looked at where the site has to agree with them
        sequence = build_sequence(wall if site.site is None else built.assembly)
        sheets = site_files(sequence, site, stock_of(sequence, made, stones), stage) if site.site else None
        stage("writing")
        at = {name: place / name for name in FILES}
        with io.together():
            io.write_model(at["model.json"], wall, drawing=io.drawing_dict(found.drawn))
            _write(result, place, "", "check.html")
            _write_match(found, at)
            _write_carved(made, final, place, at)
            io.write_json(at["sequence.json"], io.sequence_dict(sequence, dot_text(sequence)))
            io.write_text(at["building.html"], view.building_html(sequence))
            shown = (made.carved, whole, *_pictures(made))
            page = overview_html(result, stones, shown, (built, final), sequence, FILES)
            io.write_text(place / "report.html", page)
            site_lines = written_site(site, sheets)
    for warning in (*found.warnings, *built.notes):
        warn(warning)
    proofs = {name: verify_file(place / f"{name}certificate.json").proved for name in ("", "carved.")}
    say(" ".join(overall(final, sequence)))
    say(f"  drawn    {wall.name}: {result.verdict}, {_proof(proofs[''])}")
    tried = " or ".join(f"{more:g}" for more in GAPS if more > gap)
    fell = f"; with {tried} it is not proved to stand as built" if tried else ""
    say(f"  matched  {len(found.match)} of {STOCK} stones: Lambda {whole.imposition:.3f}, gap {whole.gap:.3f}{fell}")
    say(f"  sawn     {len(sawn)} voussoirs, new")
    say(f"  as built {final.verdict}, {_proof(proofs['carved.'])}")
    held = _say_stages(sequence, "drawn" if sequence.assembly is wall else "carved")
    for line in site_lines:
        say(line)
    say(f"  written  {place}; open {place / 'report.html'} in a browser, and check the wall again with")
    say(typed("check", place / "carved.json"))
    stands = held and result.verdict == final.verdict == "stable"
    return 0 if stands and all(proofs.values()) else 1


def _say_stages(sequence: "BuildSequence", of: str) -> bool:
    """Say how many stages there are, of the wall as drawn or as carved; whether all stand, with props where needed."""
    bare = [step for step in sequence.steps if step.verdict != "stable"]
    say(f"  sequence {len(sequence.steps)} stages of the wall as {of}, each verified, {len(bare)} of them with props")
    return all(step.propped == "stable" for step in bare)


def _write_match(found: "StoneMatch", at: "dict[str, Path]") -> None:
    """What became of the cells' talk with the stones: these, the match and its page."""
    from cyclopean import io
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.io.matches import MatchFiles, match_dict
    from cyclopean.view.match_page import match_html

    rounds = [{"Lambda": r.imposition, "gap": r.gap, "seconds": r.seconds} for r in found.rounds]
    data = match_dict(found.match, found.stones, found.cells, MatchFiles("stones.obj", "model.json"), rounds)
    io.write_stones(at["stones.obj"], Inventory(found.stones))
    io.write_json(at["match.json"], data)
    io.write_text(at["match.html"], match_html(found.match, found.stones, found.cells, found.rounds))


def _write_carved(made: "StoneCarving", final: "Result", place: "Path", at: "dict[str, Path]") -> None:
    """The wall as it will be built, and what is cut off for it."""
    from cyclopean import io
    from cyclopean.io.cutlist import carved_meshes, cutlist_csv, cuts_csv

    io.write_model(at["carved.json"], made.assembly)
    _write(final, place, "carved.", None)
    io.write_text(at["cutlist.csv"], cutlist_csv(made.carved))
    io.write_text(at["cuts.csv"], cuts_csv(made.carved))
    io.write_mesh(at["wall.glb"], carved_meshes(made.carved))


def _pictures(made: "StoneCarving") -> tuple[str, str]:
    """The stones as they are placed, and as they are carved."""
    from cyclopean.view.carving_drawing import carving_svg

    of, name = (made.drawn, made.fixed, made.carved), made.drawn.name
    before = carving_svg(*of, f"{name}, stones as placed", "before", made.built.sawn)
    return before, carving_svg(*of, f"{name}, stones as carved", "after", made.built.sawn)


def _write(result: "Result", place: "Path", prefix: str, report: str | None) -> None:
    """Result, certificate and page of one check."""
    files = {
        "json": place / f"{prefix}result.json",
        "certificate": place / f"{prefix}certificate.json",
        **({"report": place / report} if report else {}),
    }
    write_result(result, Files(files), str(place / (f"{prefix}json" if prefix else "model.json")))


def _proof(proved: bool) -> str:
    return "certificate verified" if proved else "NO valid certificate"


def _sawn(drawn: "PolygonalWall") -> list[int]:
    """Blocks that are sawn new."""
    from cyclopean.assembly import supports
    from cyclopean.design.matching.sawn import sawn_blocks

    ids, fixed = [block.id for block in drawn.assembly.blocks], supports(drawn.assembly)[0]
    found: list[int] = sawn_blocks(ids, fixed, drawn.pattern.kind, SAWN).tolist()
    return found


def _curved_wall() -> "PolygonalWall":
    """Polygonal stones on a gently curved face, around an arched door."""
    from cyclopean.design.walls.openings import Opening
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.polygonal import polygonal_wall
    from cyclopean.design.walls.surfaces import Cylinder

    door = Opening(1.05, 0.9, 1.25, head="arch")
    return polygonal_wall(PatternSettings(openings=(door,)), surface=Cylinder(8.0, 1.5))
