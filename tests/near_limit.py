"""Random assemblies, many of them within 2 % of the tilt at which they fall."""

import functools
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cyclopean.assembly import Assembly, Block, supports
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.solvers import ConicProgram, solve
from cyclopean.statics import EquilibriumSystem, equilibrium_system

G = 9.80665


@dataclass(frozen=True)
class Case:
    """A model, its friction, and a gravity vector at `share` times the sideways pull that topples it."""

    assembly: Assembly
    mu: float
    gravity: tuple[float, float, float]
    share: float  # 1 = the limit; nan where even upright it falls


def random_assembly(rng: np.random.Generator) -> Assembly:
    """One of five families with random proportions."""
    kind = rng.integers(5)
    if kind == 0:
        size = rng.uniform(0.5, 1.5, 3)
        count = int(rng.integers(1, 7))
        return stack(count, size=tuple(size), offset=float(rng.uniform(-0.3, 0.3) * size[0] / count))
    if kind == 1:
        columns, courses = (int(n) for n in rng.integers(2, 5, 2))
        return wall(columns, courses, length=float(rng.uniform(0.3, 0.6)), depth=float(rng.uniform(0.15, 0.4)))
    if kind == 2:
        return arch(int(rng.integers(3, 12)), radius=1.0, thickness=float(rng.uniform(0.1, 0.35)))
    if kind == 3:
        return vault(int(rng.integers(5, 10)), int(rng.integers(1, 4)), thickness=float(rng.uniform(0.15, 0.4)))
    return dome(int(rng.integers(2, 5)), int(rng.integers(6, 10)), thickness=float(rng.uniform(0.08, 0.3)))


def posed(assembly: Assembly, mu: float, gravity: np.ndarray) -> EquilibriumSystem:
    """The equilibrium system with one friction coefficient everywhere."""
    assert assembly.contacts is not None
    fixed, _ = supports(assembly)
    return equilibrium_system(assembly, assembly.contacts.with_mu(mu), fixed, gravity, 2400.0)


def limit_multiplier(base: EquilibriumSystem, push: np.ndarray) -> float:
    """Largest t with a state for p + t push, by one conic programme; nan where there is none at t = 0 already."""
    q, m = base.points, len(base.p)
    stretch = np.ones((q, 3))
    stretch[:, 0] = base.mu
    A = sp.bmat([[base.A, push[:, None]], [None, -sp.identity(1)], [sp.diags(-stretch.ravel()), None]], format="csc")
    program = ConicProgram(
        sp.csc_matrix((3 * q + 1, 3 * q + 1)),
        np.append(np.zeros(3 * q), -1.0),
        A,
        np.concatenate([-base.p, np.zeros(1 + 3 * q)]),
        (("zero", m, 1), ("nonnegative", 1, 1), ("second-order", 3, q)),
    )
    answer = solve(program, tol_gap_abs=1e-9, tol_gap_rel=1e-9, tol_feas=1e-9)
    return float(answer.x[-1]) if answer.word == "solved" else np.nan


@functools.cache  # both tests read all of them
def random_case(seed: int) -> Case:
    """Case number `seed`: half of them close to their limit, evenly on both sides, the others anywhere."""
    rng = np.random.default_rng(seed)
    assembly, mu = random_assembly(rng), float(rng.uniform(0.3, 1.0))
    heading = rng.uniform(0, 2 * np.pi)
    sideways = np.array([np.cos(heading), np.sin(heading), 0.0])
    upright = posed(assembly, mu, np.array([0.0, 0.0, -G]))
    pushed = posed(assembly, mu, G * sideways - np.array([0.0, 0.0, G]))
    push = pushed.p * (pushed.force_unit / upright.force_unit) - upright.p
    limit = limit_multiplier(upright, push)
    near = bool(rng.random() < 0.5)
    beside = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-4, np.log10(0.02)))
    share = 1.0 + beside if near else float(rng.uniform(0, 2))
    if not np.isfinite(limit):
        return Case(assembly, mu, (0.0, 0.0, -G), np.nan)
    pull = share * limit * G
    return Case(assembly, mu, (float(pull * sideways[0]), float(pull * sideways[1]), -G), share)


def plain(assembly: Assembly) -> Assembly:
    """The same blocks without the contacts the template knows: they are to be detected."""
    return Assembly(tuple(Block(b.id, b.vertices, b.faces, fixed=b.fixed) for b in assembly.blocks))
