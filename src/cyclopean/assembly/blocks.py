"""Blocks, loads and the assembly they make."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from cyclopean.arrays import Bools, Floats, sealed
from cyclopean.assembly.contacts import Contacts
from cyclopean.errors import InputError
from cyclopean.geometry import MassProperties, Polyhedra, mass_properties, pack

__all__ = ["Assembly", "Block", "Load", "supports"]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """One rigid stone as a closed polygon mesh."""

    id: str
    vertices: Floats  # (v, 3) m
    faces: tuple[tuple[int, ...], ...]  # corners counter-clockwise from outside
    density: float | None = None  # kg/m3; None = not given, a default will be assumed
    fixed: bool | None = None  # True = support; None = not said
    group: str | None = None  # course, storey, whatever the file calls it

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", sealed(f"block '{self.id}': vertices", self.vertices, None, 3))
        object.__setattr__(self, "faces", tuple(map(tuple, self.faces)))
        if self.density is not None and not (0.0 < self.density < np.inf):
            raise InputError(f"block '{self.id}': density {self.density:g} must be a positive number of kg/m3")


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """A force that stays as it is while the block moves."""

    block: int  # index into Assembly.blocks
    force: Floats  # (3,) N, world
    point: Floats  # (3,) m, world

    def __post_init__(self) -> None:
        for name in ("force", "point"):
            object.__setattr__(self, name, sealed(f"load {name}", getattr(self, name), 3))


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Blocks, and what the model says of their contacts and loads.

    `contacts` is None where they are to be detected; empty where the model says that there are none.
    """

    blocks: tuple[Block, ...]
    contacts: Contacts | None = None
    loads: tuple[Load, ...] = ()
    name: str = "model"
    mesh: Polyhedra = field(init=False)
    mass: MassProperties = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocks", tuple(self.blocks))
        object.__setattr__(self, "loads", tuple(self.loads))
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
        for load in self.loads:
            if not 0 <= load.block < len(self.blocks):
                raise InputError(f"loads: block index {load.block} is out of range")

    def __len__(self) -> int:
        return len(self.blocks)

    @property
    def size(self) -> float:
        """Diagonal of the bounding box (m); 0 for an empty model."""
        return float(np.linalg.norm(np.ptp(self.mesh.vertex, axis=0))) if len(self.mesh.vertex) else 0.0


def supports(assembly: Assembly, rule: str = "", tolerance: float | None = None) -> tuple[Bools, str]:
    """Which blocks are held, and by which rule.

    Parameters
    ----------
    assembly : Assembly
        The model.
    rule : str
        "" = the `fixed` flags, and if no block has one, every block that touches the lowest point within the
        length tolerance; "below=Z" = every block with a vertex at or below height Z (m); "ids=a,b" = these blocks.
    tolerance : float, optional
        Length (m) within which a block counts as touching; default 1e-6 of the model's size.

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
    tol = 1e-6 * assembly.size if tolerance is None else tolerance
    lowest = np.full(n, np.inf)
    np.minimum.at(lowest, assembly.mesh.vertex_body, assembly.mesh.vertex[:, 2])
    if rule == "":
        if any(b.fixed is True for b in assembly.blocks):
            return np.array([b.fixed is True for b in assembly.blocks]), "file"
        if n and all(b.fixed is False for b in assembly.blocks):
            raise InputError('no block is a support: every block says "fixed": false; use --supports to name some')
        return lowest <= lowest.min(initial=np.inf) + tol, "lowest"
    kind, _, value = rule.partition("=")
    if kind == "below":
        try:
            height = float(value)
        except ValueError:
            height = np.nan
        if not np.isfinite(height):
            raise InputError(f"--supports {rule}: '{value}' is not a height in metres")
        fixed = lowest <= height
    elif kind == "ids":
        known = {b.id for b in assembly.blocks}
        one = value in known  # an id may hold a comma
        wanted = {value} if one else {name.strip() for name in value.split(",")} - {""}
        if wanted - known:
            raise InputError(f"--supports {rule}: block '{min(wanted - known)}' is not in the model")
        fixed = np.array([b.id in wanted for b in assembly.blocks], bool)
    else:
        raise InputError(f"--supports {rule}: expected below=Z or ids=a,b")
    if not fixed.any():
        raise InputError(f"--supports {rule}: no block is a support; lower the rule or name blocks with ids=a,b")
    return fixed, rule
