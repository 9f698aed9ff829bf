"""`view`: a model or a result as a page in the browser."""

import os
from pathlib import Path, PurePath
from typing import Annotated

from cyclopean.api.inputs import Reading
from cyclopean.cli.command import argument, command, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import long_work, say, warn
from cyclopean.errors import InputError
from cyclopean.options import Option


@command()
def view(
    file: Annotated[str, argument("FILE", "Model or result file.", source=True)],
    files: Annotated[Files, written(out=("F", "Page to write [a new file in the folder for temporary ones]."))] = Files(
        {}
    ),
    model: Annotated[str | None, Option("Model of a result, where it is not found beside it.", metavar="MODEL")] = None,
    no_browser: Annotated[bool, Option("Only write the page.", "flag")] = False,
    reading: Reading = Reading(),
) -> int:
    """Show a model, or the result of a check, as a page that needs no network."""
    if not files.to and no_browser:
        raise InputError("`no_browser`: needs `out` F, or nobody would find the page")

    from cyclopean import io

    with long_work(f"drawing {file}"):
        page, warnings = _page(file, model, reading)
    for warning in warnings:
        warn(warning)
    path = files.to.get("out") or _temporary(file)
    io.write_text(path, page)
    say(f"written {path}")
    if not no_browser:
        import webbrowser

        webbrowser.open(path.resolve().as_uri())
    return 0


def _page(file: str, model: str | None, reading: Reading) -> tuple[str, tuple[str, ...]]:
    """The page, and what reading had to say."""
    from cyclopean.io.result_reading import is_result, read_result

    if is_result(file):
        from cyclopean.view import report_html

        result, warnings = read_result(file, model, reading.units)
        return report_html(result), warnings
    if model is not None:
        raise InputError(f"`model`: {file} is itself a model, not a result")
    return _drawn(file, reading)


def _drawn(file: str, reading: Reading) -> tuple[str, tuple[str, ...]]:
    import numpy as np

    from cyclopean import io
    from cyclopean.assembly import Contacts, check_contacts, detect, supports
    from cyclopean.geometry import mesh_faults
    from cyclopean.view.model_page import model_html

    assembly, warnings = io.read_model(file, reading.units, reading.strict)
    sound = not mesh_faults(assembly.mesh)
    contacts = Contacts.of([], []) if assembly.contacts is None else assembly.contacts
    if not sound:
        warnings += ("some blocks are no closed solids, so contacts are not looked for; see the command info",)
    elif assembly.contacts is None:
        found = detect(assembly)
        contacts, warnings = found.contacts, (*warnings, *found.warnings)
    else:
        contacts, _, said = check_contacts(assembly, assembly.contacts)
        warnings += said
    nothing_held = all(block.fixed is False for block in assembly.blocks)
    held = np.zeros(len(assembly), bool) if nothing_held else supports(assembly)[0]
    return model_html(assembly, contacts, held, warnings), warnings


def _temporary(file: str) -> Path:
    import tempfile

    stem = PurePath(file).stem
    handle, path = tempfile.mkstemp(prefix=f"{stem if stem.isprintable() else 'model'}-", suffix=".html")
    os.close(handle)
    return Path(path)
