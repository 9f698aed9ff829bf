"""What an analysis answers."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Contacts, Loading
from cyclopean.representation import one_line

if TYPE_CHECKING:
    from cyclopean.analysis.large_displacement.subsidence import Subsidence
    from cyclopean.analysis.safety_margins import Margins
    from cyclopean.analysis.sensitivity_study.sampling import Sensitivity
    from cyclopean.analysis.undecided import Undecided

OPEN = 1e-6  # of the largest displacement: what gaps less counts as shut

__all__ = ["Result", "Settled", "Within", "Word", "millimetres", "openings", "relative_motion"]

Word = Literal["stable", "unstable", "undecided"]


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """How the blocks come to rest after a settlement that is small."""

    ground: Floats  # (n, 6) m, rad: what the ground does to supports, zero for other blocks
    displacement: Floats  # (n, 6) m, rad: of all blocks, supports included
    gap: Floats  # (P, 3) m: opening and sliding of each contact point, in the frame of its patch


@dataclass(frozen=True, slots=True)
class Within:
    """For which drawings around a model its verdict was asked for, and for which it was proved."""

    asked: float  # m
    degrees: float | None  # by which normals may lean; None = by what the length allows
    holds: bool
    certain: float  # m: the largest length for which it was proved, to a tenth; 0 = none

    def words(self) -> str:
        """What is certain, in a sentence."""
        lean = (
            ""
            if self.degrees is None
            else f", their normals within {self.degrees:g} degree{'s' * (self.degrees != 1.0)}"
        )
        if self.holds:
            return f"The answer holds for every drawing within {millimetres(self.asked)} of this one{lean}."
        if not self.certain:
            return f"For no length was that proved of all drawings around it{lean}; asked {millimetres(self.asked)}."
        return (
            f"That is certain only for drawings within {millimetres(self.certain)} of this one{lean};"
            f" asked {millimetres(self.asked)}."
        )


def millimetres(length: float) -> str:
    """A length (m) as a person reads it, rounded down to three digits.

    >>> millimetres(0.0031999), millimetres(0.25), millimetres(0.003)
    ('3.19 mm', '250 mm', '3 mm')
    """
    unit = 10.0 ** (math.floor(math.log10(1e3 * length)) - 2)
    return f"{math.floor(1e3 * length / unit * (1.0 + 1e-12)) * unit:.6g} mm"


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """A verdict, what it rests on, and the certificate that proves it."""

    __repr__ = one_line

    assembly: Assembly
    contacts: Contacts  # the ones used, mu filled in
    fixed: Bools  # (n,)
    method: str  # "cra" or "rbe"
    verdict: Word
    reason: str  # one sentence a person understands
    assumed: dict[str, Any]  # mu, density, supports, gravity: only what the user or the file did not say
    gravity: Floats  # (3,) m/s2
    residuals: dict[str, float]  # relative, recomputed by us from the model
    force: Floats | None = None  # (P, 3) N: fn, fu, fv at each contact point in the frame of its patch, on b
    frame: Floats | None = None  # (c, 3, 3) rows n, u, v
    tension: Floats | None = None  # (P,) N at each contact point: what the penalty form would need, when asked for
    tension_exact: bool = False  # whether forces with that tension make a state of the method
    utilisation: Floats | None = None  # (c,) |sum ft| / (mu sum fn) of each patch; 0 where it carries nothing
    mechanism: Floats | None = None  # (n, 6) velocity of the centre of mass and angular velocity; zero rows when fixed
    displacement: Floats | None = None  # (n, 6) of a coupled state: virtual, scaled with eps; zero rows when fixed
    certificate: dict[str, Any] | None = None
    provenance: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    drawing: str = ""  # how many contacts there are only because the drawing was forgiven something; also a warning
    settled: Settled | None = None  # when stable after a settlement: `force` is then that of the settled state
    loading: Loading | None = None  # cases and their factors, where the model or the user told them apart
    path: "Subsidence | None" = None  # the steps of a settlement, where it was followed
    sensitivity: "Sensitivity | None" = None  # what became of samples, where some were drawn
    undecided: "Undecided | None" = None  # where coupled analysis is: what is known all the same
    within: Within | None = None  # for which drawings around the model it holds, where that was asked
    spare: "Callable[[], Margins] | None" = None  # finds `margins`; once, when they are first asked for

    @property
    def margins(self) -> "Margins | None":
        """How far it is from falling, where that is to be told."""
        return None if self.spare is None else self.spare()

    @property
    def strength(self) -> float:
        """Pa: the most that a joint of this model may pull; 0 where all are dry."""
        return float(self.contacts.strength.max(initial=0.0))

    @property
    def partly_held(self) -> tuple[str, ...]:
        """Ids of the blocks that supports hold in some directions only."""
        pairs = zip(self.assembly.blocks, self.fixed.tolist(), strict=True)
        return tuple(block.id for block, whole in pairs if block.held and not whole)


def openings(result: Result) -> list[tuple[int, float]]:
    """Contacts that open in a settlement, the widest first: number, and opening (m) at the corner where it is most."""
    if result.settled is None or not len(result.contacts):
        return []
    width = np.maximum.reduceat(result.settled.gap[:, 0], result.contacts.start[:-1])
    order = np.argsort(-width, kind="stable")
    least = OPEN * float(np.abs(result.settled.displacement[:, :3]).max())
    return [(int(k), float(width[k])) for k in order if width[k] > least]


def relative_motion(contacts: Contacts, motion: Floats, centre: Floats) -> Floats:
    """(P, 3) how contact points move on b against a, world axes, of (n, 6) motions about (n, 3) centres of mass."""
    of_a, of_b = (
        motion[i, :3] + np.cross(motion[i, 3:], contacts.point - centre[i])
        for i in (contacts.a[contacts.patch], contacts.b[contacts.patch])
    )
    return np.asarray(of_b - of_a)
