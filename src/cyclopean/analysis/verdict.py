"""What an analysis answers."""

from dataclasses import dataclass, field
from typing import Any, Literal

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Contacts

__all__ = ["Result", "Word"]

Word = Literal["stable", "unstable", "undecided"]


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
