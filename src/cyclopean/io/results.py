"""The result file `cyclopean.result/1`."""

import math
from typing import TYPE_CHECKING, Any

from cyclopean import __version__

if TYPE_CHECKING:  # only a name here: converting a file must not load the solvers
    from cyclopean.analysis import Margins, Result, Sensitivity, Subsidence
    from cyclopean.analysis.safety_margins import Bracket

__all__ = ["margins_dict", "result_dict", "sensitivity_dict", "subsidence_dict"]

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
        virtual one of every free block: lengths in the unit of eps, rotations in that unit per metre). `loading`,
        `partly_held`, `joints_that_pull` and `settlement` only where the model or the command says such things.
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
    if result.loading is not None:
        document["loading"] = {"combination": result.loading.name, "factors": result.loading.factors}
    if result.partly_held:
        document["partly_held"] = list(result.partly_held)
    if result.strength > 0.0:
        pulling = result.contacts.strength > 0.0
        document["joints_that_pull"] = {"strength": result.strength, "contacts": int(pulling.sum())}
    if result.force is not None or result.tension is not None:
        document["forces"] = _forces(result, ids)
    if result.verdict == "unstable" and result.mechanism is not None:
        document["mechanism"] = {ids[i]: result.mechanism[i].tolist() for i in free}
    if result.verdict == "stable" and result.displacement is not None:
        document["displacement"] = {ids[i]: result.displacement[i].tolist() for i in free}
    if result.settled is not None:
        document["settlement"] = _settlement(result, ids)
    kind = None if result.certificate is None else result.certificate.get("kind")
    document["certificate"] = None if result.certificate is None else {"kind": kind, "file": certificate_file}
    document["provenance"] = {"cyclopean": __version__} | result.provenance
    document["seconds"] = result.seconds
    return {key: _plain(value) for key, value in document.items()}


def margins_dict(found: "Margins", result: "Result") -> dict[str, Any]:
    """What a model has to spare, ready for JSON: the part `margins` of a result file; null what was not found."""
    mu = result.contacts.mu
    ids = [block.id for block in result.assembly.blocks]

    def side(bracket: "Bracket | None") -> dict[str, Any] | None:
        if bracket is None:
            return None
        k = bracket.governing
        joint = None if k is None else [ids[int(result.contacts.a[k])], ids[int(result.contacts.b[k])]]
        return {"stands": bracket.stands, "falls": bracket.falls, "governing": joint}

    friction, tilt = side(found.friction), side(found.tilt)
    if friction is not None and found.friction is not None and len(mu) and float(mu.min()) == float(mu.max()):
        falls = found.friction.falls
        friction["mu"] = {
            "stands": found.friction.stands * float(mu[0]),
            "falls": None if falls is None else falls * float(mu[0]),
        }
    if tilt is not None:
        tilt["azimuth"] = found.azimuth
    joints = side(found.joints)
    if joints is not None:
        joints["geometric_safety"] = found.geometric_safety
    return {"method": "rbe", "friction": friction, "joints": joints, "tilt": tilt, "seconds": found.seconds}


def sensitivity_dict(found: "Sensitivity") -> dict[str, Any]:
    """What became of the samples, ready for JSON: the part `sensitivity` of a result file."""
    low, estimate, high = found.probability
    document = {
        "vary": {r.quantity: [r.low, r.high] for r in found.ranges},
        "method": found.method,
        "seed": found.seed,
        "samples": len(found.words),
        "count": found.count,
        "probability": {"low": low, "estimate": estimate, "high": high, "confidence": 0.95} if found.words else None,
        "throughout": {"verdict": found.throughout, "why": found.why},
        "draws": {r.quantity: found.values[:, k].tolist() for k, r in enumerate(found.ranges)},
        "verdicts": list(found.words),
        "seconds": found.seconds,
    }
    return {key: _plain(value) for key, value in document.items()}


def subsidence_dict(found: "Subsidence", result: "Result") -> dict[str, Any]:
    """The path of a settlement that is not small (m): the part `path` of a result file."""
    ids, a, b = [block.id for block in result.assembly.blocks], found.contacts.a, found.contacts.b
    return {
        "reached": found.reached,
        "share": found.share,
        "ended": found.ended,
        "proved": found.proved,
        "steps": [
            {
                "share": step.share,
                "settlement": step.settlement,
                "word": step.word,
                "opening": step.opening,
                "joint": None if step.joint < 0 else [ids[a[step.joint]], ids[b[step.joint]]],
                "touching": step.touching,
            }
            for step in found.steps
        ],
    }


def _settlement(result: "Result", ids: list[str]) -> dict[str, Any]:
    """What the ground does (m, rad), how the blocks follow, and which joints open by how much (m), corner by corner."""
    assert result.settled is not None
    contacts, ground = result.contacts, result.settled.ground
    opens, first = result.settled.gap[:, 0], contacts.start
    least = 1e-6 * float(abs(result.settled.displacement[:, :3]).max())
    return {
        "ground": {ids[i]: ground[i].tolist() for i in range(len(ids)) if ground[i].any()},
        "displacement": {name: row.tolist() for name, row in zip(ids, result.settled.displacement, strict=True)},
        "openings": [
            {"contact": k, "a": ids[contacts.a[k]], "b": ids[contacts.b[k]], "opening": opens[first[k] : first[k + 1]]}
            for k in range(len(contacts))
            if opens[first[k] : first[k + 1]].max() > least
        ],
    }


def _forces(result: "Result", ids: list[str]) -> list[dict[str, Any]]:
    contacts, force = result.contacts, result.force
    frame = contacts.frame if result.frame is None else result.frame
    rows, strength = [], contacts.strength
    for k, (a, b) in enumerate(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True)):
        row: dict[str, Any] = {"a": ids[a], "b": ids[b], "polygon": contacts.polygon(k).tolist()}
        here = slice(contacts.start[k], contacts.start[k + 1])
        row["force"] = None if force is None else force[here].tolist()
        row["frame"] = frame[k].tolist()
        row["utilisation"] = None if result.utilisation is None else float(result.utilisation[k])
        if result.strength > 0.0:
            row["strength"] = float(strength[k])
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
