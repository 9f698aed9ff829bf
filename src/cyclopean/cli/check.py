"""`check`: does it stand?"""

import time
from collections.abc import Callable
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
    Settle,
    Supports,
    Tension,
    Tolerance,
    Units,
)
from cyclopean.cli.outputs import STANDARD_OUTPUT, planned, seen_from
from cyclopean.cli.subsiding import Steps, followed, path_lines
from cyclopean.cli.terminal import long_work, of_file, say, say_json, warn
from cyclopean.cli.values import case_factors, choice, optional_number, settlements, tilt, vector, weights, whole
from cyclopean.cli.vary import Cluster, Samples, Seed, Vary, Workers, asked, sensitivity_lines, vary
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.analysis import Margins, Result, Sensitivity, Settings, Subsidence
    from cyclopean.assembly import Assembly

__all__ = ["check", "verdict_lines", "write_result"]

METHODS = ("cra", "rbe")
STATUS = {"stable": 0, "unstable": 1, "undecided": 3}


def check(
    model: ModelFile,
    method: Annotated[
        str | None,
        typer.Option(metavar="|".join(METHODS), help="Coupled analysis or equilibrium alone [cra]."),
    ] = None,
    mu: Mu = None,
    density: Density = None,
    supports: Supports = "",
    gravity: Gravity = None,
    tilt_by: Annotated[
        str | None,
        typer.Option("--tilt", metavar="DEG[,AZ]", help="Turn gravity towards azimuth AZ (degrees from +x to +y)."),
    ] = None,
    combination: Combination = "",
    factor: Factors = None,
    all_combinations: Annotated[
        bool, typer.Option("--all-combinations", help="Check every combination of the model; a table.")
    ] = False,
    units: Units = None,
    tolerance: Tolerance = None,
    rough: Annotated[
        str | None,
        typer.Option(metavar="L|auto", help="Find contacts of rough surfaces, nearer than this (m) [flat faces only]."),
    ] = None,
    tension: Tension = None,
    cohesion: Cohesion = None,
    settle: Settle = None,
    steps: Steps = None,
    cone: Annotated[
        str, typer.Option(metavar="C", help="Friction cone: exact, inscribed:K or circumscribed:K.")
    ] = "exact",
    solver: Annotated[
        str, typer.Option(metavar="NAME", help="auto, clarabel or osqp; rbe also newton or interior.")
    ] = "auto",
    weigh: Annotated[
        str | None, typer.Option("--weights", metavar="N,T", help="Weights of normal and tangential forces [1,1].")
    ] = None,
    penalty: Annotated[
        bool, typer.Option("--penalty", help="Let joints pull, at a price: shows where tension would be needed.")
    ] = False,
    eps: Annotated[str | None, typer.Option(metavar="E", help="cra: overlap of points that press [1].")] = None,
    eta: Annotated[
        str | None, typer.Option(metavar="E", help="cra: largest virtual displacement of a point [10 eps].")
    ] = None,
    beta_min: Annotated[
        str | None, typer.Option("--beta-min", metavar="B", help="cra: least sliding where friction acts [0.01 eps].")
    ] = None,
    seconds: Annotated[str | None, typer.Option(metavar="S", help="cra: time for the search [60].")] = None,
    nodes: Annotated[
        str | None, typer.Option(metavar="N", help="cra: cases the refuting search may open [2000].")
    ] = None,
    spare: Annotated[
        bool | None,
        typer.Option("--margins/--no-margins", help="Say how far it is from falling [up to 600 contact points]."),
    ] = None,
    varies: Vary = None,
    samples: Samples = None,
    seed: Seed = None,
    workers: Workers = None,
    cluster: Cluster = None,
    json: Annotated[
        str | None, typer.Option(metavar="F|-", help="Write the result; - prints it and nothing else.")
    ] = None,
    certificate: Annotated[str | None, typer.Option(metavar="F", help="Write the proof of the verdict.")] = None,
    report: Annotated[str | None, typer.Option(metavar="F", help="Write a page to read in a browser.")] = None,
) -> int:
    """Tell whether a model stands, and prove it.

    Exit status: 0 stable, 1 unstable, 3 undecided, 2 bad input.
    """
    began = time.perf_counter()
    wanted: dict[str, Any] = {
        "method": "" if method is None else choice("--method", method, METHODS),
        "mu": optional_number("--mu", mu, least=0.0),
        "density": optional_number("--density", density, above=0.0),
        "supports": supports,
        "gravity": vector("--gravity", gravity),
        "tilt": tilt("--tilt", tilt_by),
        "tolerance": optional_number("--tolerance", tolerance, above=0.0),
        "cone": cone,
        "solver": solver,
        "weights": weights("--weights", weigh),
        "penalty": penalty,
        "combination": combination,
        "factors": case_factors("--factor", factor),
        "tension": optional_number("--tension", tension, above=0.0),
        "cohesion": optional_number("--cohesion", cohesion, above=0.0),
        "settle": settlements("--settle", settle),
    }
    search = {
        "eps": optional_number("--eps", eps, above=0.0),
        "eta": optional_number("--eta", eta, above=0.0),
        "beta_min": optional_number("--beta-min", beta_min, above=0.0),
        "seconds": optional_number("--seconds", seconds, above=0.0),
        "nodes": whole("--nodes", nodes) if nodes is not None else None,
    }
    wanted |= {name: value for name, value in search.items() if value is not None}
    course = None if steps is None else whole("--steps", steps)
    variation = asked(varies, samples, seed, workers, cluster)
    files = planned({"--json": json, "--certificate": certificate, "--report": report}, keep=model)
    if all_combinations and (combination or files or json or variation is not None or course is not None):
        given = "--combination" if combination else "--vary" if variation is not None else next(iter(files), "--json")
        given = given if course is None else "--steps"
        raise InputError(f"--all-combinations prints a table and nothing else; leave out {given}")

    from cyclopean import analysis, io

    settings = analysis.Settings(**wanted)
    idle = tuple(f"--{name.replace('_', '-')}" for name, value in search.items() if value is not None)
    if idle and settings.chosen_method() == "rbe":
        warn(f"{', '.join(idle)}: no effect, for only coupled analysis has it (--method cra)")
    with long_work(f"checking {model}") as stage, of_file(model):
        started = time.perf_counter()
        assembly, warnings = io.read_model(model, units)
        read = time.perf_counter() - started
        if rough is not None:
            assembly, said = _on_rough_surfaces(model, assembly, rough)
            warnings = (*warnings, *said)
        if all_combinations:
            return _every_combination(model, assembly, settings, warnings, stage)
        result, path = followed(assembly, settings, analysis.check(assembly, settings, stage), course, stage)
        margins = _margins(assembly, settings, result, spare, stage)
        sensitivity = None if variation is None else vary(assembly, settings, variation, stage)
    result = replace(
        result,
        warnings=(*warnings, *result.warnings),
        seconds={"read": read, **result.seconds, "total": time.perf_counter() - began},
    )
    for warning in result.warnings:
        warn(warning)
    data = write_result(result, files, model, margins, sensitivity, path)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        more = [] if sensitivity is None else sensitivity_lines(sensitivity)
        told = [*verdict_lines(result, data, files), *_margin_lines(margins, result)]
        if path is not None:  # what opens in a small settlement is not what opens in this one
            told = [*(line for line in told if not line.startswith("  opened")), *path_lines(path, result)]
        say("\n".join([*told, *more]))
    return STATUS[result.verdict]


def _on_rough_surfaces(model: str, assembly: "Assembly", rough: str) -> tuple["Assembly", tuple[str, ...]]:
    """Give a model that lists no contacts those of its rough surfaces, and say what they stand for."""
    from cyclopean.assembly import rough_contacts
    from cyclopean.assembly.patches import patch_notes

    band = None if rough == "auto" else optional_number("--rough", rough, above=0.0)
    if assembly.contacts is not None:
        raise InputError(f"--rough: {model} lists its contacts; leave --rough out")
    contacts, patches = rough_contacts(assembly, band)
    return replace(assembly, contacts=contacts), patch_notes(assembly, patches)


def _every_combination(
    model: str,
    assembly: "Assembly",
    settings: "Settings",
    warnings: tuple[str, ...],
    stage: Callable[[str], None],
) -> int:
    """One line for each combination of the model; the exit status of the worst: unstable, then undecided."""
    from cyclopean import analysis

    if not assembly.combinations:
        raise InputError(f'{model}: has no "combinations"; name some in the model, or use --factor')
    results = {
        one.name: analysis.check(assembly, replace(settings, combination=one.name), stage)
        for one in assembly.combinations
    }
    for warning in dict.fromkeys((*warnings, *(w for result in results.values() for w in result.warnings))):
        warn(warning)
    wide = max(map(len, results))
    for name, result in results.items():
        loads = "" if result.loading is None else result.loading.words().partition(": ")[2]
        say(f"{name:{wide}}  {result.verdict:9}  {loads}")
    words = {result.verdict for result in results.values()}
    return STATUS[next(word for word in ("unstable", "undecided", "stable") if word in words)]


def _margins(
    assembly: "Assembly", settings: "Settings", result: "Result", wanted: bool | None, stage: Callable[[str], None]
) -> "Margins | None":
    """What a model that stands has to spare; without being asked only where that takes about a second."""
    from cyclopean import analysis
    from cyclopean.analysis.safety_margins import POINTS

    few = len(result.contacts.point) <= POINTS
    if result.verdict != "stable" or result.settled is not None or not (few if wanted is None else wanted):
        return None
    stage("margins")
    given = replace(assembly, contacts=result.contacts)
    return analysis.margins(analysis.prepare(given, settings, stage), settings)


def _margin_lines(found: "Margins | None", result: "Result") -> list[str]:
    """How far it is from falling, on one line."""
    if found is None:
        return []
    told = []
    if (friction := found.friction) is not None:
        mu = result.contacts.mu
        one = len(mu) and mu.min() == mu.max()
        least = f"mu {friction.stands * mu[0]:.3g}" if one else f"{100 * friction.stands:.1f} % of mu"
        told.append("needs no friction" if friction.stands == 0.0 else f"needs {least}")
    if (joints := found.joints) is not None:
        over = "at least " if joints.falls is None else ""
        told.append(f"geometric safety {over}{found.geometric_safety:.4g}")
    if (tilt := found.tilt) is not None:
        told.append(f"tilt up to {tilt.stands:.2f} degrees towards azimuth {found.azimuth:g}")
    return [f"  margins  {', '.join(told)} (by rbe)"] if told else []


def write_result(
    result: "Result",
    files: dict[str, Path],
    model: str,
    margins: "Margins | None" = None,
    sensitivity: "Sensitivity | None" = None,
    path: "Subsidence | None" = None,
) -> dict[str, Any]:
    """Write the files that were asked for, once all of them are composed; return the result as data.

    Parameters
    ----------
    result : Result
        What was found.
    files : dict of str to Path
        Where to write, by option; the files name each other by relative paths.
    model : str
        Path of the model.
    margins : Margins, optional
        What the model has to spare.
    sensitivity : Sensitivity, optional
        What became of samples, where some were drawn.
    path : Subsidence, optional
        The steps of a settlement, where it was followed.
    """
    from cyclopean import io

    proof = files.get("--certificate") if result.certificate is not None else None
    data = io.result_dict(result, seen_from(files.get("--json"), proof))
    if margins is not None:
        data["margins"] = io.margins_dict(margins, result)
    if sensitivity is not None:
        data["sensitivity"] = io.sensitivity_dict(sensitivity)
    if path is not None:
        data["path"] = io.subsidence_dict(path, result)
    page = None
    if "--report" in files:
        from cyclopean.view import report_html
        from cyclopean.view.margins_table import margins_section
        from cyclopean.view.sensitivity_chart import sensitivity_section
        from cyclopean.view.subsidence_table import subsidence_section

        there = files["--report"]
        page = report_html(
            result,
            certificate_file=seen_from(there, proof),
            model_file=seen_from(there, Path(model)),
            sections=(
                "" if path is None else subsidence_section(path, result),
                "" if margins is None else margins_section(margins, result),
                "" if sensitivity is None else sensitivity_section(sensitivity),
            ),
        )
    with io.together():
        if proof is not None:
            io.write_json(proof, result.certificate)
        elif "--certificate" in files:
            old = "; the file that is there is of an earlier run" if files["--certificate"].is_file() else ""
            warn(f"--certificate {files['--certificate']}: nothing was proved, so no certificate is written{old}")
        if page is not None:
            io.write_text(files["--report"], page)
        if "--json" in files:
            io.write_json(files["--json"], data)
    return data


def verdict_lines(result: "Result", data: dict[str, Any], files: dict[str, Path]) -> list[str]:
    """Say the verdict, why, what it rests on, and where the files are."""
    lines = [
        f"{result.verdict}: {result.reason}",
        f"  model    {result.assembly.name}: {data['blocks']} blocks, {data['free']} of them free,"
        f" {data['contacts']} contacts; method {result.method}",
    ]
    if result.loading is not None:
        lines.append(f"  loads    {result.loading.words()}")
    if result.partly_held:
        lines.append(f"  held     partly: {_some(result.partly_held)}")
    if result.settled is not None:
        lines.append(f"  opened   {_opened(result)}")
    if result.strength > 0.0:
        lines.append(f"  WARNING  this counts on joints that pull with up to {result.strength:g} Pa; dry joints do not")
    if result.assumed:
        lines.append("  assumed  " + ", ".join(f"{name} {_plain(value)}" for name, value in result.assumed.items()))
    if result.certificate is not None:
        lines.append(f"  proof    {result.certificate['kind']}, checked in exact arithmetic{_within(result)}")
    lines += _tension_line(result)
    written = [str(path) for option, path in files.items() if option != "--certificate" or result.certificate]
    if written:
        lines.append(f"  written  {', '.join(written)}")
    return lines


def _opened(result: "Result") -> str:
    """The joints that open furthest in a settlement, in m."""
    from cyclopean.analysis import openings

    ids, a, b = [block.id for block in result.assembly.blocks], result.contacts.a, result.contacts.b
    found = [f"{ids[a[k]]} and {ids[b[k]]} by {width:.3g} m" for k, width in openings(result)]
    more = f" and {len(found) - 4} more" if len(found) > 4 else ""
    return ", ".join(found[:4]) + more if found else "nothing"


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def _within(result: "Result") -> str:
    """The bounds on which a proof by coupled analysis depends."""
    proof = result.certificate
    if proof is None or not {"eps", "eta", "beta_min"} <= proof.keys():
        return ""
    return f"; eta {proof['eta'] / proof['eps']:g} eps, beta_min {proof['beta_min'] / proof['eps']:g} eps"


def _tension_line(result: "Result") -> list[str]:
    """Say where joints would pull, when that was measured."""
    if result.tension is None or not len(result.tension):
        return []
    at = int(result.tension.argmax())
    ends = (
        result.assembly.blocks[int(x[result.contacts.patch[at]])].id for x in (result.contacts.a, result.contacts.b)
    )
    # the price on tension is finite, so a trace of it is left where none is needed
    trace = 1e-4 * float(abs(result.force[:, 0]).max(initial=0.0)) if result.force is not None else 0.0
    if not (result.tension[at] > trace):
        return [f"  tension  none {'is needed' if result.verdict == 'stable' else 'that would help was found'}"]
    return [f"  tension  at most {result.tension[at]:.3g} N at a point, between {' and '.join(ends)}"]


def _plain(value: Any) -> str:
    """Write numbers as a person does."""
    if isinstance(value, int | float):
        return f"{value:g}"
    if isinstance(value, str):
        return value
    return "(" + ", ".join(f"{float(x):g}" for x in value) + ")"
