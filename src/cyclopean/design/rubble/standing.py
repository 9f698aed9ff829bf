"""Whether what is being laid stands: contacts of the real surfaces, and forces in them, stone by stone.

A stone may be laid where the wall with it is in rigid-block equilibrium,

    A f = -p,   f in the cones of friction,

over the contacts where the meshes touch as they lie (`touching`). The model has the same.

The forces that hold what was laid before are known. A new stone leaves them as they are but for the stones it comes to
bear on, and those that bear these, down to the ground: the forces on them, and those alone, are found anew, with all
others as loads. That there are such forces is enough for the whole wall to stand, and so is a small problem in a wall
of any size. That there are none proves nothing; the stone then goes elsewhere.

A wall that only just stands falls when it is touched. So friction is counted with less than stone has on stone, and
each stage has to stand with gravity leaning a little as well, along the wall either way and across it either way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.equilibrium.newton import collapse_bound, newton
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.patches import Meeting
from cyclopean.design.rubble.features import Body
from cyclopean.design.rubble.touching import touching
from cyclopean.errors import SolverError
from cyclopean.geometry import frames_from_normals
from cyclopean.statics import EquilibriumSystem, Schur, contact_matrix, project_cones

__all__ = ["FRICTION", "GRAVITY", "Fresh", "Joint", "Mass", "State", "Structure"]

FRICTION = 0.6  # counted on: 31 degrees
GRAVITY = 9.80665  # m/s2, standard
BEARING = 0.25  # least upward component of the normal of a contact that bears a stone
BALANCED = 1e-7  # of the weight of a stone: what forces may leave over on it
CAP = 30  # factorisations: most need six to ten, and few of those that stand more than twenty
WIDE = 6.0  # sizes of a stone: within that along the wall, others help
WEDGED = 0.8  # of all loads together: where forces must be larger, stones only hold by wedging (upright walls: 0.5)
RINGS = 2  # of stones around a new one, by which it is tried whether they can hold it with all others fixed
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
    def points(self) -> Floats:
        """(q, 3) where forces act: at the corners of faces, and at points."""
        return np.concatenate([part.polygon for part in self.parts])

    @property
    def bearing(self) -> Floats:
        """(n, 3) those of them that bear it."""
        found = [part.polygon for part in self.parts if part.normal[2] >= BEARING]
        return np.concatenate([np.zeros((0, 3)), *found])


@dataclass(frozen=True, slots=True, eq=False)
class Fresh:
    """A stone that is to be laid, or was."""

    mass: Mass
    body: Body
    joints: tuple[Joint, ...]

    @property
    def bearing(self) -> Floats:
        """(n, 3) points that bear it."""
        return np.concatenate([np.zeros((0, 3)), *(joint.bearing for joint in self.joints)])


At = tuple[int, int]  # a joint: stone, and which of its own
# Forces (q, 3) on the upper stones, N, world, in joints of a new stone and those that change with it: for each way of
# gravity.
State = tuple[Mapping[At, Floats], ...]


class Structure:
    """What stands: stones by their numbers, their joints, and forces."""

    def __init__(self, ground: Body, friction: float = FRICTION, lean: float = 0.0) -> None:
        self.ground, self.friction = ground, friction
        self.down = _ways_down(lean)  # (c, 3)
        self.stones: dict[int, Fresh] = {}
        self.force: dict[At, Floats] = {}  # (c, q, 3) N
        self.above: dict[int, list[tuple[int, int]]] = {}  # joints of later stones with each stone
        self.next = 0  # number of the stone that is laid next
        self.worst = 0  # leaning way of gravity in which a wall failed to stand last

    def fresh(self, mass: Mass, body: Body, near: Sequence[int], others: Sequence[Body] = ()) -> Fresh:
        """A new stone with all its joints: with the ground, those of `near`, and others that are laid with it."""
        beside = {GROUND: self.ground, **{k: self.stones[k].body for k in near}}
        beside |= {self.next + i: other for i, other in enumerate(others)}
        met = touching(body, list(beside.values()))
        return Fresh(mass, body, tuple(Joint(k, parts) for k, parts in zip(beside, met, strict=True) if parts))

    def held(self, fresh: Sequence[Fresh]) -> State | None:
        """Forces that hold one or more new stones and all that stands; None where none were found."""
        if not any(new.joints for new in fresh):
            return None
        numbers = tuple(range(self.next, self.next + len(fresh)))
        bearers = self._bearers([j.below for new in fresh for j in new.joints if j.below < self.next])
        beside = _Problem.of(self, (*self._beside(fresh), *numbers), fresh, others_fixed=True)
        if beside.impossible(self.worst):  # of those that do not stand, half are found out here
            return None
        few = _Problem.of(self, (*bearers, *numbers), fresh)
        many: _Problem | None = None
        found: dict[int, Mapping[At, Floats]] = {}
        for way in (self.worst, *(k for k in range(len(self.down)) if k != self.worst)):
            forces = few.forces(way)
            if forces is None and (way == self.worst or not beside.impossible(way)):  # others may have to help
                around = self._around(bearers, fresh[-1].mass.centre)
                many = many or _Problem.of(self, (*around, *numbers), fresh)
                forces = many.forces(way)
            if forces is None:
                self.worst = way
                return None
            found[way] = forces
        return tuple(found[way] for way in range(len(self.down)))

    def _beside(self, fresh: Sequence[Fresh]) -> tuple[int, ...]:
        """What new stones touch, what touches that, and so on; sorted."""
        found = {joint.below for new in fresh for joint in new.joints if joint.below < self.next}
        for _ in range(RINGS - 1):
            for k in found - {GROUND}:
                found |= {joint.below for joint in self.stones[k].joints} | {above for above, _ in self.above[k]}
        return tuple(sorted(found - {GROUND}))

    def _around(self, bearers: Sequence[int], centre: Floats) -> tuple[int, ...]:
        """These stones, and others near enough along the wall to help them; sorted."""
        if not bearers:
            return ()
        far = WIDE * float(np.cbrt(np.median([stone.mass.volume for stone in self.stones.values()])))
        near = {k for k, stone in self.stones.items() if abs(stone.mass.centre[0] - centre[0]) <= far}
        return tuple(sorted(near | set(bearers)))

    def resolve(self) -> bool:
        """Find the forces in all joints anew, keep those that are known where none are found; whether all were."""
        self.worst = 0
        if not self.stones:
            return True
        every = _Problem.of(self, tuple(sorted(self.stones)), ())
        found = [every.forces(way) for way in range(len(self.down))]
        self._keep([forces or {} for forces in found])
        return all(forces is not None for forces in found)

    def lay(self, fresh: Sequence[Fresh], state: State) -> None:
        """Add stones, with the forces that hold them."""
        for new in fresh:
            number, self.next = self.next, self.next + 1
            self.stones[number], self.above[number] = new, []
            for k, joint in enumerate(new.joints):
                if joint.below != GROUND:
                    self.above[joint.below].append((number, k))
        self._keep(state)

    def _keep(self, state: Sequence[Mapping[At, Floats]]) -> None:
        """Take forces over."""
        for way, forces in enumerate(state):
            for at, force in forces.items():
                self.force.setdefault(at, np.zeros((len(self.down), *force.shape)))[way] = force

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


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Balance of some stones, new ones last, with the forces in all other joints as they are."""

    structure: Structure
    stones: Mapping[int, Fresh]
    joints: Mapping[At, Joint]
    system: EquilibriumSystem | None
    schur: Schur | None

    @classmethod
    def of(
        cls, structure: Structure, free: tuple[int, ...], fresh: Sequence[Fresh], others_fixed: bool = False
    ) -> "_Problem":
        """Where all others are fixed, joints with them can carry anything, and less is asked than of the wall."""
        old = len(free) - len(fresh)
        stones = {k: structure.stones[k] for k in free[:old]} | dict(zip(free[old:], fresh, strict=True))
        row = {k: i for i, k in enumerate(free)}
        joints = {
            (k, i): joint
            for k, stone in stones.items()
            for i, joint in enumerate(stone.joints)
            if joint.below == GROUND or joint.below in row or others_fixed
        }
        if others_fixed:
            above = [at for k in free[:old] for at in structure.above[k] if at[0] not in row]
            joints |= {(k, i): structure.stones[k].joints[i] for k, i in above}
        ends = np.array([(row.get(joint.below, -1), row.get(k, -1)) for (k, _), joint in joints.items()])
        masses = [stone.mass for stone in stones.values()]
        system = _system(masses, list(joints.values()), ends, structure.friction)
        return cls(structure, stones, joints, system, None if system is None else Schur(system, threads=1))

    def forces(self, way: int) -> dict[At, Floats] | None:
        """(q, 3) N in the joints between these, for one way of gravity; None where none were found."""
        if self.system is None or self.schur is None:
            return None
        system = self._posed(self.system, way)
        f = _balanced(system, self.schur, [stone.mass for stone in self.stones.values()])
        if f is None:
            return None
        world = np.einsum("qf,qfi->qi", f * system.force_unit, system.frame)
        last = np.cumsum([len(joint.points) for joint in self.joints.values()])
        return dict(zip(self.joints, np.split(world, last[:-1]), strict=True))

    def impossible(self, way: int) -> bool:
        """Whether forces that hold these, for one way of gravity, would be too large for all that stands."""
        if self.system is None or self.schur is None:
            return True
        system = self._posed(self.system, way)
        every = {**self.structure.stones, **self.stones}.values()
        whole = sum(stone.mass.weight for stone in every) / system.force_unit
        most = WEDGED * max(whole / system.total, 1.0)
        try:
            answer = newton(system, self.schur, cap=CAP, lost=most)
        except (SolverError, np.linalg.LinAlgError):
            return False
        return collapse_bound(system, answer.y) >= most

    def _posed(self, system: EquilibriumSystem, way: int) -> EquilibriumSystem:
        """The system with the loads of one way of gravity."""
        return replace(system, p=self._load(way).ravel() / system.force_unit)

    def _load(self, way: int) -> Floats:
        """(b, 6) N: weights, and forces in joints with stones that are not among these; moments over the unit."""
        structure = self.structure
        load = np.zeros((len(self.stones), 6))
        for row, (k, stone) in enumerate(self.stones.items()):
            load[row, :3] += structure.down[way] * stone.mass.weight
            for i, joint in enumerate(stone.joints):
                if (k, i) not in self.joints and (k, i) in structure.force:
                    _push(load[row], structure.force[k, i][way], joint, stone.mass.centre)
            for above, i in structure.above.get(k, ()):
                if (above, i) not in self.joints:
                    force = -structure.force[above, i][way]
                    _push(load[row], force, structure.stones[above].joints[i], stone.mass.centre)
        assert self.system is not None
        return load / [1.0, 1.0, 1.0, *3 * [self.system.length_unit]]


def _ways_down(lean: float) -> Floats:
    """(c, 3) unit directions of gravity: straight down, and leaning by so many degrees along and across the wall."""
    plumb = np.array([[0.0, 0.0, -1.0]])
    if not lean > 0.0:
        return plumb
    side, down = np.sin(np.radians(lean)), -np.cos(np.radians(lean))
    leaning = [[0.0, -side, down], [0.0, side, down], [side, 0.0, down], [-side, 0.0, down]]
    return np.concatenate([plumb, leaning])


def _turned(part: Meeting) -> Meeting:
    """The same patch with its normal the other way."""
    return replace(part, polygon=part.polygon[::-1], normal=-part.normal)


def _push(load: Floats, force: Floats, joint: Joint, centre: Floats) -> None:
    """Add known forces (q, 3) at the points of a joint to the load (6,) of a stone."""
    load[:3] += force.sum(axis=0)
    load[3:] += np.cross(joint.points - centre, force).sum(axis=0)


def _system(masses: Sequence[Mass], joints: Sequence[Joint], ends: Ints, friction: float) -> EquilibriumSystem | None:
    """A f = -p of some stones without loads; None where their joints (rows `ends`) have no points."""
    count = [len(joint.points) for joint in joints]
    total = sum(count)
    if not total:
        return None
    point = np.concatenate([joint.points for joint in joints])
    parts = [part for joint in joints for part in joint.parts]
    normal = np.repeat([part.normal for part in parts], [len(part.polygon) for part in parts], axis=0)
    frame = frames_from_normals(normal)
    rows = np.repeat(ends, count, axis=0)
    unit = float(np.mean([mass.weight for mass in masses]))
    length = float(np.mean([mass.volume for mass in masses])) ** (1.0 / 3.0)
    centre = np.array([mass.centre for mass in masses] + [np.zeros(3)])
    arm = (point[:, None] - centre[rows]) / length  # (q, 2, 3)
    wrench = np.zeros((len(masses), 6))
    sides = rows[:, 0], rows[:, 1], arm[:, 0], arm[:, 1], frame
    matrix = contact_matrix(len(masses), *sides)
    if matrix.shape[0] * matrix.shape[1] <= DENSE:
        matrix = matrix.toarray()
    free, used, mu, one = np.arange(len(masses)), np.arange(total), np.full(total, friction), np.ones(len(masses))
    return EquilibriumSystem(free, used, *sides, mu, matrix, wrench.ravel(), unit, length, one, one)


def _balanced(system: EquilibriumSystem, schur: Schur, masses: Sequence[Mass]) -> Floats | None:
    """(q, 3) scaled forces in their cones that balance the loads; None where none were found."""
    try:
        answer = newton(system, schur, cap=CAP, lost=WEDGED)
    except (SolverError, np.linalg.LinAlgError):
        return None
    found = np.asarray(project_cones(answer.f, system.mu))
    weight = np.array([mass.weight for mass in masses]) / system.force_unit
    size = np.cbrt([mass.volume for mass in masses]) / system.length_unit
    own = np.repeat(np.column_stack([weight, weight * size]), 3, axis=1)
    balances = bool((np.abs(system.residual(found)) <= BALANCED * own.ravel()).all())
    return found if answer.word == "balanced" and balances else None
