"""What a certificate proves and what it does not, in words."""

from cyclopean.analysis import Result

_REBUILT = "Volumes, weights and contact normals are rebuilt from the geometry, and every contact lies on both blocks."
_BALANCED = (
    "The listed forces push and never pull, stay within friction at every contact point, and balance every free"
    " block to 10⁻⁹ of its own weight; exactly, where the claim of the certificate says so."
)
_PROVES = {
    "rbe-state": [_BALANCED],
    "rbe-mechanism": [
        "A motion of the rigid blocks exists that the loads drive and that the contacts listed do not resist.",
        "Any admissible forces that held up the blocks that fall, with all that they lean on, would have to exceed a"
        " million times the weight and loads of these.",
    ],
    "cra-state": [
        _BALANCED,
        "The listed virtual displacement brings them about, at every contact point to 10⁻⁹: what presses overlaps by"
        " eps and nothing overlaps more; friction acts against sliding, and where it acts the point slides by at least"
        " beta_min; nothing moves further than eta.",
    ],
    "cra-tree": [
        "No forces and virtual displacement within the bounds go together as coupled analysis asks.",
        "The cases leave nothing out, and each is refuted with numbers that the checker recomputes exactly.",
    ],
    "rbe-state-within": [
        "In every drawing within the length and the angle that the claim names, forces next to the listed ones stay"
        " within friction at every contact and balance every free block exactly."
    ],
    "rbe-mechanism-within": [
        "In every drawing within the length and the angle that the claim names, the loads drive this motion of the"
        " rigid blocks and no contact listed resists it."
    ],
}

_LIMITS = [
    "That the model is the structure: it is about the geometry, density, friction and supports in the file, not about"
    " what was surveyed or will be built.",
    "Anything about crushing, cracking, settlement of the ground or earthquakes.",
]
_PROVES_NOT = {
    "rbe-state": [
        "That these very forces will arise. Rigid-block equilibrium asks whether forces that keep balance exist, not"
        " whether the blocks' contact brings them about."
    ],
    "rbe-mechanism": [
        "Anything beyond the contacts listed: a contact that the model misses could still hold it. The motion follows"
        " the associated (dilatant) flow that rigid-block equilibrium assumes: blocks that slide also rise."
    ],
    "cra-state": [
        "That this is the state that nature picks: there are mostly others. What is proved is that one exists in which"
        " forces and displacement go together."
    ],
    "cra-tree": [
        "Anything for other bounds: with a larger eta or a smaller beta_min, in eps, a state may exist.",
        "Anything beyond the contacts listed. Nor how the blocks would move: rigid-block equilibrium has forces for"
        " this model, so there is no collapse mechanism to show.",
    ],
}


_PROVES_NOT |= {f"{kind}-within": _PROVES_NOT[kind] for kind in ("rbe-state", "rbe-mechanism")}


def proves(result: Result) -> list[str]:
    """What the certificate of a result proves."""
    return [*_PROVES.get(_kind(result), []), _REBUILT]


def proves_not(result: Result) -> list[str]:
    """What one might think it proves, and it does not."""
    return [*_LIMITS, *_PROVES_NOT.get(_kind(result), [])]


def _kind(result: Result) -> str:
    return "" if result.certificate is None else str(result.certificate.get("kind", ""))
