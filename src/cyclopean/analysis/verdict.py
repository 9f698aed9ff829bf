"""What an analysis answers."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Contacts, Loading

if TYPE_CHECKING:
    from cyclopean.analysis.large_displacement.subsidence import Subsidence
    from cyclopean.analysis.safety_margins import Margins
    from cyclopean.analysis.sensitivity_study.sampling import Sensitivity

OPEN = 1e-6  # of the largest displacement: what gaps less counts as shut

__all__ = ["Result", "Settled", "Word", "openings", "relative_motion"]

Word = Literal["stable", "unstable", "undecided"]


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """How the blocks come to rest after a settlement that is small."""

    ground: Floats  # (n, 6) m, rad: what the ground does to supports, zero for other blocks
    displacement: Floats  # (n, 6) m, rad: of all blocks, supports included
    gap: Floats  # (P, 3) m: opening and sliding of each contact point, in the frame of its patch


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """A verdict, what it rests on, and the certificate that proves it."""

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
