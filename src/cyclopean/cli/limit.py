"""`limit`: by how much may a push, a tilt or loads grow before it falls?"""

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.model_options import (
    Cohesion,
    Combination,
    Density,
    Factors,
    Gravity,
    ModelFile,
    Mu,
    Supports,
    Tension,
    Tolerance,
    Units,
)
from cyclopean.cli.outputs import STANDARD_OUTPUT, planned, seen_from
from cyclopean.cli.plain import PlainCommand
from cyclopean.cli.terminal import long_work, of_file, say, say_json, warn
from cyclopean.cli.values import case_factors, choice, number, optional_number, vector, whole
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.analysis import CoupledBracket, LimitResult, Live, LiveLoad, Polar, Pushover

__all__ = ["LimitCommand", "limit"]

METHODS = ("rbe", "cra")
SOLVERS = ("auto", "interior", "clarabel")


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


def limit(
    model: ModelFile,
    push: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Push every block, in multiples of its weight.")
    ] = None,
    tilt: Annotated[
        str | None, typer.Option(metavar="[AZ]", help="Tilt the ground towards azimuth AZ (degrees from +x to +y) [0].")
    ] = None,
    load: Annotated[
        list[str] | None,
        typer.Option(metavar="BLOCK:FX,FY,FZ[@X,Y,Z]", help="Force (N) on a block, at its centroid or a point."),
    ] = None,
    mu: Mu = None,
    density: Density = None,
    supports: Supports = "",
    gravity: Gravity = None,
    combination: Combination = "",
    factor: Factors = None,
    units: Units = None,
    tolerance: Tolerance = None,
    tension: Tension = None,
    cohesion: Cohesion = None,
    method: Annotated[
        str, typer.Option(metavar="|".join(METHODS), help="cra also brackets the limit without dilatancy.")
    ] = "rbe",
    solver: Annotated[str, typer.Option(metavar="NAME", help="auto, interior or clarabel.")] = "auto",
    seconds: Annotated[
        str | None,
        typer.Option(metavar="S", help="Time for both bounds and their proof; cra: for each trial as well [60]."),
    ] = None,
    polar: Annotated[
        str | None, typer.Option(metavar="N", help="With --tilt: towards N azimuths; the least is answered.")
    ] = None,
    pushover: Annotated[
        str | None,
        typer.Option(metavar="REACH", help="Follow the mechanism as far: 0.1m or 10deg of the fastest block."),
    ] = None,
    steps: Annotated[str | None, typer.Option(metavar="N", help="Steps of --pushover [20].")] = None,
    json: Annotated[
        str | None, typer.Option(metavar="F|-", help="Write the result; - prints it and nothing else.")
    ] = None,
    certificate: Annotated[str | None, typer.Option(metavar="F", help="Write the proof of both bounds.")] = None,
    report: Annotated[str | None, typer.Option(metavar="F", help="Write a page to read in a browser.")] = None,
) -> int:
    """Tell by how much live loads may grow before a mechanism forms, and prove it from both sides.

    Exit status: 0 done, whatever the answer; 2 bad input.
    """
    began = time.perf_counter()
    choice("--method", method, METHODS)
    choice("--solver", solver, SOLVERS)
    wanted: dict[str, Any] = {
        "mu": optional_number("--mu", mu, least=0.0),
        "density": optional_number("--density", density, above=0.0),
        "supports": supports,
        "gravity": vector("--gravity", gravity),
        "tolerance": optional_number("--tolerance", tolerance, above=0.0),
        "combination": combination,
        "factors": case_factors("--factor", factor),
        "tension": optional_number("--tension", tension, above=0.0),
        "cohesion": optional_number("--cohesion", cohesion, above=0.0),
    }
    budget = optional_number("--seconds", seconds, above=0.0)
    if budget is not None:
        wanted["seconds"] = budget
    _one_of(push, tilt, load)
    azimuths = None if polar is None else _azimuths(polar, tilt)
    course = _reach(pushover, steps)
    files = planned({"--json": json, "--certificate": certificate, "--report": report}, keep=model)

    from cyclopean import analysis, io

    live = _live(push, tilt, load)
    settings = analysis.Settings(**wanted)
    with long_work(f"limit of {model}") as stage, of_file(model):
        started = time.perf_counter()
        assembly, warnings = io.read_model(model, units)
        read = time.perf_counter() - started
        around = None
        if azimuths is not None and live.tilt is not None:
            around = analysis.polar_tilt(
                assembly,
                settings,
                count=azimuths,
                first=live.tilt,
                solver=solver,
                seconds=_left(budget, began),
                progress=stage,
            )
            result = around.least
        else:
            result = analysis.limit(assembly, live, settings, stage, solver=solver, seconds=_left(budget, began))
        coupled = analysis.coupled_bracket(assembly, result, settings, progress=stage) if method == "cra" else None
        curve = None
        if course is not None:
            reach, unit, count = course
            curve = analysis.pushover(
                assembly,
                result.live,
                settings,
                reach=reach,
                unit=unit,
                steps=count,
                seconds=_left(budget, began),
                progress=stage,
            )
    result = replace(
        result,
        warnings=(*warnings, *result.warnings),
        seconds={"read": read, **result.seconds, "total": time.perf_counter() - began},
    )
    for warning in result.warnings:
        warn(warning)
    data = _written(result, files, model, coupled, around, curve)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join(_lines(result, coupled, around, curve, files)))
    return 0


def _left(budget: float | None, began: float) -> float | None:
    """What is left of the time given; never nothing at all."""
    return None if budget is None else max(budget - (time.perf_counter() - began), 1e-3)


def _one_of(push: str | None, tilt: str | None, load: list[str] | None) -> None:
    given = [
        name for name, value in (("--push", push), ("--tilt", tilt), ("--load", load or None)) if value is not None
    ]
    if len(given) != 1:
        raise InputError(
            f"{' and '.join(given) or 'nothing grows'}: give exactly one of --push X,Y,Z, --tilt [AZ] and"
            " --load BLOCK:FX,FY,FZ (which may stand several times)"
        )


def _live(push: str | None, tilt: str | None, load: list[str] | None) -> "Live":
    from cyclopean.analysis import Live

    if push is not None:
        return Live(push=vector("--push", push))
    if tilt is not None:
        return Live(tilt=number("--tilt", tilt))
    return Live(loads=tuple(_load(text) for text in load or []))


def _load(text: str) -> "LiveLoad":
    """Read BLOCK:FX,FY,FZ or BLOCK:FX,FY,FZ@X,Y,Z; an id may hold colons."""
    from cyclopean.analysis import LiveLoad

    block, colon, rest = text.rpartition(":")
    if not colon or not block:
        raise InputError(f"--load {text}: expected BLOCK:FX,FY,FZ or BLOCK:FX,FY,FZ@X,Y,Z")
    force, at, point = rest.partition("@")
    pulls, place = vector(f"--load {block}", force), vector(f"--load {block}", point) if at else None
    if pulls is None:
        raise InputError(f"--load {text}: expected three numbers FX,FY,FZ")
    return LiveLoad(block, pulls, place)


def _azimuths(text: str, tilt: str | None) -> int:
    count = whole("--polar", text)
    if tilt is None:
        raise InputError(f"--polar {text}: goes with --tilt only")
    if not 1 <= count <= 3600:
        raise InputError(f"--polar {text}: expected a whole number from 1 to 3600")
    return count


def _reach(text: str | None, steps: str | None) -> tuple[float, str, int] | None:
    """Read 0.1m or 10deg, and the number of steps."""
    if text is None:
        if steps is not None:
            raise InputError(f"--steps {steps}: goes with --pushover only")
        return None
    unit = "deg" if text.endswith("deg") else "m"
    value = number("--pushover", text.removesuffix(unit))
    if not value > 0.0:
        raise InputError(f"--pushover {text}: expected a positive length such as 0.1m, or an angle such as 10deg")
    count = 20 if steps is None else whole("--steps", steps)
    if not 1 <= count <= 10_000:
        raise InputError(f"--steps {steps}: expected a whole number from 1 to 10000")
    return value, unit, count


def _written(
    result: "LimitResult",
    files: dict[str, Path],
    model: str,
    coupled: "CoupledBracket | None",
    polar: "Polar | None",
    curve: "Pushover | None",
) -> dict[str, Any]:
    """Write the files that were asked for, once all of them are composed; return the result as data."""
    from cyclopean import io

    proof = files.get("--certificate") if result.certificate is not None else None
    data = io.limit_dict(result, seen_from(files.get("--json"), proof), coupled=coupled, polar=polar, pushover=curve)
    page = None
    if "--report" in files:
        from cyclopean.view.limit_page import limit_html

        there = files["--report"]
        page = limit_html(
            result,
            coupled=coupled,
            polar=polar,
            pushover=curve,
            certificate_file=seen_from(there, proof),
            model_file=seen_from(there, Path(model)),
        )
    with io.together():
        if proof is not None:
            io.write_json(proof, result.certificate)
        elif "--certificate" in files:
            warn(f"--certificate {files['--certificate']}: nothing was proved, so no certificate is written")
        if page is not None:
            io.write_text(files["--report"], page)
        if "--json" in files:
            io.write_json(files["--json"], data)
    return data


def _lines(
    result: "LimitResult",
    coupled: "CoupledBracket | None",
    polar: "Polar | None",
    curve: "Pushover | None",
    files: dict[str, Path],
) -> list[str]:
    """Say both bounds, what they rest on, and where the files are."""
    lines = [f"{_head(result)}: {result.reason}"]
    lines.append(
        f"  model    {result.assembly.name}: {len(result.assembly)} blocks, {int((~result.fixed).sum())} of them free,"
        f" {len(result.contacts)} contacts"
    )
    if result.assumed:
        lines.append("  assumed  " + ", ".join(f"{name} {_plain(value)}" for name, value in result.assumed.items()))
    if result.governing is not None:
        contacts, blocks = result.contacts, result.assembly.blocks
        ends = (blocks[int(x[result.governing])].id for x in (contacts.a, contacts.b))
        lines.append(f"  moves    most at the joint between {' and '.join(ends)}")
    if coupled is not None:
        lines.append(f"  cra      {_coupled_line(coupled)}")
    if polar is not None:
        lines.append(f"  polar    {len(polar.results)} azimuths; least towards {polar.least.live.tilt:g} degrees")
    if curve is not None:
        last = curve.steps[-1]
        lines.append(
            f"  pushover '{curve.control}' to {last.displacement:.4g} m, {last.rotation:.4g} degrees: multiplier"
            f" {curve.steps[0].multiplier:.4g} to {last.multiplier:.4g}; {curve.ended}"
        )
    if result.certificate is not None:
        lines.append(f"  proof    {result.certificate['kind']}, checked in exact arithmetic")
    written = [str(path) for option, path in files.items() if option != "--certificate" or result.certificate]
    if written:
        lines.append(f"  written  {', '.join(written)}")
    return lines


def _head(result: "LimitResult") -> str:
    if result.word == "limit":
        if result.angle is not None and result.angle[0] is not None:
            return f"{result.angle[0]:.5g} degrees"
        return f"{result.value:.6g}"
    return {"unbounded": "no limit", "falls": "falls", "undecided": "undecided"}[result.word]


def _coupled_line(coupled: "CoupledBracket") -> str:
    stands = "no multiplier was certified" if coupled.stands is None else f"certified at {coupled.stands:.6g}"
    if coupled.not_yet is None:
        return f"{stands}, all but the limit itself" if coupled.stands else stands
    return f"{stands}; {coupled.word} at {coupled.not_yet:.6g} ({len(coupled.trials)} trials)"


def _plain(value: Any) -> str:
    if isinstance(value, int | float):
        return f"{value:g}"
    return value if isinstance(value, str) else "(" + ", ".join(f"{float(x):g}" for x in value) + ")"
