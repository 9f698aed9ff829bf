"""From bounds that the solvers claim to bounds that the independent checker has confirmed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.certificates import Parts, certify, force_rows
from cyclopean.analysis.equilibrium.components import component_labels, lightest
from cyclopean.analysis.equilibrium.deciding import ACCEPTED, decide_rigid
from cyclopean.analysis.equilibrium.opening import SLOW
from cyclopean.analysis.equilibrium.polishing import PLAIN, Polished, Polisher
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.growing import GrowingModel
from cyclopean.analysis.limit_analysis.live_load import STANDARD_GRAVITY
from cyclopean.analysis.limit_analysis.own_scale import limit_at_own_scale, opened_bound
from cyclopean.analysis.limit_analysis.solving import CLOSED, LimitOutcome
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Bools, Floats
from cyclopean.proof import Report, seal, verify
from cyclopean.statics import EquilibriumSystem

__all__ = ["Proved", "in_users_units", "prove_bounds"]

RAISED = (0.0, 1e-9, 1e-8, 1e-7)  # by which an upper bound is raised when rounding spoils its proof
LOWERED = (0.0, 1e-10, 1e-9, 1e-8, 1e-7, 5e-7)  # ... and a lower one is lowered, for room in the cones
# What states may miss their balance by, in the lightest block's weight. More than rounding may hold what falls: it is
# allowed where no lower bound does without.
MISSED = (PLAIN, ACCEPTED)
OWN_SCALE = 3000  # free blocks up to which a model is solved again at every block's own scale
ASKED = 40  # multipliers that are then decided one by one, at most
BELOW = 2e-7  # relative: how far below a mechanism's multiplier the next one lies
TRIFLE = 1e-9  # multipliers that differ by no more than this share of any block's dead load are all one


@dataclass(frozen=True, slots=True, eq=False)
class Proved:
    """Bounds as they stand in a certificate; None where that side was not proved."""

    lower: float | None = None
    upper: float | None = None
    unbounded: bool = False  # whether forces hold every larger multiplier too
    room: float = 0.0  # what of the gap is due to what certificates let states miss
    force: Floats | None = None  # (q, 3) scaled, at lower
    motion: Floats | None = None  # (m, 6) m/s and rad/s, largest 1
    certificate: dict[str, Any] | None = None
    report: Report | None = None
    falls: bool = False  # whether a mechanism was found without live loads: they may hold up what stands

    @property
    def closed(self) -> bool:
        """Whether nothing is left to be found."""
        if self.unbounded:
            return True
        if self.lower is None or self.upper is None:
            return False
        return _closed(self.lower, self.upper, self.room)


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """What grows, and sides of a certificate of it."""

    growing: GrowingModel

    @property
    def model(self) -> PreparedModel:
        """With its dead loads."""
        return self.growing.model

    @property
    def system(self) -> EquilibriumSystem:
        """Of the dead loads."""
        return self.growing.system

    @property
    def trifle(self) -> float:
        """By how much multipliers may differ and still count as one."""
        live, dead = (np.linalg.norm(p.reshape(-1, 6)[:, :3], axis=1) for p in (self.growing.live, self.system.p))
        least = float(np.min(dead[live > 0.0] / live[live > 0.0], initial=np.inf))
        return TRIFLE * least if np.isfinite(least) else 0.0

    def room(self, y: Floats) -> tuple[float, float]:
        """The multiplier at which the loads do no work in (6 m,) y, and by how much a certificate wants more.

        A state may leave 1e-9 of the lightest block's weight unbalanced, so a mechanism has to do more work.
        """
        system, power = self.system, float(self.growing.live @ y)
        if not power > 0.0:
            return np.inf, 0.0
        rows, least = y.reshape(-1, 6), lightest(component_labels(system), system.weight)
        speed = np.linalg.norm(rows[:, :3], axis=1) + system.diagonal * np.linalg.norm(rows[:, 3:], axis=1)
        rounding = 4e-15 * float(np.abs(system.p) @ np.abs(y))
        return -float(system.p @ y) / power, (SLOW * (1.0 + 1e-6) * float(least @ speed) + rounding) / power

    def polished(self, f: Floats, times: float, limit: float = ACCEPTED) -> Polished | None:
        """Forces of (q, 3) f that balance every block at a multiplier; None where they miss that by more than `limit`.

        Counted in the weight of the lightest block, as certificates do; own weights are those of the dead gravity.
        """
        growing, balance = self.growing, self.growing.balance(times)
        there = replace(growing.system, p=growing.system.p + times * growing.live)
        share = lightest(component_labels(there), balance.weight) / balance.weight
        found = Polisher(there, balance, growing.schur).polished(f, share, zeros=False)
        return found if (found.own.max(1) <= limit * share).all() else None

    def decided(self, times: float, limit: float) -> Iterator[dict[str, Any]]:
        """What rigid-block equilibrium says at one multiplier, as sides of a certificate; nothing if undecided.

        A state may miss balance by `limit` of the lightest block's weight. Of a mechanism also the motion of the same
        blocks that falls at the least multiplier.
        """
        model = self.growing.at(times)
        there = model.system()
        found = decide_rigid(model, there, schur=self.growing.schur) if times else self.growing.standing
        if found.word == "balanced" and found.state is not None:
            state = self.polished(found.state.f * (there.force_unit / self.system.force_unit), times, limit)
            yield from [{"lower": times, "state": state}] if state is not None else []
        if found.word == "collapse" and found.y is not None:
            yield self.moving(found.y)
            least = opened_bound(self.growing.pencil, self.growing.balance(0.0), found.y)[1]
            if least is not None and (proved := _alone(self, self.moving(least))):
                yield proved

    def moving(self, y: Floats, least: float = -np.inf, raised: bool = True) -> dict[str, Any]:
        """A motion as a side of a certificate, its bound at least `least`; `raised` lets it have room."""
        y = self.system.still(y)
        motion = y.reshape(-1, 6).copy()
        motion[:, 3:] /= self.system.length_unit
        motion /= max(float(np.max(np.abs(motion), initial=0.0)), 1e-300)
        still, room = self.room(y) if raised else (np.inf, 0.0)
        upper = max(least, still + room) if np.isfinite(still) else least
        return {"upper": upper, "motion": motion, "room": room}


def prove_bounds(
    growing: GrowingModel, outcome: LimitOutcome, again: bool = False, budget: Budget = UNLIMITED
) -> Proved:
    """Write the certificate of an outcome, have it checked, and keep what was proved.

    What is not proved on both sides is solved again at every block's own scale.

    Parameters
    ----------
    growing : GrowingModel
        The model and what grows on it.
    outcome : LimitOutcome
        In the user's multipliers.
    again : bool
        Whether to solve again where that is needed.
    budget : Budget
        Where no time is left for a proof, nothing is proved.
    """
    case = _Case(growing)
    if not budget.allows_proof(len(growing.model.contacts.point)):
        return Proved()
    if outcome.word == "unbounded" and (found := _without_limit(case)) is not None:
        return found
    first = _best(case, list(_sides(case, outcome, again)), budget)
    wanted = outcome.word in ("limit", "undecided", "unbounded")
    if not wanted or not again or budget.over:
        return first
    if first.lower is None or first.lower > 0.0:
        rest = next(case.decided(0.0, ACCEPTED), {})
        if "motion" in rest:
            return replace(first, falls=True)  # what stands at a multiplier may need these loads to stand
        if first.lower is None and rest:
            first = _tighter(case, first, _best(case, [rest], budget))
    if first.closed or growing.system.blocks > OWN_SCALE:
        return first
    own = in_users_units(limit_at_own_scale(growing.pencil, growing.balance(0.0)), growing.pencil.unit)
    best = _tighter(case, first, _best(case, list(_sides(case, own, True)), budget))
    if best.upper is None and (found := _without_limit(case)) is not None:
        return found
    for limit in MISSED:
        best = _bisected(case, best, limit, budget)
    return replace(best, room=max(best.room, 0.25 * case.trifle))


def _sides(case: _Case, outcome: LimitOutcome, raised: bool) -> Iterator[dict[str, Any]]:
    """What an outcome says of either side, ready for a certificate; `raised` lets an upper bound have room."""
    if outcome.f is not None and np.isfinite(outcome.lower):
        steps = [(outcome.lower - step * abs(outcome.lower), limit) for limit in MISSED for step in LOWERED]
        held = ((lower, case.polished(outcome.f, lower, limit)) for lower, limit in steps)
        found = next(((lower, state) for lower, state in held if state is not None), None)
        if found is not None:
            yield {"lower": found[0], "state": found[1]}
    if outcome.y is not None and np.isfinite(outcome.upper):
        yield case.moving(outcome.y, outcome.upper, raised)


def _bisected(case: _Case, known: Proved, limit: float, budget: Budget) -> Proved:
    """Both bounds brought together by deciding one multiplier after another between them.

    A mechanism says how far down it works, and the next question is asked there (Newton's method for a ratio;
    Dinkelbach 1967); where that is slow, halfway. Bounds that lie no further apart than a trifle are left as they are.
    """
    low, high, room = known.lower or 0.0, np.inf if known.upper is None else known.upper, known.room
    trifle = case.trifle
    sides: dict[str, dict[str, Any]] = {}
    top, gap, fast = high - room, np.inf, np.isfinite(high)  # no state is sought beyond, certificates might let it pass
    for _ in range(ASKED):
        if budget.over or _closed(low, high, room) or high - low <= trifle or top - low <= max(CLOSED * abs(low), room):
            break
        near = top - BELOW * abs(top) if fast else 0.5 * (low + top)
        times = near if np.isfinite(top) else 4.0 * max(low, 1.0)
        if not low < times < top:
            break
        before, top, falls = top, times, False
        for found in case.decided(times, limit):
            if "state" in found:
                low, top, sides["lower"] = times, before, found
            elif found["upper"] < high:
                high, room, sides["upper"], falls = found["upper"], found["room"], found, True
                top = min(top, high - room)
        fast, gap = falls and top - low < 0.25 * gap, top - low
    return _tighter(case, known, _best(case, list(sides.values()), budget)) if sides else known


def _closed(lower: float, upper: float, room: float) -> bool:
    """Whether bounds lie as near each other as they can be proved: mechanisms need one and a half times their room."""
    return upper - lower <= max(2.0 * CLOSED * max(abs(lower), abs(upper)), 4.0 * room) < np.inf


def _best(case: _Case, sides: list[dict[str, Any]], budget: Budget) -> Proved:
    """Both sides in one certificate; where that fails each by itself, and then again those that stand."""
    if not sides:
        return Proved()
    whole = {key: value for side in sides for key, value in side.items()}
    certificate, report = _checked(case, whole)
    if not report.proved and budget.over:
        return Proved(report=report)
    if not report.proved:
        kept = {key: value for side in sides for key, value in _alone(case, side).items()}
        if not kept:
            return Proved(report=report)
        whole = kept
        certificate, report = _checked(case, whole)
    if not report.proved:
        return Proved(report=report)
    state = whole.get("state")
    force = None if state is None else _in_units(state, case)
    room = whole.get("room", 0.0)
    return Proved(whole.get("lower"), whole.get("upper"), False, room, force, whole.get("motion"), certificate, report)


def _in_units(state: Polished, case: _Case) -> Floats:
    """(q, 3) forces of a state in the units of the system, frame by frame."""
    high, low = state.parts
    world = high if low is None else high + low
    contacts, patch = case.model.contacts, case.model.contacts.patch[case.system.used]
    smooth = contacts.mu[patch] == 0.0
    local = np.einsum("qij,qj->qi", case.system.frame, world)
    local[smooth] = 0.0
    local[smooth, 0] = world[smooth, 0] * contacts.scale[patch[smooth]]
    shift = case.system.pull if len(case.system.pull) else 0.0
    local /= case.system.force_unit
    local[:, 0] += shift
    return np.asarray(local)


def _alone(case: _Case, side: Mapping[str, Any]) -> dict[str, Any]:
    """One side, as far as it can be proved by itself; an upper bound is raised a little where that helps."""
    for step in RAISED if "upper" in side else RAISED[:1]:
        moved = {key: value + step * abs(value) if key == "upper" else value for key, value in side.items()}
        if _checked(case, moved)[1].proved:
            return moved
    return {}


def _tighter(case: _Case, one: Proved, other: Proved) -> Proved:
    """The better bound of either side; both in one certificate."""
    if other.report is None or not other.report.proved:
        return one
    if one.report is None or not one.report.proved:
        return other
    low = max((one, other), key=lambda p: -np.inf if p.lower is None else p.lower)
    high = min((one, other), key=lambda p: np.inf if p.upper is None else p.upper)
    if low is high:
        return low
    assert low.certificate is not None
    assert high.certificate is not None
    keys = ("upper", "mechanism")
    certificate = {key: value for key, value in low.certificate.items() if key not in keys}
    certificate |= {key: high.certificate[key] for key in keys if key in high.certificate}
    certificate["seal"] = seal(certificate)
    report = verify(certificate)
    if not report.proved:
        return low if low.lower is not None else high
    return Proved(low.lower, high.upper, False, high.room, low.force, high.motion, certificate, report)


def _without_limit(case: _Case) -> Proved | None:
    """Forces at multiplier 0, and forces that balance the live loads alone: their sums hold at every multiplier."""
    growing, model = case.growing, case.model
    forces = [float(np.linalg.norm(load.force)) for load in growing.loads]
    weight = STANDARD_GRAVITY * float(np.max(model.mass[~model.fixed], initial=0.0))
    lacking = weight / min(forces, default=np.inf)  # by which all loads are scaled: what is missed is less than all
    times = 2.0 ** np.ceil(np.log2(lacking)) if lacking > 1.0 else 1.0
    dry = replace(growing.at(times, 0.0), contacts=replace(model.contacts, tension=None))
    states = []
    for there in (growing.at(0.0), dry):
        found = decide_rigid(there, there.system())
        if found.word != "balanced" or found.state is None:
            return None
        states.append(found.state)
    idle = _idle(case)
    high, low = (None if part is None else np.where(idle[:, None], 0.0, part / times) for part in states[1].parts)
    sides = {"lower": 0.0, "state": states[0], "recession": (high, low)}
    certificate, report = _checked(case, sides)
    if not report.proved:
        return None
    return Proved(0.0, None, True, 0.0, _in_units(states[0], case), None, certificate, report)


def _idle(case: _Case) -> Bools:
    """(q,) points of components on which nothing live acts: forces that balance live loads alone have none there."""
    system = case.system
    label = component_labels(system)
    acting = np.bincount(label, np.abs(case.growing.live).reshape(-1, 6).sum(1)) > 0.0
    return np.asarray(~acting[label[np.maximum(system.row_a, system.row_b)]])


def _checked(case: _Case, sides: Mapping[str, Any]) -> tuple[dict[str, Any], Report]:
    model, system = case.model, case.system
    proof = {"world_force": sides["state"].parts} if "state" in sides else {}
    proof |= {key: sides[key] for key in ("motion",) if key in sides}
    certificate = certify(model, system, "limit-bounds", proof)
    names = [block.id for block in model.assembly.blocks]
    certificate["live"] = {
        "gravity": _plain(case.growing.gravity),
        "loads": [
            {"block": names[load.block], "force": _plain(load.force), "point": _plain(load.point)}
            for load in case.growing.loads
        ],
    }
    certificate |= {key: float(sides[key]) for key in ("lower", "upper") if key in sides}
    if "recession" in sides:
        parts: Parts = sides["recession"]
        certificate["recession"] = force_rows(system, model.contacts, parts)
    certificate["seal"] = seal(certificate)
    return certificate, verify(certificate)


def _plain(vector: Floats) -> list[float]:
    """Numbers, with noise below 1e-60 of the largest set to zero."""
    size = float(np.max(np.abs(vector), initial=0.0))
    return [float(x) if abs(x) > 1e-60 * size else 0.0 for x in vector]


def in_users_units(outcome: LimitOutcome, unit: float) -> LimitOutcome:
    """Multipliers t = unit s; an upper bound is rounded up, a lower one is what its forces balance."""
    upper = outcome.upper * unit
    upper = upper + 4e-16 * abs(upper) if np.isfinite(upper) else upper
    return replace(outcome, lower=outcome.lower * unit, upper=upper, least=outcome.least * unit)
