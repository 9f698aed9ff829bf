"""Answers that stand in books, pinned.

Every limit is found by bisection on the solver's word; just beside it, on both sides, the verdict is then proved by a
certificate. Tolerances: a limit from statics by hand is met to 1e-6, well above the 1e-9 that a certificate allows and
well below anything one could build. Arch limits are quoted to five digits for arcs, while ours have facets: 32 chords a
voussoir put its centroid within 1e-5 of the arc's.
"""

from collections.abc import Callable

import numpy as np
import pytest

from cyclopean.analysis import Settings, check, solve_rbe
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.design import arch, stack
from laws import quick
from near_limit import G, posed

MOST = 40 if quick() else 80  # voussoirs
UPRIGHT = np.array([0.0, 0.0, -G])


def stands(model: Assembly, mu: float, gravity: np.ndarray = UPRIGHT) -> bool:
    word = solve_rbe(posed(model, mu, gravity)).word
    assert word in ("balanced", "collapse")
    return word == "balanced"


def bisected(holds: Callable[[float], bool], low: float, high: float, within: float) -> float:
    """The value between `low` (falls) and `high` (stands) where the verdict turns."""
    assert holds(high)
    assert not holds(low)
    while high - low > within:
        middle = (low + high) / 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return (low + high) / 2


def proved(model: Assembly, mu: float, gravity: np.ndarray = UPRIGHT) -> str:
    return check(
        model, Settings(method="rbe", mu=mu, gravity=(float(gravity[0]), float(gravity[1]), float(gravity[2])))
    ).verdict


def tilted(degrees: float) -> np.ndarray:
    angle = np.deg2rad(degrees)
    return G * np.array([np.sin(angle), 0.0, -np.cos(angle)])


def upto(cases: list[tuple[int, float]]) -> list[tuple[int, float]]:
    """Those of so few voussoirs."""
    return [case for case in cases if case[0] <= MOST]


@pytest.mark.parametrize("degrees", [10.0, 20.0, 30.0, 40.0])
def test_a_cube_on_a_slope_needs_the_tangent(degrees: float) -> None:
    limit = np.tan(np.deg2rad(degrees))
    assert proved(stack(1), limit * (1 + 1e-6), tilted(degrees)) == "stable"
    assert proved(stack(1), limit * (1 - 1e-6), tilted(degrees)) == "unstable"


def test_a_cube_on_a_slope_tips_at_45_degrees() -> None:
    assert proved(stack(1), 2.0, tilted(45 - 1e-4)) == "stable"
    assert proved(stack(1), 2.0, tilted(45 + 1e-4)) == "unstable"


def test_two_cubes_on_a_slope_tip_at_half() -> None:
    limit = np.rad2deg(np.arctan(0.5))
    assert limit == pytest.approx(26.565, abs=1e-3)
    assert proved(stack(2), 0.84, tilted(limit - 1e-4)) == "stable"
    assert proved(stack(2), 0.84, tilted(limit + 1e-4)) == "unstable"


@pytest.mark.parametrize(
    ("offset", "verdict"),
    [(0.49, "stable"), (0.4999, "stable"), (0.50, "stable"), (0.5001, "unstable"), (0.51, "unstable")],
)
def test_overhang(offset: float, verdict: str) -> None:
    """At exactly one half the edge carries the whole weight: a state exists, and 0.5 is exact in binary."""
    assert proved(stack(2, offset=[0.0, offset]), 0.84) == verdict


@pytest.mark.parametrize("count", [2, 4, 8])
def test_harmonic_stack(count: int) -> None:
    """From the top down block k may stand out by 1/(2k) over the one below: half the harmonic number in all."""
    reach = [1 / (2 * k) for k in range(1, count + 1)]
    assert sum(reach) == pytest.approx(0.5 * sum(1 / k for k in range(1, count + 1)))
    offsets = [0.0, *reach[::-1]]  # the lowest block is flush, the next ones stand out more and more
    assert proved(stack(count + 1, size=(1, 1, 0.25), offset=[s * 0.9999 for s in offsets]), 0.84) == "stable"
    assert proved(stack(count + 1, size=(1, 1, 0.25), offset=[s * 1.0001 for s in offsets]), 0.84) == "unstable"


@pytest.mark.parametrize(("voussoirs", "limit"), upto([(20, 0.10746), (21, 0.10679), (40, 0.10746), (80, 0.10746)]))
def test_least_thickness_of_a_semicircular_arch(voussoirs: int, limit: float) -> None:
    """t/R by Milankovitch's rule for finite voussoirs (Cocchetti and Rizzi 2020; linear programmes)."""

    def model(thickness: float) -> Assembly:
        return arch(voussoirs, radius=1.0, thickness=thickness, facets=32)

    found = bisected(lambda t: stands(model(t), 0.84), 0.100, 0.115, 2e-6)
    assert found == pytest.approx(limit, abs=1.5e-5)  # five digits quoted, 32 chords a voussoir
    assert proved(model(found * 1.0005), 0.84) == "stable"
    assert proved(model(found * 0.9995), 0.84) == "unstable"


@pytest.mark.parametrize(("voussoirs", "limit"), upto([(20, 0.3090), (40, 0.3090), (80, 0.3094)]))
def test_no_semicircular_arch_stands_on_less_friction(voussoirs: int, limit: float) -> None:
    """Below this mu a semicircle slides however thick it is: the lowest mu over thickness (0.3092 for the arc)."""

    def least(thickness: float) -> float:
        model = arch(voussoirs, radius=1.0, thickness=thickness, facets=16)
        return bisected(lambda mu: stands(model, mu), 0.25, 0.45, 2e-5)

    found = min(least(t) for t in (0.16, 0.18, 0.20, 0.22, 0.24))
    assert found == pytest.approx(limit, abs=3e-4)  # four digits quoted; thickness sampled


def test_friction_that_a_thin_arch_needs() -> None:
    """At the least thickness the arch hinges for mu >= 0.3958 and slides too below (Cocchetti and Rizzi 2020)."""
    model = arch(80, radius=1.0, thickness=0.10746 * 1.0005, facets=32)
    found = bisected(lambda mu: stands(model, mu), 0.30, 0.60, 1e-4)
    assert found == pytest.approx(0.3958, abs=4e-3)  # the limit is approached as the root of the spare thickness


def lune(count: int, thickness: float, opening: float = np.deg2rad(1.0)) -> Assembly:
    """Half a lune of a dome of mean radius 1: `count` voussoirs from a fixed springing to a frictionless crown.

    By symmetry two half lunes meet at the crown in a horizontal thrust; a fixed, frictionless, upright plane there is
    the other half.
    """
    angles = np.linspace(0.0, np.deg2rad(89.9), count + 1)

    def ring(angle: float) -> np.ndarray:
        radii = np.array([1 - thickness / 2, 1 + thickness / 2])
        x, z = radii * np.cos(angle), radii * np.sin(angle)
        side = x * np.tan(opening / 2)
        return np.array([[x[0], -side[0], z[0]], [x[1], -side[1], z[1]], [x[1], side[1], z[1]], [x[0], side[0], z[0]]])

    faces = ((0, 1, 2, 3), (7, 6, 5, 4), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
    rings = [ring(a) for a in angles]

    def solid(name: str, low: np.ndarray, high: np.ndarray, fixed: bool) -> Block:
        turned = tuple(face[::-1] for face in faces)
        return Block(name, np.concatenate([low, high]), turned, fixed=fixed)

    ground, crown = rings[0] - [0, 0, 0.2], rings[-1] + [-0.2, 0, 0]
    blocks = [
        solid("springer", ground, rings[0], True),
        *(solid(f"v{k}", rings[k], rings[k + 1], False) for k in range(count)),
        solid("crown", rings[-1], crown, True),
    ]
    pairs = [(k, k + 1) for k in range(count + 1)]
    mu = [None] * count + [0.0]
    return Assembly(tuple(blocks), Contacts.of(pairs, rings, mu))


def test_least_thickness_of_a_dome() -> None:
    """t/R about 0.0428 for a hemisphere cut into lunes (linear programme, n = 320)."""
    found = bisected(lambda t: stands(lune(160, t), 0.84), 0.035, 0.055, 1e-5)
    assert found == pytest.approx(0.0428, abs=2e-4)
    assert proved(lune(160, found * 1.002), 0.84) == "stable"
    assert proved(lune(160, found * 0.998), 0.84) == "unstable"


@pytest.mark.parametrize("thickness", [0.5, 0.6, 0.8, 1.2])
@pytest.mark.parametrize("voussoirs", [20, 30, 40])
def test_the_twelve_arches_that_a_local_solver_half_rejects(voussoirs: int, thickness: float) -> None:
    """Inner radius 5, both end voussoirs held, mu 0.84: all twelve stand."""
    assert proved(arch(voussoirs, thickness=thickness, springers="fixed"), 0.84) == "stable"


def test_the_h_frame_has_a_state_of_equilibrium() -> None:
    """A beam squeezed between two held columns: forces that balance exist, though nothing can produce them."""
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

    def box(name: str, low: tuple[float, ...], high: tuple[float, ...], fixed: bool) -> Block:
        (x, y, z), (X, Y, Z) = low, high
        corners = [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z), (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)]
        return Block(name, np.array(corners), faces, fixed=fixed)

    frame = (
        box("left", (0, 0, 0), (0.4, 0.4, 1.2), True),
        box("right", (1.0, 0, 0), (1.4, 0.4, 1.2), True),
        box("beam", (0.4, 0, 0.6), (1.0, 0.4, 0.9), False),
    )
    assert check(Assembly(frame), Settings(method="rbe", mu=0.84)).verdict == "stable"
    assert check(Assembly(frame), Settings(method="rbe", mu=0.0)).verdict == "unstable"
