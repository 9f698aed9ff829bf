"""`sequence`: in which order is it built, and does every stage stand?"""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.model_options import Density, Gravity, ModelFile, Mu, Supports, Tolerance, Units
from cyclopean.cli.outputs import STANDARD_OUTPUT, planned
from cyclopean.cli.terminal import long_work, of_file, say, say_json, warn
from cyclopean.cli.values import choice, optional_number, vector, whole
from cyclopean.cli.workers import MOST, beside
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["sequence"]

METHODS = ("cra", "rbe")
MANY = 100  # blocks beyond which checking is worth a process of its own


def sequence(
    model: ModelFile,
    out: Annotated[str, typer.Option(metavar="F", show_default=False, help="Sequence file to write.")],
    method: Annotated[
        str, typer.Option(metavar="|".join(METHODS), help="Coupled analysis or equilibrium alone.")
    ] = "cra",
    mu: Mu = None,
    density: Density = None,
    supports: Supports = "",
    gravity: Gravity = None,
    units: Units = None,
    tolerance: Tolerance = None,
    lean: Annotated[
        str | None,
        typer.Option(
            metavar="C", help="Share of a joint's normal along gravity that makes one rest on the other [0.1]."
        ),
    ] = None,
    clearance: Annotated[
        str | None, typer.Option(metavar="L", help="Length (m) of approach and retreat [0.1].")
    ] = None,
    props: Annotated[
        str | None,
        typer.Option(metavar="N", help="Props beyond the least possible, up to which all sets are tried [4]."),
    ] = None,
    seconds: Annotated[str | None, typer.Option(metavar="S", help="Time for the search of one stage [10].")] = None,
    workers: Annotated[
        str | None,
        typer.Option(metavar="N", help="Processes; those beyond the first check certificates [2 beyond 100 blocks]."),
    ] = None,
    json: Annotated[
        str | None, typer.Option(metavar="F|-", help="Write the sequence here too; - prints it and nothing else.")
    ] = None,
    dot: Annotated[str | None, typer.Option(metavar="F", help="Write the dependency graph for Graphviz.")] = None,
    report: Annotated[str | None, typer.Option(metavar="F", help="Write a page that shows the building.")] = None,
) -> int:
    """Find the order in which a model is built, and check every stage.

    Exit status: 0 done, whatever the verdicts in the file are; 2 bad input.
    """
    wanted: dict[str, Any] = {
        "method": choice("--method", method, METHODS),
        "mu": optional_number("--mu", mu, least=0.0),
        "density": optional_number("--density", density, above=0.0),
        "supports": supports,
        "gravity": vector("--gravity", gravity),
        "tolerance": optional_number("--tolerance", tolerance, above=0.0),
    }
    budget = optional_number("--seconds", seconds, above=0.0)
    chosen: dict[str, Any] = {
        "lean": optional_number("--lean", lean, least=0.0),
        "clearance": optional_number("--clearance", clearance, above=0.0),
        "most_props": None if props is None else whole("--props", props),
    }
    files = planned({"--out": out, "--json": json, "--dot": dot, "--report": report}, keep=model)

    from cyclopean import analysis, io
    from cyclopean.design.construction.sequence import SECONDS, build_sequence, dot_text

    settings = analysis.Settings(**wanted, seconds=SECONDS if budget is None else budget)
    options = {name: value for name, value in chosen.items() if value is not None}
    assembly, warnings = io.read_model(model, units)
    count = whole("--workers", workers) if workers is not None else 2 if len(assembly) > MANY else 1
    if not 1 <= count <= MOST:
        raise InputError(f"--workers: {count} is not between 1 and {MOST}")
    with beside(count - 1) as checkers, long_work(f"sequencing {model}") as stage, of_file(model):
        found = build_sequence(assembly, settings, **options, progress=stage, executor=checkers)
    for warning in (*warnings, *found.warnings):
        warn(warning)
    graph = dot_text(found)
    data = io.sequence_dict(found, graph)
    page = None
    if "--report" in files:
        from cyclopean.view import building_html

        page = building_html(found)
    with io.together():
        for option in ("--out", "--json"):
            if option in files:
                io.write_json(files[option], data)
        if "--dot" in files:
            io.write_text(files["--dot"], graph)
        if page is not None:
            io.write_text(files["--report"], page)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join([*_lines(found, data), f"  written  {', '.join(map(str, files.values()))}"]))
    return 0


def _lines(found: "BuildSequence", data: dict[str, Any]) -> list[str]:
    """Say what was found."""
    stages = data["stages"]
    said = ", ".join(f"{count} {word}" for word, count in stages.items() if count) or "none"
    lines = [
        f"sequence: {data['free']} stones in {len(data['layers'])} layers; stages: {said}",
        f"  model    {data['model']}: {data['blocks']} blocks, method {data['method']}",
    ]
    for cycle in data["cycles"]:
        broken = ", ".join(f"'{e['upper']}' on '{e['lower']}'" for e in cycle["broken"])
        lines.append(f"  cycle    {_some(cycle['blocks'])} rest on each other; set aside: {broken}")
    for step in found.steps:
        if step.free is None:
            names = [found.assembly.blocks[i].id for i in step.blocked_by]
            lines.append(f"  trapped  '{found.assembly.blocks[step.block].id}' by {_some(names)}")
    first = data["first_unstable"]
    if first is not None:
        lines.append(f"  first    {first['verdict']} at step {first['step']}, with '{first['block']}'")
        if first["props"]:
            kind = "the fewest props that help" if first["smallest"] else "props that help"
            lines.append(f"  props    {_some(first['props'])}: {kind}; with them {first['with_props']}")
        else:
            lines.append("  props    none were found that help")
    return lines


def _some(names: list[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(f"'{name}'" for name in names[:most]) + more
