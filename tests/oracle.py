"""A second answer to every question of the program, sharing nothing with it: linear and mixed-integer programmes.

A structure is blocks and joints in the plane (d = 2, polygons in x and z, one unit of weight per area and depth) or in
space (d = 3). For free block i, joint points r_k with normal n_k from block a into block b, and edges g of the friction
cones,

    A f = -p,  f >= 0        rows: force, and moment about c_i;  columns: one per edge g of the cone at a point

In the plane the cone has two edges n + mu t, n - mu t and all is exact; in space a cone of K edges lies inside the
round one (radius mu) or around it (radius mu / cos(pi / K)). Every question is asked twice, of a structure a little
weaker than the given one (friction and contacts less by MARGIN) and of one a little stronger: *stable* is what the
weaker one is, *unstable* what the stronger one is, and what lies between is *near*, too near to call. Without friction
nothing can be less: *stable* is then what also stands with every joint turned by what a file's last digits may turn it,
to BALANCE of the lightest block.

No answer of HiGHS is believed: forces must balance every block to BALANCE of that block's own weight and size, a motion
must need forces of FAR total weights to be stopped, both summed in extended precision. What fails that is *near* too.
Independent groups of blocks (components) are asked one by one, with rows in units of each block's own weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, linprog
from scipy.sparse.csgraph import connected_components

G = 9.80665
MARGIN = 1e-6  # by which friction and contacts are less or more, relative
BALANCE = 1e-8  # of a block's own weight (and size): how well forces must balance it
FAR = 1e6  # total weights: forces that no structure has
TURNED = 4  # times that frictionless joints are turned at random
EDGES = (8, 64)  # of a friction cone in space: a coarse one first
CLASH = 1e-7  # eps; a motion that misses a pattern by more does not have it
NODES = 20000  # of the tree of patterns of one coupled question
Long = np.longdouble


@dataclass(frozen=True, eq=False)
class Body:
    """One block: what equilibrium has to know of it."""

    weight: float  # N at 9.80665 m/s2
    centre: np.ndarray  # (d,) m
    size: float  # m, diagonal of its bounding box
    fixed: bool = False


@dataclass(frozen=True, eq=False)
class Joint:
    """Where two blocks touch: the corners of a convex patch, or the ends of a segment."""

    a: int
    b: int
    point: np.ndarray  # (m, d) m
    normal: np.ndarray  # (d,) unit vector from a into b


@dataclass(frozen=True, eq=False)
class Structure:
    """Blocks, joints and what acts on them."""

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    mu: float
    gravity: np.ndarray  # (d,) m/s2
    loads: tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...] = ()  # block, force (N), point (m)
    rounding: float = 0.0  # m, of the coordinates in the file that the program reads

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.gravity)


@dataclass(frozen=True)
class LimitAnswer:
    """What the oracle knows of a multiplier: it stands up to `lower` and does not beyond `upper`.

    word: "limit", "unbounded", "falls" (not at 0 already) or "near".
    """

    word: str
    lower: float = float("nan")
    upper: float = float("nan")


def eased(structure: Structure, by: float) -> Structure:
    """The structure with friction and contacts larger by the share `by`; weaker for by < 0."""
    joints = [
        replace(joint, point=joint.point + by * (joint.point - joint.point.mean(axis=0))) for joint in structure.joints
    ]
    return replace(structure, mu=structure.mu * (1.0 + by), joints=tuple(joints))


def turned(structure: Structure, rng: np.random.Generator) -> Structure:
    """The structure with every joint turned at random by what rounding its ends may turn it."""
    joints = []
    for joint in structure.joints:
        angle = 4.0 * structure.rounding / np.linalg.norm(np.ptp(joint.point, axis=0))
        aside = rng.normal(size=structure.dimension)
        aside -= (aside @ joint.normal) * joint.normal
        joints.append(replace(joint, normal=joint.normal + angle * aside / np.linalg.norm(aside)))
    return replace(structure, joints=tuple(joints))


# --- equilibrium -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Equations:
    """A f + p = 0 of one component, in N and N m, and the units in which a programme sees it."""

    A: np.ndarray  # (rows, columns) extended precision, per edge of a cone with unit normal part
    p: np.ndarray  # (rows,) dead loads
    row: np.ndarray  # (rows,) own weight, and own weight times own size
    column: np.ndarray  # (columns,) weight of the lighter free block at the point
    point: np.ndarray  # (columns,) which point of the component
    kind: np.ndarray  # (columns,) 0 = the normal alone, 1 and -1 = n + mu t and n - mu t, else the edge's number
    total: float  # N, weight of the component
    blocks: tuple[int, ...]

    def scaled(self) -> np.ndarray:
        """The matrix that a programme sees."""
        return np.asarray(self.A / self.row[:, None] * self.column, float)


def components(structure: Structure) -> list[tuple[int, ...]]:
    """Free blocks that hang together; supports separate."""
    n = len(structure.bodies)
    touch = np.zeros((n, n), bool)
    for joint in structure.joints:
        if not structure.bodies[joint.a].fixed and not structure.bodies[joint.b].fixed:
            touch[joint.a, joint.b] = True
    _, label = connected_components(touch, directed=False)
    free = [i for i in range(n) if not structure.bodies[i].fixed]
    groups: dict[int, list[int]] = {}
    for i in free:
        groups.setdefault(int(label[i]), []).append(i)
    return [tuple(group) for group in groups.values()]


def cross(arm: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Moments (..., 1) in the plane or (..., 3) in space."""
    if arm.shape[-1] == 2:
        return (arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0])[..., None]
    return np.cross(arm, force)


def edges(normal: np.ndarray, mu: float, count: int, outer: bool) -> np.ndarray:
    """(K, d) edges of the friction cone, normal part 1; in the plane n + mu t, n - mu t; without friction n alone."""
    if mu == 0.0:
        return normal[None]
    if len(normal) == 2:
        tangent = np.array([normal[1], -normal[0]])
        return np.stack([normal + mu * tangent, normal - mu * tangent])
    across = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(normal, across)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    angle = 2.0 * np.pi * np.arange(count) / count
    radius = mu / np.cos(np.pi / count) if outer else mu
    return normal + radius * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v)


def wrenches(body: Body, point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(K, rows) force and moment about the block's centre, in extended precision."""
    arm = np.asarray(point, Long) - np.asarray(body.centre, Long)
    force = np.asarray(force, Long)
    return np.concatenate([force, cross(np.broadcast_to(arm, force.shape), force)], axis=-1)


def equations(
    structure: Structure, blocks: Sequence[int], count: int = 2, outer: bool = False, normals: bool = False
) -> Equations:
    """Equilibrium of some free blocks; `normals` adds a column for the normal alone at each point."""
    bodies, d = structure.bodies, structure.dimension
    height = d + (1 if d == 2 else 3)
    place = {i: k * height for k, i in enumerate(blocks)}
    columns, scale, number, kinds = [], [], [], []
    points = 0
    for joint in structure.joints:
        here = [(joint.b, 1.0), (joint.a, -1.0)]
        here = [(i, sign) for i, sign in here if i in place]
        if not here:
            continue
        cone = edges(joint.normal, structure.mu, count, outer)
        kind = [0] if len(cone) == 1 else [1, -1] if d == 2 else list(range(1, len(cone) + 1))
        if normals and len(cone) > 1:
            cone, kind = np.concatenate([joint.normal[None], cone]), [0, *kind]
        unit = min(bodies[i].weight for i, _ in here)
        for point in joint.point:
            block = np.zeros((len(cone), height * len(place)), Long)
            for i, sign in here:
                block[:, place[i] : place[i] + height] += sign * wrenches(bodies[i], point, cone)
            columns.append(block)
            scale += [unit] * len(cone)
            number += [points] * len(cone)
            kinds += kind
            points += 1
    A = np.concatenate(columns).T if columns else np.zeros((height * len(place), 0), Long)
    row = np.concatenate([[bodies[i].weight] * d + [bodies[i].weight * bodies[i].size] * (height - d) for i in blocks])
    return Equations(
        A,
        weights(structure, blocks, structure.gravity, structure.loads),
        row,
        np.array(scale, float),
        np.array(number, int),
        np.array(kinds, int),
        float(sum(bodies[i].weight for i in blocks)),
        tuple(blocks),
    )


def weights(structure: Structure, blocks: Sequence[int], acceleration: np.ndarray, loads: Sequence = ()) -> np.ndarray:
    """(rows,) what an acceleration (m/s2) of all of them and loads do to blocks."""
    d = structure.dimension
    height = d + (1 if d == 2 else 3)
    p = np.zeros(height * len(blocks), Long)
    for k, i in enumerate(blocks):
        p[k * height : k * height + d] = structure.bodies[i].weight / G * np.asarray(acceleration, Long)
        for block, force, point in loads:
            if block == i:
                p[k * height : (k + 1) * height] += wrenches(structure.bodies[i], point, np.array([force]))[0]
    return p


# --- answers that are checked ----------------------------------------------------------------------------------------


def balanced(eq: Equations, p: np.ndarray, f: np.ndarray) -> bool:
    """Whether forces (N per edge) hold p, each block to BALANCE of its own weight."""
    left = np.abs(eq.A @ f + p) / eq.row
    return bool(np.all(f >= 0.0) and np.sum(f) <= FAR * eq.total and np.all(left <= BALANCE))


def resisted(eq: Equations, y: np.ndarray) -> float:
    """Work that forces of FAR total weights could do against a motion (N m per unit of it)."""
    return float(FAR * eq.total * np.sum(np.maximum(0.0, -(np.asarray(y, Long) @ eq.A))))


def polished(eq: Equations, p: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Forces nearer to balance: corrections in proportion to each force, residuals in extended precision."""
    f, best, off = np.maximum(np.asarray(f, Long), 0.0), f, np.inf
    for _ in range(5):
        left = (eq.A @ f + p) / eq.row
        worst = float(np.max(np.abs(left), initial=0.0))
        if not worst < off:
            break
        best, off = f, worst
        if worst < 1e-3 * BALANCE:
            break
        share = np.asarray(f, float)
        M = np.asarray(eq.A * (share / eq.row[:, None]), float)
        through = np.maximum(np.abs(M).max(axis=1), 1e-300)  # what passes through a block may be far above its weight
        relative = np.linalg.lstsq(M / through[:, None], -np.asarray(left / through, float), rcond=1e-15)[0]
        f = np.maximum(f * (1.0 + np.asarray(relative, Long)), 0.0)
    return best


def mended(eq: Equations, p: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Forces to which a programme of its own adds what is missing, in units of the lighter block at each point."""
    f = np.maximum(np.asarray(f, Long), 0.0)
    room = np.asarray(f / eq.column, float)
    least = np.where(room > 1e6, -np.inf, -room)
    found = linprog(
        np.ones(len(room)) * (room <= 1e6),
        A_eq=eq.scaled(),
        b_eq=-np.asarray((eq.A @ f + p) / eq.row, float),
        bounds=np.column_stack([least, np.full(len(room), np.inf)]),
        method="highs",
    )
    return f if found.x is None else np.maximum(f + found.x * np.asarray(eq.column, Long), 0.0)


def _rounded(eq: Equations, y: np.ndarray) -> np.ndarray:
    """A motion without what is rounding: blocks that hardly move rest, joints that hardly open or slide move as one."""
    row = eq.row.reshape(len(eq.blocks), -1)
    unit = (row[:, :1] / row).ravel()  # 1, and 1 / size
    speed = np.asarray(y, Long) / unit
    size = np.abs(speed.reshape(row.shape)).max(axis=1)
    speed *= np.repeat(size > 1e-8 * size.max(initial=0.0), row.shape[1])
    B = eq.A * unit[:, None]
    still = np.abs(speed @ B) < 1e-11 * size.max(initial=0.0)
    for _ in range(2):
        left = np.asarray(speed @ B[:, still], float)
        speed -= np.linalg.lstsq(np.asarray(B[:, still].T, float), left, rcond=1e-12)[0]
    return speed * unit


def falling(eq: Equations, p: np.ndarray, y: np.ndarray) -> np.ndarray | None:
    """The motion y or -y, or either without what blocks move by rounding, if forces cannot stop it."""
    for motion in (y, _rounded(eq, y)):
        for way in (motion, -motion):
            if p @ way > resisted(eq, way):
                return way
    return None


def held(eq: Equations, p: np.ndarray, judge: Equations | None = None) -> tuple[str, np.ndarray | None]:
    """Whether forces balance p: "yes" and forces, "no" and a motion, or "unsure".

    max s with A f + s p = 0, 0 <= s <= 1: 1 where forces exist, else 0 and the multipliers are a motion, which is to
    be a mechanism of `judge`.
    """
    judge = eq if judge is None else judge
    if not np.any(p):
        return "yes", np.zeros(len(eq.column))
    M, q = eq.scaled(), np.asarray(p / eq.row, float)
    if not M.shape[1]:
        return "no", q
    stretch, through = np.ones(M.shape[1]), np.ones(len(q))
    for _ in range(3):
        found = linprog(
            np.append(np.zeros(M.shape[1]), -1.0),
            A_eq=np.column_stack([M * stretch, q]) / through[:, None],
            b_eq=np.zeros(len(q)),
            bounds=np.column_stack([np.zeros(M.shape[1] + 1), np.append(np.full(M.shape[1], np.inf), 1.0)]),
            method="highs",
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        if found.x is None:
            return "unsure", None
        share = found.x[-1]
        if share > 0.5:
            f = polished(eq, p, np.asarray(found.x[:-1] / share * stretch * eq.column, Long))
            if not balanced(eq, p, f):
                f = polished(eq, p, mended(eq, p, f))
            if balanced(eq, p, f):
                return "yes", f
        motion = falling(judge, p, np.asarray(found.eqlin.marginals, Long) / through / eq.row)
        if motion is not None:
            return "no", motion
        # what passes through a block may be far above its weight: units of what was found, or of the heaviest
        stretch = np.maximum(stretch, found.x[:-1] * stretch) if share > 0.5 else eq.total / eq.column
        through = np.maximum(1.0, np.abs(M * stretch).max(axis=1))
    return "unsure", None


def _cones(structure: Structure) -> tuple[int, ...]:
    return EDGES if structure.dimension == 3 and structure.mu > 0.0 else (2,)


def rbe(structure: Structure) -> str:
    """Rigid-block equilibrium: "stable", "unstable" or "near"."""
    weak, strong = eased(structure, -MARGIN), eased(structure, MARGIN)
    rng = np.random.default_rng(0)
    others = [turned(structure, rng) for _ in range(TURNED)] if structure.mu == 0.0 and structure.rounding else []
    words = [_group(structure, weak, others, strong, blocks) for blocks in components(structure)]
    return "unstable" if "unstable" in words else "near" if "near" in words else "stable"


def _group(
    structure: Structure, weak: Structure, others: Sequence[Structure], strong: Structure, blocks: Sequence[int]
) -> str:
    least = min(structure.bodies[i].weight for i in blocks)
    for count in _cones(structure):
        eq = equations(weak, blocks, count)
        if held(eq, eq.p)[0] == "yes":
            turned_too = (equations(other, blocks, count) for other in others)
            finer = (replace(eq, row=eq.row * np.minimum(1.0, least / _weight(structure, eq))) for eq in turned_too)
            return "stable" if all(held(eq, eq.p)[0] == "yes" for eq in finer) else "near"
        eq = equations(strong, blocks, count, outer=True)
        if held(eq, eq.p, equations(structure, blocks, count, outer=True))[0] == "no":
            return "unstable"
    return "near"


def _weight(structure: Structure, eq: Equations) -> np.ndarray:
    """(rows,) weight of the block of each row."""
    return np.repeat([structure.bodies[i].weight for i in eq.blocks], len(eq.row) // len(eq.blocks))


# --- multipliers -----------------------------------------------------------------------------------------------------


def limit(structure: Structure, push: np.ndarray) -> LimitAnswer:
    """How large the acceleration t |g| push may grow (t >= 0) before the structure falls."""
    base = rbe(structure)
    if base != "stable":
        return LimitAnswer("falls" if base == "unstable" else "near")
    weak, strong = eased(structure, -MARGIN), eased(structure, MARGIN)
    live = np.linalg.norm(structure.gravity) * np.asarray(push, float)
    lower, upper = np.inf, np.inf
    for blocks in components(structure):
        for count in _cones(structure):
            low = _stands_to(equations(weak, blocks, count), weights(weak, blocks, live))
            around = equations(structure, blocks, count, outer=True)
            high = _falls_from(equations(strong, blocks, count, outer=True), around, weights(strong, blocks, live))
            if low == np.inf or high - low <= 1e-3 * abs(high):
                break
        lower, upper = min(lower, low), min(upper, high)
    if lower == np.inf:
        return LimitAnswer("unbounded", np.inf, np.inf)
    return LimitAnswer("limit" if np.isfinite(upper) else "near", lower, upper)


def _grown(eq: Equations, live: np.ndarray) -> OptimizeResult:
    """max t with A f + p + t live = 0."""
    M, q = eq.scaled(), np.asarray(live / eq.row, float)
    return linprog(
        np.append(np.zeros(M.shape[1]), -1.0),
        A_eq=np.column_stack([M, q]),
        b_eq=-np.asarray(eq.p / eq.row, float),
        bounds=(0.0, None),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )


def _stands_to(eq: Equations, live: np.ndarray) -> float:
    """A multiplier at which forces are known; infinite where forces balance the live load alone."""
    found = _grown(eq, live)
    if found.status == 3 or found.x is None:
        return np.inf if held(eq, live)[0] == "yes" else 0.0
    t = max(0.0, float(found.x[-1]))
    for share in (1.0, 1.0 - 1e-7):
        p = eq.p + share * t * live
        if balanced(eq, p, polished(eq, p, found.x[:-1] * eq.column)):
            return share * t
    return 0.0


def _falls_from(eq: Equations, judge: Equations, live: np.ndarray) -> float:
    """A multiplier from which on a motion is known, a mechanism of `judge`; infinite where there is none."""
    found = _grown(eq, live)
    if found.status != 0:
        return np.inf
    y = np.asarray(found.eqlin.marginals, Long) / eq.row
    least = np.inf
    for motion in (y, -y, _rounded(eq, y), -_rounded(eq, y)):
        if live @ motion > 0.0:  # f.(A'y) = -(p + t live).y for every state
            least = min(least, float((1e-2 * resisted(judge, motion) - judge.p @ motion) / (live @ motion)))
    return least


# --- coupled analysis in the plane -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Allowed:
    """Bounds of a virtual motion in units of eps."""

    eta: float = 10.0
    beta: float = 0.01


def coupled(structure: Structure, allowed: Allowed) -> str:
    """Coupled analysis of a plane structure: "stable", "unstable" or "near".

    Forces and motion know each other through a pattern alone: which points are engaged (dn = -eps) and which way they
    rub. Where the forces of a pattern cannot balance the loads, a motion in which all of them do work tells so, and
    the forces that do not: every state has one of these, a *demand*. Patterns are searched in a tree: the smallest
    demand not met yet is met in each of its ways in turn, ways that no virtual motion has are cut off, and where all
    demands are met the forces say yes or make another demand. No force is ever bounded, no whole number rounded.
    """
    weak = eased(structure, -MARGIN), Allowed(allowed.eta * (1 - MARGIN), allowed.beta * (1 + MARGIN))
    strong = eased(structure, MARGIN), Allowed(allowed.eta * (1 + MARGIN), allowed.beta * (1 - MARGIN))
    words = []
    for blocks in components(structure):
        if _Patterns(*strong, blocks).state() == "no":
            return "unstable"
        words.append("stable" if _Patterns(*weak, blocks).state() == "yes" else "near")
    return "near" if "near" in words else "stable"


class _Patterns:
    """The tree of patterns of one component: bit k of a mask is point k engaged, k + q rubs along +t, k + 2q along -t.

    A point that rubs is engaged.
    """

    def __init__(self, structure: Structure, allowed: Allowed, blocks: Sequence[int]) -> None:
        self.eq = equations(structure, blocks, normals=True)
        self.normal, self.slide = gaps(structure, blocks)
        self.count, self.allowed = (q := len(self.normal)), allowed
        which = {0: 0, 1: 1, -1: 2}
        self.bit = [int(k) + q * which[int(kind)] for k, kind in zip(self.eq.point, self.eq.kind, strict=True)]
        self.demands: set[int] = set()
        self.clashes = {1 << q + k | 1 << 2 * q + k for k in range(q)}  # nothing rubs both ways
        self.left = NODES
        size = np.concatenate([[1.0, 1.0, structure.bodies[i].size] for i in blocks])
        self.pull = np.asarray(self.eq.p / self.eq.total, float) / size
        self.least = self._least_work(structure.mu)
        rows = np.vstack([self.normal, -self.normal, self.slide, -self.slide, -self.pull[None]])
        self.rows = np.column_stack([rows, -np.ones(len(rows))])  # the last unknown: by how much all are missed

    def state(self) -> str:
        """Whether there is a coupled state: "yes", "no", or "unsure"."""
        try:
            return "yes" if self._search(0, 0) else "no"
        except _UnsureError:
            return "unsure"

    def _least_work(self, mu: float) -> float:
        """Every state has p.dq = sum fn + sum |ft||dd_t|, no less than the least of sum fn + beta sum |ft|."""
        eq = self.eq
        price = 1.0 + self.allowed.beta * np.where(eq.kind == 0, 0.0, mu)
        p = -np.asarray(eq.p / eq.row, float)
        found = linprog(price * eq.column / eq.total, A_eq=eq.scaled(), b_eq=p, method="highs")
        return found.fun * (1.0 - 1e-4) - 1e-6 if found.status == 0 else -1e6

    def _search(self, on: int, off: int) -> bool:
        """Whether a state has all of `on` and nothing of `off`."""
        self.left -= 1
        if self.left < 0:
            raise _UnsureError
        missed, dn = self._motion(on)
        if missed > CLASH:
            return False
        while True:
            barred = off | self._barred(on)
            unmet = [demand & ~barred for demand in self.demands if not demand & on]
            if unmet:
                break
            if self._forces(on):
                if missed > 1e-2 * CLASH:
                    raise _UnsureError
                return True
        ways = min(unmet, key=int.bit_count)
        order = sorted(_bits(ways), key=lambda k: dn[k % self.count])
        for k in order:
            if self._search(on | 1 << k | 1 << k % self.count, off):
                return True
            off |= 1 << k
        return False

    def _motion(self, on: int) -> tuple[float, np.ndarray]:
        """How far (eps) the best virtual motion misses a pattern, and the opening (q,) of its points.

        Where it misses, the rows that say so make a *clash*: what no motion has together.
        """
        if any(clash & on == clash for clash in self.clashes):
            return np.inf, np.zeros(self.count)
        q, eta, beta = self.count, self.allowed.eta, self.allowed.beta
        bits = np.array([on >> k & 1 for k in range(3 * q)], bool).reshape(3, q)
        bound = np.concatenate(
            [
                np.where(bits[0], -1.0, eta),
                np.ones(q),
                np.where(bits[1], -beta, eta),  # what rubs along +t slides along -t
                np.where(bits[2], -beta, eta),
                [-self.least],
            ]
        )
        found = self._programme(-self.pull, self.rows[:, :-1], bound)
        if found.status == 0:
            return 0.0, self.normal @ found.x
        found = self._programme(np.append(np.zeros(len(self.pull)), 1.0), self.rows, bound)
        if found.x is None:
            raise _UnsureError
        if found.fun > CLASH:
            binding = np.flatnonzero(found.ineqlin.marginals[: 4 * q] < 0.0)
            asked = np.concatenate([np.arange(q), np.full(q, -1), np.arange(q, 3 * q)])[binding]
            self.clashes.add(sum(1 << int(k) for k in asked if k >= 0 and on >> int(k) & 1))
        return float(found.fun), self.normal @ found.x[:-1]

    def _programme(self, cost: np.ndarray, rows: np.ndarray, bound: np.ndarray) -> OptimizeResult:
        free = np.full((len(cost), 2), [-np.inf, np.inf])
        if len(cost) > len(self.pull):
            free[-1, 0] = 0.0
        tight = {"primal_feasibility_tolerance": 1e-9, "dual_feasibility_tolerance": 1e-9}
        return linprog(cost, A_ub=rows, b_ub=bound, bounds=free, method="highs", options=tight)

    def _barred(self, on: int) -> int:
        """What would make a clash whole."""
        barred, q = 0, self.count
        for clash in self.clashes:
            rest = clash & ~on
            if rest.bit_count() == 1:
                barred |= rest
        engaged = barred & ((1 << q) - 1)
        return barred | engaged << q | engaged << 2 * q

    def _forces(self, on: int) -> bool:
        """Whether the forces of a pattern balance the loads; if not, demands are added that it does not meet."""
        eq = self.eq
        active = np.array([on >> k & 1 for k in self.bit], bool)
        met = True
        while True:
            word, found = held(_only(eq, active), eq.p)
            if word == "unsure" and met:
                raise _UnsureError
            if word != "no" or found is None:
                return met
            met = False
            motion = self._sparsest(active, found)
            work = np.asarray(motion @ eq.A, float)
            room = 1e-6 * float(eq.p @ motion) / (FAR * eq.total)
            needed = (work < -room) & ~active
            demand = 0
            for k in np.flatnonzero(needed):
                demand |= 1 << self.bit[k]
            for k in range(self.count):  # a point that must be engaged anyhow
                if demand >> k & 1:
                    demand &= ~(1 << k + self.count | 1 << k + 2 * self.count)
            self.demands.add(demand)
            if not demand:
                return False
            active |= needed

    def _sparsest(self, active: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """A motion against which allowed forces do nothing and few others: least sum of what these could do."""
        eq = self.eq
        M, q = eq.scaled(), np.asarray(eq.p / eq.row, float)
        upper = np.append(np.where(active, np.inf, 1.0), np.inf)
        found = linprog(
            np.append(np.zeros(M.shape[1]), -1.0),
            A_eq=np.column_stack([M, q]),
            b_eq=np.zeros(len(q)),
            bounds=np.column_stack([np.zeros(M.shape[1] + 1), upper]),
            method="highs",
        )
        if found.status == 0:
            y = -np.asarray(found.eqlin.marginals, Long) / eq.row
            for other in (y, -y):
                if eq.p @ other > resisted(_only(eq, active), other):
                    return other
        return motion


class _UnsureError(Exception):
    """A programme that cannot be believed, or a tree that grows too large."""


def _only(eq: Equations, active: np.ndarray) -> Equations:
    return replace(eq, A=eq.A[:, active], column=eq.column[active])


def _bits(mask: int) -> list[int]:
    return [k for k in range(mask.bit_length()) if mask >> k & 1]


def gaps(structure: Structure, blocks: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """(q, 3 blocks) each: opening and sliding (of b along t = (nz, -nx)) of points, rotations times own size."""
    place = {i: 3 * k for k, i in enumerate(blocks)}
    normal, slide = [], []
    for joint in structure.joints:
        if joint.a not in place and joint.b not in place:
            continue
        tangent = np.array([joint.normal[1], -joint.normal[0]])
        for point in joint.point:
            for rows, direction in ((normal, joint.normal), (slide, tangent)):
                row = np.zeros(3 * len(place))
                for i, sign in ((joint.b, 1.0), (joint.a, -1.0)):
                    if i in place:
                        body = structure.bodies[i]
                        work = np.asarray(wrenches(body, point, direction[None])[0], float)
                        row[place[i] : place[i] + 3] += sign * work / [1.0, 1.0, body.size]
                rows.append(row)
    return np.array(normal).reshape(-1, 3 * len(place)), np.array(slide).reshape(-1, 3 * len(place))
