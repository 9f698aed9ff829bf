"""`convert` and `verify`: the same model in another format, and does a certificate prove what it says?"""

import os
import stat
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.api.inputs import Reading
from cyclopean.cli.command import argument, command, written
from cyclopean.cli.outputs import Files, planned
from cyclopean.cli.terminal import long_work, of_file, one_line, say, warn
from cyclopean.errors import InputError
from cyclopean.options import Option

if TYPE_CHECKING:
    from cyclopean.analysis import Comparison
    from cyclopean.assembly import Healing
    from cyclopean.proof import Report

LISTED = 10  # blocks in the table of what was moved
LARGEST = 1 << 30  # bytes that a certificate may have


@command()
def verify(
    certificate: Annotated[
        str | None, argument("CERTIFICATE", "Certificate file; not needed with --page.", source=True)
    ] = None,
    model: Annotated[
        str | None, Option("Model file that it has to be about; says what differs.", metavar="MODEL")
    ] = None,
    reading: Reading = Reading(),
    tolerance: Annotated[
        Any, Option("What the model's drawing was forgiven.", "tolerance", metavar="GAP[,DEGREES]|auto")
    ] = None,
    files: Annotated[
        Files, written("json", page=("F", "Write a page that checks certificates dropped on it, off line."))
    ] = Files({}),
) -> int:
    """Check a certificate in exact arithmetic.

    Exit status: 0 it proves what it claims, 1 it does not, or not of this model, 2 it cannot be read.
    """
    if certificate is None:
        return _page_alone(files, model)
    units = reading.units
    if model is not None:
        files.within(Path(), (), (model,))
    elif units is not None or tolerance is not None:
        name = "tolerance" if units is None else "units"
        raise InputError.of(name, tolerance if units is None else units, "is of a model; give `model` too")

    from cyclopean.proof import NotACertificateError, read_file, verify_file
    from cyclopean.proof import verify as checked

    try:
        _refuse_endless(certificate)
        with long_work(f"verifying {certificate}"):
            content = {} if model is None else read_file(certificate)
            report = verify_file(certificate) if model is None else checked(content)
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise InputError(f"{certificate or repr(certificate)}: cannot be read: {why}") from None
    except NotACertificateError as error:
        raise InputError(f"{certificate}: {error}") from None
    same = None if model is None else _compared(report, content, model, reading, tolerance)
    data = asdict(report)
    if same is not None:
        data["model"] = {"same": not same.differences, "differences": list(same.differences)}
    if files.to:
        files.write({"json": lambda: data, "page": _page})
    files.tell(data, _told(report, model, same))
    return 0 if report.proved and not (same and same.differences) else 1


def _page_alone(files: Files, model: str | None) -> int:
    """Write the page that checks certificates, where none is given to be checked now.

    Raises
    ------
    InputError
        Neither a certificate nor a page is asked for, or what only goes with a certificate.
    """
    if "page" not in files.to:
        raise InputError(
            "CERTIFICATE is missing: name a certificate file, or write a page that checks them with `page`"
        )
    if model is not None or "json" in files.to or files.only_json:
        raise InputError.of("model" if model is not None else "json", model or "-", "goes with a certificate; name one")
    files.write({"page": _page})
    say(f"{files.to['page']}: drop a certificate on this page to check it; it needs no network")
    return 0


def _page() -> str:
    from cyclopean.view.proof_here import proof_page

    return proof_page()


def _compared(
    report: "Report", content: Mapping[str, Any], model: str, reading: Reading, tolerance: Any
) -> "Comparison | None":
    """Hold what has been proved against a model file; of what has not, only the file is read."""
    from cyclopean import io

    with of_file(model):
        assembly, warnings = io.read_model(model, reading.units, reading.strict)
        for warning in warnings:
            warn(warning)
        if not report.proved:
            return None
        from cyclopean.analysis import Settings, compare

        with long_work(f"comparing with {model}"):
            return compare(content, assembly, Settings(tolerance=tolerance))


def _told(report: "Report", model: str | None, same: "Comparison | None") -> list[str]:
    """The answer, line by line: what is proved, and what it assumes or how it differs from the model."""
    word = "proved" if report.proved else "NOT proved"
    if same is not None and same.differences:
        word = "PROVED, BUT NOT OF THIS MODEL"
    lines = [f"{word}: {report.claim or 'no claim that can be read'}", f"  {report.reason}"]
    if same is None:
        return [*lines, *(f"  {line}" for line in report.assumed)]
    if same.differences:
        return [*lines, *(f"  {one_line(line)}" for line in same.differences)]
    near = f"; lengths differ by at most {same.apart:.2g} m" if same.apart else ", to the last digit"
    return [
        *lines,
        f"  model      {model}: the same blocks, contacts and loads{near}",
        f"  assumed    {one_line(', '.join(same.assumed))}",
    ]


def _refuse_endless(path: str) -> None:
    """Refuse what would be read for ever, or would not fit into memory.

    Raises
    ------
    InputError
        A folder, a device, a named pipe, a path that is none, or a file of more than `LARGEST` bytes.
    OSError
        There is no such file.
    """
    try:
        found = os.stat(path)
    except ValueError:  # a null character
        raise InputError(f"{path}: is not a path") from None
    mode = found.st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"{path}: is a folder; name a file in it")
    if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):
        raise InputError(f"{path}: is a device; name a file")
    if stat.S_ISFIFO(mode) and not path.startswith("/dev/"):  # a shell's own pipes end, others need not
        raise InputError(f"{path}: is a pipe; name a file")
    if found.st_size > LARGEST:
        raise InputError(f"{path}: holds {found.st_size / 1e9:.1f} GB, more than any certificate; is it one?")


@command()
def convert(
    source: Annotated[str, argument("IN", "Model file to read.")],
    target: Annotated[str, argument("OUT", "File to write; its ending decides.")],
    result: Annotated[
        tuple[str, ...],
        Option(
            "Result, match, carving, sequence or interlock of the model, to go along; may be given several times.",
            "texts",
            metavar="F",
        ),
    ] = (),
    heal: Annotated[
        float | None,
        Option(
            "Move vertices by up to L (m) so that faces that are meant to touch lie in one plane.",
            "number",
            metavar="L",
            above=0.0,
            unit="m",
        ),
    ] = None,
    reading: Reading = Reading(),
) -> int:
    """Write a model in another format, in metres.

    Endings: .json, .compas.json, .3dm (Rhino), .ifc, .glb, .obj, .ply, .stl, .3ddat (3DEC), .csv (tables).
    """
    from cyclopean import io
    from cyclopean.assembly import heal as healed

    outputs = [str(path) for path in io.exchange_paths(target)]
    names = ["OUT", "OUT, contacts"][: len(outputs)]
    for kept in (source, *result):
        planned(dict(zip(names, outputs, strict=True)), keep=kept)
    if heal is not None and result:
        raise InputError.of(
            "heal", heal, "a result is of the model as it is drawn; heal it, then check what is written"
        )
    assembly, warnings = io.read_model(source, reading.units, reading.strict)
    assembly, findings, more = io.read_findings(result, assembly)
    drawn, stale = io.read_drawing(source)
    drawing = None if drawn is None else io.drawing_dict(drawn)
    lines: list[str] = []
    if heal is not None:
        with long_work(f"healing {source}"), of_file(source):
            healing = healed(assembly, heal)
        assembly, more, lines = healing.assembly, (*more, *healing.warnings), _moved(healing)
        if drawing is not None and healing.moved.any():
            drawing = None
            more = (*more, f"{source}: how the wall was drawn is dropped: what is healed is no longer that")
    lost = io.write_exchange(target, assembly, findings, drawing)
    for warning in (*warnings, *more, *(stale if drawn is None else ()), *lost):
        warn(warning)
    written = outputs[:1] if assembly.contacts is None else outputs
    say("\n".join([f"{assembly.name}: {len(assembly)} blocks; written {', '.join(written)}", *lines]))
    return 0


def _moved(healing: "Healing") -> list[str]:
    """What was moved, and a table of the blocks that moved most."""
    by, blocks = healing.moved.tolist(), healing.assembly.blocks
    moved = sorted((k for k, far in enumerate(by) if far), key=lambda k: -by[k])
    if not moved:
        return ["  healed     nothing had to move"]
    most, growth = 1e3 * max(by), 100.0 * max(map(abs, healing.growth.tolist()))
    lines = [
        f"  healed     {len(moved)} of {len(blocks)} blocks: vertices by up to {most:.3g} mm,"
        f" volumes by up to {growth:.2g} %"
    ]
    rows = moved[:LISTED]
    wide = max(5, *(len(one_line(blocks[k].id)) for k in rows))
    lines.append(f"  {'block':{wide}}  moved, mm  volume, %  planes shared")
    lines += [
        f"  {one_line(blocks[k].id):{wide}}  {1e3 * healing.moved[k]:9.3g}  {100.0 * healing.growth[k]:+9.2g}"
        f"  {healing.matched[k]:13d}"
        for k in rows
    ]
    return [*lines, f"  ... and {len(moved) - LISTED} more"] if len(moved) > LISTED else lines
