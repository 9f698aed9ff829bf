"""`check`: does it stand?"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.analysis.answers import answer
from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import CheckOptions, examined
from cyclopean.api.inputs import Reading
from cyclopean.cli.command import argument, command, written
from cyclopean.cli.outputs import Files, seen_from
from cyclopean.cli.terminal import long_work, of_file, say, warn
from cyclopean.cli.workers import workers as hands
from cyclopean.errors import InputError
from cyclopean.options import option
from cyclopean.texts import first_few, plain

if TYPE_CHECKING:
    from cyclopean.analysis import Margins, Result, Sensitivity, Subsidence

MODEL = argument("MODEL", "Model file.", source=True)
STATUS = {"stable": 0, "unstable": 1, "undecided": 3}
AT_ETA = "at eta"  # the file of the proof of a state at a larger eta
FEW = 24  # rows of the table of a settlement on the terminal


@dataclass(frozen=True, slots=True)
class Several:
    """What of a model is checked more than once, and who does that."""

    all_combinations: bool = option(False, "Check every combination of the model; a table.", "flag")
    workers: int | None = option(None, "With `vary`: processes [1].", "whole", metavar="N")
    cluster: str | None = option(None, "With `vary`: scheduler of a dask cluster.", metavar="ADDRESS")


@command(settle="is --settlement now; to settle is to lay stones")
def check(
    model: Annotated[str, MODEL],
    settings: Settings = Settings(),
    reading: Reading = Reading(),
    options: CheckOptions = CheckOptions(),
    several: Several = Several(),
    files: Annotated[Files, written("json", "certificate", "report", "drawing")] = Files({}),
) -> int:
    """Tell whether a model stands, and prove it.

    Exit status: 0 stable, 1 unstable, 3 undecided, 2 bad input.
    """
    for name in ("workers", "cluster"):
        if getattr(several, name) is not None and not options.vary:
            raise InputError.of(name, None, "nothing varies; say what does, such as `vary` mu=0.6:0.8")
    with long_work(f"checking {model}") as stage, of_file(model):
        if several.all_combinations:
            return _every_combination(model, settings, reading, options, files, stage)
        with hands(several.workers or 1, several.cluster) as executor:
            result = examined(model, settings, reading, options, stage, executor)
        stage("margins")
        spare = result.margins
    for warning in result.warnings:
        if warning != result.drawing:
            warn(warning)
    data = write_result(result, files, model)
    files.tell(data, _lines(result, data, files, spare))
    return STATUS[result.verdict]


def _every_combination(
    model: str,
    settings: Settings,
    reading: Reading,
    options: CheckOptions,
    files: Files,
    stage: Callable[[str], None],
) -> int:
    """One line for each combination of the model; the exit status of the worst: unstable, then undecided."""
    given = "combination" if settings.combination else "vary" if options.vary else next(iter(files.to), "")
    if given := "json" if files.only_json else "steps" if options.steps is not None else given:
        raise InputError(f"`all_combinations` prints a table and nothing else; leave out `{given}`")
    from cyclopean.api.inputs import assembly_of

    assembly, warnings = assembly_of(model, reading)
    if not assembly.combinations:
        raise InputError(f'{model}: has no "combinations"; name some in the model, or use `factor`')
    results = {
        one.name: examined(assembly, replace(settings, combination=one.name), Reading(), options, stage)
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


def write_result(result: "Result", files: Files, model: str) -> dict[str, Any]:
    """Write the files that were asked for, once all of them are composed; return the result as data.

    Parameters
    ----------
    result : Result
        What was found.
    files : Files
        Where to write; the files name each other by relative paths.
    model : str
        Path of the model.
    """
    from cyclopean import io
    from cyclopean.api.drawings import drawn

    proof, files = files.proof(result.certificate), _beside(result, files)
    data = io.result_dict(result, *(seen_from(files.to.get("json"), file) for file in (proof, files.to.get(AT_ETA))))
    there = files.to.get("report")

    def page() -> str:
        from cyclopean.view import report_html

        return report_html(result, certificate_file=seen_from(there, proof), model_file=seen_from(there, Path(model)))

    known = result.undecided
    at = None if known is None or known.stable_at is None else known.stable_at.certificate
    proofs: dict[str, Callable[[], Any]] = {"certificate": lambda: result.certificate, AT_ETA: lambda: at}
    steps = () if result.path is None else result.path.proofs
    files = replace(files, to={**files.to, **files.points(steps)[0]})
    proofs |= {f"step-{k:02d}": partial(dict, found) for k, found in enumerate(steps) if found is not None}
    files.write({**proofs, "report": page, "json": lambda: data, **drawn(result)})
    return data


def _beside(result: "Result", files: Files) -> Files:
    """The files, with the certificate of a state at a larger eta beside that of the verdict, which it is not."""
    file, known = files.to.get("certificate"), result.undecided
    if file is None or known is None or known.stable_at is None:
        return files
    return replace(files, to={**files.to, AT_ETA: file.with_name(f"{file.stem}-at-eta{file.suffix}")})


def _lines(result: "Result", data: dict[str, Any], files: Files, spare: "Margins | None") -> list[str]:
    """All that is said of a result."""
    told = [*verdict_lines(result, data), *_margin_lines(spare, result)]
    if result.path is not None:  # what opens in a small settlement is not what opens in this one
        told = [*(line for line in told if not line.startswith("  opened")), *_path_lines(result.path, result, files)]
    if result.sensitivity is not None:
        told += _sensitivity_lines(result.sensitivity)
    return told + _beside(result, files).line(but=() if result.certificate else ("certificate",))


def _margin_lines(found: "Margins | None", result: "Result") -> list[str]:
    """How far it is from falling, on one line."""
    if found is None:
        return []
    from cyclopean.analysis.verdict import millimetres

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
    if found.within:
        told.append(f"holds for drawings within {millimetres(found.within)}")
    return [f"  margins  {', '.join(told)} (by rbe)"] if told else []


def _path_lines(path: "Subsidence", result: "Result", files: Files) -> list[str]:
    """The table: how far, what was found, and the widest joint."""
    ids, a, b = [block.id for block in result.assembly.blocks], path.contacts.a, path.contacts.b
    lines = ["  path     settlement m   found       widest joint m"]
    every = -(-len(path.steps) // FEW)
    for k, step in enumerate(path.steps):
        if k % every and k < len(path.steps) - 3 and not step.met:
            continue
        joint = "" if step.joint < 0 else f"   {ids[a[step.joint]]} and {ids[b[step.joint]]}"
        joint += "".join(f"   ({one} and {other} meet)" for one, other in step.met)
        lines.append(f"           {step.settlement:<12.5g}   {step.word:9}   {step.opening:<8.4g}{joint}".rstrip())
    lines.append(f"  steps    {files.points(path.proofs)[1]}")
    if not path.proved:
        lines.append(
            "  NOT PROVED  no certificate covers any of these states but the first, which moves by next to nothing"
        )
    return lines


def _sensitivity_lines(found: "Sensitivity") -> list[str]:
    """Say what the samples came to."""
    what = ", ".join(f"{r.quantity} {r.low:g} to {r.high:g}" for r in found.ranges)
    lines = [f"  vary     {what}: {found.why}"]
    if found.words:
        low, estimate, high = found.probability
        count = found.count
        lines.append(
            f"           {count['stable']} of {len(found.words)} samples stand, {count['unstable']} fall,"
            f" {count['undecided']} undecided: {100 * estimate:.1f} % stand"
            f" (95 % sure: {100 * low:.1f} to {100 * high:.1f} %)"
        )
    return lines


def verdict_lines(result: "Result", data: dict[str, Any]) -> list[str]:
    """Say the verdict, why, and what it rests on."""
    known, (word, said) = result.undecided, answer(result)
    why = "" if said.startswith(result.reason) or known is not None else f": {result.reason}"
    lines = [
        f"{word}. {said}",
        *([] if known is None else [f"  {word:8} {text}" for word, text in known.lines()]),
        f"  verdict  {result.verdict}, by {result.method}{why}",
        f"  model    {result.assembly.name}: {data['blocks']} blocks, {data['free']} of them free,"
        f" {data['contacts']} contacts",
    ]
    if result.drawing:
        lines.append(f"  drawing  {result.drawing}")
    if result.loading is not None:
        lines.append(f"  loads    {result.loading.words()}")
    if result.partly_held:
        lines.append(f"  held     partly: {first_few(result.partly_held, 5)}")
    if result.settled is not None:
        lines.append(f"  opened   {_opened(result)}")
    if result.strength > 0.0:
        lines.append(f"  WARNING  this counts on joints that pull with up to {result.strength:g} Pa; dry joints do not")
    lines += assumed_line(result.assumed)
    if result.certificate is not None:
        lines.append(f"  proof    {result.certificate['kind']}, checked in exact arithmetic{_within(result)}")
    return lines + _tension_line(result)


def assumed_line(assumed: Mapping[str, Any]) -> list[str]:
    """What neither the model nor the command said, on one line."""
    return [f"  assumed  {', '.join(f'{name} {plain(value)}' for name, value in assumed.items())}"] if assumed else []


def _opened(result: "Result") -> str:
    """The joints that open furthest in a settlement, in m."""
    from cyclopean.analysis import openings

    ids, a, b = [block.id for block in result.assembly.blocks], result.contacts.a, result.contacts.b
    found = [f"{ids[a[k]]} and {ids[b[k]]} by {width:.3g} m" for k, width in openings(result)]
    return first_few(found, 4) or "nothing"


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
