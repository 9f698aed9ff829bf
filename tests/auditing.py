"""One case asked of the program and of the oracle, and what the two answers say about each other."""

import json
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cyclopean
import oracle
from cyclopean.proof import verify
from oracle_models import Case, dumped

SECONDS = 10.0  # budget of a coupled search
TOLD = 1e-9  # relative rounding of multipliers

AGREES, UNDECIDED, OPEN, NEAR, CONTRADICTS, UNPROVED, RAISES = (
    "agrees",
    "undecided",  # the program does not say
    "open",  # nor does the oracle: too near to call
    "near",  # the oracle does not
    "contradicts",
    "unproved",  # a verdict whose certificate is missing or refused
    "raises",
)
PROOFS = {  # kinds of certificate that prove a verdict
    ("rbe", "stable"): ("rbe-state",),
    ("rbe", "unstable"): ("rbe-mechanism",),
    ("cra", "stable"): ("cra-state",),
    ("cra", "unstable"): ("rbe-mechanism", "cra-tree"),
}
FAILURES = (CONTRADICTS, UNPROVED, RAISES)


@dataclass(frozen=True)
class Finding:
    """What came of one case."""

    case: Case
    outcome: str
    truth: str  # the oracle's word
    ours: str  # the program's
    note: str = ""

    def row(self) -> dict[str, Any]:
        """As JSON; `oracle_models.loaded` reads the case in it."""
        return dumped(self.case) | {
            "outcome": self.outcome,
            "oracle": self.truth,
            "ours": self.ours,
            "note": self.note,
        }


def judged(case: Case, folder: Path, seconds: float = SECONDS) -> Finding:
    """Ask both about a case; its model is written into the folder, for the program reads files."""
    path = folder / "case.json"
    path.write_text(json.dumps(case.document))
    asked = _limit if case.kind == "limit" else _verdict
    try:
        return asked(case, path, seconds)
    except Exception:  # noqa: BLE001 - whatever it is, it is a finding
        return Finding(case, RAISES, "", "", traceback.format_exc())


def refused(certificate: dict[str, Any] | None, *kinds: str) -> str:
    """Why a certificate does not prove the claim; empty where it is accepted, as the file that it would be."""
    if certificate is None:
        return "no certificate"
    report = verify(json.loads(json.dumps(certificate)))
    if not report.proved:
        return report.reason
    return "" if report.kind in kinds else f"the certificate proves something else: {report.kind}"


def _verdict(case: Case, path: Path, seconds: float) -> Finding:
    options: dict[str, Any] = {"method": case.kind, "mu": case.mu, "gravity": case.gravity}
    if case.kind == "cra":
        options |= {"eta": case.eta, "beta_min": case.beta, "seconds": seconds}
    result = cyclopean.check(path, **options)
    truth = answer(case)
    found = Finding(case, AGREES, truth, result.verdict)
    if result.verdict == "undecided":
        told = truth in ("stable", "unstable")
        return replace(found, outcome=UNDECIDED if told else OPEN, note=result.reason)
    if missing := refused(result.certificate, *PROOFS[case.kind, result.verdict]):
        return replace(found, outcome=UNPROVED, note=missing)
    if truth not in ("stable", "unstable"):
        return replace(found, outcome=NEAR)
    if truth != result.verdict:
        return replace(found, outcome=CONTRADICTS, note=result.reason)
    return found


def answer(case: Case) -> str:
    """The oracle's verdict: "stable", "unstable" or "near".

    A coupled case whose blocks may leave the plane has every state of the plane, and perhaps others: what is *unstable*
    in the plane is *near* then, unless no forces balance it at all.
    """
    structure = case.structure()
    if case.kind == "rbe":
        return oracle.rbe(structure)
    word = oracle.coupled(structure, oracle.Allowed(case.eta, case.beta))
    return word if case.plane_only or word == "stable" or oracle.rbe(structure) == "unstable" else "near"


def _limit(case: Case, path: Path, seconds: float) -> Finding:
    assert case.push is not None
    result = cyclopean.limit(path, push=case.live, mu=case.mu, gravity=case.gravity)
    truth = oracle.limit(case.structure(), case.push)
    bounds = f" {truth.lower:.12g} to {truth.upper:.12g}" if truth.word == "limit" else ""
    ours = f"{result.word} {result.lower} to {result.upper}"
    found = Finding(case, AGREES, truth.word + bounds, ours, result.reason)
    if result.word not in ("undecided", "falls"):
        missing = refused(result.certificate, "limit-bounds")
        told = [(result.certificate or {}).get(side) for side in ("lower", "upper")]
        if not missing and told != [result.lower, result.upper] and result.word == "limit":
            missing = f"the certificate has other bounds: {told}"
        if missing:
            return replace(found, outcome=UNPROVED, note=missing)
    if contradicts(truth, result.word, result.lower, result.upper):
        return replace(found, outcome=CONTRADICTS)
    if truth.word == "near":
        return replace(found, outcome=OPEN if result.word == "undecided" else NEAR)
    if result.word == "undecided":
        return replace(found, outcome=UNDECIDED)
    return found


def contradicts(truth: oracle.LimitAnswer, word: str, lower: float | None, upper: float | None) -> bool:
    """Whether a claim about a multiplier is wrong; bounds that lie wide apart are not."""
    if truth.word == "falls":
        return word in ("limit", "unbounded") or (lower is not None and lower >= 0.0 and word != "falls")
    if truth.word == "near":
        return False
    if word == "falls":
        return True
    room = TOLD * max(1.0, abs(truth.lower)) if truth.word == "limit" else 0.0
    if truth.word == "unbounded":
        return upper is not None
    return word == "unbounded" or (
        (lower is not None and lower > truth.upper + room) or (upper is not None and upper < truth.lower - room)
    )
