"""Blocks taken out, moved and put back, one at a time: only the contacts of that block are looked for again.

    at home     where the model has it; two blocks at home touch as the model says (or as was found at first)
    elsewhere   a block that was moved touches what `detect` finds, at the tolerance that the model began with

So an arrangement depends only on where its blocks are, not on the way there.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.assembly.blocks import Assembly, Block
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.detection import detect
from cyclopean.assembly.materials import paired_friction
from cyclopean.assembly.parts import part
from cyclopean.errors import InputError

__all__ = ["Arrangement", "Pose", "arrange"]


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """How a block was moved: turned about its centroid at home, then shifted."""

    turn: Floats  # (3, 3) rotation
    shift: Floats  # (3,) m

    def __post_init__(self) -> None:
        for name, *shape in (("turn", 3, 3), ("shift", 3)):
            object.__setattr__(self, name, sealed(f"pose {name}", getattr(self, name), *shape))
        skew = np.abs(self.turn @ self.turn.T - np.eye(3)).max()
        if not (skew <= 1e-9 and np.linalg.det(self.turn) > 0.0):
            raise InputError("pose turn: is not a rotation")

    def of(self, point: Floats, centre: Floats) -> Floats:
        """(k, 3) m, where the points of a block go whose centroid at home is `centre`."""
        return np.asarray((point - centre) @ self.turn.T + centre + self.shift)


@dataclass(frozen=True, slots=True, eq=False)
class Arrangement:
    """The blocks of a model as they are put now."""

    model: Assembly  # every block at home
    home: Contacts  # of the blocks at home
    held: Bools  # (n,) supports among the blocks of the model
    tolerance: float  # m, within which faces touch
    poses: Mapping[int, Pose]  # of the blocks that are not at home
    removed: frozenset[int]
    joints: Contacts  # of the blocks that stand, by their numbers in the model
    notes: tuple[str, ...]  # what a person should know of the blocks that were moved
    assembly: Assembly  # the blocks that stand, with their contacts; supports are marked
    index: Ints  # (m,) their numbers in the model

    @property
    def contacts(self) -> Contacts:
        """Contacts of the blocks that stand, by their numbers in `assembly`."""
        assert self.assembly.contacts is not None
        return self.assembly.contacts

    @property
    def fixed(self) -> Bools:
        """(m,) supports among the blocks that stand."""
        return np.asarray(self.held[self.index])

    def number(self, name: str) -> int:
        """Number in the model of the block with this id.

        Raises
        ------
        InputError
            There is none.
        """
        for k, block in enumerate(self.model.blocks):
            if block.id == name:
                return k
        raise InputError(f"block '{name}' is not in the model")

    def place(self, block: int) -> int | None:
        """Number in `assembly` of a block of the model; None where it was taken out."""
        at = int(np.searchsorted(self.index, block))
        return at if at < len(self.index) and self.index[at] == block else None

    def moved(self, block: int, pose: Pose) -> "Arrangement":
        """The same with one block somewhere else (no matter where it was, or whether it had been taken out)."""
        at_home = not np.any(pose.shift) and np.array_equal(pose.turn, np.eye(3))
        poses = {k: p for k, p in self.poses.items() if k != block} | ({} if at_home else {block: pose})
        return self._with(block, poses, self.removed - {block})

    def put_back(self, block: int) -> "Arrangement":
        """The same with one block at home."""
        return self.moved(block, Pose(np.eye(3), np.zeros(3)))

    def without(self, block: int) -> "Arrangement":
        """The same without one block.

        Raises
        ------
        InputError
            It is the last block, or the last support.
        """
        left = np.ones(len(self.model), bool)
        left[[*self.removed, block]] = False
        if not left.any():
            raise InputError(f"block '{self.model.blocks[block].id}' is the last one; it stays")
        if not (left & self.held).any():
            raise InputError(f"block '{self.model.blocks[block].id}' is the last support; it stays")
        return self._with(block, self.poses, self.removed | {block})

    def _with(self, block: int, poses: Mapping[int, Pose], removed: frozenset[int]) -> "Arrangement":
        """Put one block's contacts in the place of those that it had."""
        name = f"'{self.model.blocks[block].id}'"
        parts = [self.joints.only(np.flatnonzero((self.joints.a != block) & (self.joints.b != block)))]
        notes = tuple(note for note in self.notes if name not in note.partition(":")[0])
        if block not in removed:
            if block not in poses:
                away = np.array(sorted({*poses, *removed}), np.int64)
                ends = np.stack([self.home.a, self.home.b], 1)
                here = (ends == block).any(axis=1) & ~np.isin(ends, away).any(axis=1)
                parts.append(self.home.only(np.flatnonzero(here)))
            found, said = self._found(block, poses)
            parts.append(found)
            notes = (*notes, *said)
        joints = Contacts.joined(parts)  # those of one pair keep their order
        return _arranged(self, poses, removed, joints.only(np.lexsort((joints.b, joints.a))), notes)

    def _found(self, block: int, poses: Mapping[int, Pose]) -> tuple[Contacts, tuple[str, ...]]:
        """Contacts of one block with the others that stand, unless both are at home; and what looks wrong."""
        here, mesh = _put(self.model, block, poses), self.assembly.mesh
        low, high = here.vertices.min(axis=0) - 2.0 * self.tolerance, here.vertices.max(axis=0) + 2.0 * self.tolerance
        least, most = mesh.boxes()
        beside = np.all(least <= high, axis=1) & np.all(most >= low, axis=1) & (self.index != block)
        if block not in poses:
            beside &= np.isin(self.index, np.array(sorted(poses), np.int64))
        near = np.flatnonzero(beside)
        at = int(np.searchsorted(self.index[near], block))
        order = [*self.index[near[:at]].tolist(), block, *self.index[near[at:]].tolist()]
        blocks = [self.assembly.blocks[i] for i in near[:at]] + [here] + [self.assembly.blocks[i] for i in near[at:]]
        found = detect(Assembly(tuple(blocks)), self.tolerance)
        rows = found.contacts.only(np.flatnonzero((found.contacts.a == at) | (found.contacts.b == at)))
        name = f"'{here.id}'"
        said = tuple(line for line in found.warnings if name in line.partition(":")[0] and block in poses)
        ends = np.array(order, np.int64)
        return paired_friction(self.model, replace(rows, a=ends[rows.a], b=ends[rows.b]))[0], said


def arrange(model: Assembly, contacts: Contacts, held: Bools, tolerance: float) -> Arrangement:
    """Begin with every block at home. Loads have to be at points: their cases and combinations are not kept.

    Parameters
    ----------
    model : Assembly
        n blocks; its own contacts are not looked at.
    contacts : Contacts
        Of these blocks, as given or detected.
    held : (n,) bool
        Supports; they stay what they are wherever blocks are put.
    tolerance : float
        Length (m) within which faces touch.

    Raises
    ------
    InputError
        The model has loads on faces or throughout volumes.
    """
    if model.actions:
        raise InputError("arrangement: resolve the model's loads to points first")
    joints = contacts.only(np.lexsort((contacts.b, contacts.a)))
    first = Arrangement(model, joints, held, tolerance, {}, frozenset(), joints, (), model, np.arange(len(model)))
    return _arranged(first, {}, frozenset(), joints, ())


def _arranged(
    base: Arrangement, poses: Mapping[int, Pose], removed: frozenset[int], joints: Contacts, notes: tuple[str, ...]
) -> Arrangement:
    """Fill in what follows from the poses and joints; loads go with the blocks that bear them."""
    model = base.model
    left = np.ones(len(model), bool)
    left[sorted(removed)] = False
    index = np.flatnonzero(left)
    place = np.full(len(model), -1)
    place[index] = np.arange(len(index))
    blocks = tuple(replace(_put(model, k, poses), fixed=bool(base.held[k])) for k in index.tolist())
    contacts = replace(joints, a=place[joints.a], b=place[joints.b])
    assembly = part(model, blocks, contacts, place, lambda block, points: _at(model, block, poses, points))
    return replace(base, poses=poses, removed=removed, joints=joints, notes=notes, assembly=assembly, index=index)


def _put(model: Assembly, block: int, poses: Mapping[int, Pose]) -> Block:
    """A block where it is."""
    whole = model.blocks[block]
    return replace(whole, vertices=_at(model, block, poses, whole.vertices)) if block in poses else whole


def _at(model: Assembly, block: int, poses: Mapping[int, Pose], point: Floats) -> Floats:
    """(k, 3) m, where points of a block at home go with it."""
    return poses[block].of(point, model.mass.centroid[block]) if block in poses else point
