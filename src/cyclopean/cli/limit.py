"""`limit`: by how much may a push, a tilt or loads grow before it falls?"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.analysis.answers import amount, limit_answer
from cyclopean.analysis.settings import Settings
from cyclopean.api.inputs import Reading
from cyclopean.api.limiting import LIMITED, LimitOptions, limited
from cyclopean.cli.check import MODEL, assumed_line
from cyclopean.cli.command import command, some, written
from cyclopean.cli.outputs import Files, seen_from
from cyclopean.cli.plain import PlainCommand
from cyclopean.cli.terminal import long_work, of_file, warn

if TYPE_CHECKING:
    from cyclopean.analysis import CoupledBracket, LimitResult


class LimitCommand(PlainCommand):
    """A command whose --tilt may go without a value, which then is azimuth 0."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the azimuth in where the word after --tilt is no number."""
        filled = []
        for word, after in zip(args, [*args[1:], ""], strict=True):
            filled.append(word)
            if word == "--tilt" and not _is_number(after):
                filled.append("0")
        return super().parse_args(ctx, filled)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@command(parser=LimitCommand)
def limit(
    model: Annotated[str, MODEL],
    options: LimitOptions = LimitOptions(),
    settings: Annotated[Settings, some(LIMITED)] = Settings(),
    reading: Reading = Reading(),
    files: Annotated[
        Files, written("json", "report", "drawing", certificate=("F", "Write the proof of both bounds."))
    ] = Files({}),
) -> int:
    """Tell by how much live loads may grow before a mechanism forms, and prove it from both sides.

    Exit status: 0 done, whatever the answer; 2 bad input.
    """
    options.check()
    with long_work(f"limit of {model}") as stage, of_file(model):
        result = limited(model, None, settings, reading, options, stage)
    for warning in result.warnings:
        warn(warning)
    files.tell(_written(result, files, model), _lines(result, files))
    return 0


def _written(result: "LimitResult", files: Files, model: str) -> dict[str, Any]:
    """Write the files that were asked for, once all of them are composed; return the result as data."""
    from cyclopean import io
    from cyclopean.api.drawings import drawn
    from cyclopean.view.limit_page import limit_html

    proof = files.proof(result.certificate)
    data, there = io.limit_dict(result, seen_from(files.to.get("json"), proof)), files.to.get("report")

    def page() -> str:
        return limit_html(result, certificate_file=seen_from(there, proof), model_file=seen_from(there, Path(model)))

    proofs: dict[str, Callable[[], Any]] = {"certificate": lambda: result.certificate}
    points = () if result.pushover is None else result.pushover.proofs
    here = replace(files, to={**files.to, **files.points(points)[0]})
    proofs |= {f"step-{k:02d}": partial(dict, found) for k, found in enumerate(points) if found is not None}
    here.write({**proofs, "report": page, "json": lambda: data, **drawn(result)})
    return data


def _lines(result: "LimitResult", files: Files) -> list[str]:
    """Say both bounds, what they rest on, and where the files are."""
    coupled, polar, curve = result.coupled, result.polar, result.pushover
    title, said = limit_answer(result)
    if said == result.reason:
        lines = [f"{title}. {said}"]
    else:
        head = f"multiplier {result.value:.6g}" if result.angle is None else f"{result.angle[0]:.5g} degrees"
        lines = [said, f"  limit    {head}: {result.reason}"]
    lines.append(
        f"  model    {result.assembly.name}: {len(result.assembly)} blocks, {int((~result.fixed).sum())} of them free,"
        f" {len(result.contacts)} contacts"
    )
    if result.loading is not None:
        lines.append(f"  loads    {result.loading.words()}")
    lines += assumed_line(result.assumed)
    lines += _mechanism_line(result)
    if coupled is not None:
        lines.append(f"  cra      {_coupled_line(coupled)}")
    if polar is not None:
        lines.append(f"  polar    {len(polar.results)} azimuths; least towards {polar.towards:g} degrees")
    if (moved := result.travelling) is not None:
        reach = f"x = {moved.places[0]:g} to {moved.places[-1]:g} m"
        lines.append(f"  along    {len(moved.places)} places, {reach}; least at x = {moved.at:g} m")
    if curve is not None:
        first, last = curve.steps[0], curve.steps[-1]
        bears = (amount(result.live, step.multiplier, up=False)[0] for step in (first, last))
        lines.append(
            f"  pushover '{curve.control}' goes {last.displacement:.4g} m and turns {round(last.rotation, 6):.4g}"
            f" degrees: the limit is {' at first, '.join(bears)} then; {curve.ended}"
        )
        for step in curve.steps:
            pairs = ", ".join(f"{one} and {other}" for one, other in step.met)
            lines += [f"           {pairs} meet at {step.displacement:.4g} m"] if step.met else []
        lines.append(f"  points   {files.points(curve.proofs)[1]}")
    if result.certificate is not None:
        lines.append(f"  proof    {result.certificate['kind']}, checked in exact arithmetic")
    return lines + files.line(but=() if result.certificate else ("certificate",))


def _mechanism_line(result: "LimitResult") -> list[str]:
    """Which joints move in the mechanism, how, and which of those that bear something moves most."""
    from cyclopean.analysis import moving_joints

    if result.governing is None:
        return []
    contacts, blocks, joints = result.contacts, result.assembly.blocks, moving_joints(result)
    count = [sum(joint.kind == kind for joint in joints) for kind in ("hinge", "slide", "part")]
    words = ("opens about a hinge", "slides", "parts"), ("open about hinges", "slide", "part")
    told = [f"{k} {'joints' if k > 1 else 'joint'} {words[k > 1][i]}" for i, k in enumerate(count) if k]
    ends = " and ".join(blocks[int(x[result.governing])].id for x in (contacts.a, contacts.b))
    return [f"  moves    {', '.join(told)}; most at the joint between {ends}"]


def _coupled_line(coupled: "CoupledBracket") -> str:
    stands = "no multiplier was certified" if coupled.stands is None else f"certified at {coupled.stands:.6g}"
    if coupled.not_yet is None:
        return f"{stands}, all but the limit itself" if coupled.stands else stands
    if coupled.falls is not None:
        stands += f"; proved to have no coupled state at {coupled.falls:.6g}, which says nothing of others"
    if coupled.falls != coupled.not_yet:
        stands += f"; {coupled.word} at {coupled.not_yet:.6g}"
    return f"{stands} ({len(coupled.trials)} trials)"
