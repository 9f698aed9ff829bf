"""`sequence`: in which order is it built, and does every stage stand?"""

from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import SEQUENCED, SequenceOptions, sequenced
from cyclopean.api.inputs import Reading, assembly_of
from cyclopean.cli.check import MODEL
from cyclopean.cli.command import command, some, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import long_work, of_file, warn
from cyclopean.cli.workers import MOST, beside
from cyclopean.errors import InputError
from cyclopean.options import Option

if TYPE_CHECKING:
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["sequence"]

MANY = 100  # blocks beyond which checking is worth a process of its own


@command(lean="is --bearing now; a lean is an angle, as in settle")
def sequence(
    model: Annotated[str, MODEL],
    files: Annotated[
        Files,
        written(
            "json",
            out=("F", "Required: Sequence file to write."),
            dot=("F", "Write the dependency graph for Graphviz."),
            report=("F", "Write a page that shows the building."),
        ),
    ],
    settings: Annotated[Settings, some(SEQUENCED, seconds="Time for the search of one stage.")] = Settings(
        seconds=10.0
    ),
    reading: Reading = Reading(),
    options: SequenceOptions = SequenceOptions(),
    workers: Annotated[
        int | None,
        Option("Processes; those beyond the first check certificates [2 beyond 100 blocks].", "whole", metavar="N"),
    ] = None,
) -> int:
    """Find the order in which a model is built, and check every stage.

    Exit status: 0 done, whatever the verdicts in the file are; 2 bad input.
    """
    from cyclopean import io
    from cyclopean.design.construction.sequence import dot_text
    from cyclopean.view import building_html

    assembly, warnings = assembly_of(model, reading)
    count = workers if workers is not None else 2 if len(assembly) > MANY else 1
    if not 1 <= count <= MOST:
        raise InputError.of("workers", count, f"expected a whole number from 1 to {MOST}")
    with beside(count - 1) as checkers, long_work(f"sequencing {model}") as stage, of_file(model):
        found = sequenced(assembly, settings, Reading(), options, stage, executor=checkers)
    for warning in (*warnings, *found.warnings):
        warn(warning)
    graph = dot_text(found)
    data = io.sequence_dict(found, graph)
    files.write(
        {"out": lambda: data, "json": lambda: data, "dot": lambda: graph, "report": lambda: building_html(found)}
    )
    files.tell(data, [*_lines(found, data), *files.line()])
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
