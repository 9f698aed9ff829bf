"""`sequence`: in which order is it built, and does every stage stand?"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import SEQUENCED, sequenced
from cyclopean.api.inputs import Reading, assembly_of
from cyclopean.api.site import SiteOptions, site_folder, site_sheets
from cyclopean.cli.check import MODEL
from cyclopean.cli.command import command, some, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.site import written_site
from cyclopean.cli.terminal import long_work, of_file, warn
from cyclopean.cli.workers import Hands, workers
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.texts import first_few

if TYPE_CHECKING:
    from cyclopean.design.construction.sequence import BuildSequence

MANY = 40  # blocks beyond which a process more is worth its start
SHOWN = 8  # props that are said


@dataclass(frozen=True)
class Building(SequenceOptions, SiteOptions):
    """How the order is found, and what is drawn for whoever builds."""

    def __post_init__(self) -> None:
        SequenceOptions.__post_init__(self)
        SiteOptions.__post_init__(self)


@command(
    lean="is --bearing now; a lean is an angle, as in settle",
    props="the fewest stones to hold are always looked for now; leave it out",
)
def sequence(
    model: Annotated[str, MODEL],
    files: Annotated[
        Files,
        written(
            "json",
            "drawing",
            out=("F", "Required: Sequence file to write."),
            dot=("F", "Write the dependency graph for Graphviz."),
            report=("F", "Write a page that shows the building."),
        ),
    ],
    settings: Annotated[Settings, some(SEQUENCED, seconds="Time for the search of one stage.")] = Settings(
        seconds=30.0
    ),
    reading: Reading = Reading(),
    options: Building = Building(),
    hands: Hands = Hands(),
) -> int:
    """Find the order in which a model is built, or take a given one, and check every stage.

    Exit status: 0 done, whatever the verdicts in the file are; 2 bad input.
    """
    from cyclopean import io
    from cyclopean.api.drawings import drawn
    from cyclopean.design.construction.sequence import dot_text
    from cyclopean.view import building_html

    site_folder(options)
    assembly, warnings = assembly_of(model, reading)
    usual = 2 if len(assembly) > MANY and hands.cluster is None else 1
    with (
        workers(usual if hands.workers is None else hands.workers, hands.cluster) as executor,
        long_work(f"sequencing {model}") as stage,
        of_file(model),
    ):
        found = sequenced(assembly, settings, options, stage, executor)
        sheets = site_sheets(found, options, progress=stage)
    for warning in (*warnings, *found.warnings):
        warn(warning)
    graph = dot_text(found)
    data = io.sequence_dict(found, graph)
    told: dict[str, Callable[[], Any]] = {"out": lambda: data, "json": lambda: data, "dot": lambda: graph}
    with io.together():
        files.write({**told, "report": lambda: building_html(found), **drawn(found)})
        site_line = written_site(options, sheets)
    files.tell(data, [*_lines(found, data), *site_line, *files.line()])
    return 0


def _lines(found: "BuildSequence", data: dict[str, Any]) -> list[str]:
    """Say what was found."""
    from cyclopean.view.building import outcome

    stages = data["stages"]
    said = ", ".join(f"{count} {word}" for word, count in stages.items() if count) or "none"
    title, needs, _ = outcome(found)
    lines = [
        f"{title}. {needs}",
        f"  sequence {data['free']} stones in {len(data['layers'])} layers; stages: {said}",
        f"  model    {data['model']}: {data['blocks']} blocks, method {data['method']}",
    ]
    for cycle in data["cycles"]:
        broken = ", ".join(f"'{e['upper']}' on '{e['lower']}'" for e in cycle["broken"])
        lines.append(f"  cycle    {_some(cycle['blocks'])} rest on each other; set aside: {broken}")
    for step in found.steps:
        if step.free is None:
            names = [found.assembly.blocks[i].id for i in step.blocked_by]
            lines.append(f"  trapped  '{found.assembly.blocks[step.block].id}' by {_some(names)}")
    return [*lines, *_given(data["given"]), *_falling(found, data)]


def _given(given: dict[str, Any] | None) -> Iterator[str]:
    """An order that was given, and the valid one nearest to it."""
    if given is None:
        return
    if given["valid"]:
        yield "  order    as given, and valid: every stone finds what it rests on, and a way in"
        return
    fault, count = given["faults"][0], len(given["faults"])
    more = f" ({count - 1} more like it)" if count > 1 else ""
    why = f"before {_some(fault['missing'])} that it rests on" if fault["missing"] else "without a way in: "
    why += "" if fault["missing"] else f"{_some(fault['trapped_by'])} stand already"
    yield f"  order    as given, not valid: '{fault['block']}' at step {fault['step']} comes {why}{more}"
    nearest = given["nearest"]
    moves, least = len(nearest["moved"]), nearest["least_moves"]
    told = "no valid order is nearer" if moves == least else f"at least {least} are needed"
    stages = ", ".join(f"{n} {word}" for word, n in nearest["stages"].items() if n)
    yield f"  nearest  {moves} move{'s' * (moves != 1)}: {_some(nearest['moved'])}; {told}; its stages: {stages}"


def _falling(found: "BuildSequence", data: dict[str, Any]) -> Iterator[str]:
    """The first stage that is not proved to stand, how it falls, and the props of all."""
    first = data["first_unstable"]
    if first is None:
        return
    how = ""
    if first["moving"]:
        others = f", and with it {_some(first['moving'][1:])}" if first["moving"][1:] else ""
        how = f": '{first['moving'][0]}' {first['how']}{others}"
    yield f"  first    {first['verdict']} at step {first['step']}, with '{first['block']}'{how}"
    held, least = data["held"], data["least_held"]
    told = "no fewer would do" if held <= least else f"at least {least} are needed"
    yield f"  props    {held} stone{'s' * (held != 1)} to hold: {told}"
    ids = [block.id for block in found.assembly.blocks]
    for prop in found.props[:SHOWN]:
        yield f"           {prop.said(ids)}"
    if len(found.props) > SHOWN:
        yield f"           and {len(found.props) - SHOWN} more, in the file"


def _some(names: list[str]) -> str:
    return first_few([f"'{name}'" for name in names], 6)
