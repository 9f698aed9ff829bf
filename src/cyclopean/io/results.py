"""What analyses found, as data: `cyclopean.result/1` and `cyclopean.limit/1`."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cyclopean import __version__
from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.io.files import picked, plain

if TYPE_CHECKING:  # only a name here: converting a file must not load the solvers
    from cyclopean.analysis import (
        LimitResult,
        Margins,
        Result,
        Sensitivity,
        Subsidence,
    )
    from cyclopean.analysis.safety_margins import Bracket
    from cyclopean.analysis.undecided import Undecided
    from cyclopean.design.walls.front import WallInterlock

__all__ = ["interlock_dict", "limit_dict", "margins_dict", "result_dict", "sensitivity_dict", "subsidence_dict"]

SCHEMA, LIMIT = "cyclopean.result/1", "cyclopean.limit/1"


def result_dict(
    result: "Result", certificate_file: str | None = None, stable_at_file: str | None = None
) -> dict[str, Any]:
    """Return a verdict as plain lists, numbers and text, ready for JSON; what is not finite becomes null.

    Parameters
    ----------
    result : Result
        The verdict.
    certificate_file : str, optional
        Where the certificate was written.
    stable_at_file : str, optional
        Where that of the state at a larger eta was written, where the verdict is undecided and there is one.

    Returns
    -------
    dict
        `forces` only where there are forces (N, in the frame of the patch, on `b`) or where tension was measured (then
        with `tension`, N at each point; `force` is null where no state was found), `mechanism` only when unstable (m/s
        and rad/s of every free block, up to a common factor), `displacement` only when stable by coupled analysis (the
        virtual one of every free block: lengths in the unit of eps, rotations in that unit per metre). `loading`,
        `partly_held`, `joints_that_pull` and `settlement` only where the model or the command says such things;
        `margins`, `sensitivity`, `path` and `within` (lengths in m) where they were asked for. Where coupled analysis
        is undecided, `nearest`, the best forces and displacement met, `change`, and `stable_at` where a state was
        proved at a larger eta.
    """
    ids = [block.id for block in result.assembly.blocks]
    document: dict[str, Any] = {"schema": SCHEMA, "model": result.assembly.name, "method": result.method}
    document |= {"verdict": result.verdict, "reason": result.reason} | _counts(result) | {"residuals": result.residuals}
    document |= _loading(result)
    if result.partly_held:
        document["partly_held"] = result.partly_held
    if result.strength > 0.0:
        pulling = result.contacts.strength > 0.0
        document["joints_that_pull"] = {"strength": result.strength, "contacts": int(pulling.sum())}
    if result.force is not None or result.tension is not None:
        document["forces"] = _pulled(result, _forces(result, ids))
    if result.method == "rbe" and result.force is not None:
        document["objective"] = _objective(result.force, result.provenance)
    if result.verdict == "unstable" and result.mechanism is not None:
        document["mechanism"] = _motion(result, ids, result.mechanism)
    if result.verdict == "stable" and result.displacement is not None:
        document["displacement"] = _motion(result, ids, result.displacement)
    if result.settled is not None:
        document["settlement"] = _settlement(result, ids)
    if result.undecided is not None:
        document |= _undecided(result, result.undecided, ids, stable_at_file)
    document |= _tail(result, certificate_file)
    if result.within is not None:
        document["within"] = picked(result.within, "asked", "degrees", "holds", "certain")
    if (spare := result.margins) is not None:
        document["margins"] = margins_dict(spare, result)
    if result.sensitivity is not None:
        document["sensitivity"] = sensitivity_dict(result.sensitivity)
    if result.path is not None:
        document["path"] = subsidence_dict(result.path, result)
    return {key: plain(value) for key, value in document.items()}


def _objective(force: Floats, provenance: Mapping[str, Any]) -> float:
    """N2: half the weighted sum of squares that rigid-block equilibrium makes least, of these forces (q, 3)."""
    pressing, rubbing = provenance.get("settings", {}).get("weights", (1.0, 1.0))
    return 0.5 * float(pressing * (force[:, 0] ** 2).sum() + rubbing * (force[:, 1:] ** 2).sum())


def _undecided(result: "Result", known: "Undecided", ids: list[str], file: str | None) -> dict[str, Any]:
    """The best triple met, what would decide it, and at which eta a state is proved."""
    found: dict[str, Any] = {}
    if known.force is not None and known.displacement is not None:
        force = _forces(replace(result, force=known.force, utilisation=None), ids)
        found["nearest"] = {"forces": force, "displacement": _motion(result, ids, known.displacement)}
    if (at := known.stable_at) is not None:
        found["stable_at"] = {"eta": at.eta, "certificate": {"kind": at.certificate["kind"], "file": file}}
    change: dict[str, Any] = {"untried": known.untried}
    if known.friction is not None:
        change["friction"] = picked(known.friction, "factor", "mu")
    if known.recut is not None:
        change["recut"] = picked(known.recut, "block", "on", "angle", "needed")
    return found | {"change": change}


def limit_dict(
    result: "LimitResult",
    certificate_file: str | None = None,
) -> dict[str, Any]:
    """Return bounds, mechanism and forces of limit analysis as plain lists, numbers and text, ready for JSON.

    Parameters
    ----------
    result : LimitResult
        The bounds.
    certificate_file : str, optional
        Where the certificate was written.

    Returns
    -------
    dict
        `multiplier` {lower, upper, gap} (null where not proved; of a tilt the tangent of the angle), `angle` in degrees
        when tilted, `mechanism` (m/s and rad/s of every free block, largest 1), `forces` at the lower multiplier as in
        a result file, `joints` that move (hinge, slide, part), and `governing` among them.
    """
    coupled, polar, pushover = result.coupled, result.polar, result.pushover
    ids = [block.id for block in result.assembly.blocks]
    document: dict[str, Any] = {"schema": LIMIT, "model": result.assembly.name}
    document["method"] = "rbe" if coupled is None else "cra"
    document |= {"word": result.word, "reason": result.reason, "live": _live(result)} | _loading(result)
    document["multiplier"] = picked(result, "lower", "upper", "gap")
    for key, names, pair in (
        ("angle", ("lower", "upper"), result.angle),
        ("window", ("least", "largest"), result.window),
    ):
        if pair is not None:
            document[key] = dict(zip(names, pair, strict=True))
    document |= _counts(result)
    if result.mechanism is not None:
        from cyclopean.analysis import moving_joints

        document["mechanism"] = _motion(result, ids, result.mechanism)
        document["joints"] = [
            _ends(result, ids, joint.contact) | picked(joint, "kind", "speed", "point")
            for joint in moving_joints(result)
        ]
        document["governing"] = None if result.governing is None else _ends(result, ids, result.governing)
    if result.force is not None:
        document["forces"] = _forces(result, ids)
    if coupled is not None:
        document["coupled"] = {
            "stands": coupled.stands,
            "not_certified": coupled.not_yet,
            "verdict": coupled.word,
            "no_state": coupled.falls,
            "trials": [{"multiplier": t, "verdict": word} for t, word in coupled.trials],
        }
    if polar is not None:
        document["polar"] = [
            {"azimuth": azimuth, "multiplier" if result.live.tilt is None else "angle": {"lower": low, "upper": high}}
            for azimuth, low, high in polar.table
        ]
    if (moved := result.travelling) is not None:
        document["along"] = [
            {"x": x, "word": one.word, "multiplier": picked(one, "lower", "upper")}
            for x, one in zip(moved.places, moved.results, strict=True)
        ]
    if pushover is not None:
        document["pushover"] = picked(pushover, "control", "ended", "steps")
    return {key: plain(value) for key, value in (document | _tail(result, certificate_file)).items()}


def _loading(result: "Result | LimitResult") -> dict[str, Any]:
    """Which cases act, and earth, water and fill among them; nothing where no case was told apart."""
    found = result.loading
    if found is None:
        return {}
    said = {"combination": found.name, "factors": found.factors}
    return {"loading": said | ({"fields": list(found.fields)} if found.fields else {})}


def _counts(result: "Result | LimitResult") -> dict[str, Any]:
    sizes = {"blocks": len(result.assembly), "free": int((~result.fixed).sum())}
    return sizes | {"contacts": len(result.contacts), "points": len(result.contacts.point), "assumed": result.assumed}


def _tail(result: "Result | LimitResult", file: str | None) -> dict[str, Any]:
    proof = result.certificate
    return {
        "certificate": None if proof is None else {"kind": proof.get("kind"), "file": file},
        "provenance": {"cyclopean": __version__} | result.provenance,
        "warnings": list(result.warnings),
        "seconds": result.seconds,
    }


def _motion(result: "Result | LimitResult", ids: list[str], motion: Floats) -> dict[str, Any]:
    """Rows (6,) of the free blocks."""
    return {ids[i]: motion[i] for i, held in enumerate(result.fixed.tolist()) if not held}


def _live(result: "LimitResult") -> dict[str, Any]:
    live = result.live
    if live.push is not None or live.tilt is not None:
        return picked(live, "tilt" if live.push is None else "push")
    rows = [picked(load, "block", "force", "point") for load in live.loads]
    return {"loads": [{key: value for key, value in row.items() if value is not None} for row in rows]}


def _ends(result: "Result | LimitResult", ids: list[str], contact: int) -> dict[str, Any]:
    return {"contact": contact, "a": ids[result.contacts.a[contact]], "b": ids[result.contacts.b[contact]]}


def margins_dict(found: "Margins", result: "Result") -> dict[str, Any]:
    """What a model has to spare, ready for JSON: the part `margins` of a result file; null what was not found."""
    mu = result.contacts.mu

    def side(bracket: "Bracket | None") -> dict[str, Any] | None:
        if bracket is None:
            return None
        return picked(bracket, "stands", "falls") | {"governing": _joint(result, result.contacts, bracket.governing)}

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
    told = {"method": "rbe", "friction": friction, "joints": joints, "tilt": tilt}
    return told | {"within": found.within or None, "seconds": found.seconds}


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
    return {key: plain(value) for key, value in document.items()}


def subsidence_dict(found: "Subsidence", result: "Result") -> dict[str, Any]:
    """The path of a settlement that is not small (m): the part `path` of a result file."""
    document = picked(found, "reached", "share", "ended", "proved", "steps")
    for row in document["steps"]:
        row["joint"] = _joint(result, found.contacts, None if row["joint"] < 0 else row["joint"])
    return document


def _joint(result: "Result", contacts: Contacts, k: int | None) -> list[str] | None:
    """Ids of the two blocks at a contact."""
    return None if k is None else [result.assembly.blocks[end[k]].id for end in (contacts.a, contacts.b)]


def _settlement(result: "Result", ids: list[str]) -> dict[str, Any]:
    """What the ground does (m, rad), how the blocks follow, and which joints open by how much (m), corner by corner."""
    assert result.settled is not None
    ground, opens, first = result.settled.ground, result.settled.gap[:, 0], result.contacts.start
    least = 1e-6 * float(abs(result.settled.displacement[:, :3]).max())
    wide = [opens[first[k] : first[k + 1]] for k in range(len(result.contacts))]
    return {
        "ground": {name: row for name, row in zip(ids, ground, strict=True) if row.any()},
        "displacement": dict(zip(ids, result.settled.displacement, strict=True)),
        "openings": [_ends(result, ids, k) | {"opening": w} for k, w in enumerate(wide) if w.max() > least],
    }


def _forces(result: "Result | LimitResult", ids: list[str]) -> list[dict[str, Any]]:
    """Polygon, forces, frame and share of friction of each contact; `force` is null where no state was found."""
    contacts, force, used = result.contacts, result.force, result.utilisation
    frame = contacts.frame if result.frame is None else result.frame
    return [
        {
            "a": ids[a],
            "b": ids[b],
            "polygon": contacts.polygon(k),
            "force": None if force is None else force[contacts.start[k] : contacts.start[k + 1]],
            "frame": frame[k],
            "utilisation": None if used is None else used[k],
        }
        for k, (a, b) in enumerate(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True))
    ]


def _pulled(result: "Result", rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The same rows with the strength of joints that pull, and the tension found at their points."""
    start, strength = result.contacts.start, result.contacts.strength
    for k, row in enumerate(rows):
        if result.strength > 0.0:
            row["strength"] = strength[k]
        if result.tension is not None:
            row["tension"] = result.tension[start[k] : start[k + 1]]
    return rows


def interlock_dict(found: "WallInterlock") -> dict[str, Any]:
    """The score J and the rules of masons, for JSON; None where a wall has nothing to measure."""
    one = found.interlock
    rules = plain(one.rules)
    return {
        "seen": found.seen,
        "along": plain(found.along),
        "size": plain(found.size),
        "J": one.score,
        "courses": found.courses,
        "tolerance": one.tolerance,
        "head_joints": len(one.head),
        "head_length": one.head_length,
        "aligned_length": one.aligned_length,
        "crossings": len(one.crossings),
        "running": [{"length": joint.length, "courses": joint.courses} for joint in one.running],
        "minimum_trace": None if rules["trace"] is None else found.minimum_trace,
        "rules": rules,
        "masons": plain(found.masons),
    }
