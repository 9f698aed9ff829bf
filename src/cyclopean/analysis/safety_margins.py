"""How much a model that stands has to spare: friction, joints, tilt.

By rigid-block equilibrium, which asks only for forces that balance: what it finds is what is left at most. By coupled
analysis, or where stones slide without opening, less may be left.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.equilibrium.deciding import ACCEPTED, decide_rigid
from cyclopean.analysis.equilibrium.neighbour import Neighbour
from cyclopean.analysis.limit_analysis.limit import Found, find_limit, proved_limit
from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.analysis.limit_analysis.polar import last_least
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.proving import polished, prove, rigid_claim
from cyclopean.analysis.robust.search import certain_length
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Result, relative_motion
from cyclopean.assembly import Contacts, length_tolerance

__all__ = ["POINTS", "Bracket", "Margins", "margins", "shrunk"]

POINTS = 600  # contact points up to which margins are found without being asked for: about a second
HALF = 0.5 * (1.0 + 1e-9)  # of the tolerance, and room for rounding
CLOSE = 1e-3  # of the value said: how far apart the two sides of a margin may be
NEARER = 2 / 3  # where a bracket is split, towards what stands: a state takes a fraction of the time of a mechanism
SPECK = 1e-3  # of its size, below which a joint is a point; of friction, below which it is next to none
AZIMUTHS = 8  # that the ground is tilted towards


@dataclass(frozen=True, slots=True, eq=False)
class Bracket:
    """A margin between two models, each with a certificate: one that stands, and one that falls."""

    stands: float
    falls: float | None  # None = none was looked for, or none was proved
    governing: int | None = None  # contact that opens or slides most in the motion of the one that falls


@dataclass(frozen=True, slots=True, eq=False)
class Margins:
    """What a model has to spare, by rigid-block equilibrium."""

    friction: Bracket | None  # share of every friction coefficient with which it stands; None = it falls as it is
    joints: Bracket | None  # share of its size, about its centroid, to which every joint may shrink
    tilt: Bracket | None  # degrees by which the ground may tilt, towards the worst of the azimuths looked at
    azimuth: float | None = None  # degrees from +x to +y: that one
    within: float = 0.0  # m: it is proved to stand in every drawing within this length; 0 = within none
    seconds: float = 0.0

    @property
    def geometric_safety(self) -> float:
        """1 over the share to which the joints may shrink; 1 where there is nothing to spare."""
        return 1.0 if self.joints is None else 1.0 / self.joints.stands


def shrunk(contacts: Contacts, share: float) -> Contacts:
    """Contacts of which every polygon is shrunk about its centroid to this share of its size."""
    if not len(contacts):
        return contacts
    first = contacts.point[contacts.start[:-1]]  # local, so that a model far from the origin loses nothing
    arm = contacts.point - first[contacts.patch]
    centre = np.zeros((len(contacts), 3))
    np.add.at(centre, contacts.patch, contacts.shares[:, None] * arm)
    middle = centre[contacts.patch]
    return replace(contacts, point=first[contacts.patch] + middle + share * (arm - middle))


def margins(model: PreparedModel, settings: Settings, stands: bool = False) -> Margins:
    """Find the least friction and joints with which a model stands, and how far the ground or the drawing may be off.

    The first two are closed in upon from both sides, to a thousandth, the tilt of the ground by limit analysis towards
    eight azimuths. Both sides of each are proved: the model that stands and the one that falls have certificates that
    have passed the independent checker. So has that of all drawings within the last length, which is found to a tenth;
    that some beyond it fall is not said.

    Parameters
    ----------
    model : PreparedModel
        As it was checked.
    settings : Settings
        The solver.
    stands : bool
        Whether it is proved already that it does, by either method: a coupled state, too, balances every load.
    """
    began = time.perf_counter()
    case = _Case(replace(settings, method="rbe", penalty=False), Neighbour())
    if not stands and case.proved(model).verdict != "stable":
        return Margins(None, None, None, seconds=time.perf_counter() - began)
    contacts = model.contacts
    if not model.system().p.any():  # nothing acts, so that anything will do
        return Margins(None, None, None, seconds=time.perf_counter() - began)
    friction = _bracket(case, lambda s: replace(model, contacts=replace(contacts, mu=s * contacts.mu)), 0.0)
    joints = None
    if not (contacts.strength.any() or contacts.at_points.any()):  # they would pull elsewhere; points have no size
        joints = _bracket(case, lambda s: _smaller(model, s), SPECK)
    tilt, azimuth = _least_tilt(model)
    return Margins(friction, joints, tilt, azimuth, certain_length(model), time.perf_counter() - began)


def _smaller(model: PreparedModel, share: float) -> PreparedModel:
    """The model with its joints shrunk; the tolerance with them, for no joint may be as narrow as that.

    Where contacts lie off their faces as much of it stays as they do: half of it.
    """
    exact = model.tolerance <= 2.0 * length_tolerance(model.assembly) * (1.0 + 1e-9)
    left = share if exact else max(share, HALF)
    return replace(model, contacts=shrunk(model.contacts, share), tolerance=left * model.tolerance)


def _least_tilt(model: PreparedModel) -> tuple[Bracket | None, float | None]:
    """Tilt towards the worst azimuth, and that azimuth; None where gravity is not vertical, or nothing falls."""
    if model.gravity[:2].any() or not model.gravity[2] < 0.0 or model.settled is not None or model.fixed.all():
        return None, None
    found: dict[float, Found] = {}
    for azimuth in np.linspace(0.0, 360.0, AZIMUTHS, endpoint=False).tolist():
        known = next(iter(found.values())).growing if found and not model.assembly.loads else None
        found[azimuth] = find_limit(model, Live(tilt=azimuth), beside=known)
    bounded = [(one.outcome.upper, azimuth) for azimuth, one in found.items() if one.outcome.word == "limit"]
    if not bounded:
        return None, None
    azimuth = bounded[last_least([upper for upper, _ in bounded])][1]
    result = proved_limit(model, Live(tilt=azimuth), found[azimuth])
    lower, upper = result.angle or (None, None)
    return (None, None) if lower is None else (Bracket(lower, upper, result.governing), azimuth)


@dataclass(frozen=True, slots=True)
class _Case:
    """One model after the other, each begun from what the one before came to."""

    settings: Settings
    neighbour: Neighbour

    def stands(self, model: PreparedModel) -> bool | None:
        """What the solvers say; None where they do not know."""
        system = model.system()
        outcome = self.neighbour.solve(system)
        if outcome.word == "balanced" and outcome.f is not None:
            if polished(model, system, outcome.f, self.neighbour.schur).worst <= ACCEPTED:
                return True
            outcome = decide_rigid(model, system)
        return {"balanced": True, "collapse": False}.get(outcome.word)

    def proved(self, model: PreparedModel) -> Result:
        """A verdict with a certificate."""
        system = model.system()
        result = prove(model, self.settings, system, rigid_claim(self.neighbour.solve(system)))
        if result.verdict != "undecided":
            return result
        return prove(model, self.settings, system, rigid_claim(decide_rigid(model, system)))


def _bracket(case: _Case, weaker: Callable[[float], PreparedModel], least: float) -> Bracket | None:
    """Close in between the model as it is, 1, and the weakest looked at; None where an end is not proved."""
    stands, falls = 1.0, least
    if case.stands(weaker(least)):
        stands = least
    while falls < stands and stands - falls > CLOSE * max(stands, SPECK):
        between = NEARER * stands + (1.0 - NEARER) * falls
        if case.stands(weaker(between)):
            stands = between
        else:
            falls = between
    proved = next((s for s in _upwards(stands) if case.proved(weaker(s)).verdict == "stable"), None)
    if proved is None or stands == least:
        return None if proved is None else Bracket(proved, None)
    for below in (falls, (1.0 - 10.0 * CLOSE) * falls, least):
        fallen = case.proved(weaker(below))
        if fallen.verdict == "unstable":
            return Bracket(proved, below, _governing(fallen))
    return Bracket(proved, None)


def _upwards(stands: float) -> tuple[float, ...]:
    """Where a proof is tried: at what was found, and with more and more room, to the model as it is."""
    more = (1.0, 1.0 + CLOSE, 1.1, 2.0, 10.0, 100.0, 1e4)
    return (*(factor * stands for factor in more if factor * stands < 1.0), 1.0)


def _governing(result: Result) -> int | None:
    """Contact whose points move most against each other in a mechanism."""
    contacts, rows = result.contacts, result.mechanism
    if rows is None or not len(contacts):
        return None
    apart = np.linalg.norm(relative_motion(contacts, rows, result.assembly.mass.centroid), axis=1)
    return int(contacts.patch[np.argmax(apart)])
