"""From loads in cases to forces at points: which loads act, by how much, and where.

Everything that a model says about loads comes to point loads and one vector of gravity before any statics, so that a
certificate holds nothing else. The resultant of a pressure q on an area with area vector N / 2 (outward, Newell) is
-q N / 2 at the area's centroid; of a traction t it is t |N| / 2 there. A body force b gives V b, an acceleration a
gives rho V a, both at the centre of mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.checking import ALIGNED, face_distances
from cyclopean.assembly.field_loads import FieldLoad
from cyclopean.assembly.loads import SELF, BodyLoad, Load, SurfaceLoad
from cyclopean.assembly.precision import FLAT_SHARE, length_tolerance, local_mesh
from cyclopean.errors import InputError
from cyclopean.geometry import planar_regions

__all__ = ["Loading", "area_resultant", "load_cases", "loading", "members", "resolved_loads", "surface_loads_at_points"]

FLAT = 1e-6  # of a polygon's own size: rounding that a file may carry


@dataclass(frozen=True, slots=True)
class Loading:
    """Which loads act, and how much of each."""

    name: str  # of the combination; "" = all loads
    factors: dict[str, float]  # of the weight ("self") and of every case of the model
    fields: tuple[str, ...] = ()  # a line on each earth, water or fill, forces without their factors

    def words(self) -> str:
        """Name and factors on one line.

        Examples
        --------
        >>> Loading("ULS", {"self": 1.35, "wind": 0.0}).words()
        'ULS: self x 1.35, wind x 0'
        """
        each = ", ".join(f"{case} x {factor:g}" for case, factor in self.factors.items())
        return "; ".join([f"{self.name or 'all loads'}: {each}", *self.fields])


def load_cases(assembly: Assembly) -> tuple[str, ...]:
    """Cases of a model in the order in which they first stand there, the weight ("self") before all."""
    return tuple(dict.fromkeys([SELF, *(load.case for load in (*assembly.loads, *assembly.actions))]))


def loading(assembly: Assembly, combination: str = "", factors: Sequence[tuple[str, float]] = ()) -> Loading | None:
    """Choose which loads act.

    Parameters
    ----------
    assembly : Assembly
        The model.
    combination : str
        Name of one of its combinations; "" = every case with factor 1.
    factors : sequence of (case, factor)
        Instead of what the combination says of these cases.

    Returns
    -------
    Loading or None
        None where nothing was said and the model has no cases worth a name: all loads act as they stand.

    Raises
    ------
    InputError
        No such combination, or no such case.
    """
    known = load_cases(assembly)
    if not combination and not factors and set(known) <= {SELF, "dead"}:
        return None
    chosen = dict.fromkeys(known, 1.0)
    if combination:
        found = next((c for c in assembly.combinations if c.name == combination), None)
        if found is None:
            names = ", ".join(f"'{c.name}'" for c in assembly.combinations) or "none"
            raise InputError.of("combination", combination, f"the model has no such combination; it has {names}")
        chosen = {case: float(case == SELF) for case in known} | dict(found.factors)
    for case, factor in factors:
        if case not in known:
            raise InputError(f"`factor` {case}={factor:g}: no load has this case; there are {', '.join(known)}")
        chosen[case] = float(factor)
    return Loading(combination, chosen)


def resolved_loads(assembly: Assembly, chosen: Loading | None, density: float) -> Assembly:
    """The same assembly with every load as a force at a point, times its factor; loads with factor 0 are gone.

    So are its combinations, whose cases may be gone.

    Parameters
    ----------
    assembly : Assembly
        The model, its meshes sound.
    chosen : Loading, optional
        Factors; None = all 1.
    density : float
        kg/m3 where a block gives none.

    Raises
    ------
    InputError
        A surface load off the faces of its block, or a group that no block belongs to; earth, water or fill.
    """
    factors = dict.fromkeys(load_cases(assembly), 1.0) if chosen is None else chosen.factors
    if not assembly.actions and all(factors[load.case] == 1.0 for load in assembly.loads):
        return assembly
    found = [replace(load, force=factors[load.case] * load.force) for load in assembly.loads]
    for number, action in enumerate(assembly.actions):
        if isinstance(action, FieldLoad):
            raise InputError("loads: earth, water and fill have to be resolved before (resolved_fields)")
        rows = _spread(assembly, action, density) if isinstance(action, BodyLoad) else [_pressed(assembly, number)]
        found += [replace(row, force=factors[row.case] * row.force) for row in rows]
    return replace(assembly, loads=tuple(row for row in found if row.force.any()), actions=(), combinations=())


def surface_loads_at_points(assembly: Assembly) -> Assembly:
    """The same assembly with surface loads as forces at points, each still of its case: faces may then change.

    Raises
    ------
    InputError
        A surface load off the faces of its block.
    """
    numbers = [k for k, load in enumerate(assembly.actions) if isinstance(load, SurfaceLoad)]
    if not numbers:
        return assembly
    rest = tuple(load for load in assembly.actions if not isinstance(load, SurfaceLoad))
    return replace(assembly, loads=(*assembly.loads, *(_pressed(assembly, k) for k in numbers)), actions=rest)


def members(assembly: Assembly, row: BodyLoad | FieldLoad) -> Bools:
    """(n,) the blocks that a load takes hold of; of earth, water and fill also those that hide others from it."""
    return np.array([row.block in (None, i) and row.group in (None, block.group)
                     for i, block in enumerate(assembly.blocks)])  # fmt: skip


def _spread(assembly: Assembly, load: BodyLoad, density: float) -> list[Load]:
    """Forces at the centres of mass of the blocks that a body force takes hold of."""
    volume, centroid, heavy = assembly.mass.volume, assembly.mass.centroid, assembly.densities(density)
    rows = []
    for i in np.flatnonzero(members(assembly, load)).tolist():
        if load.force is not None:
            force = load.force
        elif load.body is not None:
            force = volume[i] * load.body
        else:
            assert load.acceleration is not None
            force = heavy[i] * volume[i] * load.acceleration
        rows.append(Load(i, force, centroid[i], load.case))
    return rows


def _pressed(assembly: Assembly, number: int) -> Load:
    """The resultant of a surface load."""
    load = assembly.actions[number]
    assert isinstance(load, SurfaceLoad)
    block = assembly.blocks[load.block]
    if load.face is not None:
        ring = block.vertices[list(block.faces[load.face])]
    else:
        ring = _outward(assembly, load, f"surface load {number} on block '{block.id}'")
    area, point = area_resultant(ring)
    if load.pressure is not None:
        return Load(load.block, -load.pressure * area, point, load.case)
    assert load.traction is not None
    return Load(load.block, float(np.linalg.norm(area)) * load.traction, point, load.case)


def area_resultant(ring: Floats) -> tuple[Floats, Floats]:
    """Area vector (m2, by Newell) and centroid (m) of a (k, 3) polygon; of one that is not flat, of its projection.

    Raises
    ------
    InputError
        It has no area.

    Examples
    --------
    >>> area, point = area_resultant(np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]))
    >>> area.tolist(), point.tolist()
    ([0.0, 0.0, 2.0], [1.0, 0.5, 0.0])
    """
    origin = ring[0]
    arms = ring[1:] - origin
    doubled = np.cross(arms[:-1], arms[1:])
    total = doubled.sum(0)
    size = float(total @ total)
    if not size > 1e-24 * float(np.max(np.sum(arms * arms, 1), initial=0.0)) ** 2:
        raise InputError("loads: the area of a surface load is zero")
    share = doubled @ total / size
    return np.asarray(total / 2.0), np.asarray(origin + share @ (arms[:-1] + arms[1:]) / 3.0)


def _outward(assembly: Assembly, load: SurfaceLoad, where: str) -> Floats:
    """The polygon of a surface load, wound so that it looks outward; refused where it is not on the block."""
    assert load.polygon is not None
    try:
        area = area_resultant(load.polygon)[0]
    except InputError:
        raise InputError(f"{where}: its polygon has no area") from None
    normal = area / np.linalg.norm(area)
    middle = load.polygon.mean(0)
    away = load.polygon - middle
    limit, own = FLAT_SHARE * float(assembly.mesh.diagonal[load.block]), float(np.linalg.norm(away, axis=1).max())
    if not (float(np.abs(away @ normal).max()) <= max(limit, FLAT * own)):
        raise InputError(f"{where}: its polygon is not flat; split it into flat pieces")
    mesh, origin = local_mesh(assembly)
    regions = planar_regions(mesh, length_tolerance(assembly))
    ways = np.stack([normal, -normal])
    start = len(load.polygon) * np.arange(3)
    local = np.tile(load.polygon - origin, (2, 1))
    far = face_distances(regions, np.array([load.block, load.block]), ways, local, start).reshape(2, -1).max(1)
    if not (far.min() <= limit):
        how = f"{far.min():.2g} m off" if np.isfinite(far.min()) else f"not along (cosine {ALIGNED:g})"
        raise InputError(f"{where}: its polygon is {how} the faces of the block; move it onto one of them")
    return load.polygon if far[0] <= far[1] else load.polygon[::-1]
