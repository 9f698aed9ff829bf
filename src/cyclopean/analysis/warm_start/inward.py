"""From nearly a coupled state to one, without leaving the inequalities on the way.

On given sets (points that press, and those of them that rub) a state solves

    A f = -p        dn = -1 where shut        (fu dv - fv du) / (|f_t| |dd_t|) = 0 where rubbing

far fewer equations than unknowns. Of all steps that solve them, linearised, `polish` takes the shortest; where many
stones lie on each other that breaks the inequalities at dozens of points. Here a step is measured by what it takes of
the slack s of each inequality, sum (ds / s)^2, as affine scaling does [Dikin]_, and while the equations are far from
solved a barrier, -c sum log s, draws it to the middle. No step takes more than 0.9 of any slack. The slacks:

    fn    e.f_t    mu fn - |f_t|        -e.dd_t - beta where rubbing, e = f_t / |f_t|
    dn + 1, eta - dn where open         eta - |dd_t|

With W = (sum a a' / s^2)^-1 over the rows a of a point's force slacks and M the same sum over those of its motion, the
equations are eliminated point by point, see `coupled.kkt`: 12 unknowns a block.
A force that shrinks tenfold from step to step is meant to vanish; it is let go.

All of it happens in a region. Forces between that and the rest of the blocks do not change, W = 0, but what they ask
of the motion holds there as everywhere.

References
----------
.. [Dikin] Dikin: Iterative solution of problems of linear and quadratic programming. Soviet Math. Doklady 8 (1967).
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.coupled.block_newton import Sets
from cyclopean.analysis.coupled.kkt import Doubled, Eliminated, PointRows
from cyclopean.analysis.coupled.states import Bounds, Residuals, measure
from cyclopean.analysis.warm_start.region import Region
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem

__all__ = ["inward"]

STEPS = 10  # three to five are usual; beyond that it jams
PRESSED = 1e-9  # mean block weights: below that a point carries nothing
TRACE = 1e-2  # of mu fn: friction that a point which slides is given to begin with
SHARE = 0.9  # of a slack that one step may take
NEAR = 1e-2  # residual of the equations from which nothing but them counts
CALM = 0.3  # weight of log |f_t|: friction is free to be small
FLOOR = 1e-9, 1e-3, 1e-2  # slacks count as at least this: forces; of mu fn and of eps; of eps, towards eta
LOST = 1e-5, 1e-4  # mean block weights: pressure and friction below which a force that halves is let go
JAMMED = 0.15  # length of a step, three times in a row, that leads nowhere
SLACK = 1e-11  # of dependent rows


@dataclass(frozen=True, slots=True, eq=False)
class _Wall:
    """Inequalities of one kind: row . (force or displacement of the point) + a constant >= 0."""

    point: Ints  # (k,)
    row: Floats  # (k, 3)
    slack: Floats  # (k,)
    floor: Floats  # (k,)
    weight: float = 1.0  # of its barrier

    def added(self, metric: Floats, pull: Floats, c: float) -> None:
        """Add sum a a' / s^2 and c sum a / s to (q, 3, 3) and (q, 3), in place."""
        s = np.maximum(self.slack, self.floor)
        scaled = self.row / s[:, None]
        metric[self.point] += scaled[:, :, None] * scaled[:, None, :]
        pull[self.point] += c * self.weight * scaled

    def reach(self, step: Floats) -> float:
        """The longest share of a (q, 3) step that leaves enough slack; one that has none already may lose a floor."""
        rate = -np.einsum("kj,kj->k", self.row, step[self.point])
        room = np.where(self.slack > self.floor, SHARE * self.slack, np.maximum(self.slack, 0.0) + 0.5 * self.floor)
        return float(np.min(room[rate > 0.0] / rate[rate > 0.0], initial=1.0))


def inward(
    system: EquilibriumSystem, at: Region, doubled: Doubled, bounds: Bounds, f: Floats, dq: Floats
) -> tuple[Floats, Floats, Residuals]:
    """Look for a state near (f, dq) that differs from it in a region only.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points, of all blocks.
    at : Region
        Where it may differ. Forces between it and the rest stay as they are.
    doubled : Doubled
        Of the region's part: twelve unknowns a block.
    bounds : Bounds
        With eps = 1.
    f, dq : (q, 3), (6 m,)
        Start; which points press is taken from it.

    Returns
    -------
    f, dq, residuals
        The last pair met; `residuals.accepted` says whether it is a state.
    """
    part, given, motion = at.part, at.given(system, dq), dq[at.dof]
    force, sets = _begun(part, bounds, at.rim, f[at.point], given + part.gap(motion))
    f, dq, c, jammed = f.copy(), dq.copy(), 1.0, 0
    found = measure(system, bounds, f, dq)
    for _ in range(STEPS):
        d = given + part.gap(motion)
        walls = _walls(part, bounds, sets, force, d)
        try:
            worst, df, step = _step(part, doubled, sets, _metrics(sets, at.rim, walls, c), force, d)
        except (SolverError, np.linalg.LinAlgError):
            break
        dd = part.gap(step)
        length = min([1.0, *(wall.reach(df) for wall in walls[0]), *(wall.reach(dd) for wall in walls[1])])
        before, force, motion = force, force + length * df, motion + length * step
        if length < 1.0 or worst < NEAR:
            force, sets = _let_go(sets, before, force)
        f[at.point], dq[at.dof] = force, motion
        found = measure(system, bounds, f, dq)
        jammed = jammed + 1 if length < JAMMED else 0
        if found.accepted or jammed > 2 or not (length > JAMMED**2):
            break
        if length == 1.0:
            c = 0.0 if worst < NEAR else 0.1 * c
    return f, dq, found


def _begun(system: EquilibriumSystem, bounds: Bounds, rim: Bools, f: Floats, d: Floats) -> tuple[Floats, Sets]:
    """The sets, and a trace of friction wherever a point that presses slides far enough to have some."""
    tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
    pressed = f[:, 0] > PRESSED
    could = (slide > 2.0 * bounds.beta) & ~rim
    rubbing = pressed & (system.mu > 0.0) & ((tangent > 10.0 * PRESSED) | could)
    little = rubbing & (tangent < TRACE * system.mu * f[:, 0]) & ~rim
    trace = -(TRACE * system.mu * f[:, 0] / np.maximum(slide, 1e-12))[:, None] * d[:, 1:]
    begun = np.where(pressed[:, None], f, 0.0)
    begun[:, 1:] = np.where(little[:, None], trace, np.where(rubbing[:, None], begun[:, 1:], 0.0))
    return begun, Sets.of(pressed, rubbing)


def _let_go(sets: Sets, before: Floats, f: Floats) -> tuple[Floats, Sets]:
    """Make forces that vanish vanish."""
    was, now = np.hypot(before[:, 1], before[:, 2]), np.hypot(f[:, 1], f[:, 2])
    lost = sets.pressed & (f[:, 0] < LOST[0]) & (f[:, 0] < 0.5 * before[:, 0])
    idle = sets.rubbing & (now < LOST[1]) & (now < 0.5 * was)
    if not (lost.any() or idle.any()):
        return f, sets
    left = Sets.of(sets.pressed & ~lost, sets.rubbing & ~lost & ~idle)
    return left.without(f), left


def _walls(
    system: EquilibriumSystem, bounds: Bounds, sets: Sets, f: Floats, d: Floats
) -> tuple[list[_Wall], list[_Wall]]:
    """Inequalities of forces and of displacements."""
    E, T, free = (np.flatnonzero(s) for s in (sets.pressed, sets.rubbing, ~sets.pressed))
    tangent, slide = np.hypot(f[T, 1], f[T, 2]), np.hypot(d[:, 1], d[:, 2])
    e, mu = f[T, 1:] / np.maximum(tangent, 1e-300)[:, None], system.mu[T]
    least = np.full(len(f), FLOOR[0])
    normal = np.tile([1.0, 0.0, 0.0], (len(free), 1))
    forces = [
        _Wall(E, np.tile([1.0, 0.0, 0.0], (len(E), 1)), f[E, 0], least[E]),
        _Wall(T, _rows(0.0, e), tangent, least[T], CALM),
        _Wall(T, _rows(mu, -e), mu * f[T, 0] - tangent, np.maximum(FLOOR[1] * mu * f[T, 0], FLOOR[0])),
    ]
    out = d[:, 1:] / np.maximum(slide, 1e-12)[:, None]
    narrow, wide = np.full(len(f), FLOOR[1]), np.full(len(f), FLOOR[2])
    motions = [
        _Wall(free, normal, d[free, 0] + 1.0, narrow[free]),
        _Wall(free, -normal, bounds.eta - d[free, 0], wide[free]),
        _Wall(T, _rows(0.0, -e), -np.sum(e * d[T, 1:], 1) - bounds.beta, narrow[T]),
        _Wall(np.arange(len(f)), _rows(0.0, -out), bounds.eta - slide, wide),
    ]
    return forces, motions


def _rows(normal: Floats | float, tangential: Floats) -> Floats:
    return np.concatenate([np.broadcast_to(normal, len(tangential))[:, None], tangential], 1)


def _step(
    system: EquilibriumSystem,
    doubled: Doubled,
    sets: Sets,
    metrics: tuple[Floats, Floats, Floats, Floats],
    f: Floats,
    d: Floats,
) -> tuple[float, Floats, Floats]:
    """The largest residual of the equations, and the step (df, dq) that solves them at the least cost."""
    W, slope, M, bend = metrics
    off, rows = system.residual(f), PointRows.empty(len(f), 2)
    rows.shut(sets.pressed, d)
    rows.sine(sets.rubbing, f, d)
    worst = max(float(np.max(np.abs(off), initial=0.0)), float(np.max(np.abs(rows.r), initial=0.0)))
    step = Eliminated(doubled, system, (W, M), rows, rows.slack(SLACK)).step(off, rows.r, slope, bend)
    return worst, step.df, step.dq


def _metrics(
    sets: Sets, rim: Bools, walls: tuple[list[_Wall], list[_Wall]], c: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """W and the barrier's slope on forces; M and its slope on displacements. At the rim no force moves."""
    q = len(sets.pressed)
    H, pull, M, motion_pull = np.zeros((q, 3, 3)), np.zeros((q, 3)), np.zeros((q, 3, 3)), np.zeros((q, 3))
    for wall in walls[0]:
        wall.added(H, pull, c)
    for wall in walls[1]:
        wall.added(M, motion_pull, c)
    k = np.flatnonzero(sets.rubbing)
    size = np.maximum(walls[0][1].slack, walls[0][1].floor)
    H[k, 1, 1] += size**-2.0  # friction turns no more easily than it grows
    H[k, 2, 2] += size**-2.0
    active = np.stack([sets.pressed, sets.rubbing, sets.rubbing], 1) & ~rim[:, None]
    i = np.arange(3)
    H[:, i, i] = np.where(active, H[:, i, i], 1.0)
    scale = 1.0 / np.sqrt(H[:, i, i])
    both = scale[:, :, None] * scale[:, None, :]
    W = np.asarray(np.linalg.inv(H * both), float) * both * (active[:, :, None] & active[:, None, :])
    return W, -pull, M, -motion_pull
