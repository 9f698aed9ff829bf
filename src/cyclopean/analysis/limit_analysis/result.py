"""What limit analysis answers."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Contacts, Loading
from cyclopean.representation import one_line

if TYPE_CHECKING:
    from cyclopean.analysis.large_displacement.pushover import Pushover
    from cyclopean.analysis.limit_analysis.bracket import CoupledBracket
    from cyclopean.analysis.limit_analysis.polar import Polar, Travelling

__all__ = ["LimitResult", "LimitWord"]

LimitWord = Literal["limit", "unbounded", "falls", "undecided"]


@dataclass(frozen=True, slots=True, eq=False)
class LimitResult:
    """The largest multiplier of the live loads, bounded from both sides, and the certificate that proves both.

    `word`: "limit", both bounds; "unbounded", no mechanism exists, `lower` is what was tried; "falls", it does not
    stand without live loads (`window` tells between which multipliers it does, where there are any); "undecided", the
    bounds lie further apart than 1e-6, or one of them is missing.
    """

    __repr__ = one_line

    assembly: Assembly
    contacts: Contacts  # the ones used, mu filled in
    fixed: Bools  # (n,)
    live: Live
    method: str  # "rbe"
    word: LimitWord
    reason: str  # one sentence a person understands
    lower: float | None  # proved to stand at this multiplier; of a tilt tan(angle)
    upper: float | None  # proved not to stand from here on
    window: tuple[float, float] | None  # multipliers between which it stands, where it falls without live loads
    assumed: dict[str, Any]
    gravity: Floats  # (3,) m/s2, without live loads
    force: Floats | None = None  # (P, 3) N: fn, fu, fv at each contact point in the frame of its patch, at `lower`
    utilisation: Floats | None = None  # (c,)
    mechanism: Floats | None = None  # (n, 6) velocity and angular velocity, at `upper`; zero rows when fixed
    governing: int | None = None  # contact at which the mechanism dissipates most: it opens or slides, see `joints`
    angle: tuple[float | None, float | None] | None = None  # degrees, lower and upper, of a tilt
    certificate: dict[str, Any] | None = None
    provenance: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    loading: Loading | None = None
    coupled: "CoupledBracket | None" = None  # what coupled analysis says below the bounds
    polar: "Polar | None" = None  # tilts or pushes in other directions, of which this is the least
    travelling: "Travelling | None" = None  # the load in other places, of which this is the least
    pushover: "Pushover | None" = None  # the curve on displaced geometry

    @property
    def value(self) -> float:
        """The middle of both bounds; NaN where one is missing."""
        if self.lower is None or self.upper is None:
            return float("nan")
        return (self.lower + self.upper) / 2.0

    @property
    def gap(self) -> float:
        """(upper - lower) relative to the larger of them; infinite where one is missing."""
        if self.lower is None or self.upper is None:
            return float("inf")
        size = max(abs(self.lower), abs(self.upper))
        return (self.upper - self.lower) / size if size > 0.0 else 0.0

    @property
    def frame(self) -> Floats:
        """(c, 3, 3) rows n, u, v of each contact."""
        return self.contacts.frame if len(self.contacts) else np.zeros((0, 3, 3))
