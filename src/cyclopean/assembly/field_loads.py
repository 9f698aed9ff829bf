"""Earth, water and fill on the faces that look at them, and the coefficients of earth pressure.

Earth on a back that leans by theta from the upright (above zero where it looks up), with the friction angle phi of the
earth, delta of wall and earth and a ground that rises by beta, presses by Coulomb's plane wedge (1776; as a product of
angles Mueller-Breslau 1906; with an earthquake turned by psi, Mononobe and Okabe, psi = atan(kh / (1 - kv))):

    active    K = cos2(phi - theta - psi) / [cos psi cos2 theta cos(delta + theta + psi) (1 + R)2]
              R2 = sin(phi + delta) sin(phi - beta - psi) / [cos(delta + theta + psi) cos(theta - beta)]
    passive   K = cos2(phi + theta - psi) / [cos psi cos2 theta cos(delta - theta + psi) (1 - R)2]
              R2 = sin(phi + delta) sin(phi + beta - psi) / [cos(delta - theta + psi) cos(theta - beta)]
    at rest   K = (1 - sin phi) (1 + sin beta)                       (Jaky 1944; with a slope as in EN 1997-1, 9.5.2)

At depth z the force on each square metre *of the upright* is K (1 - kv) (gamma z + q cos theta cos beta / cos(theta -
beta)), inclined by delta + theta below the level where active, by theta - delta where passive, level at rest: over a
height H that is K gamma H2 / 2. q is per square metre of the plan.

By hand: a level ground, an upright smooth back and 30 degrees give 1/3 active, 3 passive, 1/2 at rest.

>>> [round(earth_coefficient(state, 30.0), 4) for state in ("active", "passive", "rest")]
[0.3333, 3.0, 0.5]
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from cyclopean.assembly.loads import DEAD, check_case
from cyclopean.errors import InputError

__all__ = ["Earth", "EarthState", "FieldLoad", "Fill", "Uplift", "Water", "earth_coefficient"]

EarthState = Literal["active", "rest", "passive"]
Uplift = Literal["none", "linear", "full"]
WATER = 9806.65  # N/m3: 1000 kg/m3 under standard gravity
EARTHY = 3_000.0, 40_000.0  # N/m3, from foamed fill to heavy slag: a number beyond is of another unit
WATERY = 9_000.0, 13_000.0  # N/m3, up to a thin slurry
STEEP = 60.0  # degrees by which a back may lean either way: beyond it, it is a ground or a roof


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FieldLoad:
    """A pressure that grows with depth, on all blocks, on one or on a group.

    Other blocks hide nothing from earth and water, so that walls which face each other can be told apart.
    """

    block: int | None = None  # index into Assembly.blocks
    group: str | None = None
    case: str = DEAD
    unit_weight: float  # N/m3

    def __post_init__(self) -> None:
        check_case(self.case)
        if self.block is not None and self.group is not None:
            raise InputError('loads: earth, water and fill act on a "block" or a "group"; give one of them, or neither')
        low, high = WATERY if isinstance(self, Water) else EARTHY
        if not low <= self.unit_weight <= high:
            raise InputError(
                f"loads: unit_weight {self.unit_weight:g} N/m3 is outside {low:g} to {high:g}; 18 kN/m3 are 18000,"
                " 1000 kg/m3 are 9807"
            )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Earth(FieldLoad):
    """Earth that lies against faces on one side."""

    side: float  # azimuth (degrees from +x to +y) in which the earth lies, seen from the wall
    state: EarthState
    friction: float  # degrees, of the earth
    wall_friction: float = 0.0  # degrees, of wall and earth
    slope: float = 0.0  # degrees by which the ground rises away from the wall
    surcharge: float = 0.0  # Pa of the plan
    height: float | None = None  # m, world: of the ground at the wall; None = the top of what looks at it
    foot: float | None = None  # m, world: below it there is none; None = the lowest of what looks at it
    back: float | None = None  # degrees from the upright; None = as the faces lean on average
    seismic: tuple[float, float] = (0.0, 0.0)  # kh towards the wall, kv upwards

    def __post_init__(self) -> None:
        super(Earth, self).__post_init__()
        if self.state not in get_args(EarthState):
            raise InputError(f"loads: state '{self.state}' of soil is not one of {', '.join(get_args(EarthState))}")
        if not 0.0 < self.friction < STEEP:
            raise InputError(f"loads: friction {self.friction:g} of soil must be between 0 and {STEEP:g} degrees")
        most = self.friction / 3.0 if self.state == "passive" else self.friction
        if not 0.0 <= self.wall_friction <= most:
            why = " (a third of it: beyond, Coulomb's plane wedge makes too much of passive earth)"
            raise InputError(
                f"loads: wall_friction {self.wall_friction:g} of soil must be from 0 to {most:g} degrees"
                f"{why if self.state == 'passive' else ', the friction of the soil'}"
            )
        if not self.surcharge >= 0.0:
            raise InputError(f"loads: surcharge {self.surcharge:g} of soil is less than 0 Pa")
        if self.state == "rest" and any(self.seismic):
            raise InputError("loads: earth at rest has no seismic coefficient; make it active")
        self.coefficient(self.back or 0.0)

    def coefficient(self, theta: float) -> float:
        """K of a back that leans by `theta` degrees; errors as `earth_coefficient`."""
        return earth_coefficient(
            self.state, self.friction, self.wall_friction, back=theta, slope=self.slope, seismic=self.seismic
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Water(FieldLoad):
    """Water that stands against faces on one side, and in joints where `uplift` says so."""

    unit_weight: float = WATER
    side: float  # azimuth (degrees) in which the water lies
    head: float  # m, world: of its surface
    foot: float | None = None
    uplift: Uplift = "none"  # in joints: full, or falling in a line to nothing at the end of the joint that is away

    def __post_init__(self) -> None:
        super(Water, self).__post_init__()
        if self.uplift not in get_args(Uplift):
            raise InputError(f"loads: uplift '{self.uplift}' of water is not one of {', '.join(get_args(Uplift))}")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fill(FieldLoad):
    """Fill that lies on faces that look up: its weight, and a level pressure where `level` says so."""

    height: float  # m, world: of its surface, the road
    surcharge: float = 0.0  # Pa
    level: float = 0.0  # level pressure as a share of the upright one: 0 counts on no help of the haunches
    spread: float | Literal["boussinesq"] = 0.0  # degrees from the upright, of a load on the road

    def __post_init__(self) -> None:
        super(Fill, self).__post_init__()
        if not (self.surcharge >= 0.0 and self.level >= 0.0):
            raise InputError("loads: surcharge and level of fill must not be negative")
        if not (self.spread == "boussinesq" or (isinstance(self.spread, float) and 0.0 <= self.spread < STEEP)):
            raise InputError(
                f"loads: spread {self.spread} of fill is neither from 0 to {STEEP:g} degrees nor boussinesq"
            )


def earth_coefficient(
    state: EarthState,
    friction: float,
    wall_friction: float = 0.0,
    *,
    back: float = 0.0,
    slope: float = 0.0,
    seismic: tuple[float, float] = (0.0, 0.0),
) -> float:
    """Coefficient of earth pressure of the module's head; angles in degrees, the result is a number.

    Raises
    ------
    InputError
        No wedge is in equilibrium: the slope is steeper than the earth bears, or the back leans too far.
    """
    phi, delta, theta, beta = np.radians([friction, wall_friction, back, slope])
    kh, kv = seismic
    if not (kh >= 0.0 and kv < 1.0):
        raise InputError(f"loads: seismic {kh:g}, {kv:g} of soil: expected kh of at least 0 and kv below 1")
    psi = np.arctan2(kh, 1.0 - kv)
    if not (abs(slope) + np.degrees(psi) <= friction and abs(back) <= STEEP):
        raise InputError(
            f"loads: no wedge of soil rests with a slope of {slope:g} degrees (and {np.degrees(psi):.3g} of an"
            f" earthquake) under a friction angle of {friction:g}, on a back that leans by {back:.3g}"
        )
    if state == "rest":
        return float((1.0 - np.sin(phi)) * (1.0 + np.sin(beta)))
    way = 1.0 if state == "active" else -1.0
    lean = np.cos(delta + way * theta + psi)
    root = np.sqrt(np.sin(phi + delta) * np.sin(phi - way * beta - psi) / (lean * np.cos(theta - beta)))
    rest = np.cos(psi) * np.cos(theta) ** 2 * lean * (1.0 + way * root) ** 2
    if not (lean > 0.0 and rest > 0.0 and (way > 0.0 or root < 1.0)):
        raise InputError(f"loads: no passive wedge of soil has a friction angle of {friction:g} and these slopes")
    return float(np.cos(phi - way * theta - psi) ** 2 / rest)
