"""The result file `cyclopean.result/1`."""

import math
from typing import TYPE_CHECKING, Any

from cyclopean import __version__

if TYPE_CHECKING:  # only a name here: converting a file must not load the solvers
    from cyclopean.analysis import Result

__all__ = ["result_dict"]

SCHEMA = "cyclopean.result/1"


def result_dict(result: "Result", certificate_file: str | None = None) -> dict[str, Any]:
    """Return a verdict as plain lists, numbers and text, ready for JSON; what is not finite becomes null.

    Parameters
    ----------
    result : Result
        The verdict.
    certificate_file : str, optional
        Where the certificate was written.

    Returns
    -------
    dict
        `forces` only where there are forces (N, in the frame of the patch, on `b`) or where tension was measured (then
        with `tension`, N at each point; `force` is null where no state was found), `mechanism` only when unstable (m/s
        and rad/s of every free block, up to a common factor), `displacement` only when stable by coupled analysis (the
        virtual one of every free block: lengths in the unit of eps, rotations in that unit per metre).
    """
    contacts, ids = result.contacts, [block.id for block in result.assembly.blocks]
    free = [i for i, held in enumerate(result.fixed.tolist()) if not held]
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "model": result.assembly.name,
        "method": result.method,
        "verdict": result.verdict,
        "reason": result.reason,
        "blocks": len(ids),
        "free": len(free),
        "contacts": len(contacts),
        "points": len(contacts.point),
        "assumed": result.assumed,
        "residuals": result.residuals,
    }
    if result.force is not None or result.tension is not None:
        document["forces"] = _forces(result, ids)
    if result.verdict == "unstable" and result.mechanism is not None:
        document["mechanism"] = {ids[i]: result.mechanism[i].tolist() for i in free}
    if result.verdict == "stable" and result.displacement is not None:
        document["displacement"] = {ids[i]: result.displacement[i].tolist() for i in free}
    kind = None if result.certificate is None else result.certificate.get("kind")
    document["certificate"] = None if result.certificate is None else {"kind": kind, "file": certificate_file}
    document["provenance"] = {"cyclopean": __version__} | result.provenance
    document["seconds"] = result.seconds
    return {key: _plain(value) for key, value in document.items()}


def _forces(result: "Result", ids: list[str]) -> list[dict[str, Any]]:
    contacts, force = result.contacts, result.force
    frame = contacts.frame if result.frame is None else result.frame
    rows = []
    for k, (a, b) in enumerate(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True)):
        row: dict[str, Any] = {"a": ids[a], "b": ids[b], "polygon": contacts.polygon(k).tolist()}
        here = slice(contacts.start[k], contacts.start[k + 1])
        row["force"] = None if force is None else force[here].tolist()
        row["frame"] = frame[k].tolist()
        row["utilisation"] = None if result.utilisation is None else float(result.utilisation[k])
        if result.tension is not None:
            row["tension"] = result.tension[here].tolist()
        rows.append(row)
    return rows


def _plain(value: Any) -> Any:
    """Lists, dicts, text and finite numbers; arrays and numpy scalars become those, the rest text."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
