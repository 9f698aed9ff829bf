"""What a user may say about an analysis: every option described once, for the command line, Python and Grasshopper."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cyclopean.errors import InputError
from cyclopean.options import check_options, option
from cyclopean.texts import AUTO

if TYPE_CHECKING:
    from cyclopean.analysis.coupled.states import Bounds
    from cyclopean.assembly import Forgiven

__all__ = ["CRA_SOLVERS", "DENSITY", "GRAVITY", "METHODS", "MU", "RBE_SOLVERS", "Settings"]

MU = 0.84  # tan 40 degrees, as both reference systems
DENSITY = 2400.0  # kg/m3
GRAVITY = (0.0, 0.0, -9.80665)  # m/s2
ASKEW = 6.0  # degrees that faces may lean where only a gap is said
METHODS = ("cra", "rbe")
RBE_SOLVERS = ("auto", "newton", "interior", "clarabel", "osqp")
CRA_SOLVERS = ("auto", "clarabel", "osqp")
COUPLED = ("eps", "eta", "beta_min", "seconds", "nodes")  # what only coupled analysis has


@dataclass(frozen=True, slots=True)
class Settings:
    """What a user may say about an analysis; None (or "") = not said, a default is assumed and reported."""

    method: str = option("", "Coupled analysis or equilibrium alone [cra].", choices=METHODS)
    mu: float | None = option(None, "Friction where the model gives none [0.84].", "number", metavar="M", least=0.0)
    density: float | None = option(
        None, "kg/m3 where the model gives none [2400].", "number", metavar="D", above=0.0, unit="kg/m3"
    )
    supports: str = option("", "below=Z or ids=a,b instead of what the model says.", metavar="S")
    gravity: tuple[float, float, float] | None = option(None, "m/s2 [0,0,-9.80665].", "vector", metavar="X,Y,Z")
    tilt: tuple[float, float] | None = option(
        None, "Turn gravity towards azimuth AZ (degrees from +x to +y).", "tilt", metavar="DEG[,AZ]"
    )
    tolerance: float | tuple[float, float] | str | None = option(
        None, "Gap (m) within which faces touch, and how far they may lean, or auto.", "tolerance",
        metavar="GAP[,DEGREES]|auto",
    )  # fmt: skip
    cone: str = option("exact", "Friction cone: exact, or a pyramid, inscribed:K or circumscribed:K.", metavar="C")
    solver: str = option("auto", "auto, clarabel or osqp; rbe also newton or interior.", metavar="NAME")
    weights: tuple[float, float] = option(
        (1.0, 1.0), "rbe: weights of normal and tangential forces.", "pair", metavar="N,T"
    )
    penalty: bool = option(False, "Let joints pull, at a price: shows where tension would be needed.", "flag")
    eps: float = option(1.0, "cra: overlap of points that press.", "number", metavar="E", above=0.0)
    eta: float | None = option(
        None, "cra: largest virtual displacement of a point [10 eps].", "number", metavar="E", above=0.0
    )
    beta_min: float | None = option(
        None, "cra: least sliding where friction acts [0.01 eps].", "number", metavar="B", above=0.0
    )
    seconds: float = option(60.0, "cra: time for the search.", "number", metavar="S", above=0.0)
    nodes: int = option(2000, "cra: cases the refuting search may open.", "whole", metavar="N", least=1)
    combination: str = option("", "Combination of load cases that the model names.", metavar="NAME")
    factors: tuple[tuple[str, float], ...] = option(
        (), "Factor of a load case; self is the weight. Repeatable.", "factors", metavar="CASE=X", word="factor"
    )
    surcharge: float | None = option(
        None, "Surcharge on the soil of the model, instead of what it says.", "number", metavar="PA", least=0.0,
        unit="Pa",
    )  # fmt: skip
    soil_height: float | None = option(
        None, "z of the ground on the soil's side (m), instead of what the model says.", "number", metavar="Z"
    )
    tension: float | None = option(
        None, "rbe: what joints may pull where the model gives none [0, dry].", "number", metavar="PA", above=0.0,
        unit="Pa",
    )  # fmt: skip
    cohesion: float | None = option(
        None, "rbe: the same, given as mu times it.", "number", metavar="PA", above=0.0, unit="Pa"
    )
    settlement: tuple[tuple[str, tuple[float, ...]], ...] = option(
        (), "rbe: small settlement of a support (m, rad). Repeatable.", "settlements",
        metavar="BLOCK:DX,DY,DZ[,RX,RY,RZ]",
    )  # fmt: skip
    within: float | tuple[float, ...] | None = option(
        None, "rbe: does it hold for every drawing within L (m), normals within DEGREES?", "within",
        metavar="L[,DEGREES]",
    )  # fmt: skip
    effort: float = 1.0  # share of a coupled search's usual work on larger models, for who asks of many: no option

    def __post_init__(self) -> None:
        check_options(self)
        if self.solver not in RBE_SOLVERS:
            raise InputError.of(
                "solver",
                self.solver,
                f"expected one of {', '.join(RBE_SOLVERS)} (osqp comes with: pip install 'cyclopean[osqp]')",
            )
        if not all(weight > 0.0 for weight in self.weights):
            raise InputError.of("weights", self.weights, "expected two positive numbers N,T")
        if self.method == "cra" and (only := self.asks_for_rbe()):
            raise InputError(f"{only}: only rigid-block equilibrium has it; use `method` rbe")
        self._check_pull()
        self.forgiven()
        self.drawings()
        self.bounds()

    def _check_pull(self) -> None:
        beside = [name for name in ("tension", "cohesion", "within") if getattr(self, name) is not None]
        beside += [name for name in ("penalty", "settlement") if getattr(self, name)]
        if self.cone != "exact" and beside:
            raise InputError.of("cone", self.cone, f"pyramids are for dry joints as drawn; leave out `{beside[0]}`")
        if self.tension is not None and self.cohesion is not None:
            raise InputError("`tension` and `cohesion` say the same thing (C = mu PA); give one of them")
        if self.penalty and (self.tension is not None or self.cohesion is not None):
            raise InputError("`penalty` asks what tension dry joints would need; leave out `tension` and `cohesion`")
        for name, motion in self.settlement:
            if len(motion) != 6 or not all(map(math.isfinite, motion)):
                raise InputError.of("settlement", name, "expected six finite numbers, metres and radians")
        for case, factor in self.factors:
            if not math.isfinite(factor):
                raise InputError.of("factors", case, "expected a finite number")

    def without_effect(self) -> str:
        """A line on options that were given and that change nothing, or nothing."""
        given = [f"`{name}`" for name in COUPLED if getattr(self, name) != getattr(Settings(), name)]
        if given and self.chosen_method() == "rbe":
            return f"{', '.join(given)}: no effect, for only coupled analysis has it (`method` cra)"
        if "`eps`" in given and self.eta is None and self.beta_min is None:
            return "`eps`: no effect, for `eta` and `beta_min` follow it where they are not given"
        if self.weights != (1.0, 1.0) and self.cone != "exact":
            return "`weights`: no effect, for pyramids take any forces that balance"
        return ""

    def asks_for_rbe(self) -> str:
        """The first option given that only rigid-block equilibrium has; "" where there is none."""
        if self.weights != (1.0, 1.0):
            return f"`weights` {self.weights[0]:g},{self.weights[1]:g}"
        for name in ("tension", "cohesion"):
            if (value := getattr(self, name)) is not None:
                return f"`{name}` {value:g}"
        if self.settlement:
            return f"`settlement` {self.settlement[0][0]}"
        if self.within is not None:
            return (
                f"`within` {self.within:g}" if isinstance(self.within, float | int) else f"`within` {self.within[0]:g}"
            )
        return f"`solver` {self.solver}" if self.solver not in CRA_SOLVERS else ""

    def chosen_method(self) -> str:
        """The method said, or the default: coupled analysis unless an option asks for rigid-block equilibrium."""
        return self.method or ("rbe" if self.asks_for_rbe() else "cra")

    def drawings(self) -> tuple[float, float | None] | None:
        """Length (m) and degrees by which drawings may differ for which the answer is to hold; degrees may be unsaid.

        Raises
        ------
        InputError
            Not a positive length, or an angle that is not from 0 to below 90.
        """
        said = self.within
        if said is None:
            return None
        rows = tuple(said) if isinstance(said, tuple | list) else (said,)
        wanted = InputError.of(
            "within", said, "expected a positive length in metres, or L,DEGREES with DEGREES below 90"
        )
        if not 1 <= len(rows) <= 2 or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in rows):
            raise wanted
        length, degrees = float(rows[0]), float(rows[1]) if len(rows) == 2 else None
        if not 0.0 < length < math.inf or not (degrees is None or 0.0 <= degrees < 90.0):
            raise wanted
        return length, degrees

    def forgiven(self) -> "Forgiven | None":
        """What the drawing is forgiven, as far as it was said; None also where it is to be found.

        Raises
        ------
        InputError
            Not a positive length and angle, nor the word auto.
        """
        from cyclopean.assembly import Forgiven

        said = self.tolerance
        if said is None or said == AUTO:
            return None
        gap, degrees = said if isinstance(said, tuple | list) and len(said) == 2 else (said, ASKEW)
        try:
            found = Forgiven(float(gap), math.radians(float(degrees)))
        except (TypeError, ValueError):
            found = Forgiven(math.nan, math.nan)
        if isinstance(said, bool) or not (0.0 < found.gap < math.inf and 0.0 < found.angle < math.pi / 2.0):
            raise InputError.of("tolerance", said, "expected a positive gap in metres, GAP,DEGREES, or auto")
        return found

    def bounds(self) -> "Bounds":
        """Bounds of the virtual displacement.

        Raises
        ------
        InputError
            One of eps, eta, beta_min is not positive, or they contradict each other.
        """
        from cyclopean.analysis.coupled.states import Bounds

        eta = 10.0 * self.eps if self.eta is None else self.eta
        if eta < self.eps:
            raise InputError.of("eta", eta, f"must not be smaller than eps ({self.eps:g}), by which points overlap")
        return Bounds(self.eps, eta, 0.01 * self.eps if self.beta_min is None else self.beta_min)
