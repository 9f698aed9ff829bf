"""The result of limit analysis as data: `cyclopean.limit/1`."""

import math
from typing import TYPE_CHECKING, Any

from cyclopean import __version__

if TYPE_CHECKING:  # only names here: converting a file must not load the solvers
    from cyclopean.analysis import CoupledBracket, LimitResult, Polar, Pushover

__all__ = ["limit_dict"]

SCHEMA = "cyclopean.limit/1"


def limit_dict(
    result: "LimitResult",
    certificate_file: str | None = None,
    *,
    coupled: "CoupledBracket | None" = None,
    polar: "Polar | None" = None,
    pushover: "Pushover | None" = None,
) -> dict[str, Any]:
    """Return bounds, mechanism and forces as plain lists, numbers and text, ready for JSON.

    Parameters
    ----------
    result : LimitResult
        The bounds.
    certificate_file : str, optional
        Where the certificate was written.
    coupled : CoupledBracket, optional
        What coupled analysis said.
    polar : Polar, optional
        Tilts in other directions.
    pushover : Pushover, optional
        The curve on displaced geometry.

    Returns
    -------
    dict
        `multiplier` {lower, upper, gap} (null where not proved; of a tilt the tangent of the angle), `angle` in degrees
        when tilted, `mechanism` (m/s and rad/s of every free block, largest 1), `forces` at the lower multiplier as in
        a result file, `joints` that move (hinge, slide, part), and `governing` among them.
    """
    ids = [block.id for block in result.assembly.blocks]
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "model": result.assembly.name,
        "method": "rbe" if coupled is None else "cra",
        "word": result.word,
        "reason": result.reason,
        "live": _live(result),
        "multiplier": {"lower": result.lower, "upper": result.upper, "gap": _finite(result.gap)},
    }
    if result.angle is not None:
        document["angle"] = {"lower": result.angle[0], "upper": result.angle[1]}
    if result.window is not None:
        document["window"] = {"least": result.window[0], "largest": result.window[1]}
    document |= {
        "blocks": len(ids),
        "free": int((~result.fixed).sum()),
        "contacts": len(result.contacts),
        "points": len(result.contacts.point),
        "assumed": result.assumed,
    }
    if result.mechanism is not None:
        free = [i for i, held in enumerate(result.fixed.tolist()) if not held]
        document["mechanism"] = {ids[i]: result.mechanism[i].tolist() for i in free}
        document["joints"] = _joints(result, ids)
        document["governing"] = None if result.governing is None else _ends(result, ids, result.governing)
    if result.force is not None:
        document["forces"] = _forces(result, ids)
    if coupled is not None:
        document["coupled"] = {
            "stands": coupled.stands,
            "not_certified": coupled.not_yet,
            "verdict": coupled.word,
            "trials": [{"multiplier": t, "verdict": word} for t, word in coupled.trials],
        }
    if polar is not None:
        document["polar"] = [
            {"azimuth": azimuth, "angle": {"lower": low, "upper": high}} for azimuth, low, high in polar.table
        ]
    if pushover is not None:
        document["pushover"] = {
            "control": pushover.control,
            "ended": pushover.ended,
            "steps": [
                {
                    "displacement": step.displacement,
                    "rotation": step.rotation,
                    "multiplier": _finite(step.multiplier),
                    "touching": step.touching,
                }
                for step in pushover.steps
            ],
        }
    proof = result.certificate
    document["certificate"] = None if proof is None else {"kind": proof["kind"], "file": certificate_file}
    document["provenance"] = {"cyclopean": __version__} | _plain(result.provenance)
    document["seconds"] = result.seconds
    return document


def _live(result: "LimitResult") -> dict[str, Any]:
    live = result.live
    if live.push is not None:
        return {"push": list(live.push)}
    if live.tilt is not None:
        return {"tilt": live.tilt}
    return {
        "loads": [
            {"block": load.block, "force": list(load.force)}
            | ({} if load.point is None else {"point": list(load.point)})
            for load in live.loads
        ]
    }


def _ends(result: "LimitResult", ids: list[str], contact: int) -> dict[str, Any]:
    return {"contact": contact, "a": ids[result.contacts.a[contact]], "b": ids[result.contacts.b[contact]]}


def _joints(result: "LimitResult", ids: list[str]) -> list[dict[str, Any]]:
    from cyclopean.analysis import moving_joints

    return [
        _ends(result, ids, joint.contact) | {"kind": joint.kind, "speed": joint.speed, "point": list(joint.point)}
        for joint in moving_joints(result)
    ]


def _forces(result: "LimitResult", ids: list[str]) -> list[dict[str, Any]]:
    contacts, frame = result.contacts, result.frame
    rows = []
    for k in range(len(contacts)):
        here = slice(int(contacts.start[k]), int(contacts.start[k + 1]))
        share = 0.0 if result.utilisation is None else float(result.utilisation[k])
        rows.append(
            {
                "a": ids[contacts.a[k]],
                "b": ids[contacts.b[k]],
                "polygon": contacts.polygon(k).tolist(),
                "force": [] if result.force is None else result.force[here].tolist(),
                "frame": frame[k].tolist(),
                "utilisation": _finite(share),
            }
        )
    return rows


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _plain(value: Any) -> Any:
    """The same with what is not finite as null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return _finite(value) if isinstance(value, float) else value
