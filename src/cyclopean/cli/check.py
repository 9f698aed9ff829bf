"""`check`: does it stand?"""

import os
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.model_options import Density, Gravity, ModelFile, Mu, Supports, Tolerance, Units
from cyclopean.cli.outputs import STANDARD_OUTPUT, planned
from cyclopean.cli.terminal import long_work, say, say_json, warn
from cyclopean.cli.values import choice, optional_number, tilt, vector, weights, whole

if TYPE_CHECKING:
    from cyclopean.analysis import Result

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
    units: Units = None,
    tolerance: Tolerance = None,
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
    }
    search = {
        "eps": optional_number("--eps", eps, above=0.0),
        "eta": optional_number("--eta", eta, above=0.0),
        "beta_min": optional_number("--beta-min", beta_min, above=0.0),
        "seconds": optional_number("--seconds", seconds, above=0.0),
        "nodes": whole("--nodes", nodes) if nodes is not None else None,
    }
    wanted |= {name: value for name, value in search.items() if value is not None}
    files = planned({"--json": json, "--certificate": certificate, "--report": report}, keep=model)

    from cyclopean import analysis, io

    settings = analysis.Settings(**wanted)
    idle = tuple(f"--{name.replace('_', '-')}" for name, value in search.items() if value is not None)
    if idle and settings.chosen_method() == "rbe":
        warn(f"{', '.join(idle)}: no effect, for only coupled analysis has it (--method cra)")
    with long_work(f"checking {model}") as stage:
        started = time.perf_counter()
        assembly, warnings = io.read_model(model, units)
        read = time.perf_counter() - started
        result = analysis.check(assembly, settings, stage)
    result = replace(
        result,
        warnings=(*warnings, *result.warnings),
        seconds={"read": read, **result.seconds, "total": time.perf_counter() - began},
    )
    for warning in result.warnings:
        warn(warning)
    data = write_result(result, files, model)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join(verdict_lines(result, data, files)))
    return STATUS[result.verdict]


def write_result(result: "Result", files: dict[str, Path], model: str) -> dict[str, Any]:
    """Write the files that were asked for, once all of them are composed; return the result as data.

    Parameters
    ----------
    result : Result
        What was found.
    files : dict of str to Path
        Where to write, by option; the files name each other by relative paths.
    model : str
        Path of the model.
    """
    from cyclopean import io

    proof = files.get("--certificate") if result.certificate is not None else None
    data = io.result_dict(result, _seen_from(files.get("--json"), proof))
    page = None
    if "--report" in files:
        from cyclopean.view import report_html

        there = files["--report"]
        page = report_html(result, certificate_file=_seen_from(there, proof), model_file=_seen_from(there, Path(model)))
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


def _seen_from(page: Path | None, file: Path | None) -> str | None:
    """Name a file as seen from the folder of another one, or from here where that is standard output."""
    if file is None:
        return None
    return os.path.relpath(file, os.curdir if page is None else page.parent).replace(os.sep, "/")


def verdict_lines(result: "Result", data: dict[str, Any], files: dict[str, Path]) -> list[str]:
    """Say the verdict, why, what it rests on, and where the files are."""
    lines = [
        f"{result.verdict}: {result.reason}",
        f"  model    {result.assembly.name}: {data['blocks']} blocks, {data['free']} of them free,"
        f" {data['contacts']} contacts; method {result.method}",
    ]
    if result.assumed:
        lines.append("  assumed  " + ", ".join(f"{name} {_plain(value)}" for name, value in result.assumed.items()))
    if result.certificate is not None:
        lines.append(f"  proof    {result.certificate['kind']}, checked in exact arithmetic{_within(result)}")
    lines += _tension_line(result)
    written = [str(path) for option, path in files.items() if option != "--certificate" or result.certificate]
    if written:
        lines.append(f"  written  {', '.join(written)}")
    return lines


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
