"""What a user may say about an analysis."""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.coupled.states import Bounds
from cyclopean.errors import InputError

__all__ = ["CRA_SOLVERS", "DENSITY", "GRAVITY", "METHODS", "MU", "RBE_SOLVERS", "Settings"]

MU = 0.84  # tan 40 degrees, as both reference systems
DENSITY = 2400.0  # kg/m3
GRAVITY = (0.0, 0.0, -9.80665)  # m/s2
METHODS = ("cra", "rbe")
RBE_SOLVERS = ("auto", "newton", "interior", "clarabel", "osqp")
CRA_SOLVERS = ("auto", "clarabel", "osqp")


@dataclass(frozen=True, slots=True)
class Settings:
    """What a user may say about an analysis; None (or "") = not said, a default is assumed and reported."""

    method: str = ""  # "cra", "rbe"; not said: cra, unless an option is given that only rbe has
    mu: float | None = None
    density: float | None = None  # kg/m3
    supports: str = ""  # "", "below=Z", "ids=a,b"
    gravity: tuple[float, float, float] | None = None  # m/s2
    tilt: tuple[float, float] | None = None  # degrees, azimuth in degrees
    tolerance: float | None = None  # m
    cone: str = "exact"
    solver: str = "auto"
    weights: tuple[float, float] = (1.0, 1.0)  # normal, tangential
    penalty: bool = False  # measure the tension that a state would need
    eps: float = 1.0  # scaled: overlap of points that press (coupled analysis)
    eta: float | None = None  # scaled: largest virtual displacement; 10 eps
    beta_min: float | None = None  # scaled: least sliding where there is friction; 0.01 eps
    seconds: float = 60.0  # budget of the search for a coupled state or its refutation
    nodes: int = 2000  # budget of the refuting search
    combination: str = ""  # of the model's; "" = all loads with factor 1
    factors: tuple[tuple[str, float], ...] = ()  # case and factor, instead of what the combination says
    tension: float | None = None  # Pa that joints may pull where the model gives none; rigid-block equilibrium only
    cohesion: float | None = None  # Pa; the same, given as mu times it
    settle: tuple[tuple[str, tuple[float, ...]], ...] = ()  # support and its six numbers (m, rad)

    def __post_init__(self) -> None:
        self._check_method()
        if self.mu is not None and not (0.0 <= self.mu < np.inf):
            raise InputError.of("mu", self.mu, "expected a number >= 0")
        if self.density is not None and not (0.0 < self.density < np.inf):
            raise InputError.of("density", self.density, "expected a positive number of kg/m3")
        if self.tolerance is not None and not (0.0 < self.tolerance < np.inf):
            raise InputError.of("tolerance", self.tolerance, "expected a positive length in metres")
        if not (0.0 < self.seconds < np.inf):
            raise InputError.of("seconds", self.seconds, "expected a positive number")
        if not (self.nodes >= 1):
            raise InputError.of("nodes", self.nodes, "expected a whole number >= 1")
        self._check_pull()
        for name, values in (("gravity", self.gravity), ("tilt", self.tilt)):
            if values is not None and not np.isfinite(values).all():
                raise InputError.of(name, None, "expected finite numbers")
        self.bounds()

    def _check_method(self) -> None:
        if self.method not in ("", *METHODS):
            raise InputError.of("method", self.method, f"expected one of {', '.join(METHODS)}")
        if self.solver not in RBE_SOLVERS:
            raise InputError(
                f"`solver` {self.solver}: expected one of {', '.join(RBE_SOLVERS)}"
                " (osqp comes with: pip install 'cyclopean[osqp]')"
            )
        if self.method == "cra" and (only := self.asks_for_rbe()):
            raise InputError(f"{only}: only rigid-block equilibrium has it; use `method` rbe")

    def _check_pull(self) -> None:
        for name in ("tension", "cohesion"):
            value = getattr(self, name)
            if value is not None and not (0.0 < value < np.inf):
                raise InputError.of(name, value, "expected a positive number of Pa")
        if self.tension is not None and self.cohesion is not None:
            raise InputError("`tension` and `cohesion` say the same thing (C = mu PA); give one of them")
        if self.penalty and (self.tension is not None or self.cohesion is not None):
            raise InputError("`penalty` asks what tension dry joints would need; leave out `tension` and `cohesion`")
        for name, motion in self.settle:
            if len(motion) != 6 or not np.isfinite(motion).all():
                raise InputError.of("settle", name, "expected six finite numbers, metres and radians")
        for case, factor in self.factors:
            if not np.isfinite(factor):
                raise InputError.of("factor", case, "expected a finite number")

    def asks_for_rbe(self) -> str:
        """The first option given that only rigid-block equilibrium has; "" where there is none."""
        if self.cone != "exact":
            return f"`cone` {self.cone}"
        if self.weights != (1.0, 1.0):
            return f"`weights` {self.weights[0]:g},{self.weights[1]:g}"
        for name in ("tension", "cohesion"):
            if (value := getattr(self, name)) is not None:
                return f"`{name}` {value:g}"
        if self.settle:
            return f"`settle` {self.settle[0][0]}"
        return f"`solver` {self.solver}" if self.solver not in CRA_SOLVERS else ""

    def chosen_method(self) -> str:
        """The method said, or the default: coupled analysis unless an option asks for rigid-block equilibrium."""
        return self.method or ("rbe" if self.asks_for_rbe() else "cra")

    def bounds(self) -> Bounds:
        """Bounds of the virtual displacement.

        Raises
        ------
        InputError
            One of eps, eta, beta_min is not positive, or they contradict each other.
        """
        eta = 10.0 * self.eps if self.eta is None else self.eta
        return Bounds(self.eps, eta, 0.01 * self.eps if self.beta_min is None else self.beta_min)
