"""`demo`: four models from nothing to verdicts with proofs, in one folder."""

from typing import TYPE_CHECKING, Annotated

import typer

from cyclopean.cli.check import write_result
from cyclopean.cli.outputs import folder
from cyclopean.cli.terminal import long_work, say

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly

__all__ = ["demo"]

EXPECTED = {"wall": "stable", "arch": "stable", "stack": "unstable", "frame": "unstable"}


def demo(
    out: Annotated[
        str | None, typer.Option(metavar="DIR", help="Folder to write to [demo, made if it is not there].")
    ] = None,
) -> int:
    """Make four models, check and prove them.

    A polygonal wall with an opening, an arch, a leaning stack and a beam that hangs on friction; models, results,
    certificates and pages go into one folder.
    """
    place = folder("--out", out, "demo")

    from cyclopean import analysis, design, io, view
    from cyclopean.proof import verify_file

    models = {
        "wall": _curved_wall(),
        "arch": design.arch(20),
        "stack": design.stack(5, offset=0.3),
        "frame": _h_frame(),
    }
    with long_work("demo"):
        results = {name: analysis.check(model) for name, model in models.items()}
        for name, result in results.items():
            io.write_model(place / f"{name}.json", result.assembly)
            write_result(
                result,
                {
                    "--json": place / f"{name}.result.json",
                    "--certificate": place / f"{name}.certificate.json",
                    "--report": place / f"{name}.html",
                },
                str(place / f"{name}.json"),
            )
        entries = [view.index_entry(result, f"{name}.html") for name, result in results.items()]
        io.write_text(place / "index.html", view.index_html(entries, "Four models, four proofs"))
    expected = True
    for name, result in results.items():
        proved = result.certificate is not None and verify_file(place / f"{name}.certificate.json").proved
        expected &= proved and result.verdict == EXPECTED[name]
        proof = "certificate verified" if proved else "NO valid certificate"
        say(f"{result.assembly.name:21} {result.verdict:9} {proof}")
    say(f"open {place / 'index.html'} in a browser; check again with: cyclopean check {place / 'wall.json'}")
    return 0 if expected else 1


def _curved_wall() -> "Assembly":
    """Polygonal stones on a gently curved face, around an arched door."""
    from cyclopean.design.walls.openings import Opening
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.polygonal import polygonal_wall
    from cyclopean.design.walls.surfaces import Cylinder

    door = Opening(1.05, 0.9, 1.25, head="arch")
    return polygonal_wall(PatternSettings(openings=(door,)), surface=Cylinder(8.0, 1.5)).assembly


def _h_frame() -> "Assembly":
    """A beam between the upright faces of two fixed columns, with nothing below it.

    Friction would carry it if something squeezed it, and nothing does: rigid-block equilibrium alone accepts it.
    """
    import numpy as np

    from cyclopean.assembly import Assembly, Block

    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    boxes = {  # lowest corner and size, m
        "left": ((0.0, 0.0, 0.0), (0.4, 0.4, 1.2)),
        "right": ((1.0, 0.0, 0.0), (0.4, 0.4, 1.2)),
        "beam": ((0.4, 0.0, 0.6), (0.6, 0.4, 0.3)),
    }
    blocks = tuple(Block(name, low + corner * size, faces, fixed=name != "beam") for name, (low, size) in boxes.items())
    return Assembly(blocks, name="H frame")
