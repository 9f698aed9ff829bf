"""`demo`: three models from nothing to verdicts with proofs, in one folder."""

from typing import Annotated

import typer

from cyclopean.cli.check import write_result
from cyclopean.cli.outputs import folder
from cyclopean.cli.terminal import long_work, say

__all__ = ["demo"]

EXPECTED = {"arch": "stable", "wall": "stable", "stack": "unstable"}


def demo(
    out: Annotated[
        str | None, typer.Option(metavar="DIR", help="Folder to write to [demo, made if it is not there].")
    ] = None,
) -> int:
    """Make three models, check and prove them.

    An arch, a wall and a leaning stack; models, results, certificates and pages go into one folder.
    """
    place = folder("--out", out, "demo")

    from cyclopean import analysis, design, io, view
    from cyclopean.proof import verify_file

    models = {"arch": design.arch(20), "wall": design.wall(6, 8), "stack": design.stack(5, offset=0.3)}
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
        io.write_text(place / "index.html", view.index_html(entries, "Three models, three proofs"))
    expected = True
    for name, result in results.items():
        proved = result.certificate is not None and verify_file(place / f"{name}.certificate.json").proved
        expected &= proved and result.verdict == EXPECTED[name]
        proof = "certificate verified" if proved else "NO valid certificate"
        say(f"{result.assembly.name:15} {result.verdict:9} {proof}")
    say(f"open {place / 'index.html'} in a browser; check again with: cyclopean check {place / 'arch.json'}")
    return 0 if expected else 1
