"""What the one-call functions accept: a file, or what another function gave; options as keywords."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar, runtime_checkable

from cyclopean.errors import InputError
from cyclopean.options import option

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.stones.stone import Stone

Chosen = TypeVar("Chosen")


@runtime_checkable
class HasAssembly(Protocol):
    """A wall of any kind, a match, a carving, a result: whatever holds a structure."""

    @property
    def assembly(self) -> "Assembly":
        """The structure."""


Path: TypeAlias = str | os.PathLike[str]
Bodies: TypeAlias = "Sequence[Any] | Mapping[str, Any]"  # of meshes: see `io.python_bodies`
Model: TypeAlias = "Path | Assembly | HasAssembly | Bodies"
Stones: TypeAlias = "Path | Inventory | Sequence[Stone]"


@dataclass(frozen=True, slots=True)
class Reading:
    """How a model file is read."""

    units: str | None = option(
        None, "Unit of the model's lengths, such as mm, where the file does not say it.", metavar="U"
    )
    strict: bool = option(False, "A block that has to be mended is an error.", "flag")


@dataclass(frozen=True, slots=True)
class StoneReading:
    """How files of stones are read."""

    units: str | None = option(None, "Unit of the stones' lengths, such as mm.", metavar="U")
    strict: bool = option(False, "A stone that cannot be used is an error.", "flag")


def assembly_of(model: Model, reading: Reading = Reading()) -> "tuple[Assembly, tuple[str, ...]]":
    """The structure, and what was assumed in reading it.

    Parameters
    ----------
    model : path, Assembly, anything with an `assembly`, or bodies
        Where it is. Bodies are meshes of trimesh or COMPAS, or pairs of vertices and faces: a list, a table by name, or
        one of them; a model of COMPAS too.
    reading : Reading
        Units of a file that does not say them, and whether blocks may be mended.

    Raises
    ------
    InputError
        The file cannot be read, units were given for what is no file, it is none of these, or it has to be mended and
        may not.
    """
    if isinstance(model, str | os.PathLike):
        from cyclopean.io import read_model

        return read_model(model, reading.units, reading.strict)
    from cyclopean.assembly import Assembly, mended

    given: Any = model.assembly if isinstance(model, HasAssembly) else model
    said: tuple[str, ...] = ()
    if isinstance(given, Assembly):
        _refuse_units(reading.units)
    else:
        from cyclopean.io.python_bodies import read_bodies

        given, said = read_bodies(given, reading.units)
    found = mended(given)
    if reading.strict:
        found.refused("model")
    return found.assembly, (*said, *found.said)


def inventory_of(stones: Stones, reading: StoneReading) -> "tuple[Inventory, tuple[str, ...]]":
    """The stones, and what was assumed in reading them; errors as `assembly_of`."""
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.stones.stone import Stone

    if isinstance(stones, (str, os.PathLike)):
        from cyclopean.io import read_stones

        return read_stones(stones, reading.units, reading.strict)
    _refuse_units(reading.units)
    if isinstance(stones, Inventory):
        return stones, ()
    given: Any = stones
    if isinstance(given, Sequence) and all(isinstance(stone, Stone) for stone in given):
        return Inventory(tuple(given)), ()
    raise InputError(f"stones: expected a folder, a file, an Inventory or a list of Stone, got {type(stones).__name__}")


def _refuse_units(units: str | None) -> None:
    if units is not None:
        raise InputError(f"units: '{units}' is for files; what is in memory is in metres")


def silent(_: str) -> None:
    """Tell nobody."""


def said(base: Chosen, /, **options: Any) -> Chosen:
    """Settings in which the options that were given (are not None) stand instead."""
    given = {name: value for name, value in options.items() if value is not None}
    return replace(base, **given) if given else base  # type: ignore[type-var]
