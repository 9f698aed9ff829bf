"""Whether what is being laid stands: contacts of the real surfaces, and forces in them, stone by stone.

A stone may be laid where the wall with it is in rigid-block equilibrium,

    A f = -p,   f in the cones of friction,

over the contacts that `assembly.patches` finds between the meshes as they lie, within a narrow band: those that touch
before anything moves. The model has the same. What is proved of the model asks for friction of the faces as well: so
with gravity straight down, friction about the normal of a contact is less by what its faces lean from it.

The forces that hold what was laid before are known. A new stone leaves them as they are but for the stones it comes to
bear on, and those that bear these, down to the ground: the forces on them, and those alone, are found anew, with all
others as loads. That there are such forces is enough for the whole wall to stand, and so is a small problem in a wall
of any size. That there are none proves nothing; the stone then goes elsewhere.

A wall that only just stands falls when it is touched. So friction is counted with less than stone has on stone, and
each stage has to stand with gravity leaning a little as well, along the wall either way and across it either way.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.equilibrium.newton import newton
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.patches import Meeting, Surface, meetings
from cyclopean.errors import SolverError
from cyclopean.geometry import frames_from_normals
from cyclopean.statics import EquilibriumSystem, Schur, contact_matrix, project_cones

__all__ = ["FRICTION", "GRAVITY", "Fresh", "Joint", "Mass", "State", "Structure"]

FRICTION = 0.6  # counted on: 31 degrees
GRAVITY = 9.80665  # m/s2, standard
BEARING = 0.25  # least upward component of the normal of a contact that bears a stone
BALANCED = 1e-9  # of the weight: what forces may leave over
CAP = 30  # factorisations: most need six to ten, and few of those that stand more than twenty
ALIGNED = (0.9976, 0.9903, 0.9781, 0.955)  # cosines of 4, 8, 12 and 17 degrees: the flattest faces at each spot bear
CURVED = 1e-3  # radians by which friction is less, that what is proved about the faces has room
WIDE = 6.0  # sizes of a stone: within that along the wall, others help
WEDGED = 0.8  # of all loads together: where forces must be larger, stones only hold by wedging (upright walls: 0.5)
DENSE = 1 << 18  # entries up to which a matrix is kept whole: products with it are faster then
GROUND = -1


@dataclass(frozen=True, slots=True, eq=False)
class Mass:
    """A stone as statics sees it."""

    centre: Floats  # (3,) m
    volume: float  # m3
    weight: float  # N


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """All patches between a stone and one laid before it, or the ground."""

    below: int  # -1 = ground
    parts: tuple[Meeting, ...]  # normals into the stone

    @property
    def bearing(self) -> Floats:
        """(n, 3) points of the patches that bear it."""
        found = [part.polygon for part in self.parts if len(part.polygon) and part.normal[2] >= BEARING]
        return np.concatenate(found) if found else np.zeros((0, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Fresh:
    """A stone that is to be laid, or was."""

    mass: Mass
    surface: Surface
    joints: tuple[Joint, ...]

    @property
    def bearing(self) -> Floats:
        """(n, 3) points that bear it."""
        return np.concatenate([np.zeros((0, 3)), *(joint.bearing for joint in self.joints)])


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Forces on a new stone, and those that change with it: N on the upper stone, world, by (stone, which joint)."""

    force: Mapping[tuple[int, int], Floats]  # (c, q, 3) for each way of gravity
    plumb: Mapping[tuple[int, int], Floats]  # (q, 3) with gravity straight down, where only these change


class Structure:
    """What stands: stones by their numbers, their joints where surfaces are nearer than `touch` (m), and forces."""

    def __init__(self, ground: Surface, touch: float, friction: float = FRICTION, lean: float = 0.0) -> None:
        self.ground, self.touch, self.friction = ground, touch, friction
        self.down = _ways_down(lean)  # (c, 3)
        self.stones: dict[int, Fresh] = {}
        self.force: dict[tuple[int, int], Floats] = {}  # (c, q, 3) N
        self.above: dict[int, list[tuple[int, int]]] = {}  # joints of later stones with each stone
        self.next = 0  # number of the stone that is laid next
        self.between = -np.inf, np.inf  # m along the wall: stones whose forces may change have their centres there
        self.worst = 0  # leaning way of gravity in which a wall failed to stand last

    def fresh(self, mass: Mass, surface: Surface, near: Sequence[int], others: Sequence[Surface] = ()) -> Fresh:
        """A new stone with all its joints: with the ground, those of `near`, and others that are laid with it."""
        beside = {GROUND: self.ground, **{k: self.stones[k].surface for k in near}}
        beside |= {self.next + i: other for i, other in enumerate(others)}
        met = meetings(list(beside.values()), surface, self.touch, ALIGNED)
        joints = tuple(Joint(k, tuple(parts)) for k, parts in zip(beside, met, strict=True) if parts)
        return Fresh(mass, surface, joints)

    def held(self, fresh: Sequence[Fresh]) -> State | None:
        """Forces that hold one or more new stones and all that stands; None where none were found."""
        if not any(len(part.polygon) for new in fresh for joint in new.joints for part in joint.parts):
            return None
        numbers = tuple(range(self.next, self.next + len(fresh)))
        bearers = self._bearers([j.below for new in fresh for j in new.joints if j.below < self.next])
        low, high = self.between
        if not all(low <= self.stones[k].mass.centre[0] <= high for k in bearers):
            return None
        few = (*bearers, *numbers)
        leaning = self._balanced(few, fresh, range(1, len(self.down)))
        if leaning is None:
            return None
        plumb = self._balanced(few, fresh, range(1))
        if plumb is None:  # with friction of the faces alone, others may have to help
            around = self._around(bearers, fresh[-1].mass.centre)
            plumb = self._balanced((*around, *numbers), fresh, range(1)) if len(around) > len(bearers) else None
        if plumb is None:
            return None
        force = {at: np.concatenate([plumb[at], leaning[at]]) if leaning else plumb[at] for at in (leaning or plumb)}
        return State(force, {at: f[0] for at, f in plumb.items() if at not in force})

    def _around(self, bearers: Sequence[int], centre: Floats) -> tuple[int, ...]:
        """These stones, and others near enough along the wall to help them; sorted."""
        if not bearers:
            return ()
        far = WIDE * float(np.cbrt(np.median([stone.mass.volume for stone in self.stones.values()])))
        near = {k for k, stone in self.stones.items() if abs(stone.mass.centre[0] - centre[0]) <= far}
        return tuple(sorted(near | set(bearers)))

    def resolve(self) -> None:
        """Find the forces in all joints anew, and keep those that are known where none are found."""
        if self.stones:
            every = tuple(sorted(self.stones))
            found = [self._balanced(every, (), [way]) for way in range(len(self.down))]
            for way, forces in enumerate(found):
                for at, force in (forces or {}).items():
                    self.force[at] = self.force[at].copy()
                    self.force[at][way] = force[0]
        self.worst = 0

    def lay(self, fresh: Sequence[Fresh], state: State) -> None:
        """Add stones, with the forces that hold them."""
        for new in fresh:
            number, self.next = self.next, self.next + 1
            self.stones[number], self.above[number] = new, []
            for k, joint in enumerate(new.joints):
                if joint.below != GROUND:
                    self.above[joint.below].append((number, k))
        self.force.update(state.force)
        for at, force in state.plumb.items():
            self.force[at] = np.concatenate([force[None], self.force[at][1:]])

    def meetings(self, block: Mapping[int, int]) -> dict[tuple[int, int], tuple[Meeting, ...]]:
        """Contacts of the model, between blocks a < b; `block` is the number of each stone, and the ground block 0."""
        found = {}
        for k, stone in self.stones.items():
            for joint in stone.joints:
                a, b = 0 if joint.below == GROUND else block[joint.below], block[k]
                found[min(a, b), max(a, b)] = joint.parts if a < b else tuple(map(_turned, joint.parts))
        return found

    def _bearers(self, below: Sequence[int]) -> tuple[int, ...]:
        """These stones, and all that bear them, down to the ground; sorted."""
        found: set[int] = set()
        fresh = list(below)
        while fresh:
            k = fresh.pop()
            if k != GROUND and k not in found:
                found.add(k)
                fresh += [joint.below for joint in self.stones[k].joints if len(joint.bearing)]
        return tuple(sorted(found))

    def _balanced(
        self, free: tuple[int, ...], fresh: Sequence[Fresh], ways: Sequence[int]
    ) -> dict[tuple[int, int], Floats] | None:
        """Forces in all joints of these stones, new ones last, with all others as they are, for some ways of gravity."""
        if not len(ways):
            return {}
        old = len(free) - len(fresh)
        stones = {k: self.stones[k] for k in free[:old]} | dict(zip(free[old:], fresh, strict=True))
        row = {k: i for i, k in enumerate(free)}
        masses = [stone.mass for stone in stones.values()]
        load = np.zeros((len(ways), len(free), 6))
        load[:, :, :3] = self.down[list(ways), None] * np.array([m.weight for m in masses])[:, None]
        found: dict[tuple[int, int], Joint] = {}
        for k, stone in stones.items():
            for i, joint in enumerate(stone.joints):
                if joint.below == GROUND or joint.below in row:
                    found[k, i] = joint
                elif (k, i) in self.force:
                    _push(load[:, row[k]], self.force[k, i][list(ways)], joint, stone.mass.centre)
            for above, i in self.above.get(k, ()):
                if above not in row:
                    force = -self.force[above, i][list(ways)]
                    _push(load[:, row[k]], force, self.stones[above].joints[i], stone.mass.centre)
        ends = np.array([(row.get(joint.below, -1), row[k]) for (k, _), joint in found.items()])
        system = _system(masses, load[0], list(found.values()), ends, self.friction)
        if system is None:
            return None
        if ways[0] == 0:
            system = replace(system, mu=_faces_mu(found.values(), self.friction))
        first = self.worst if self.worst < len(ways) else 0
        f, worst = _forces(system, load / [1.0, 1.0, 1.0, *3 * [system.length_unit]], first)
        if f is None:
            self.worst = worst if len(ways) > 1 else self.worst
            return None
        world = np.einsum("cqf,qfi->cqi", f * system.force_unit, system.frame)
        last = np.cumsum([len(_points(joint)) for joint in found.values()])
        return dict(zip(found, np.split(world, last[:-1], axis=1), strict=True))


def _ways_down(lean: float) -> Floats:
    """(c, 3) unit directions of gravity: straight down, and leaning by so many degrees along and across the wall."""
    plumb = np.array([[0.0, 0.0, -1.0]])
    if not lean > 0.0:
        return plumb
    side, down = np.sin(np.radians(lean)), -np.cos(np.radians(lean))
    leaning = [[0.0, -side, down], [0.0, side, down], [side, 0.0, down], [-side, 0.0, down]]
    return np.concatenate([plumb, leaning])


def _faces_mu(joints: Iterable[Joint], friction: float) -> Floats:
    """(q,) friction about the contacts' normals that is friction of all faces that touch there."""
    parts = [part for joint in joints for part in joint.parts if len(part.polygon)]
    left = np.arctan(friction) - np.array([part.lean for part in parts]) - CURVED
    return np.repeat(np.tan(np.maximum(left, 0.0)), [len(part.polygon) for part in parts])


def _turned(part: Meeting) -> Meeting:
    """The same patch with its normal the other way."""
    return replace(part, polygon=part.polygon[::-1], normal=-part.normal)


def _push(load: Floats, force: Floats, joint: Joint, centre: Floats) -> None:
    """Add known forces (c, q, 3) at the points of a joint to the loads (c, 6) of a stone."""
    load[:, :3] += force.sum(axis=1)
    load[:, 3:] += np.cross(_points(joint) - centre, force).sum(axis=1)


def _points(joint: Joint) -> Floats:
    """(q, 3) points of all patches of a joint that can carry."""
    return np.concatenate([part.polygon for part in joint.parts if len(part.polygon)] or [np.zeros((0, 3))])


def _system(
    masses: Sequence[Mass], load: Floats, joints: Sequence[Joint], ends: Ints, friction: float
) -> EquilibriumSystem | None:
    """A f = -p of some stones under loads (b, 6) N, N m; None where their joints (rows `ends`) have no points."""
    count = [len(_points(joint)) for joint in joints]
    total = sum(count)
    if not total:
        return None
    point = np.concatenate([_points(joint) for joint in joints])
    parts = [part for joint in joints for part in joint.parts if len(part.polygon)]
    normal = np.repeat([part.normal for part in parts], [len(part.polygon) for part in parts], axis=0)
    frame = frames_from_normals(normal)
    rows = np.repeat(ends, count, axis=0)
    unit = float(np.mean([mass.weight for mass in masses]))
    length = float(np.mean([mass.volume for mass in masses])) ** (1.0 / 3.0)
    centre = np.array([mass.centre for mass in masses] + [np.zeros(3)])
    arm = (point[:, None] - centre[rows]) / length  # (q, 2, 3)
    wrench = load / unit
    wrench[:, 3:] /= length
    sides = rows[:, 0], rows[:, 1], arm[:, 0], arm[:, 1], frame
    matrix = contact_matrix(len(masses), *sides)
    if matrix.shape[0] * matrix.shape[1] <= DENSE:
        matrix = matrix.toarray()
    free, used, mu = np.arange(len(masses)), np.arange(total), np.full(total, friction)
    return EquilibriumSystem(free, used, *sides, mu, matrix, wrench.ravel(), unit, length)


def _forces(system: EquilibriumSystem, loads: Floats, first: int) -> tuple[Floats | None, int]:
    """(c, q, 3) scaled forces that balance each of some loads (c, b, 6), in their cones, from the `first` of them on.

    None where one has none; and which one that is.
    """
    schur = Schur(system, threads=1)
    found = np.zeros((len(loads), system.points, 3))
    for k in (first, *(k for k in range(len(loads)) if k != first)):
        posed = replace(system, p=loads[k].ravel() / system.force_unit)
        try:
            answer = newton(posed, schur, cap=CAP, lost=WEDGED)
        except (SolverError, np.linalg.LinAlgError):
            return None, k
        found[k] = project_cones(answer.f, system.mu)
        off = float(np.abs(posed.residual(found[k])).max(initial=0.0))
        if answer.word != "balanced" or not off <= BALANCED * system.blocks:
            return None, k
    return found, first
