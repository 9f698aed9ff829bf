"""From near a coupled state into the middle of its family, and along a path to the state itself.

The exact answer of a convex programme sits on the edge of everything: points lose their last bit of force, friction is
at its bound. Few of its active sets are those of a state, and finding the others is combinatorial. But every point that
rubs has its own alpha, so that states come in families of thousands of dimensions, and most have an interior. With
g = dn + 1, t = |f_t| and s = |dd_t|, the path solves

    A f = -p        fn g = nu        f_t x dd_t = 0 where a point rubs

by Gauss-Newton while nu goes to zero. Of all steps that solve the linearised equations it takes the shortest, and most
central, in the metric H and the slope b of the barrier

    - sum ln fn + ln (mu fn - t) + ln t + ln (s - beta) + ln (eta - s) + ln (eta - dn)        min b.x + 1/2 x'Hx

where fn and s also pay a little, so that nothing grows without need. So nobody has to know which points press, which
are let go and which would be at their bound: fn and g stay positive, and one of the two vanishes. Points that press
without sliding keep a trace of friction that vanishes with nu, and those that are let go lose theirs on the way. Below
nu = 1e-4 the products of points that plainly press would be stiffer than rounding allows: g = 0 replaces them one by
one, and points that are plainly let go lose their force, so that nu may go to rounding at the rest. What is told apart
then is for a polish (`block_newton`).

Forces and multipliers are eliminated point by point, see `kkt`. The slack is a small share of C W C' itself, which goes
with g^2, but no less than `LEAST` where fn > g; what it leaves behind is taken up by solving again for what is still
off, with the multipliers known so far.

By hand: with fn = 1 and g = 0.1 kept from moving, a step to nu = 0.03 takes g to 0.03.
"""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from cyclopean.analysis.coupled.block_newton import Sets
from cyclopean.analysis.coupled.kkt import Doubled, Eliminated, PointRows, Step
from cyclopean.analysis.coupled.states import Bounds, Residuals, measure
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem

__all__ = ["PathAnswer", "follow_path"]

STEPS = 160  # along one path at most, a factorisation each
DULL = 24  # steps in which nu halves at least
CUT = ((0.5, 0.3), (0.2, 0.6), (0.0, 0.9))  # of nu after a step longer than ...
LEVEL = ((1e-2, 1e-3), (1e-3, 1e-2), (0.0, 0.1))  # least nu in terms of the largest, where that is above ...
ROOM = 0.9  # share of the way to any bound that a step may go
SHORTER = 0.8  # ... and how it is cut
SHORTEST = 1e-4  # step at which a path has ended
STALLED = 3  # short steps in a row that are allowed
IDLE = 0.02  # what counts as one
OPEN = 1e-2  # fn / g below which a point is let go, at the start
GONE = 1e-3  # ... and on the way, where fn is below this as well
AGAINST = -0.5  # cosine between friction and sliding that a step may not exceed
PLAIN = 2e-10  # nu from which the pair is measured
CLEAR = 1e-4  # nu from which sets are plain enough to try
PLAINLY, TRIFLE = 1e6, 1e-8  # fn / g, or its inverse, from which this is so; force that may be dropped there
SLACK = 1e-14  # of directions, and where g = 0
RELATIVE = 1e-2  # slack in terms of C W C' on the path
LEAST = 1e-14  # slack on the path where fn > g: below that, rows are stiffer than rounding allows
SHIFT = 1e-11  # of A P A', relative to its diagonal
TINY = 1e-300  # divides zero by itself without a fault


@dataclass(frozen=True, slots=True, eq=False)
class PathAnswer:
    """Where a path ended."""

    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    residuals: Residuals
    product: float  # largest fn g on the path
    steps: int
    sets: Sets  # of a polish: whoever has more force than gap presses


def follow_path(
    system: EquilibriumSystem, doubled: Doubled, bounds: Bounds, f: Floats, dq: Floats, deadline: float = np.inf
) -> PathAnswer:
    """Look for a coupled state from an interior start.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, m free blocks and q points; friction everywhere.
    doubled : Doubled
        Of the same system.
    bounds : Bounds
        With eps = 1.
    f, dq : (q, 3), (6 m,)
        Start: fn > 0 and dn > -1 at every point, nearly in balance; an interior point's answer to programme A before
        it is exact.
    deadline : float
        By `time.perf_counter`.

    Returns
    -------
    PathAnswer
        A state only if its residuals say so.
    """
    path = _Path(system, doubled, bounds)
    kinds = _told_apart(system, bounds, f, dq)
    f = f.copy()
    f[~(kinds.rubs | kinds.soft), 1:] = 0.0
    if not (f[:, 0].min(initial=1.0) > 0.0 and path.at(f, dq, kinds).room(bounds)):
        none = np.zeros(len(f), bool)
        return PathAnswer(f, dq, measure(system, bounds, f, dq), np.inf, 0, Sets.of(none, none))
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # ends at the factorisation's gate
        at, kinds, steps = path.followed(f, dq, kinds, deadline)
    product = float(np.max((at.f[:, 0] * at.gap)[kinds.pairs], initial=0.0))
    pressed = kinds.shut | (kinds.pairs & (at.f[:, 0] > at.gap))
    f = _without(at.f, kinds)
    return PathAnswer(
        f, at.dq, measure(system, bounds, f, at.dq), product, steps, Sets.of(pressed, pressed & kinds.rubs)
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Kinds:
    """What each point does."""

    rubs: Bools  # friction against sliding
    soft: Bools  # friction that vanishes with nu
    free: Bools  # no force at all
    shut: Bools  # g = 0

    @property
    def pairs(self) -> Bools:
        """Where fn g follows nu."""
        return ~(self.free | self.shut)


@dataclass(frozen=True, slots=True, eq=False)
class _At:
    """An iterate, and all that the barrier looks at."""

    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    d: Floats  # (q, 3)
    gap: Floats  # g
    tangent: Floats  # t
    slide: Floats  # s
    e: Floats  # (q, 2) direction of friction
    out: Floats  # (q, 2) direction of sliding
    cone: Floats  # mu fn - t
    spare: Floats  # s - beta
    sine: Floats  # between friction and sliding, where a point rubs

    def room(self, bounds: Bounds) -> bool:
        """Whether a path may start here."""
        high = max(float(self.slide.max(initial=0.0)), float(self.d[:, 0].max(initial=0.0)))
        return bool(self.gap.min(initial=1.0) > 0.0 and high < bounds.eta)


@dataclass(frozen=True, slots=True, eq=False)
class _Barrier:
    """Metric and slope, of forces and of motion."""

    H: Floats  # (q, 3, 3)
    W: Floats  # its inverse, zero where there is no force
    b: Floats  # (q, 3)
    Q: Floats  # (q, 3, 3)
    bd: Floats  # (q, 3)


def _told_apart(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> _Kinds:
    """Which points rub, which press without friction, and which are let go."""
    d = system.gap(dq)
    tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
    along = f[:, 1] * d[:, 1] + f[:, 2] * d[:, 2]
    presses = f[:, 0] >= OPEN * (d[:, 0] + 1.0)
    rubs = presses & (slide > 1.2 * bounds.beta) & (along < AGAINST * tangent * slide)
    rubs &= (tangent > 1e-6) & (tangent < system.mu * f[:, 0])
    none = np.zeros(len(f), bool)
    return _Kinds(rubs, ~rubs, none, none)


class _Path:
    def __init__(self, system: EquilibriumSystem, doubled: Doubled, bounds: Bounds) -> None:
        self.system, self.doubled, self.bounds = system, doubled, bounds

    def at(self, f: Floats, dq: Floats, kinds: _Kinds) -> _At:
        """What there is to know at (f, dq)."""
        d = self.system.gap(dq)
        tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
        e = f[:, 1:] / np.maximum(tangent, TINY)[:, None]
        out = d[:, 1:] / np.maximum(slide, TINY)[:, None]
        sine = np.where(kinds.rubs, e[:, 0] * out[:, 1] - e[:, 1] * out[:, 0], 0.0)
        cone, spare = self.system.mu * f[:, 0] - tangent, slide - self.bounds.beta
        return _At(f, dq, d, d[:, 0] + 1.0, tangent, slide, e, out, cone, spare, sine)

    def followed(self, f: Floats, dq: Floats, kinds: _Kinds, deadline: float) -> tuple[_At, _Kinds, int]:
        """Along the path as far as it goes."""
        at = self.at(f, dq, kinds)
        usual = _usual(at)
        length, short, step, trail = 1.0, 0, 0, list[float]()
        for step in range(STEPS):
            product = np.where(kinds.pairs, at.f[:, 0] * at.gap, 0.0)
            trail.append(float(product.max(initial=0.0)))
            dull = step >= DULL and not (trail[step] <= 0.5 * trail[step - DULL])
            over = dull or time.perf_counter() > deadline or not kinds.pairs.any()
            if over or (trail[-1] <= PLAIN and self.done(at, kinds)):
                break
            target = np.maximum(_at_least(CUT, length) * product, _at_least(LEVEL, trail[-1]) * trail[-1])
            try:
                trace = float(np.sqrt(trail[-1] * np.median(product[kinds.pairs])))
                move = self.step(at, kinds, self.barrier(at, kinds, usual, trace), target)
            except (SolverError, np.linalg.LinAlgError):
                break
            length = self.length(at, move, kinds)
            short = short + 1 if length < IDLE else 0
            if not (length > 0.0) or short > STALLED:
                break
            f, dq = at.f + length * move.df, at.dq + length * move.dq
            gap = at.gap + length * move.d[:, 0]
            gone = kinds.rubs & (f[:, 0] < GONE) & (f[:, 0] < OPEN * gap)
            kinds = _Kinds(kinds.rubs & ~gone, kinds.soft | gone, kinds.free, kinds.shut)
            if trail[-1] <= CLEAR:
                kinds, f = _settled(kinds, f, gap)
            at = self.at(f, dq, kinds)
        return at, kinds, step

    def done(self, at: _At, kinds: _Kinds) -> bool:
        """Whether this is a state already, without the traces."""
        return measure(self.system, self.bounds, _without(at.f, kinds), at.dq).accepted

    def barrier(self, at: _At, kinds: _Kinds, usual: tuple[Floats, Floats], trace: float) -> _Barrier:
        """Second and first derivatives; `usual` is what fn and s - beta pay by."""
        mu, k, eta = self.system.mu, np.flatnonzero(kinds.rubs), self.bounds.eta
        H, b = np.zeros((len(at.f), 3, 3)), np.zeros((len(at.f), 3))
        fn = np.where(kinds.free, 1.0, at.f[:, 0])
        H[:, 0, 0], b[:, 0] = fn**-2.0 + usual[0] ** -2.0, 1.0 / usual[0] - 1.0 / fn
        cone, tangent, e = at.cone[k], at.tangent[k], at.e[k]
        inward = np.concatenate([mu[k, None], -e], 1)
        aside = np.stack([np.zeros(len(k)), -e[:, 1], e[:, 0]], 1)  # turning friction costs cone too
        H[k] += _outer(inward / cone[:, None]) + _outer(aside / np.sqrt(cone * tangent)[:, None])
        H[k, 1, 1] += tangent**-2.0
        H[k, 2, 2] += tangent**-2.0
        b[k] -= inward / cone[:, None]
        b[k, 1:] -= e / tangent[:, None]
        j = np.flatnonzero(kinds.soft)
        small = np.maximum(1e-13, np.minimum(trace, 0.3 * mu * fn))[j, None]
        H[j, 1, 1] = H[j, 2, 2] = small[:, 0] ** -2.0
        b[j, 1:] = at.f[j, 1:] / small**2
        smooth = ~kinds.rubs & ~kinds.soft
        H[smooth, 1, 1] = H[smooth, 2, 2] = 1.0
        W = np.linalg.inv(H)
        W[smooth, 1:], W[smooth, :, 1:], W[kinds.free] = 0.0, 0.0, 0.0
        out = np.concatenate([np.zeros((len(at.f), 1)), at.out], 1)
        steep, slope = (eta - at.slide) ** -2.0, 1.0 / (eta - at.slide)
        steep[k] += at.spare[k] ** -2.0 + usual[1][k] ** -2.0
        slope[k] += 1.0 / usual[1][k] - 1.0 / at.spare[k]
        Q, bd = _outer(np.sqrt(steep)[:, None] * out), slope[:, None] * out
        Q[:, 0, 0] += (eta - at.d[:, 0]) ** -2.0
        bd[:, 0] += 1.0 / (eta - at.d[:, 0])
        return _Barrier(H, 0.5 * (W + W.transpose(0, 2, 1)), b, Q, bd)

    def rows(self, at: _At, kinds: _Kinds, W: Floats, target: Floats) -> tuple[PointRows, Floats]:
        """Rows fn g = target, or g = 0 on fixed sets, and friction against sliding; and the slack of each."""
        fn, g = at.f[:, 0], at.gap
        rows = PointRows.empty(len(fn), 2)
        share = kinds.pairs / np.maximum(np.maximum(fn, g), TINY)
        rows.C[:, 0, 0], rows.G[:, 0, 0] = g * share, fn * share + kinds.shut
        rows.r[:, 0] = (fn * g - target) * share + np.where(kinds.shut, g, 0.0)
        rows.sine(kinds.rubs, at.f, at.d)
        slack = rows.slack(SLACK)
        loose = np.maximum(RELATIVE * rows.C[:, 0, 0] ** 2 * W[:, 0, 0], np.where(fn > g, LEAST, TINY))
        slack[:, 0] = np.where(kinds.pairs, loose, slack[:, 0])
        return rows, slack

    def step(self, at: _At, kinds: _Kinds, barrier: _Barrier, target: Floats) -> Step:
        """The step, refined until what it leaves off is small; the best met if that never happens."""
        rows, slack = self.rows(at, kinds, barrier.W, target)
        local = Eliminated(self.doubled, self.system, (barrier.W, barrier.Q), rows, slack, (SHIFT, 1e-6))
        off = self.system.residual(at.f)
        return local.refined(off, rows.r, barrier.b, barrier.bd, partial(_wrong, at, kinds, off))

    def length(self, at: _At, move: Step, kinds: _Kinds) -> float:
        """Longest of 1, 0.8, ... that goes at most `ROOM` of the way to every bound; 0 where none does."""
        length = 1.0
        while length > SHORTEST:
            if self.within(at, move, kinds, length):
                return length
            length *= SHORTER
        return 0.0

    def within(self, at: _At, move: Step, kinds: _Kinds, length: float) -> bool:
        """Whether a step of that length keeps a share of all that is positive."""
        left, eta, on, pairs = 1.0 - ROOM, self.bounds.eta, ~kinds.free, kinds.pairs
        watched = kinds.free & ~kinds.shut
        f, d = at.f + length * move.df, at.d + length * move.d
        tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
        along, gap, high = f[:, 1] * d[:, 1] + f[:, 2] * d[:, 2], d[:, 0] + 1.0, f[:, 0] > left * at.f[:, 0]
        others = (
            high[on & ~kinds.rubs].all()
            and (gap > left * at.gap)[pairs].all()
            and (gap[watched] > -1e-13).all()
            and (eta - slide > left * (eta - at.slide)).all()
            and (eta - d[:, 0] > left * (eta - at.d[:, 0])).all()
        )
        rubbing = high & (self.system.mu * f[:, 0] - tangent > left * at.cone)
        rubbing &= (slide - self.bounds.beta > left * at.spare) & (along < AGAINST * slide * tangent)
        return bool(others and (rubbing | ~kinds.rubs).all())


def _usual(at: _At) -> tuple[Floats, Floats]:
    """Sizes of fn and s - beta that the barrier lets them keep."""
    return np.maximum(1.0, 3.0 * at.f[:, 0]), np.maximum(0.1, 2.0 * at.spare)


def _settled(kinds: _Kinds, f: Floats, gap: Floats) -> tuple[_Kinds, Floats]:
    """Points that plainly press are shut from here on, and those that are plainly let go lose their force."""
    shut = kinds.pairs & (f[:, 0] > PLAINLY * gap) & (f[:, 0] > GONE)
    free = kinds.pairs & (gap > PLAINLY * f[:, 0]) & (f[:, 0] < TRIFLE)
    f = np.where(free[:, None], 0.0, f)
    return _Kinds(kinds.rubs & ~free, kinds.soft & ~free, kinds.free | free, kinds.shut | shut), f


def _without(f: Floats, kinds: _Kinds) -> Floats:
    """The forces that `kinds` allows."""
    f = np.where(kinds.free[:, None], 0.0, f)
    f[~kinds.rubs, 1:] = 0.0
    return f


def _wrong(at: _At, kinds: _Kinds, off: Floats, left: Floats, miss: Floats) -> float:
    """What a solution of the linearised equations leaves off, in terms of what it may."""
    fine = np.where(kinds.pairs, 0.05 * np.minimum(at.f[:, 0], np.abs(at.gap)), 1e-13)
    balance = max(1e-12, 1e-2 * float(np.max(np.abs(off), initial=0.0)))
    parts = (np.abs(miss[:, 0]) / fine)[kinds.pairs | kinds.shut], np.abs(miss[:, 1]) / 1e-3, np.abs(left) / balance
    return max(float(np.max(part, initial=0.0)) for part in parts)


def _outer(x: Floats) -> Floats:
    """(q, 3, 3) x x' of each row."""
    return x[:, :, None] * x[:, None, :]


def _at_least(table: tuple[tuple[float, float], ...], x: float) -> float:
    """The entry of the first threshold below x."""
    return next(value for above, value in table if x > above or above == 0.0)
