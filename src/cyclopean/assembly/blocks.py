"""Blocks, loads and the assembly they make."""

from collections import Counter
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from cyclopean.arrays import Bools, Floats, sealed
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.field_loads import FieldLoad
from cyclopean.assembly.loads import SELF, BodyLoad, Combination, Load, SurfaceLoad
from cyclopean.errors import InputError
from cyclopean.geometry import MassProperties, Polyhedra, mass_properties, pack
from cyclopean.representation import one_line

__all__ = ["DIRECTIONS", "Action", "Assembly", "Block", "FrictionPair", "Settlement", "held_directions", "supports"]

Action: TypeAlias = SurfaceLoad | BodyLoad | FieldLoad  # a load that is not at a point

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
"""What a support may hold: displacements of the centre of mass along the world's axes, rotations about them."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """One rigid stone as a closed polygon mesh."""

    __repr__ = one_line

    id: str
    vertices: Floats  # (v, 3) m
    faces: tuple[tuple[int, ...], ...]  # corners counter-clockwise from outside
    density: float | None = None  # kg/m3; None = not given, a default will be assumed
    fixed: bool | None = None  # True = support; None = not said
    group: str | None = None  # course, storey, whatever the file calls it
    material: str | None = None  # what "friction" of pairs goes by
    held: tuple[str, ...] = ()  # of DIRECTIONS: what a partial support holds; all six = fixed

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", sealed(f"block '{self.id}': vertices", self.vertices, None, 3))
        object.__setattr__(self, "faces", tuple(map(tuple, self.faces)))
        if self.density is not None and not (0.0 < self.density < np.inf):
            raise InputError(f"block '{self.id}': density {self.density:g} must be a positive number of kg/m3")
        if wrong := [name for name in self.held if name not in DIRECTIONS]:
            raise InputError(f"block '{self.id}': held names '{wrong[0]}'; choose among {', '.join(DIRECTIONS)}")
        object.__setattr__(self, "held", tuple(name for name in DIRECTIONS if name in self.held))


@dataclass(frozen=True, slots=True)
class FrictionPair:
    """Friction between two materials, in either order."""

    a: str
    b: str
    mu: float

    def __post_init__(self) -> None:
        if not (0.0 <= self.mu < np.inf):
            raise InputError(f"friction of {self.a} on {self.b}: mu {self.mu:g} must be a number that is not negative")


@dataclass(frozen=True, slots=True, eq=False)
class Settlement:
    """A movement that the ground forces on a support."""

    block: int  # index into Assembly.blocks
    motion: Floats  # (6,) m and rad: displacement of its centre of mass, then rotation about it, world axes

    def __post_init__(self) -> None:
        object.__setattr__(self, "motion", sealed("settlement motion", self.motion, 6))


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Blocks, and what the model says of their contacts and loads.

    `contacts` is None where they are to be detected; empty where the model says that there are none.
    """

    __repr__ = one_line

    blocks: tuple[Block, ...]
    contacts: Contacts | None = None
    loads: tuple[Load, ...] = ()
    name: str = "model"
    actions: tuple[Action, ...] = ()
    combinations: tuple[Combination, ...] = ()
    friction: tuple[FrictionPair, ...] = ()  # where a contact gives no mu
    settlements: tuple[Settlement, ...] = ()
    mesh: Polyhedra = field(init=False)
    mass: MassProperties = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocks", tuple(self.blocks))
        for name in ("loads", "actions", "combinations", "friction", "settlements"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        twice = [name for name, count in Counter(b.id for b in self.blocks).items() if count > 1]
        if twice:
            raise InputError(f"block '{twice[0]}': the id stands twice; ids must be unique")
        for block in self.blocks:
            count = len(block.vertices)
            for k, face in enumerate(block.faces):
                if len(face) < 3 or len(set(face)) < len(face):
                    raise InputError(f"block '{block.id}': face {k} needs at least 3 different corners")
                if min(face) < 0 or max(face) >= count:
                    raise InputError(
                        f"block '{block.id}': face {k} names vertex {max(face, key=lambda i: (i < 0, i))},"
                        f" but its vertices are 0..{count - 1}"
                    )
        object.__setattr__(self, "mesh", pack([(b.vertices, b.faces) for b in self.blocks]))
        object.__setattr__(self, "mass", mass_properties(self.mesh))
        if self.contacts is not None and len(self.contacts):
            ends = np.concatenate([self.contacts.a, self.contacts.b])
            if ends.min() < 0 or ends.max() >= len(self.blocks):
                raise InputError("contacts: a block index is out of range")
        for name, rows in (("loads", self.loads), ("loads", self.actions), ("settlements", self.settlements)):
            for one in rows:
                if one.block is not None and not 0 <= one.block < len(self.blocks):
                    raise InputError(f"{name}: block index {one.block} is out of range")
        _check_actions(self)
        _check_combinations(self)
        _check_friction(self)

    def densities(self, otherwise: float) -> Floats:
        """(n,) kg/m3 of the blocks; `otherwise` where a block gives none."""
        return np.array([otherwise if block.density is None else block.density for block in self.blocks], float)

    def __len__(self) -> int:
        return len(self.blocks)

    @property
    def size(self) -> float:
        """Diagonal of the bounding box (m); 0 for an empty model."""
        return float(np.linalg.norm(np.ptp(self.mesh.vertex, axis=0))) if len(self.mesh.vertex) else 0.0


def _check_actions(assembly: Assembly) -> None:
    groups = {block.group for block in assembly.blocks}
    for load in assembly.actions:
        if not isinstance(load, SurfaceLoad):
            if load.group is not None and load.group not in groups:
                raise InputError(f"loads: no block belongs to group '{load.group}'")
        elif load.face is not None:
            block = assembly.blocks[load.block]
            if not 0 <= load.face < len(block.faces):
                raise InputError(
                    f"loads: block '{block.id}' has no face {load.face}; its faces are 0..{len(block.faces) - 1}"
                )


def _check_combinations(assembly: Assembly) -> None:
    """A case that no load has is a slip of the pen, and would silently leave a load out."""
    cases = {SELF, *(load.case for load in (*assembly.loads, *assembly.actions))}
    names = [one.name for one in assembly.combinations]
    if len(set(names)) < len(names):
        twice = next(name for name, count in Counter(names).items() if count > 1)
        raise InputError(f"combination '{twice}': the name stands twice; names must be unique")
    for one in assembly.combinations:
        if unknown := [case for case, _ in one.factors if case not in cases]:
            raise InputError(
                f"combination '{one.name}': no load has the case '{unknown[0]}'; there are {', '.join(sorted(cases))}"
            )


def _check_friction(assembly: Assembly) -> None:
    if not assembly.friction:
        return
    materials = {block.material for block in assembly.blocks}
    seen: set[frozenset[str]] = set()
    for one in assembly.friction:
        if unknown := [name for name in (one.a, one.b) if name not in materials]:
            raise InputError(f"friction of {one.a} on {one.b}: no block has the material '{unknown[0]}'")
        if (pair := frozenset((one.a, one.b))) in seen:
            raise InputError(f"friction of {one.a} on {one.b}: the pair stands twice; keep one")
        seen.add(pair)


def held_directions(assembly: Assembly) -> Bools:
    """(n, 6) bool: what the model's partial supports hold, in the order of `DIRECTIONS`."""
    held = np.zeros((len(assembly), 6), bool)
    for i, block in enumerate(assembly.blocks):
        if block.held:
            held[i] = [name in block.held for name in DIRECTIONS]
    return held


def supports(assembly: Assembly, rule: str = "") -> tuple[Bools, str]:
    """Which blocks are held, and by which rule.

    Blocks of which the model's partial supports hold all six directions are held whatever the rule says. Where it has
    partial supports and no `fixed` flags, these are what it says of supports: the lowest blocks are not held beside.

    Parameters
    ----------
    assembly : Assembly
        The model.
    rule : str
        "" = the `fixed` flags, and if no block has one, every block that touches the lowest point within 1e-6 of the
        model's size; "below=Z" = every block with a vertex at or below height Z (m); "ids=a,b" = these blocks.

    Returns
    -------
    fixed : (n,) bool
        True for supports.
    rule : str
        "file", "lowest", or the rule as given.

    Raises
    ------
    InputError
        The rule is not one of these, names an unknown block, or picks no block.
    """
    n = len(assembly)
    tol = 1e-6 * assembly.size  # the precision of its numbers
    lowest = assembly.mesh.boxes()[0][:, 2]
    whole = np.array([len(b.held) == len(DIRECTIONS) for b in assembly.blocks], bool)
    if rule == "":
        if any(b.fixed is True or b.held for b in assembly.blocks):
            return np.array([b.fixed is True for b in assembly.blocks]) | whole, "file"
        if n and all(b.fixed is False for b in assembly.blocks):
            raise InputError('no block is a support: every block says "fixed": false; use `supports` to name some')
        return lowest <= lowest.min(initial=np.inf) + tol, "lowest"
    kind, _, value = rule.partition("=")
    if kind == "below":
        try:
            height = float(value)
        except ValueError:
            height = np.nan
        if not np.isfinite(height):
            raise InputError.of("supports", rule, f"'{value}' is not a height in metres")
        fixed = lowest <= height
    elif kind == "ids":
        known = {b.id for b in assembly.blocks}
        one = value in known  # an id may hold a comma
        wanted = {value} if one else {name.strip() for name in value.split(",")} - {""}
        if wanted - known:
            raise InputError.of("supports", rule, f"block '{min(wanted - known)}' is not in the model")
        fixed = np.array([b.id in wanted for b in assembly.blocks], bool)
    else:
        raise InputError.of("supports", rule, "expected below=Z or ids=a,b")
    if not fixed.any():
        raise InputError.of("supports", rule, "no block is a support; lower the rule or name blocks with ids=a,b")
    return fixed | whole, rule
