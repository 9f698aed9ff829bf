"""A settlement of supports that is not small: the path of the blocks, step by step, as long as they find rest.

At every step the supports go on by finite rigid motions, and the blocks follow so that the loads lose most while
nothing closes that is shut. With g the gaps at the place reached so far, the motion d of the blocks is that of

    min  -p.d    s.t.  A'd + g in K*       (A, p and g of that place)
    min  g.f     s.t.  A f = -p, f in K    (the dual)

and the blocks are moved by it as rigid bodies, until nothing is left to move: g in K* there to rounding. Forces that
bear on nothing open then have to balance at the place reached: a state of rest. It is the sequence of convex programmes
of [Portioli2017]_, and for hinges the energy criterion of [Iannuzzo2018]_ on the geometry as it has become. Rest is
looked for close by: where the blocks would have to go further than `JUMP` times as far as the ground, however small the
step, they fall, be it to another rest.

A joint that slides in such a programme lifts. Dry stone's does not: where a state needs forces across such gaps the
path ends, and says so. Blocks that touch only once they have moved are not noticed.

References
----------
.. [Portioli2017] Portioli, Cascini: Large displacement analysis of dry-jointed masonry structures subjected to
   settlements using rigid block modelling. Eng. Structures 148 (2017).
.. [Iannuzzo2018] Iannuzzo, Angelillo, De Chiara, De Guglielmo, De Serio, Ribera, Gesualdo: Modelling the cracks
   produced by settlements in masonry structures. Meccanica 53 (2018).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from cyclopean.analysis.checking import check
from cyclopean.analysis.equilibrium.rbe import solve_rbe
from cyclopean.analysis.equilibrium.settlement import follow
from cyclopean.analysis.large_displacement.places import TOUCHES, Displaced, Place
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Result
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Contacts
from cyclopean.errors import InputError
from cyclopean.geometry import rotations

__all__ = ["Subsidence", "SubsidenceStep", "subsidence"]

Word = Literal["rest", "falls", "locked", "slides", "undecided"]
JUMP = 100.0  # times as far as the ground: further than that no block follows it
HALVINGS = 6  # of a step, to find where rest is lost
ROUNDS = 25  # of one step: each squares what is left to move
STAYS = 1e-6  # of what a programme has to move: gaps below it are those of a hinge, and stay shut
SHUT = 1e-9  # of the length unit: what is left to move once a step is done


@dataclass(frozen=True, slots=True, eq=False)
class SubsidenceStep:
    """One point of the path."""

    share: float  # of the whole settlement
    settlement: float  # m: furthest movement of a corner of a support
    word: Word  # what was found there: the last one alone need not be "rest"
    opening: float  # m: how far the widest joint is open
    joint: int  # which contact that is; -1 where none is open
    touching: int  # contact points that still touch
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

        "stable" if there is a state of rest at its end, whose certificate it then has; else "undecided".
        """
        if self.reached and self.proved and self.last is not None:
            return replace(result, reason=self.ended, certificate=self.last.certificate)
        return replace(result, verdict="undecided", reason=self.ended, certificate=None)


_WHY: dict[Word, str] = {
    "falls": "no state of rest was found close by: the blocks fall, or snap to another place",
    "locked": "the blocks cannot follow: they are locked between the supports, and something would have to crush",
    "slides": "joints slide: the flow of this analysis lifts what slides, dry stone's does not, so it is not followed",
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
    walk = _Walk(path, path.start(), [], settings)
    walk.rests(path.start(), 0.0)
    lost = None
    for k in range(steps):
        progress(f"settlement {100.0 * (k + 1) / steps:.3g} %")
        lost = walk.on((k + 1) / steps, 1.0 / steps / 2**HALVINGS)
        if lost is not None:
            walk.made.append(lost)
            break
    made, word = walk.made, "rest" if lost is None else lost.word
    last = None if walk.share == 0.0 else walk.last
    return Subsidence(tuple(made), lost is None, _ended(made, word, last), last, model.contacts, tuple(walk.proofs))


def _judged(path: "_Path", place: Place, settings: Settings) -> Result | None:
    """What `check` says of the blocks as they stand; None where a joint gapes too wide for one normal to suit it."""
    try:
        return check(*path.displaced(place, settings))
    except InputError:
        return None


def _ended(made: list[SubsidenceStep], word: Word, last: Result | None) -> str:
    """What became of it, in a sentence."""
    rest = [step for step in made if step.word == "rest"][-1]
    far = f"{rest.settlement:.4g} m ({100 * rest.share:.4g} %)"
    proof = "proved" if last is not None and last.verdict == "stable" else "not proved"
    if word == "rest":
        return f"States of rest follow the whole settlement of {rest.settlement:.4g} m; the last one is {proof}."
    if rest.share == 0.0:
        return f"No state of rest follows the settlement: {_WHY[word]}."
    return f"States of rest follow the settlement up to {far}, the last one {proof}; then {_WHY[word]}."


class _Path(Displaced):
    """A model whose supports move."""

    def __init__(self, model: PreparedModel, ground: Floats) -> None:
        super().__init__(model)
        self.ground = ground
        self.supports = np.flatnonzero(model.fixed)
        self.all = np.arange(self.base.points)

    def settled(self, place: Place, share: float) -> Place:
        """The same with the supports where they are after a share of the settlement."""
        centre, turn = place.centre.copy(), place.turn.copy()
        here = self.supports
        centre[here] = self.model.assembly.mass.centroid[here] + share * self.ground[here, :3]
        turn[here] = rotations(share * self.ground[here, 3:])
        return Place(centre, turn)

    def _shifted(self, place: Place) -> Floats:
        """(q, 3) m: how far points that are open have shifted along their joint; they need not come back together."""
        pa, pb, n = self.ends(place)
        along = (pb - pa) - np.sum((pb - pa) * n, 1, keepdims=True) * n
        return np.asarray(np.where((self.gaps(place) > TOUCHES)[:, None], along, 0.0))

    def _apart(self, place: Place, shifted: Floats) -> Floats:
        """(q, 3) gaps that a step has to respect, in each point's frame at that place, in length units."""
        pa, pb, n = self.ends(place)
        along = shifted - np.sum(shifted * n, 1, keepdims=True) * n
        frame = self.system(place, self.all).frame
        return np.asarray(np.einsum("qij,qj->qi", frame, pb - pa - along) / self.unit)

    def followed(self, place: Place, target: float) -> tuple[Place, Word]:
        """Where the blocks come to rest once the supports have gone on."""
        shifted = self._shifted(place)
        there = self.settled(place, target)
        ground, gone, shut = 0.0, 0.0, self.gaps(place) <= TOUCHES
        lost: Word = "undecided"
        for _ in range(ROUNDS):
            gap = self._apart(there, shifted)
            size = max(
                float(np.max(_missed(gap, self.base.mu), initial=0.0)), float(np.max(np.abs(gap[shut]), initial=0.0))
            )
            if size <= SHUT:
                return there, "rest" if self._rests(there) else lost
            ground = max(ground, size)
            gap[:, 0] = np.minimum(gap[:, 0], 2.0 * JUMP * size)
            system = replace(
                self.system(there, self.all), p=self.wrench(there, self.model.gravity, self.model.assembly.loads)
            )
            found = follow(system, gap / size)
            if found.y is None or found.gap is None:
                return there, lost if lost == "slides" else _WORDS[found.word]
            lost = lost if lost == "slides" else _WORDS[found.word]
            shut = np.max(np.abs(found.gap), axis=1) <= STAYS
            step = found.y.reshape(-1, 6) * size
            gone += float(np.max(np.abs(step), initial=0.0))
            if not (gone <= JUMP * ground):
                return there, lost
            there = there.moved(self.base.free, self.world(step.ravel()))
        return there, lost

    def _rests(self, place: Place) -> bool:
        """Whether forces balance that bear on nothing that is open."""
        touching = np.flatnonzero(self.gaps(place) <= 10.0 * TOUCHES)
        loads = self.wrench(place, self.model.gravity, self.model.assembly.loads)
        return solve_rbe(replace(self.system(place, touching), p=loads)).word == "balanced"

    def told(self, place: Place, share: float, word: Word) -> SubsidenceStep:
        """A point of the path."""
        gaps = self.gaps(place)
        wide = int(np.argmax(gaps)) if len(gaps) else -1
        opens = wide >= 0 and bool(gaps[wide] > 10.0 * TOUCHES)
        patch = self.model.contacts.patch[self.base.used]
        return SubsidenceStep(
            share,
            self._ground(share),
            word,
            float(gaps[wide]) * self.unit if opens else 0.0,
            int(patch[wide]) if opens else -1,
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

    def __init__(self, path: _Path, place: Place, made: list[SubsidenceStep], settings: Settings) -> None:
        self.path, self.place, self.made, self.settings = path, place, made, settings
        self.share = 0.0
        self.last: Result | None = None
        self.proofs: list[Mapping[str, Any] | None] = []

    def rests(self, there: Place, share: float) -> None:
        """Note a place of rest, and what `check` proves of it."""
        self.place, self.share, self.last = there, share, _judged(self.path, there, self.settings)
        proved = self.last is not None and self.last.verdict == "stable"
        self.made.append(replace(self.path.told(there, share, "rest"), proved=proved))
        self.proofs.append(self.last.certificate if self.last is not None and proved else None)

    def on(self, target: float, least: float) -> SubsidenceStep | None:
        """Go on to a share of the settlement in as few steps as it takes, none below `least`; what was met if not."""
        aim = target
        while self.share < target:
            there, word = self.path.followed(self.place, aim)
            if word == "rest":
                self.rests(there, aim)
                aim = target
            elif aim - self.share > least:
                aim = (self.share + aim) / 2.0
            else:
                return self.path.told(there, aim, word)
        return None


_WORDS: dict[str, Word] = {
    "settled": "falls",  # where the motion has no end, or ends where nothing balances
    "collapse": "falls",
    "locked": "locked",
    "sliding": "slides",
    "undecided": "undecided",
}


def _missed(gap: Floats, mu: Floats) -> Floats:
    """(q,) by how much gaps are outside K*."""
    return np.asarray(np.maximum(mu * np.hypot(gap[:, 1], gap[:, 2]) - gap[:, 0], 0.0))
