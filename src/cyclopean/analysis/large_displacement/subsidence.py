"""A settlement of supports that is not small: the path of the blocks, step by step, as long as they find rest.

At every step the supports go on by finite rigid motions, and the blocks follow so that the loads lose most, what
friction takes counted, while nothing closes that is shut: the programme of `flow` on the geometry reached so far, again
until nothing is left to move. Forces that bear on nothing open then have to balance at the place reached: a state of
rest. It is the sequence of convex programmes of [Portioli2017]_, and for hinges the energy criterion of [Iannuzzo2018]_
on the geometry as it has become. Rest is looked for close by: where the blocks would have to go further than `JUMP`
times as far as the ground, however small the step, they fall, be it to another rest.

Where stones run into each other the step is cut short, and they bear on each other from there on.

References
----------
.. [Portioli2017] Portioli, Cascini: Large displacement analysis of dry-jointed masonry structures subjected to
   settlements using rigid block modelling. Eng. Structures 148 (2017).
.. [Iannuzzo2018] Iannuzzo, Angelillo, De Chiara, De Guglielmo, De Serio, Ribera, Gesualdo: Modelling the cracks
   produced by settlements in masonry structures. Meccanica 53 (2018).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from cyclopean.analysis.checking import check
from cyclopean.analysis.equilibrium.rbe import Outcome, solve_rbe
from cyclopean.analysis.large_displacement.faces import Bodies
from cyclopean.analysis.large_displacement.flow import dry_flow
from cyclopean.analysis.large_displacement.places import TOUCHES, Displaced, Place
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Result
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, Contacts
from cyclopean.errors import InputError
from cyclopean.geometry import frames_from_normals, rotations
from cyclopean.statics import EquilibriumSystem

__all__ = ["Subsidence", "SubsidenceStep", "subsidence"]

Word = Literal["rest", "falls", "locked", "meet", "undecided"]
JUMP = 100.0  # times as far as the ground: further than that no block follows it
HALVINGS = 6  # of a step, to find where rest is lost
ROUNDS = 25  # of one step: each squares what is left to move
STAYS = 1e-6  # of what a programme has to move: gaps below it are those of a hinge, and stay shut
CALM = 1e-4  # of what the ground has moved points: a last motion that is no further is none
SHUT = 1e-9  # of the length unit: what is left to move once a step is done
THIN = 0.5  # of the thinnest stone's least side: no stone goes further before it is seen whether stones have met
LOOKS = 100  # in one step, at most
HALVED = 20  # of a step in which stones run into each other, to find where they meet
MEETINGS = 12  # in one step: where stones meet more often, the path ends


@dataclass(frozen=True, slots=True, eq=False)
class SubsidenceStep:
    """One point of the path."""

    share: float  # of the whole settlement
    settlement: float  # m: furthest movement of a corner of a support
    word: Word  # what was found there: the last one alone need not be "rest"
    opening: float  # m: how far the widest joint is open
    joint: int  # which contact that is; -1 where none is open
    touching: int  # contact points that still touch
    met: tuple[tuple[str, str], ...] = ()  # ids of stones that have come into contact there
    proved: bool = False  # whether `check` proves that the blocks stand where they are then


@dataclass(frozen=True, slots=True, eq=False)
class Subsidence:
    """The path of a settlement, as far as states of rest were found."""

    steps: tuple[SubsidenceStep, ...]
    reached: bool  # whether there is rest at the end of the whole settlement
    ended: str  # one sentence
    last: Result | None  # of the displaced model at the last state of rest, as `check` judges it; None where none was
    contacts: Contacts  # that `joint` counts
    proofs: tuple[Mapping[str, Any] | None, ...] = ()  # a certificate of each step that is proved

    @property
    def share(self) -> float:
        """The largest share of the settlement at which a state of rest was found."""
        return max((step.share for step in self.steps if step.word == "rest"), default=0.0)

    @property
    def proved(self) -> bool:
        """Whether that state has a certificate."""
        return self.last is not None and self.last.verdict == "stable"

    def judged(self, result: Result) -> Result:
        """What `check` said of a little of the settlement, with the verdict on all of it.

        "stable" if there is a state of rest at its end, whose certificate it then has; else "undecided". Where nothing
        is known of a little of it, because joints slide, forces and blocks are those of that state.
        """
        if self.reached and self.proved and self.last is not None:
            known = result if result.verdict == "stable" else replace(self.last, assumed=result.assumed)
            return replace(known, reason=self.ended, certificate=self.last.certificate)
        return replace(result, verdict="undecided", reason=self.ended, certificate=None)


_WHY: dict[Word, str] = {
    "falls": "no state of rest was found close by: the blocks fall, or snap to another place",
    "locked": "the blocks cannot follow: they are locked between the supports, and something would have to crush",
    "meet": "run into each other: both are supports, or no face parts them, or it goes on again and again",
    "undecided": "the solver came to no answer",
}


def subsidence(
    assembly: Assembly,
    settings: Settings | None = None,
    *,
    steps: int = 20,
    progress: Callable[[str], None] = lambda _: None,
) -> Subsidence:
    """Follow a settlement of supports as far as blocks find rest.

    Parameters
    ----------
    assembly : Assembly
        The model; its own settlements, or those of the settings.
    settings : Settings
        As for `check`.
    steps : int
        How many; where rest is lost in one, it is divided further.
    progress : callable
        Is told each step.

    Raises
    ------
    InputError
        No settlement, joints that pull, or steps that are no positive number.
    """
    if steps < 1:
        raise InputError.of("steps", steps, "expected a whole number >= 1")
    settings = Settings() if settings is None else settings
    model = prepare(assembly, settings, progress)
    if model.settled is None:
        raise InputError.of("steps", None, "no support settles; give `settlement` BLOCK:DX,DY,DZ")
    if model.contacts.strength.any():
        raise InputError("a settlement and joints that pull do not go together: what has opened pulls no more")
    path = _Path(model, model.settled)
    walk, start = _Walk(path, settings), path.start()
    lost = None if path.rests(start) else path.told(start, 0.0, "falls")
    if lost is None:
        walk.rests(start, 0.0)
    for k in range(steps) if lost is None else ():
        progress(f"settlement {100.0 * (k + 1) / steps:.3g} %")
        lost = walk.on((k + 1) / steps, 1.0 / steps / 2**HALVINGS)
        if lost is not None:
            break
    walk.made += [] if lost is None else [lost]
    made, word = walk.made, "rest" if lost is None else lost.word
    last = None if walk.share == 0.0 else walk.last
    ended = _ended(made, word, last, walk.crossed)
    return Subsidence(tuple(made), lost is None, ended, last, path.contacts, tuple(walk.proofs))


def _judged(path: "_Path", place: Place, settings: Settings) -> Result | None:
    """What `check` says of the blocks as they stand; None where a joint gapes too wide for one normal to suit it."""
    found = None
    for points in (True, False):  # what the checker does not take as points it may take as strips
        try:
            found = check(*path.displaced(place, settings, points))
        except InputError:
            continue
        if found.verdict == "stable":
            break
    return found


def _ended(made: list[SubsidenceStep], word: Word, last: Result | None, crossed: str) -> str:
    """What became of it, in a sentence."""
    rests = [step for step in made if step.word == "rest"]
    if not rests:
        return "It does not stand even before the settlement."
    rest = rests[-1]
    far = f"{rest.settlement:.4g} m ({100 * rest.share:.4g} %)"
    proof = "proved" if last is not None and last.verdict == "stable" else "not proved"
    if word == "rest":
        return f"States of rest follow the whole settlement of {rest.settlement:.4g} m; the last one is {proof}."
    why = f"{crossed} {_WHY[word]}" if word == "meet" and crossed else _WHY[word]
    if rest.share == 0.0:
        return f"No state of rest follows the settlement: {why}."
    return f"States of rest follow the settlement up to {far}, the last one {proof}; then {why}."


class _Path(Displaced):
    """A model whose supports move."""

    def __init__(self, model: PreparedModel, ground: Floats) -> None:
        super().__init__(model)
        self.bodies = Bodies(model.assembly, np.zeros(len(model.fixed), bool))  # supports run into each other as well
        self.ground = ground
        self.supports = np.flatnonzero(model.fixed)

    def settled(self, place: Place, share: float) -> Place:
        """The same with the supports where they are after a share of the settlement."""
        centre, turn = place.centre.copy(), place.turn.copy()
        here = self.supports
        centre[here] = self.model.assembly.mass.centroid[here] + share * self.ground[here, :3]
        turn[here] = rotations(share * self.ground[here, 3:])
        return Place(centre, turn)

    def _slipped(self, place: Place) -> Floats:
        """(q, 3) m: how far points have shifted along their joint; they need not come back."""
        pa, pb, n = self.ends(place)
        return np.asarray((pb - pa) - np.sum((pb - pa) * n, 1, keepdims=True) * n)

    def _apart(self, place: Place, slipped: Floats) -> Floats:
        """(q, 3) how far points are open, and have slipped since, in each point's frame and length units."""
        pa, pb, n = self.ends(place)
        along = slipped - np.sum(slipped * n, 1, keepdims=True) * n
        return np.asarray(np.einsum("qij,qj->qi", frames_from_normals(n), pb - pa - along) / self.unit)

    def _everywhere(self, place: Place, point: Floats) -> EquilibriumSystem:
        """The equilibrium system over all points, open or not, that bear there (q, 3)."""
        system = self.system(place, np.arange(self.base.points), point)
        return replace(system, p=self.wrench(place, self.model.gravity, self.model.assembly.loads))

    def followed(self, place: Place, target: float, pressure: Floats) -> tuple[Place, Word]:
        """Where the blocks come to rest once the supports have gone on; pressures (q,) at the place before."""
        slipped, there = self._slipped(place), self.settled(place, target)
        shut = np.repeat((self.gaps(place) <= TOUCHES)[:, None], 2, 1)  # across each joint, and along it
        ground, gone, moved = 0.0, 0.0, np.inf
        point, bears = self.bearing(place)  # until the blocks have begun to follow
        for _ in range(ROUNDS):
            gap = self._apart(there, slipped)
            off = np.stack([np.abs(gap[:, 0]), np.hypot(gap[:, 1], gap[:, 2])], 1)
            missed = float(np.max(np.maximum(np.where(shut, off, 0.0).max(axis=1), -gap[:, 0])[bears], initial=0.0))
            ground = max(ground, missed)
            if missed <= SHUT and not CALM * ground < moved < np.inf:
                return there, "rest" if self.rests(there) else "falls"
            size = missed if moved == np.inf else max(missed, moved)
            gap[:, 0] = np.where(bears, np.minimum(gap[:, 0], 2.0 * JUMP * size), 2.0 * JUMP * size)
            found = dry_flow(self._everywhere(there, point), pressure, gap / size)
            if isinstance(found, str):
                return there, "falls" if self._balanced(there)[0].word == "collapse" else found
            pressure = np.maximum(found.f[:, 0], 0.0)
            along = np.hypot(found.dd[:, 1], found.dd[:, 2])
            shut = np.stack([found.dd[:, 0] <= STAYS, (found.dd[:, 0] <= STAYS) & (along <= STAYS)], 1)
            step = found.y * size
            moved = float(np.max(np.abs(step), initial=0.0))
            gone += moved
            if not (gone <= JUMP * ground):
                return there, "falls"
            there = there.moved(self.base.free, self.world(step))
            self.faced(there, shut[:, 0] & bears)
            point, bears = self.bearing(there)
        return there, "undecided"

    def pressure(self, place: Place) -> Floats:
        """(q,) of forces that balance at a place of rest, scaled."""
        found, touching = self._balanced(place)
        pressure = np.zeros(self.base.points)
        if found.f is not None:
            np.add.at(pressure, touching, np.maximum(found.f[:, 0], 0.0))
        return pressure

    def _balanced(self, place: Place) -> tuple[Outcome, Ints]:
        """Forces that bear on nothing that is open, and the points that they bear on."""
        system, touching = self.borne(place, 10.0 * TOUCHES)
        loads = self.wrench(place, self.model.gravity, self.model.assembly.loads)
        return solve_rbe(replace(system, p=loads)), touching

    def rests(self, place: Place) -> bool:
        """Whether they balance the loads."""
        return self._balanced(place)[0].word == "balanced"

    def told(self, place: Place, share: float, word: Word) -> SubsidenceStep:
        """A point of the path."""
        gaps = self.gaps(place)
        wide = int(np.argmax(gaps)) if len(gaps) else -1
        opens = wide >= 0 and bool(gaps[wide] > 10.0 * TOUCHES)
        return SubsidenceStep(
            share,
            self._ground(share),
            word,
            float(gaps[wide]) * self.unit if opens else 0.0,
            int(self.patch[wide]) if opens else -1,
            int(np.sum(gaps <= 10.0 * TOUCHES)),
        )

    def _ground(self, share: float) -> float:
        """m: how far the corner of a support has gone at most."""
        turn, most = rotations(share * self.ground[:, 3:]), 0.0
        for i in self.supports:
            arm = self.model.assembly.blocks[i].vertices - self.model.assembly.mass.centroid[i]
            went = share * self.ground[i, :3] + arm @ (turn[i] - np.eye(3)).T
            most = max(most, float(np.max(np.linalg.norm(went, axis=1))))
        return most


class _Walk:
    """How far along a path rest has been found."""

    def __init__(self, path: _Path, settings: Settings) -> None:
        self.path, self.place, self.settings = path, path.start(), settings
        self.made: list[SubsidenceStep] = []
        self.share = 0.0
        self.last: Result | None = None
        self.proofs: list[Mapping[str, Any] | None] = []
        self.crossed = ""  # stones that met where that cannot be followed

    def _goes(self, there: Place, share: float) -> None:
        """Go on from a place of rest."""
        self.path.faced(there, self.path.gaps(there) <= 10.0 * TOUCHES)
        self.path.anchored(there)
        self.place, self.share = there, share

    def rests(self, there: Place, share: float, met: Sequence[tuple[int, int]] = ()) -> None:
        """Note a place of rest, and what `check` proves of it."""
        self._goes(there, share)
        self.last = _judged(self.path, there, self.settings)
        proved = self.last is not None and self.last.verdict == "stable"
        self.made.append(replace(self.path.told(there, share, "rest"), proved=proved, met=self._names(met)))
        self.proofs.append(self.last.certificate if self.last is not None and proved else None)

    def on(self, target: float, least: float) -> SubsidenceStep | None:
        """Go on to a share of the settlement in as few steps as it takes, none below `least`; what was met if not.

        No block goes further at once than half of the thinnest is thick, so that none passes through another unseen.
        """
        aim, meetings, path = target, 0, self.path
        room, finest = THIN * path.bodies.thinnest, (target - self.share) / LOOKS
        while self.share < target:
            pressure = path.pressure(self.place)
            there, word = path.followed(self.place, aim, pressure)
            far = path.bodies.furthest(self.place, there)
            if word == "rest" and far > room and aim - self.share > finest:
                aim = self.share + max((aim - self.share) * min(0.9 * room / far, 0.5), finest)
            elif word == "rest" and path.bodies.met(there):
                meetings += 1
                if meetings > MEETINGS or not self._meet(aim, there, pressure):
                    return self._lost(there, aim, "meet")
                aim = target
            elif word == "rest":
                pace = (aim - self.share) / far if far > 0.0 else np.inf
                (self._goes if aim < target and far > room / 4.0 else self.rests)(there, aim)  # parts are not told
                aim = min(target, self.share + 0.9 * room * pace)
            elif aim - self.share > least:
                aim = (self.share + aim) / 2.0
            else:
                return self._lost(there, aim, word)
        return None

    def _lost(self, there: Place, share: float, word: Word) -> SubsidenceStep:
        """What was met where rest was lost; the last rest is noted before."""
        if self.share > self.made[-1].share:
            self.rests(self.place, self.share)
        return self.path.told(there, share, word)

    def _meet(self, aim: float, beyond: Place, pressure: Floats) -> bool:
        """Go on until stones meet that are in each other beyond, and let them bear on each other; False: not followed.

        `pressure` (q,) is that at the last place of rest.
        """
        path, low, high, there = self.path, self.share, aim, self.place
        for _ in range(HALVED):
            middle = (low + high) / 2.0
            place, word = path.followed(self.place, middle, pressure)
            if path.bodies.met(place):
                high, beyond = middle, place
            elif word == "rest":
                low, there = middle, place
            else:
                high = middle
        pairs = path.bodies.met(beyond)
        fixed = path.model.fixed
        touches = [None if fixed[one] and fixed[two] else path.bodies.touch(there, (one, two)) for one, two in pairs]
        if any(one is None for one in touches):
            self.crossed = " and ".join(f"'{name}'" for name in self._names(pairs[:1])[0])
            return False
        new = [one for one in touches if one is not None and not path.known(there, one)]
        for one in new:
            path.joined(one, there, self.settings.mu)
        if new or low > self.share:
            self.rests(there, low, [one.pair for one in new])
        return bool(new)

    def _names(self, pairs: Sequence[tuple[int, int]]) -> tuple[tuple[str, str], ...]:
        ids = [block.id for block in self.path.model.assembly.blocks]
        return tuple((ids[one], ids[other]) for one, other in pairs)
