"""What is known of a model that coupled analysis leaves undecided: what is proved, and where the search ends."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import steep_beds

if TYPE_CHECKING:
    from cyclopean.analysis.verdict import Word

__all__ = ["Fold", "Friction", "Recut", "StableAt", "Undecided", "folds_at", "listed", "recut_of"]

NAMED = 3  # stones at which a search ends that are told
LEVEL = 1e-6  # share of a face's normal along gravity below which it is upright and bears nothing


@dataclass(frozen=True, slots=True)
class Fold:
    """A stone at which the search for a coupled state ends."""

    block: str
    faces: tuple[float, ...]  # degrees from level of the faces that look down, the flattest first
    friction: float  # degrees, of the face that comes nearest to carrying it
    neighbours: tuple[str, ...]  # that may jam it; of a stone that a face carries, the other one at the joint
    steep: bool = True  # whether no face carries it by itself, see `assembly.steep_beds`

    def words(self) -> str:
        """What is the matter with it."""
        others = listed(self.neighbours)
        if not self.steep:
            return f"the search ends at the joint of '{self.block}' and {others}"
        angles = listed(list(dict.fromkeys(f"{angle:.0f}" for angle in self.faces)), "")
        lies = "on a face" if len(self.faces) == 1 else "on faces"
        lies += f" steeper than friction ({angles} degrees against {self.friction:.0f})"
        jams = f" and stands only if {others} jam{'s' * (len(self.neighbours) == 1)} it" if others else ""
        return f"stone '{self.block}' rests {lies if angles else 'on nothing'}{jams}"


@dataclass(frozen=True, slots=True)
class Recut:
    """A bearing face that would have to be flatter."""

    block: str
    on: str  # the block under that face
    angle: float  # degrees from level
    needed: float  # degrees or less

    def words(self) -> str:
        """What to cut."""
        lies = f"its face on '{self.on}' lies at {self.angle:.0f} degrees"
        return f"recut '{self.block}': {lies} and would carry it at {self.needed:g}"


@dataclass(frozen=True, slots=True, eq=False)
class StableAt:
    """A larger bound of the virtual displacement at which a state is proved."""

    eta: float  # in the unit of eps
    certificate: dict[str, Any]

    def words(self) -> str:
        """With which eta."""
        return f"with `eta` {self.eta:g} it is proved stable"


@dataclass(frozen=True, slots=True)
class Friction:
    """More friction, with which a model is proved stable."""

    factor: float  # of that of every joint
    mu: float | None  # the coefficient, where it is the same everywhere

    def words(self) -> str:
        """With how much."""
        much = f"{self.factor:g} times as much friction" if self.mu is None else f"friction {self.mu:g}"
        return f"with {much} it is proved stable"


@dataclass(frozen=True, slots=True, eq=False)
class Undecided:
    """What is known of a model that coupled analysis leaves undecided; none of it is a verdict."""

    why: str  # a sentence
    rbe: "Word"  # what rigid-block equilibrium says alone
    eta: float  # that was asked for
    force: Floats | None = None  # (P, 3) N: the best triple met, as in `Result`; no state
    displacement: Floats | None = None  # (n, 6) of it, virtual, scaled with eps
    folds: tuple[Fold, ...] = ()  # stones at which the search ends, the most blamed first
    recut: Recut | None = None
    stable_at: StableAt | None = None
    friction: Friction | None = None  # the least tried at which it is proved stable
    untried: tuple[str, ...] = ()  # for what no time was left

    def lines(self) -> list[tuple[str, str]]:
        """What is said beside `why`, each with a word: what equilibrium says, where a state is, where it ends."""
        proved = ", with proof" * (self.rbe != "undecided")
        told = [("rbe", f"rigid-block equilibrium alone says {self.rbe}{proved}")]
        if (at := self.stable_at) is not None:
            told.append(("at eta", f"a state exists for eta >= {at.eta:g}, with proof ({self.eta:g} was asked for)"))
        return told + [("stone", fold.words()) for fold in self.folds] + [("change", way) for way in self._ways()]

    def _ways(self) -> list[str]:
        """What decides it or may, each in a clause."""
        told = [way.words() for way in (self.stable_at, self.friction, self.recut) if way is not None]
        if self.untried:
            told.append(f"there was no time to try {listed(self.untried, '')}: more `seconds`")
        return told or ["more `seconds` and `nodes`, a larger `eta` or other friction may decide it"]

    def reason(self) -> str:
        """All of it in sentences."""
        return " ".join([self.why, *(f"{text[0].upper()}{text[1:]}." for _, text in self.lines())])

    def stones(self) -> list[dict[str, Any]]:
        """The stones at which the search ends as plain data: part of the provenance."""
        return [
            {"block": f.block, "faces": list(f.faces), "friction": f.friction, "neighbours": list(f.neighbours)}
            for f in self.folds
        ]


def listed(names: Sequence[str], mark: str = "'") -> str:
    """Names as a sentence has them, at most four.

    >>> listed(["a", "b", "c"]), listed(["a"]), listed([])
    ("'a', 'b' and 'c'", "'a'", '')
    """
    shown = [f"{mark}{name}{mark}" for name in names[:4]]
    if len(names) > 4:
        shown.append(f"{len(names) - 4} more")
    return " and ".join(part for part in (", ".join(shown[:-1]), *shown[-1:]) if part)


def folds_at(model: PreparedModel, points: Sequence[int] | Ints) -> tuple[Fold, ...]:
    """Stones at contact points (k,) of a model at which a search ends, in that order, at most `NAMED`.

    Those that no face carries by itself first; of other joints one of the two blocks.
    """
    contacts, blocks = model.contacts, model.assembly.blocks
    beds = {bed.block: bed for bed in steep_beds(model.assembly, contacts, model.fixed, model.gravity)}
    steep, others = dict[str, Fold](), dict[str, Fold]()
    for k in dict.fromkeys(contacts.patch[list(points)].tolist()):
        ends = int(contacts.a[k]), int(contacts.b[k])
        free = [end for end in ends if not model.fixed[end]]
        found = [end for end in free if blocks[end].id in beds]
        for end in found:
            bed, faces = beds[blocks[end].id], tuple(sorted(_bearing(model, end).values()))
            jams = bed.neighbours if faces or not bed.neighbours else _touching(model, end)
            steep.setdefault(bed.block, Fold(bed.block, faces, bed.friction, jams))
        if free and not found:
            name, faces = blocks[free[0]].id, tuple(sorted(_bearing(model, free[0]).values()))
            friction = float(np.degrees(np.arctan(contacts.mu[k])))
            others.setdefault(name, Fold(name, faces, friction, (blocks[sum(ends) - free[0]].id,), False))
    return (*steep.values(), *others.values())[:NAMED]


def recut_of(model: PreparedModel, folds: Sequence[Fold]) -> Recut | None:
    """The flattest bearing face of the first steep stone: the least to cut before one carries it, in degrees."""
    steep = next((fold for fold in folds if fold.steep and fold.faces), None)
    if steep is None:
        return None
    i = next(k for k, block in enumerate(model.assembly.blocks) if block.id == steep.block)
    angle = _bearing(model, i)
    k = min(angle, key=lambda contact: angle[contact])
    on = int(model.contacts.a[k] + model.contacts.b[k]) - i
    return Recut(steep.block, model.assembly.blocks[on].id, angle[k], float(np.floor(steep.friction)))


def _touching(model: PreparedModel, i: int) -> tuple[str, ...]:
    """Ids of all blocks that touch block i."""
    a, b, blocks = model.contacts.a, model.contacts.b, model.assembly.blocks
    return tuple(blocks[k].id for k in np.unique(np.concatenate([b[a == i], a[b == i]])).tolist())


def _bearing(model: PreparedModel, i: int) -> dict[int, float]:
    """Degrees from level of the faces of block i that look down, by contact."""
    contacts, gravity = model.contacts, model.gravity / max(float(np.linalg.norm(model.gravity)), 1e-300)
    mine = np.flatnonzero((contacts.a == i) | (contacts.b == i))
    down = contacts.frame[mine, 0] @ gravity * np.where(contacts.a[mine] == i, 1.0, -1.0)
    looks = down > LEVEL
    return dict(zip(mine[looks].tolist(), np.degrees(np.arccos(np.minimum(down[looks], 1.0))).tolist(), strict=True))
